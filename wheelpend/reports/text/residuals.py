"""Results of `residuals` as text: a table of the tests, and what each channel's mean, in a sentence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import digits_text, number_text, p_value_text, time_text
from wheelpend.reports.text.remainder import NOT_SEARCHED, remainder_sentences
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.identification.residual_tests import ChannelResidual, ResidualTests
    from wheelpend.model.record import Model

MAX_RIGHT_RATIO = 1.1  # of σ found and assumed, within which they agree
BELIEVED_INPUT_P = 0.01  # below which past inputs predict what is left
HEAVY_KURTOSIS = 1.0  # excess, from which the tails are heavy
FEW_READINGS_KURTOSIS = 100.0  # excess, of which at most three readings in a hundred are the cause
RESIDUAL_COLUMNS = ("channel", "white", "p", "past inputs p", "σ found / assumed", "kurtosis")
BASIS_WORDS = {
    "rounding": "the noise of rounding to its step",
    "stated": "the noise stated in model.toml",
    "log": "the noise found in the log",
}
CLOSING_SENTENCE = "They inform and do not decide: `wheelpend diagnose` says what is missing, and how sure that is."


def residuals_text(result: ResidualTests, model: Model) -> TextBlocks:
    """The tests of every channel, their meaning, and what the filter expects by chance."""
    if result.fitted_first:
        yield "The model has no parameter values yet: it was fitted to the logs first."
    yield Table(
        "Residuals of the filter", RESIDUAL_COLUMNS, [(name, *residual_cells(c)) for name, c in result.channels.items()]
    )
    yield from _meaning_lines(result)
    yield from noise_lines(result, model)
    yield from remainder_sentences(result.remainder, model, NOT_SEARCHED)
    yield CLOSING_SENTENCE


def residual_lines(result: ResidualTests, model: Model) -> Iterator[str]:
    """The tests' meaning alone, beside another result."""
    yield "Residuals, which inform and do not decide (`wheelpend residuals` has the figures):"
    yield from (f"  {line}" for line in _meaning_lines(result))
    yield from noise_lines(result, model)


def noise_lines(result: ResidualTests, model: Model) -> Iterator[str]:
    """Lines for model.toml that state the noise of channels as it was found, where it was taken for another.

    Of a channel with an error of its own they say nothing: its size is not that of the noise alone.
    """
    judged = {n: c for n, c in result.channels.items() if c.samples and c.white and n not in result.remainder.sensors}
    wrong = {n: c for n, c in judged.items() if not _is_of_expected_size(c) and not _is_of_few_readings(c)}
    if not wrong:
        return
    units, header = plant_units_of(model), [] if model.sensors.noise else ["[sensors.noise]"]
    yield f"The noise as it was found, to copy into model.toml{'' if header else ', under [sensors.noise]'}:"
    rows = [f"{name} = {c.sigma_found:.3g}".ljust(24) + f"# {units.unit(name)}" for name, c in wrong.items()]
    yield "\n".join(f"    {row}" for row in [*header, *rows])


def _meaning_lines(result: ResidualTests) -> Iterator[str]:
    for name, channel in result.channels.items():
        yield f"{name}: {meaning_text(channel)}"


def residual_cells(one: ChannelResidual) -> tuple[str, ...]:
    """The tests of a channel under RESIDUAL_COLUMNS, its name apart."""
    past = "" if one.independent_of_input_p is None else p_value_text(one.independent_of_input_p)
    return ("yes" if one.white else "no", p_value_text(one.whiteness_p), past, digits_text(one.sigma_ratio, 3),
            digits_text(one.kurtosis, 2))  # fmt: skip


def meaning_text(one: ChannelResidual) -> str:
    """What a channel's tests mean, in one sentence or two."""
    basis, factor = BASIS_WORDS[one.basis], digits_text(one.sigma_ratio, 2)
    if not one.samples:
        return "no reading of it was judged."
    if one.white and _is_of_few_readings(one) and one.sigma_ratio > MAX_RIGHT_RATIO:
        text = f"white at {factor} times {basis}, which few readings make; the noise of the others is less."
    elif one.white and one.sigma_ratio > MAX_RIGHT_RATIO:
        text = f"white at {factor} times {basis}: the noise is understated, not the physics."
    elif one.white and not _is_of_expected_size(one):
        text = f"white at {factor} times {basis}: the noise is overstated."
    elif one.white:
        text = f"white, at {basis}."
    else:
        text = f"not white: {_colour_text(one)}. {_colour_cause(one)}"
    return f"{text}{_input_text(one)}{_tail_text(one)}"


def _is_of_expected_size(one: ChannelResidual) -> bool:
    return one.sigma_ratio * MAX_RIGHT_RATIO >= 1.0 and one.sigma_ratio <= MAX_RIGHT_RATIO


def _is_of_few_readings(one: ChannelResidual) -> bool:
    """True where a few in a hundred readings make its size: of these the excess kurtosis is three over their share."""
    return one.kurtosis > FEW_READINGS_KURTOSIS


def _colour_text(one: ChannelResidual) -> str:
    """Where the autocorrelation stands out most."""
    rows = zip(one.autocorrelation, one.band, one.lags_s, strict=True)
    value, band, lag = max(rows, key=lambda row: abs(row[0]) / max(row[1], 1e-300))
    return f"autocorrelation {digits_text(value, 2)} at {time_text(lag)} (± {number_text(band)} by chance)"


def _colour_cause(one: ChannelResidual) -> str:
    if one.sigma_ratio > MAX_RIGHT_RATIO:
        return f"It is {digits_text(one.sigma_ratio, 2)} times as large as expected: something is missing in the model."
    if not _is_of_expected_size(one):
        size = f"{digits_text(one.sigma_ratio, 2)} times as large as expected"
        return f"It is {size}: the noise that is assumed of this channel is too large."
    return "Its size is as expected: a small law, a filter of the sensor, or rounding to steps."


def _input_text(one: ChannelResidual) -> str:
    if one.independent_of_input_p is None or one.independent_of_input_p >= BELIEVED_INPUT_P:
        return ""
    return (f" Past inputs predict it (p = {p_value_text(one.independent_of_input_p)}): what the input does is not "
            "quite what the model says; think of a delay, a lag, a gain or a dead zone.")  # fmt: skip


def _tail_text(one: ChannelResidual) -> str:
    if one.kurtosis < HEAVY_KURTOSIS:
        return ""
    return f" Its tails are heavy (excess kurtosis {digits_text(one.kurtosis, 2)}): outliers, bursts, or slips."
