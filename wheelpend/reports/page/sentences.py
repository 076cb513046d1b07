"""Sentences and numbers of the page."""

from __future__ import annotations

import numpy as np

import derive
from wheelpend.diagnosis.explain import Explanation, Step
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.problem import Study
from wheelpend.model.units import Quantities
from wheelpend.reports.page import style as figures

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def verdict(explanation: Explanation) -> str:
    """The verdict as people say it."""
    more = "more " if explanation.steps else ""
    known = {"nothing_missing": f"nothing {more}is missing", "unexplained": "something is unexplained"}
    return known.get(explanation.verdict, explanation.verdict)


def headline(explanation: Explanation, q: Quantities) -> list[str]:
    """What is missing, how large it is, and what adding it did to the held-out error."""
    lines = [sized(step, explanation, q) for step in explanation.steps]
    before, after, floor = map(error_text, (explanation.base_error, explanation.error, explanation.noise_floor))
    kind = "held-out" if explanation.study.held else "training"
    if not explanation.steps:
        return [f"With its own parameters refitted, the model has a {kind} error of {before} "
                f"(noise floor {floor}); no effect of the library is worth adding."]  # fmt: skip
    return [*lines, f"The {kind} error falls from {before} to {after}; "
                    f"the noise floor is {floor}."]  # fmt: skip


def sized(step: Step, explanation: Explanation, q: Quantities) -> str:
    """An effect with its sentence and the sizes of its coefficients in the final model."""
    sizes = []
    for name, unit in step.unit.items():
        own = {"value": step.coefficients[name], "sigma": step.sigma[name]}
        value, sigma = (explanation.parameters.get(f"{step.effect}.{name}", own)[k] for k in ("value", "sigma"))
        text = f"{name} {uncertain(value, sigma)} {shown_unit(unit)}".rstrip()
        own = explanation.parameters.get(f"{step.effect}.{name}", {}).get("per_log", [])
        text = f"{name} {in_each_log(own, unit)}" if own else text
        extra = [in_torque(value, unit, q)] if in_torque(value, unit, q) else []
        if unit == q.force and explanation.study.module.INPUT:
            extra.append(f"{100 * abs(value) / rms_voltage(explanation.study):.3g} % of the rms drive voltage")
        sizes.append(text + (f" ({', '.join(extra)})" if extra else ""))
    return f"{derive.effects.find(step.effect).sentence.rstrip('.')} ({step.effect}): {', '.join(sizes)}."


def in_each_log(rows: list[dict], unit: str) -> str:
    """A parameter that several logs have each for themselves."""
    return ", ".join(f"{uncertain(r['value'], r['sigma'])} {shown_unit(unit)} in {r['log']}" for r in rows)


def in_torque(value: float, unit: str, q: Quantities) -> str:
    """A force in V as a torque, or nothing where it is not a force or the volt's worth is unknown."""
    found = q.in_physical(value, unit)
    return f"{number(found[0], 3)} {shown_unit(found[1])}" if found else ""


def rms_voltage(study: Study) -> float:
    """Root mean square of the commanded voltage over the training logs."""
    voltage = np.concatenate([log.voltage[np.isfinite(log.voltage)] for log in study.logs])
    return float(np.sqrt(np.mean(voltage**2))) if voltage.size and np.any(voltage) else float("nan")


def doubts(explanation: Explanation) -> list[str]:
    """What these data cannot tell apart."""
    return [
        f"These data cannot tell {s.effect} from {', '.join(s.equivalent_to)}."
        for s in explanation.steps
        if s.equivalent_to
    ]


def places(diagnosis: Diagnosis, q: Quantities) -> list[str]:
    """Where the missing force is concentrated, as sentences."""
    return [
        f"{100 * p.share:.0f} % of what the {p.row} row misses lies where {figures.quantity(p.state)} is between "
        f"{number(p.low, 3)} and {number(p.high, 3)} {q.unit(p.state)}."
        for p in diagnosis.where
    ]


def uncertain_size(value: float, sigma: float) -> str:
    """Value ± standard error; small ones in powers of ten."""
    return uncertain(value, sigma) if abs(value) >= 1e-3 else f"{number(value, 5)} ± {number(sigma, 2)}"


def number(value: float | None, digits: int = 4) -> str:
    """A number in few digits, or a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    if abs(value) >= 10**digits and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", "−")
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return (mantissa + (f"×10{str(int(power)).translate(RAISED)}" if power else "")).replace("-", "−")


def error_text(value: float | None, digits: int = 4) -> str:
    """An error with all its digits, so that 1.00 is not 1."""
    if value is None or not np.isfinite(value) or abs(value) >= 10**digits:
        return number(value, digits)
    return f"{value:#.{digits}g}".rstrip(".")


def uncertain(value: float | None, sigma: float | None) -> str:
    """Value ± standard error, to two digits of the latter."""
    if value is None or sigma is None or not np.isfinite(sigma) or sigma <= 0 or not np.isfinite(value):
        return number(value)
    decimals = int(np.clip(1 - np.floor(np.log10(sigma)), 0, 9))
    if decimals == 9 or abs(value) >= 1e5:
        return f"{number(value)} ± {number(sigma, 2)}"
    return f"{value:.{decimals}f} ± {sigma:.{decimals}f}".replace("-", "−")


def probability(p: float | None) -> str:
    """A p-value; very small ones only as a bound."""
    if p is None:
        return "–"
    return "< 10⁻¹²" if p < 1e-12 else number(p, 1)


def shown_unit(unit: str) -> str:
    """A unit as people read it; nothing for a plain number."""
    return "" if unit == "1" else unit.replace(" s", "·s")
