"""Results of a campaign as text: what the logs have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from wheelpend.campaigns.summary import ParameterAgreement, ParameterRecovery, Summary
from wheelpend.campaigns.units_text import then_text, units_text
from wheelpend.identification.method_options import LEAST_SQUARES
from wheelpend.model.units import effect_unit
from wheelpend.proportion import Proportion
from wheelpend.reports.numbers import digits_text, number_text, percent_range_text
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.campaigns.one_log import LogResult
    from wheelpend.campaigns.runner import Campaign

MISFIT_ADVICE = "--then diagnose asks their logs what."
MAX_PRINTED_ITEMS = 5  # logs, or messages, that are printed
RECOVERY_COLUMNS = ("parameter", "truth", "bias", "±", "spread", "mean σ", "95 %")
AGREEMENT_COLUMNS = ("parameter", "logs", "mean", "±", "spread", "mean σ", "χ²/dof", "p")


def campaign_text(result: Campaign, file: Path) -> TextBlocks:
    """Failures, errors, verdicts and parameters over all logs."""
    summary = result.summary
    method = f" ({result.method})" if result.method else ""
    yield f"{result.do}{method}: {summary.logs - summary.failed} of {summary.logs} logs. Each is a line of {file}."
    yield from _failure_lines(result.logs)
    yield from _error_lines(summary)
    if summary.verdicts:
        yield from _verdicts_text(summary)
    yield from _parameters_text(result)
    if result.fleet is not None:
        advice = MISFIT_ADVICE if result.do == "identify" and result.then is None else ""
        yield from units_text(result.fleet, partial(effect_unit, result.model), advice)
    if result.then is not None:
        yield from then_text(result.then)
    odd = sum(bool(a.warnings) for a in result.logs)
    if odd:
        yield f"There are warnings about {odd} {_log_noun(odd)}: see the column warnings."


def _failure_lines(answers: Sequence[LogResult]) -> Iterator[str]:
    """Why logs could not be used, each message once."""
    messages: dict[str, list[str]] = {}
    for result in answers:
        if result.failure is not None:
            messages.setdefault(result.failure, []).append(result.log)
    for message, logs in list(messages.items())[:MAX_PRINTED_ITEMS]:
        yield f"Not used: {_names_text(logs)}: {message}"
    if len(messages) > MAX_PRINTED_ITEMS:
        yield f"{len(messages) - MAX_PRINTED_ITEMS} more messages are in the column failure."


def _error_lines(summary: Summary) -> Iterator[str]:
    """The errors' range, and the logs that the model does not explain."""
    for what, errors in (("Error", summary.error), ("Error with what was named", summary.error_after)):
        if errors is not None:
            mean, smallest, largest = map(number_text, errors)
            yield f"{what}: {mean} on average, {smallest} to {largest}."
    worst = summary.unexplained
    if worst and not summary.verdicts:
        yield (
            f"The model leaves more than noise in {len(worst)} {_log_noun(len(worst))}, "
            f"the worst first: {_names_text(worst)}."
        )


def _verdicts_text(summary: Summary) -> TextBlocks:
    """How often what was found missing, beside what was hidden."""
    yield f"Verdicts: {', '.join(f'{v} {n}' for v, n in summary.verdicts.items())}."
    used = summary.logs - summary.failed
    if summary.named:
        rows = [(e, str(n), f"{100 * n / used:.0f} %", interval_text(Proportion(n, used)))
                for e, n in summary.named.items()]  # fmt: skip
        yield Table("Named", ("effect", "logs", "of all", "95 % interval"), rows)
    if summary.false_alarms is not None:
        yield f"Nothing was hidden, and something was found missing in {rate_text(summary.false_alarms)}."
    if summary.first_right is not None:
        yield (
            f"Hidden: {', '.join(summary.hidden)}. The first answer is right, or declared equivalent to what is, in "
            f"{rate_text(summary.first_right)}."
        )
    for effect, rate in summary.found.items() if len(summary.hidden) > 1 else ():
        yield f"  {effect} is named, or declared equivalent, in {rate_text(rate)}."


# ---- parameters


def _parameters_text(result: Campaign) -> TextBlocks:
    summary = result.summary
    simulated = {n: row for n, row in summary.parameters.items() if isinstance(row, ParameterRecovery)}
    measured = {n: row for n, row in summary.parameters.items() if isinstance(row, ParameterAgreement)}
    ending = f" of the model with {', '.join(summary.effects)}" if summary.effects else ""
    if simulated:
        yield from _recovery_text(f"Parameters{ending} beside the truth", simulated)
    if measured:
        rows = [_agreement_cells(n, row) for n, row in measured.items()]
        yield Table(f"Parameters{ending} over the logs", AGREEMENT_COLUMNS, rows)
        yield from _agreement_sentences(measured, summary.disagreeing, result.method, asked=bool(summary.verdicts))


def _recovery_text(title: str, rows: Mapping[str, ParameterRecovery]) -> TextBlocks:
    """Parameters of simulated logs beside the truth, and the coverage of their intervals."""
    yield Table(title, RECOVERY_COLUMNS, [_recovery_cells(n, row) for n, row in rows.items()])
    inside = Proportion(sum(r.inside.hits for r in rows.values()), sum(r.inside.of for r in rows.values()))
    if inside.of:
        yield f"The truth lies in {digits_text(100 * inside.share, 3)} % of the 95 % intervals."


def _recovery_cells(name: str, row: ParameterRecovery) -> tuple[str, ...]:
    errors = (number_text(v, 2) for v in (row.bias, row.bias_sigma, row.spread, row.sigma))
    return (name, number_text(row.truth), *errors, f"{row.inside.hits}/{row.inside.of}")


def _agreement_cells(name: str, row: ParameterAgreement) -> tuple[str, ...]:
    reduced_chi_square = row.chi_square / row.degrees if row.degrees else None
    errors = (number_text(v, 2) for v in (row.mean_sigma, row.spread, row.sigma, reduced_chi_square, row.p_value))
    return (name, str(row.logs), number_text(row.mean), *errors)


def _agreement_sentences(
    rows: Mapping[str, ParameterAgreement], disagreeing: Sequence[str], method: str | None, *, asked: bool
) -> Iterator[str]:
    """Where the logs do not agree, and why that may be; ``asked`` says that each was asked already what it lacks."""
    for name in disagreeing:
        if (far := rows[name].furthest) is not None:
            which = f"furthest off is {far.log}, by" if rows[name].logs > 2 else "they differ by"
            yield f"The logs do not agree on {name}: {which} {digits_text(far.sigmas, 3)} standard errors."
    if disagreeing:
        noise = ", or noise biases the method, which --method shooting does not suffer" * (method in LEAST_SQUARES)
        ask = "" if asked else " --do diagnose asks each log what is missing."
        yield f"The machine changes from log to log, or the model misses something{noise}.{ask}"
    elif any(r.degrees for r in rows.values()):
        yield "The logs agree: they scatter no more than their standard errors allow."


# ---- rates and names


def rate_text(rate: Proportion) -> str:
    """So many of so many logs, with the interval of the share."""
    return f"{rate.hits} of {rate.of} {_log_noun(rate.of)} ({interval_text(rate)})"


def interval_text(rate: Proportion) -> str:
    """The 95 % interval of a share."""
    return f"{percent_range_text(rate.interval)} %"


def _log_noun(count: int) -> str:
    return "log" if count == 1 else "logs"


def _names_text(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_PRINTED_ITEMS} more" if len(names) > MAX_PRINTED_ITEMS else ""
    return ", ".join(names[:MAX_PRINTED_ITEMS]) + more
