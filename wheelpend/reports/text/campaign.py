"""A campaign as a table for other programs, and in words."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wheelpend.campaigns.one_log import LogResult
from wheelpend.campaigns.runner import Campaign
from wheelpend.campaigns.summary import ParameterAgreement, ParameterRecovery, Summary
from wheelpend.identification.identify import LEAST_SQUARES
from wheelpend.proportion import Proportion
from wheelpend.reports.console import print_line, print_table
from wheelpend.reports.numbers import number_text

TABLE_PREFIXES = (b"log,failure", b"seed,failure")  # of the first line of a campaign's table
VERDICT_COLUMNS = ("verdict", "named", "equivalent_to", "error", "error_after", "noise_floor")
MAX_PRINTED_ITEMS = 5  # logs, or messages, that are printed


# ---- as a table


def csv_text(result: Campaign) -> str:
    """One line per log; columns in which nothing stands are left out, and what a log does not tell is blank."""
    channels = dict.fromkeys(f"fit_percent.{c}" for a in result.logs for c in a.fit_percent)
    parameters = dict.fromkeys(n for a in result.logs for n in a.parameters)
    columns = [*VERDICT_COLUMNS, *channels, *(c for n in parameters for c in (n, f"{n}_sigma")), "warnings"]
    rows = [table_row(a) for a in result.logs]
    filled = [c for c in columns if any(row.get(c) not in (None, "") for row in rows)]
    text = io.StringIO()
    writer = csv.DictWriter(text, ["seed" if result.simulated else "log", "failure", *filled],
                            extrasaction="ignore", lineterminator="\n")  # fmt: skip
    writer.writeheader()
    writer.writerows({c: _cell_value(v) for c, v in row.items()} for row in rows)
    return text.getvalue()


def _cell_value(value: Any) -> Any:
    """A number with nine digits; a text on one line."""
    if isinstance(value, float):
        return f"{value:.9g}"
    return " ".join(value.split()) if isinstance(value, str) else value


def table_row(found: LogResult) -> dict[str, Any]:
    """One log's line, by column."""
    return {
        "log": found.log,
        "seed": found.seed,
        "failure": found.failure,
        "verdict": found.verdict,
        "named": " ".join(n.effect for n in found.named),
        "equivalent_to": " ".join(e for n in found.named for e in n.equivalent_to),
        "error": found.error,
        "error_after": found.error_after,
        "noise_floor": found.noise_floor,
        **{f"fit_percent.{c}": v for c, v in found.fit_percent.items()},
        **{n: e.value for n, e in found.parameters.items()},
        **{f"{n}_sigma": e.sigma for n, e in found.parameters.items()},
        "warnings": " ".join(found.warnings),
    }


def is_campaign_table(path: Path) -> bool:
    """Whether a file is the table of a campaign."""
    try:
        with path.open("rb") as file:
            return file.read(20).startswith(TABLE_PREFIXES)
    except OSError:
        return False


# ---- in words


def print_campaign(result: Campaign, file: Path) -> None:
    """Print what the logs have in common."""
    summary = result.summary
    method = f" ({result.method})" if result.method else ""
    print_line(
        f"{result.do}{method}: {summary.logs - summary.failed} of {summary.logs} logs. Each is a line of {file}."
    )
    print_failures(result.logs)
    print_errors(result)
    print_verdicts(summary)
    simulated = {n: row for n, row in summary.parameters.items() if isinstance(row, ParameterRecovery)}
    measured = {n: row for n, row in summary.parameters.items() if isinstance(row, ParameterAgreement)}
    ending = f" of the model with {', '.join(summary.effects)}" if summary.effects else ""
    if simulated:
        print_recovery(f"Parameters{ending} beside the truth", simulated)
    if measured:
        print_agreement(f"Parameters{ending} over the logs", measured, summary, result.method)
    odd = sum(bool(a.warnings) for a in result.logs)
    if odd:
        print_line(f"There are warnings about {odd} {_log_noun(odd)}: see the column warnings.")


def print_failures(answers: Sequence[LogResult]) -> None:
    """Print why logs could not be used, each message once."""
    messages: dict[str, list[str]] = {}
    for found in answers:
        if found.failure is not None:
            messages.setdefault(found.failure, []).append(found.log)
    for message, logs in list(messages.items())[:MAX_PRINTED_ITEMS]:
        print_line(f"Not used: {_names_text(logs)}: {message}")
    if len(messages) > MAX_PRINTED_ITEMS:
        print_line(f"{len(messages) - MAX_PRINTED_ITEMS} more messages are in the column failure.")


def print_errors(result: Campaign) -> None:
    """Print the errors' range, and the logs that the model does not explain."""
    for what, found in (("Error", result.summary.error), ("Error with what was named", result.summary.error_after)):
        if found is not None:
            print_line(
                f"{what}: {number_text(found.mean)} on average, "
                f"{number_text(found.smallest)} to {number_text(found.largest)}."
            )
    worst = result.summary.unexplained
    if worst and not result.summary.verdicts:
        print_line(
            f"The model leaves more than noise in {len(worst)} {_log_noun(len(worst))}, "
            f"the worst first: {_names_text(worst)}."
        )


def print_verdicts(summary: Summary) -> None:
    """Print how often what was found missing."""
    if not summary.verdicts:
        return
    print_line("Verdicts: " + ", ".join(f"{v} {n}" for v, n in summary.verdicts.items()) + ".")
    used = summary.logs - summary.failed
    if summary.named:
        rows = [
            (e, str(n), f"{100 * n / used:.0f} %", interval_text(Proportion(n, used))) for e, n in summary.named.items()
        ]
        print_table("Named", ("effect", "logs", "of all", "95 % interval"), rows)
    if summary.false_alarms is not None:
        print_line(f"Nothing was hidden, and something was found missing in {rate_text(summary.false_alarms)}.")
    if summary.first_right is not None:
        print_line(
            f"Hidden: {', '.join(summary.hidden)}. The first answer is right, or declared equivalent to what is, in "
            f"{rate_text(summary.first_right)}."
        )
    for effect, found in summary.found.items() if len(summary.hidden) > 1 else ():
        print_line(f"  {effect} is named, or declared equivalent, in {rate_text(found)}.")


def print_recovery(title: str, rows: dict[str, ParameterRecovery]) -> None:
    """Print parameters of simulated logs beside the truth."""
    columns = ("parameter", "truth", "bias", "±", "spread", "mean σ", "95 %")
    print_table(
        title,
        columns,
        [
            (
                n,
                number_text(r.truth),
                two_digits_text(r.bias),
                two_digits_text(r.bias_sigma),
                two_digits_text(r.spread),
                two_digits_text(r.sigma),
                f"{r.inside.hits}/{r.inside.of}",
            )
            for n, r in rows.items()
        ],
    )
    inside = Proportion(sum(r.inside.hits for r in rows.values()), sum(r.inside.of for r in rows.values()))
    if inside.of:
        print_line(f"The truth lies in {100 * inside.share:.3g} % of the 95 % intervals.")


def print_agreement(title: str, rows: dict[str, ParameterAgreement], summary: Summary, method: str | None) -> None:
    """Print whether logs agree on parameters."""
    columns = ("parameter", "logs", "mean", "±", "spread", "mean σ", "χ²/dof", "p")
    print_table(
        title,
        columns,
        [
            (
                n,
                str(r.logs),
                number_text(r.mean),
                two_digits_text(r.mean_sigma),
                two_digits_text(r.spread),
                two_digits_text(r.sigma),
                two_digits_text(r.chi_square / r.degrees if r.degrees else None),
                two_digits_text(r.p_value),
            )
            for n, r in rows.items()
        ],
    )
    for name in summary.disagreeing:
        if (far := rows[name].furthest) is not None:
            which = f"furthest off is {far.log}, by" if rows[name].logs > 2 else "they differ by"
            print_line(f"The logs do not agree on {name}: {which} {far.sigmas:.3g} standard errors.")
    if summary.disagreeing:
        noise = ", or noise biases the method, which --method shooting does not suffer" * (method in LEAST_SQUARES)
        print_line(
            f"The machine changes from log to log, or the model misses something{noise}. --do diagnose asks each log "
            "what is missing."
        )
    elif any(r.degrees for r in rows.values()):
        print_line("The logs agree: they scatter no more than their standard errors allow.")


def two_digits_text(value: float | None) -> str:
    """Two significant digits."""
    return "-" if value is None else f"{value:.2g}"


def rate_text(found: Proportion) -> str:
    """So many of so many logs, with the interval of the share."""
    return f"{found.hits} of {found.of} {_log_noun(found.of)} ({interval_text(found)})"


def interval_text(found: Proportion) -> str:
    """The 95 % interval of a share."""
    low, high = found.interval
    return f"{100 * low:.0f}-{100 * high:.0f} %"


def _log_noun(count: int) -> str:
    return "log" if count == 1 else "logs"


def _names_text(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_PRINTED_ITEMS} more" if len(names) > MAX_PRINTED_ITEMS else ""
    return ", ".join(names[:MAX_PRINTED_ITEMS]) + more
