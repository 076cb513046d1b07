"""Results of `compare` as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.numbers import (
    digits_text,
    fit_text,
    physical_text,
    prediction_error_text,
    quantity_text,
    unexplained_input_text,
)
from wheelpend.reports.text.force_ranges import missing_force_text
from wheelpend.reports.text.remainder import NOT_SEARCHED, remainder_sentences
from wheelpend.reports.text.residuals import residual_lines
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.diagnosis.compare import Comparison
    from wheelpend.model.record import Model

MAX_LISTED_TIMES = 12  # of a log
MIN_TELLING_SEGMENTS = 5  # predicted, below which an error over a long horizon is one of a few starts
MAX_NOISE_ERROR_RATIO = 1.05  # times the noise floor; below it the model explains a log


def comparison_text(result: Comparison, model: Model) -> TextBlocks:
    """Errors, fits, the closed loop, and where the model fails."""
    quantities = plant_units_of(model)
    yield from _error_text(result, quantities)
    yield from _models_text(result)
    yield from _closed_loop_lines(result, quantities)
    yield from map(_own_values_sentence, result.per_log)
    yield from force_error_lines(result, quantities, model.plant_signature.driven)
    yield from remainder_sentences(result.remainder, model, NOT_SEARCHED)
    if result.residual_tests:
        yield from residual_lines(result.residual_tests, model)
    yield from missing_force_text(result, quantities)


def _error_text(result: Comparison, quantities: PlantUnits) -> TextBlocks:
    if result.fitted_first:
        yield "The model has no parameter values yet: it was fitted to the log first."
    explained = result.error < MAX_NOISE_ERROR_RATIO * result.noise_floor
    yield (f"Error {prediction_error_text(result.error)} over {result.horizon_s:g} s "
           f"(noise floor {digits_text(result.noise_floor)}): "
           f"the model {'explains the log down to its noise.' if explained else 'misses something.'}")  # fmt: skip
    yield Table(
        f"Fit per channel over {result.horizon_s:g} s",
        ("channel", "fit [%]", "rmse"),
        [
            (c, fit_text(fit), quantity_text(result.rmse[c], quantities.unit(c)))
            for c, fit in result.fit_percent.items()
        ],
    )
    yield Table(
        "Error against horizon",
        ("seconds", "segments", "error"),
        [
            (digits_text(h.seconds), str(h.segments), "diverged" if h.diverged else prediction_error_text(h.error))
            for h in result.horizons
        ],
    )


def _models_text(result: Comparison) -> TextBlocks:
    """The errors of several models, each in a column."""
    if not result.against:
        return
    models = result.models
    rows = [(f"error over {result.horizon_s:g} s", *(prediction_error_text(m.error) for m in models))]
    for channel in result.rmse:
        rows.append((f"fit of {channel} [%]", *(fit_text(m.fit_percent.get(channel)) for m in models)))
    others = [(k, h) for k, h in enumerate(result.horizons) if h.seconds != result.horizon_s]
    for number, horizon in others:
        errors = (m.horizons[number] for m in models)
        over = f"error over {digits_text(horizon.seconds)} s, {_count_text(horizon.segments, 'segment')}"
        rows.append((over, *("diverged" if h.diverged else prediction_error_text(h.error) for h in errors)))
    yield Table("Beside other models, on the same segments", ("", *(m.label for m in models)), rows)
    if any(horizon.segments < MIN_TELLING_SEGMENTS for horizon in result.horizons):
        yield (f"Where the segments are few, chance decides which model looks better: judge by the error over "
               f"{result.horizon_s:g} s.")  # fmt: skip
    if fitted := [m.label for m in result.against if m.fitted_first]:
        yield f"Without parameter values of its own, and so fitted to the logs first: {', '.join(fitted)}."


def _closed_loop_lines(result: Comparison, quantities: PlantUnits) -> Iterator[str]:
    loop = result.closed_loop
    if not loop:
        return
    errors = [f"{c} off by {quantity_text(v, quantities.unit(c))} rms" for c, v in loop.rmse.items()]
    errors = [", ".join(errors), f"control input off by {quantity_text(loop.rmse_input, quantities.force)} rms."]
    found = f"it {quantities.words.strays}." if loop.diverged else ", ".join(errors)
    yield f"Closed loop replayed with the model: {found}"


def _own_values_sentence(row: Mapping[str, Any]) -> str:
    values = ", ".join(f"{n} {digits_text(v)}" for n, v in row.items() if n != "log")
    return f"Of its own in {row['log']}: {values}."


def force_error_lines(result: Comparison, quantities: PlantUnits, driven: bool = True) -> Iterator[str]:
    """What inverse dynamics leave of the input, and the bursts in which they leave far more than usual."""
    known = {name: error for name, error in result.force_error.items() if error is not None}
    for name, error in known.items():
        yield f"{name}: inverse dynamics {unexplained_input_text(error, driven)}"
    for name in known:
        own = [b for b in result.bursts if b["log"] == name]
        elsewhere = [b for b in own if not b["at_reversal"]]
        if elsewhere:
            yield _burst_sentence(name, elsewhere, quantities)
        if at_reversals := len(own) - len(elsewhere):
            also = "so it does" if elsewhere else "the model misses far more force than usual"
            yield f"{name}: {also} at {_count_text(at_reversals, 'reversal')}, where friction is hardest to know."


def _burst_sentence(name: str, bursts: list[dict], quantities: PlantUnits) -> str:
    peak = max(b["peak"] for b in bursts)
    physical = physical_text(peak, quantities.force, quantities, 3)
    size = quantity_text(peak, quantities.force, 3) + (f" = {physical}" if physical else "")
    times = listed_text([f"{b['from']:.3f}" for b in bursts])
    where = f"{name}: in {_count_text(len(bursts), 'short stretch', 'es')}"
    return (
        f"{where} the model misses far more force than usual, up to {size}: at "
        f"t = {times} s. Something pushes there, or winds up, that the model does not have."
    )


def _count_text(count: int, what: str, ending: str = "s") -> str:
    return f"{count} {what}{'' if count == 1 else ending}"


def listed_text(items: list[str]) -> str:
    """The first items in a row, with an ellipsis for the others."""
    return ", ".join(items[:MAX_LISTED_TIMES]) + (", …" if len(items) > MAX_LISTED_TIMES else "")
