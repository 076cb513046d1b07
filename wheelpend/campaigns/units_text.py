"""What is said of a fleet: what its units have in common, which stand out by what, why two differ, what drifts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from wheelpend.campaigns.fleet import FALSE_DISCOVERY_RATE, MIN_UNITS, Difference, Explained
from wheelpend.reports.numbers import number_text, p_value_text, percent_text
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.campaigns.drift import Drift
    from wheelpend.campaigns.one_log import LogResult
    from wheelpend.campaigns.runner import Campaign
    from wheelpend.campaigns.units import UnitsAnswer

FLEET_COLUMNS = ("parameter", "fleet", "±", "scatter", "95 %", "p", "more than its errors")
THEN_COLUMNS = ("unit", "log", "verdict", "named", "error", "after")
MAX_PRINTED_UNITS = 20  # that stand out
UnitOf = Callable[[str], str]  # a parameter's unit, by its name


def units_text(answer: UnitsAnswer, unit_of: UnitOf, advice: str = "") -> TextBlocks:
    """The fleet, the units that stand out, the effects that were named, the drifts, and why two units differ.

    ``advice`` is what to do about units that the model does not describe.
    """
    worse = {m.unit for m in answer.misfits}
    count = sum(u.unit not in worse for u in answer.units)
    if answer.fleet is None:
        yield (f"{count} {'unit has' if count == 1 else 'units have'} an estimate with errors, of a model that "
               f"describes {'it' if count == 1 else 'them'}; what units have in common is told from "
               f"{MIN_UNITS} on.")  # fmt: skip
    else:
        rows = [
            (name, *map(number_text, (p.mean, p.mean_sigma, p.scatter)),
             " to ".join(map(number_text, p.scatter_interval)), p_value_text(p.p_value), "yes" if p.scatters else "no")
            for name, p in answer.fleet.parameters.items()
        ]  # fmt: skip
        yield Table(f"The fleet of {len(answer.fleet.units)} units, without those that stand out", FLEET_COLUMNS, rows)
        yield from _odd_lines(answer, unit_of)
    yield from _misfit_lines(answer, advice)
    if answer.effects:
        named = [(e.effect, str(len(e.units)), percent_text(len(e.units) / e.of), _some(e.units))
                 for e in answer.effects]  # fmt: skip
        yield Table("Effects that are missing, by unit", ("effect", "units", "of all", "which"), named)
    for drift in answer.drifts:
        yield drift_sentence(drift, unit_of)
    if answer.differ is not None:
        one, other = answer.differ.units
        yield f"{other} beside {one}: {difference_words(answer.differ.difference, unit_of)}"


def _odd_lines(answer: UnitsAnswer, unit_of: UnitOf) -> Iterator[str]:
    odd = answer.fleet.odd if answer.fleet else ()
    if not odd:
        yield "No unit stands out by its parameters." if answer.misfits else "No unit stands out."
        return
    yield (f"{len(odd)} of {len(answer.units)} units stand out by their parameters (of those that are said to, at most "
           f"{percent_text(FALSE_DISCOVERY_RATE)} do not):")  # fmt: skip
    for one in odd[:MAX_PRINTED_UNITS]:
        yield f"  {one.unit}: {difference_words(one.difference, unit_of)}"
    if len(odd) > MAX_PRINTED_UNITS:
        yield f"  and {len(odd) - MAX_PRINTED_UNITS} more, which are in the JSON."


def _misfit_lines(answer: UnitsAnswer, advice: str) -> Iterator[str]:
    """The units that the model describes worse than the others."""
    if not answer.misfits:
        return
    usual = number_text(answer.misfits[0].usual)
    yield (f"{len(answer.misfits)} of {answer.judged} units stand out by what the model leaves there, where it leaves "
           f"{usual} times the noise of the others: something acts there that it does not have, and their parameters "
           f"are not compared.{advice and ' '}{advice}")  # fmt: skip
    for one in answer.misfits[:MAX_PRINTED_UNITS]:
        yield f"  {one.unit}: {number_text(one.error)} times the noise (p = {p_value_text(one.p_value)})."
    if len(answer.misfits) > MAX_PRINTED_UNITS:
        yield f"  and {len(answer.misfits) - MAX_PRINTED_UNITS} more, which are in the JSON."


def then_text(then: Campaign) -> TextBlocks:
    """What the logs of the units that stand out lack."""
    if not then.logs:
        yield f"{then.do}: no unit stands out, so none was asked."
        return
    rows = [
        (r.unit, r.log, r.verdict or "", _effects(r), _error_text(r.error), _error_text(r.error_after))
        for r in then.logs
    ]  # fmt: skip
    yield Table(f"{then.do}, of the units that stand out", THEN_COLUMNS, rows[:MAX_PRINTED_UNITS])
    if len(rows) > MAX_PRINTED_UNITS:
        yield f"And {len(rows) - MAX_PRINTED_UNITS} more logs, which are in the JSON."
    for result in then.logs:
        if result.failure is not None:
            yield f"{result.log}: {result.failure}"


def _effects(result: LogResult) -> str:
    return ", ".join(n.effect for n in result.named)


def _error_text(error: float | None) -> str:
    return "" if error is None else number_text(error)


def difference_words(found: Difference, unit_of: UnitOf) -> str:
    """By which parameters something differs, each with its interval."""
    if not found.parameters:
        return f"it differs by no more than its errors allow (p = {p_value_text(found.p_value)})."
    return "; ".join(_explained_words(e, unit_of) for e in found.parameters) + "."


def _explained_words(found: Explained, unit_of: UnitOf) -> str:
    low, high = found.interval
    unit = unit_of(found.parameter)
    sign = "+" if found.difference > 0 else ""
    between = f"{number_text(low)} to {number_text(high)}"
    return f"{found.parameter} {sign}{number_text(found.difference)} {unit} (95 %: {between})".replace("  ", " ")


def drift_sentence(found: Drift, unit_of: UnitOf) -> str:
    """What changes with the date."""
    whose = "All units drift alike" if found.unit is None else f"{found.unit} drifts"
    size = f"{number_text(found.per_day)} ± {number_text(found.sigma)} {unit_of(found.parameter)} a day"
    return f"{whose} in {found.parameter}: {size} (p = {p_value_text(found.p_value)})."


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
