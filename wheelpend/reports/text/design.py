"""Results of `design` as text: the command, what it asks of the machine and what it is expected to bring."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.diagnosis.criteria import MAX_EQUIVALENT_ERROR_DIFFERENCE
from wheelpend.experiments.advice import CLEAR_SEPARATION_SIGMA, duration_text, records_needed
from wheelpend.reports.numbers import digits_text
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from pathlib import Path

    from derive.plant_signature import PlantSignature
    from wheelpend.experiments.design import Design, ExpectedErrors

PREDICTIONS = ("logs", "builtin", "designed")  # errors of the logs alone, with a built-in and with the designed command
MAX_WORTHWHILE_RECORD_MIN = 60.0  # min


def design_text(design: Design, path: Path, logs: tuple[str, ...]) -> TextBlocks:
    """A command that was written to ``path``, beside the logs that are known already."""
    if logs:
        yield f"Beside {', '.join(logs)}:"
    yield f"Wrote {path}: {design.duration_s:g} s of {design.command}."
    if design.separation is not None:
        yield from _separation_text(design)
    yield _expected_errors_table(design)
    yield _peaks_table(design)
    yield from design.sentences
    if not design.own_controller:
        gains = ", ".join(map(digits_text, design.gains))
        plant = design.question.problem.plant
        made = f"it was rehearsed with a PID on {plant.what_is_controlled}, made for it: gains = [{gains}]."
        yield f"The model has no [controller]; {made}"


def _peaks_table(design: Design) -> Table:
    rows = [
        (_command_text(design, k, ""), f"{p.pitch:.3f}", f"{p.voltage:.1f}", f"{p.wheel_travel:.0f}")
        for k, p in design.peaks.items()
    ]
    plant = _plant(design)
    columns = (
        "command",
        f"{plant.words.controlled or plant.range_channel} [rad]",
        f"{plant.input_word} [{plant.input_unit}]",
        f"{plant.travel_words} [{plant.coordinates[0].unit}]",
    )
    return Table(f"What it asks of the {plant.words.machine}", columns, rows)


def _plant(design: Design) -> PlantSignature:
    return design.question.problem.plant


def _separation_text(design: Design) -> Iterator[str | Table]:
    separation = design.separation or {}
    rows = [(_command_text(design, k), f"{v:.1f}") for k, v in separation.items() if v is not None]
    title = f"{design.between[0]} or {' or '.join(design.between[1:])}: standard errors apart"
    yield Table(title, ("after", "apart"), rows)
    reached = separation["designed"] or 0.0
    needed_s = design.duration_s * records_needed(reached, separation.get("logs") or 0.0)
    if reached < CLEAR_SEPARATION_SIGMA and needed_s < 60.0 * MAX_WORTHWHILE_RECORD_MIN:
        yield f"{CLEAR_SEPARATION_SIGMA:g} would be clear: a record of about {duration_text(needed_s)} would be needed."
    elif reached < CLEAR_SEPARATION_SIGMA:
        yield (
            f"{CLEAR_SEPARATION_SIGMA:g} would be clear, which no command comes near: "
            "`wheelpend diagnose` says what else may help."
        )
    elif design.gap is not None and design.gap < MAX_EQUIVALENT_ERROR_DIFFERENCE:
        yield (
            f"Their errors will differ by {digits_text(100 * design.gap, 2)} % only, so that `wheelpend diagnose` will "
            "still list both; the smaller one is right."
        )


def _expected_errors_table(design: Design) -> Table:
    module = design.question.problem.module
    units = dict(zip(module.PARAMETERS, module.UNITS, strict=True))
    shown = [k for k in PREDICTIONS if any(getattr(v, k) is not None for v in design.parameters.values())]
    rows = [
        (n, digits_text(v.value), units[n], *(_relative_error_text(v, getattr(v, k)) for k in shown))
        for n, v in design.parameters.items()
    ]
    columns = ("parameter", "value", "unit", *(_command_text(design, k) for k in shown))
    return Table("Expected standard errors", columns, rows)


def _relative_error_text(expected: ExpectedErrors, error: float) -> str:
    """A standard error in percent of the value, or in its own unit where the value is lost in it."""
    if error == float("inf"):
        return "unknown"
    percent = 100.0 * error / abs(expected.value) if expected.value else float("inf")
    return f"{digits_text(percent, 2)} %" if percent < 100.0 else digits_text(error, 2)


def _command_text(design: Design, kind: str, beside: str = "+ ") -> str:
    """The logs at hand, the best built-in command, or the designed one."""
    beside = "" if all(v.logs is None for v in design.parameters.values()) else beside
    if kind == "logs":
        return "logs alone"
    if kind == "designed":
        return f"{beside}designed"
    factor = design.peaks[kind].factor
    return f"{beside}{design.builtin}" + ("" if factor == 1.0 else f" × {factor:.2f}")
