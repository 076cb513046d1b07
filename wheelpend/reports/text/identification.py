"""Results of `identify` as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.reports.numbers import (
    digits_text,
    estimate_text,
    number_text,
    prediction_error_text,
    unexplained_input_text,
    whole_digits_text,
)
from wheelpend.reports.text.remainder import NOT_SEARCHED, remainder_sentences, widening_sentences
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.identification.bias_test import BiasTest
    from wheelpend.identification.identify import Identification
    from wheelpend.identification.time_constants import TimeConstantChoice


def identification_text(result: Identification) -> TextBlocks:
    """Parameters with standard errors, the quality of the fit, and the bias of least squares."""
    yield from _parameters_text(result)
    yield _quality_sentence(result)
    yield from remainder_sentences(result.remainder, result.start, NOT_SEARCHED)
    yield from widening_sentences(result.widening)
    driven = result.start.plant_signature.driven
    if result.force_error is not None:
        yield f"Inverse dynamics with these values {unexplained_input_text(result.force_error, driven)}"
    if result.cutoff_hz is not None:
        yield (
            f"Motion differentiated up to {whole_digits_text(result.cutoff_hz, 2)} Hz, chosen for this log: above that "
            "noise would bend the parameters. Both sides compared up to half of it."
        )
    if result.bias:
        yield from bias_text(result.bias)
    if result.guide:
        yield from time_constants_text(result.guide)


def _parameters_text(result: Identification) -> Iterator[str | Table]:
    rows = [
        (n, estimate_text(e.value, None if n in result.fixed else e.sigma, e.unit), _remark(result, n))
        for n, e in result.parameters.items()
    ]
    yield Table(f"Parameters by {result.method}", ("parameter", "value", ""), rows)
    for n, e in result.parameters.items():
        for own in e.per_log:
            yield f"  {n} in {own.log}: {estimate_text(own.value, own.sigma, e.unit)}"


def _remark(result: Identification, name: str) -> str:
    """What a parameter's row says beside its value."""
    if name in result.fixed:
        return "fixed"
    if name in result.at_bounds:
        return "at its bound"
    return "" if result.parameters[name].identifiable else "not excited"


def _quality_sentence(result: Identification) -> str:
    parts = [f"{result.samples} samples", f"condition number {digits_text(result.condition_number, 3)}"]
    if result.error:
        parts.append(f"error {prediction_error_text(result.error)} (noise floor {number_text(result.noise_floor)})")
    if result.tau:
        parts.append(f"τ = {', '.join(f'{t:g}' for t in result.tau)} s")
    return "; ".join(parts) + "."


def bias_text(bias: BiasTest) -> TextBlocks:
    """Bias of least squares beside another method, and what noise is predicted to do."""
    columns = (bias.difference_percent, bias.sigma_percent, bias.predicted_bias_percent, bias.predicted_spread_percent)
    yield Table(
        f"Least squares against {bias.against}, in % of each parameter",
        ("parameter", "difference", "± by chance", "bias predicted", "spread predicted"),
        [(n, *(number_text(column[n]) for column in columns)) for n in bias.difference_percent],
    )
    yield bias.sentence


def time_constants_text(choice: TimeConstantChoice) -> TextBlocks:
    """Errors of the estimate over both time constants alike, and the reason for the chosen pair."""
    rows = [(f"{r.tau1:g}", number_text(r.bias), number_text(r.spread), number_text(r.score)) for r in choice.diagonal]
    title = f"Both time constants alike, on {choice.replicas} rehearsals"
    yield Table(title, ("τ [s]", "bias [%]", "spread [%]", "error [%]"), rows)
    yield choice.reason
