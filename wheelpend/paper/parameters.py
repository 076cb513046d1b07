"""The paper's numbers against each other: its constants against X1 ... X7 of Table 1, then settings and tables."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import sympy as sp

from wheelpend.paper import numbers
from wheelpend.paper.derivation import Derived, derive_all
from wheelpend.paper.letters import J_m, alpha, beta, f_w, g
from wheelpend.paper.percentages import check_tables
from wheelpend.paper.printed_numbers import Interval, NumberCheck, printed_interval
from wheelpend.paper.simulation_settings import check_simulation

GRAVITY_M_S2 = 9.81  # m/s², which the paper does not print
X_OF_MISSING = {"J_m": ("X2",), "f_w": ("X6", "X7")}
CONSTANT_UNITS = {
    "m": "kg", "M": "kg", "L": "m", "R": "m", "f_m": "N m s/rad", "f_w": "N m s/rad", "K_b": "V s/rad", "K_t": "N m/A",
    "R_m": "Ω", "J_w": "kg m²", "J_b": "kg m²", "J_m": "kg m²",
}  # fmt: skip


REFERENCE_INTERVALS = {name: printed_interval(value) for name, value in numbers.REFERENCE_PARAMETERS.items()}
Values = dict[str, Interval]


def parameter_formulas(derived: Derived) -> dict[str, sp.Expr]:
    """X1 ... X7 in the constants that the paper lists."""
    drive = {alpha: derived["12"]["α"], beta: derived["12"]["β"]}
    return {name: sp.sympify(e).subs(drive).subs(g, GRAVITY_M_S2) for name, e in derived["18"].items()}


def evaluate(expression: sp.Expr, values: Values) -> Interval:
    """Value of an expression, with the rounding of every number in it propagated to first order."""
    at = {symbol: values[symbol.name].value for symbol in expression.free_symbols}
    spread = sum(abs(float(expression.diff(x).subs(at))) * values[x.name].half_width for x in at)
    return Interval(float(expression.subs(at)), spread)


def solve_for_constant(expression: sp.Expr, target: Interval, name: str, values: Values) -> Interval | None:
    """Value of one constant at which an expression equals a printed number, or None."""
    unknown = next((x for x in expression.free_symbols if x.name == name), None)
    if unknown is None or any(x.name not in values for x in expression.free_symbols - {unknown}):
        return None
    aim = sp.Symbol("aim", positive=True)
    solutions = [e for e in sp.solve(expression - aim, unknown) if not e.could_extract_minus_sign()]
    if not solutions:
        return None
    found = evaluate(solutions[0], {**values, "aim": target})
    return found if sp.im(found.value) == 0 else None


@lru_cache
def check_numbers(x2_printed: sp.Expr) -> tuple[NumberCheck, ...]:
    """Every number that can be checked against others; X2 may be printed otherwise than derived."""
    derived = derive_all()
    known = {name: printed_interval(value) for name, value in numbers.PHYSICAL_CONSTANTS.items()}
    formulas = parameter_formulas(derived)
    repaired = {**known, **corrected_constants(formulas, known)}
    checks = [*check_parameters(formulas, known, repaired), back_emf(known, formulas, repaired)]
    checks += [*missing_inertia(formulas, x2_printed, derived, known), missing_friction(formulas, known)]
    checks += check_references(formulas, known, repaired)
    return (*checks, *check_simulation(), *check_tables())


def parameter_agreement(formulas: dict[str, sp.Expr], values: Values) -> dict[str, bool]:
    """True for each of X1 ... X7 that comes out as printed, of those that the listed constants determine."""
    complete = {n: e for n, e in formulas.items() if all(x.name in values for x in e.free_symbols)}
    return {n: evaluate(e, values).overlaps(REFERENCE_INTERVALS[n]) for n, e in complete.items()}


def corrected_constants(formulas: dict[str, sp.Expr], known: Values) -> Values:
    """Constants of which one other value corrects every wrong parameter and leaves the others right."""
    wrong = [n for n, right in parameter_agreement(formulas, known).items() if not right]
    found: Values = {}
    for name in known:
        values = [solve_for_constant(formulas[n], REFERENCE_INTERVALS[n], name, known) for n in wrong]
        agreed = [v for v in values if v is not None]
        if not wrong or len(agreed) < len(wrong):
            continue
        best = min(agreed, key=lambda v: v.half_width)
        if all(best.overlaps(v) for v in agreed) and all(parameter_agreement(formulas, {**known, name: best}).values()):
            found[name] = best
    return found


def check_parameters(formulas: dict[str, sp.Expr], known: Values, repaired: Values) -> Iterator[NumberCheck]:
    """Check each listed constant by the parameters that contain it."""
    before, after = parameter_agreement(formulas, known), parameter_agreement(formulas, repaired)
    for name in (n for n in known if n != "K_b"):
        containing = [n for n, e in formulas.items() if n in before and name in {x.name for x in e.free_symbols}]
        if known[name] == repaired[name]:
            fits = [n for n in containing if after[n]]
            status = "match" if len(fits) == len(containing) else "contradiction"
            as_listed, needs = ([n for n in fits if before[n] == right] for right in (True, False))
            notes = [f"agrees with {', '.join(as_listed)}"] if as_listed else []
            notes += (
                [f"agrees with {', '.join(needs)} once {changed_names(known, repaired)} is corrected"] if needs else []
            )
            note = "; ".join(notes) or "no parameter agrees with it"
            yield NumberCheck(
                name, status, quantity_text(name, known[name].value), quantity_text(name, known[name].value), note
            )
        else:
            yield contradiction(name, formulas, [n for n in containing if not before[n]], known, repaired)


def changed_names(known: Values, repaired: Values) -> str:
    """Names of the corrected constants."""
    return ", ".join(n for n in known if known[n] != repaired[n])


def quantity_text(name: str, value: float, digits: int = 6) -> str:
    """A value with the unit of the constant."""
    return f"{value:.{digits}g} {CONSTANT_UNITS.get(name, '')}".rstrip()


def contradiction(
    name: str, formulas: dict[str, sp.Expr], wrong: list[str], known: Values, repaired: Values
) -> NumberCheck:
    """Check of a constant that the reference parameters contradict, all with the same other value."""
    parts = []
    for n in wrong:
        value = solve_for_constant(formulas[n], REFERENCE_INTERVALS[n], name, known)
        parts.append(
            f"{n} = {REFERENCE_INTERVALS[n].value:g} needs {value} (printed: {evaluate(formulas[n], known).value:.4g})"
        )
    derived = quantity_text(name, repaired[name].value, 3)
    return NumberCheck(name, "contradiction", quantity_text(name, known[name].value), derived, "; ".join(parts))


def back_emf(known: Values, formulas: dict[str, sp.Expr], repaired: Values) -> NumberCheck:
    """K_b against K_t, which (7) takes to be equal, and against X7."""
    value = solve_for_constant(formulas["X7"], REFERENCE_INTERVALS["X7"], "K_b", repaired)
    same = known["K_b"].overlaps(known["K_t"])
    fits = value is not None and value.overlaps(known["K_b"])
    note = (
        f"(7) needs K_b = K_t, which is {known['K_t'].value:g}; X7 = {REFERENCE_INTERVALS['X7'].value:g} needs "
        f"{value}, which {'agrees' if fits else 'disagrees'} with the printed value"
    )
    status = "match" if same and fits else "contradiction"
    return NumberCheck(
        "K_b", status, quantity_text("K_b", known["K_b"].value), quantity_text("K_b", known["K_t"].value), note
    )


def missing_inertia(
    formulas: dict[str, sp.Expr], x2_printed: sp.Expr, derived: Derived, known: Values
) -> Iterator[NumberCheck]:
    """The rotor's inertia, from X2 as derived and as printed."""
    right = solve_for_constant(formulas["X2"], REFERENCE_INTERVALS["X2"], J_m.name, known)
    if right is None or J_m.name in known:
        return
    as_printed = x2_printed.subs(alpha, derived["12"]["α"])
    other = solve_for_constant(as_printed, REFERENCE_INTERVALS["X2"], J_m.name, known)
    note = f"X2 = {REFERENCE_INTERVALS['X2'].value:g} needs {right.value:.3g}"
    note += f"; with X2 as printed in (18) {other.value:.3g}" if other and not right.overlaps(other) else ""
    yield NumberCheck("J_m", "missing", "", quantity_text("J_m", right.value, 3), note)


def missing_friction(formulas: dict[str, sp.Expr], known: Values) -> NumberCheck:
    """The ground friction, from X6 − X7."""
    gap = Interval(
        REFERENCE_INTERVALS["X6"].value - REFERENCE_INTERVALS["X7"].value, REFERENCE_INTERVALS["X6"].half_width * 2
    )
    value = solve_for_constant(sp.expand(formulas["X6"] - formulas["X7"]), gap, f_w.name, known)
    assert value is not None
    note = f"X6 − X7 = {gap.value:.4f} needs {value}"
    return NumberCheck("f_w", "missing", "", quantity_text("f_w", value.value, 1), note)


def check_references(formulas: dict[str, sp.Expr], known: Values, repaired: Values) -> Iterator[NumberCheck]:
    """X1 ... X7 of Table 1 from the constants, corrected where they had to be."""
    for name, reference in REFERENCE_INTERVALS.items():
        lacking = sorted(x.name for x in formulas[name].free_symbols if x.name not in known)
        if lacking:
            note = f"{', '.join(lacking)} not given"
            yield NumberCheck(name, "missing", f"{reference.value:g}", "", note)
            continue
        value, as_listed = evaluate(formulas[name], repaired), evaluate(formulas[name], known)
        note = "" if as_listed.overlaps(reference) else (
            f"{as_listed.value:.4g} with {changed_names(known, repaired) or 'the constants'} as printed")  # fmt: skip
        status = "match" if value.overlaps(reference) else "contradiction"
        yield NumberCheck(name, status, f"{reference.value:g}", str(value), note)
