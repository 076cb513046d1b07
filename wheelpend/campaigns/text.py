"""A campaign as a table for other programs, and in words."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wheelpend.campaigns.one_log import Answer
from wheelpend.campaigns.runner import Campaign
from wheelpend.campaigns.summary import Agreement, Recovered, Summary
from wheelpend.identification.identify import LEAST_SQUARES
from wheelpend.proportion import Rate
from wheelpend.reports.console import say, table
from wheelpend.reports.numbers import number

BEGINS = (b"log,failure", b"seed,failure")  # of the first line of a campaign's table
HEAD = ("verdict", "named", "equivalent_to", "error", "error_after", "noise_floor")
MOST = 5  # logs, or messages, that are printed


# ---- as a table


def csv_text(result: Campaign) -> str:
    """One line per log; columns in which nothing stands are left out, and what a log does not tell is blank."""
    channels = dict.fromkeys(f"fit_percent.{c}" for a in result.logs for c in a.fit_percent)
    parameters = dict.fromkeys(n for a in result.logs for n in a.parameters)
    columns = [*HEAD, *channels, *(c for n in parameters for c in (n, f"{n}_sigma")), "warnings"]
    rows = [cells(a) for a in result.logs]
    filled = [c for c in columns if any(row.get(c) not in (None, "") for row in rows)]
    text = io.StringIO()
    writer = csv.DictWriter(text, ["seed" if result.simulated else "log", "failure", *filled],
                            extrasaction="ignore", lineterminator="\n")  # fmt: skip
    writer.writeheader()
    writer.writerows({c: _cell(v) for c, v in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    """A number with nine digits; a text on one line."""
    if isinstance(value, float):
        return f"{value:.9g}"
    return " ".join(value.split()) if isinstance(value, str) else value


def cells(found: Answer) -> dict[str, Any]:
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


def is_table(path: Path) -> bool:
    """Whether a file is the table of a campaign."""
    try:
        with path.open("rb") as file:
            return file.read(20).startswith(BEGINS)
    except OSError:
        return False


# ---- in words


def show_campaign(result: Campaign, file: Path) -> None:
    """Print what the logs have in common."""
    summary = result.summary
    method = f" ({result.method})" if result.method else ""
    say(f"{result.do}{method}: {summary.logs - summary.failed} of {summary.logs} logs. Each is a line of {file}.")
    show_failures(result.logs)
    show_errors(result)
    show_verdicts(summary)
    simulated = {n: row for n, row in summary.parameters.items() if isinstance(row, Recovered)}
    measured = {n: row for n, row in summary.parameters.items() if isinstance(row, Agreement)}
    ending = f" of the model with {', '.join(summary.effects)}" if summary.effects else ""
    if simulated:
        show_recovered(f"Parameters{ending} beside the truth", simulated)
    if measured:
        show_agreement(f"Parameters{ending} over the logs", measured, summary, result.method)
    odd = sum(bool(a.warnings) for a in result.logs)
    if odd:
        say(f"There are warnings about {odd} {_logs(odd)}: see the column warnings.")


def show_failures(answers: Sequence[Answer]) -> None:
    """Print why logs could not be used, each message once."""
    messages: dict[str, list[str]] = {}
    for found in answers:
        if found.failure is not None:
            messages.setdefault(found.failure, []).append(found.log)
    for message, logs in list(messages.items())[:MOST]:
        say(f"Not used: {_list(logs)}: {message}")
    if len(messages) > MOST:
        say(f"{len(messages) - MOST} more messages are in the column failure.")


def show_errors(result: Campaign) -> None:
    """Print the errors' range, and the logs that the model does not explain."""
    for what, found in (("Error", result.summary.error), ("Error with what was named", result.summary.error_after)):
        if found is not None:
            say(f"{what}: {number(found.mean)} on average, {number(found.smallest)} to {number(found.largest)}.")
    worst = result.summary.unexplained
    if worst and not result.summary.verdicts:
        say(f"The model leaves more than noise in {len(worst)} {_logs(len(worst))}, the worst first: {_list(worst)}.")


def show_verdicts(summary: Summary) -> None:
    """Print how often what was found missing."""
    if not summary.verdicts:
        return
    say("Verdicts: " + ", ".join(f"{v} {n}" for v, n in summary.verdicts.items()) + ".")
    used = summary.logs - summary.failed
    if summary.named:
        rows = [(e, str(n), f"{100 * n / used:.0f} %", interval(Rate(n, used))) for e, n in summary.named.items()]
        table("Named", ("effect", "logs", "of all", "95 % interval"), rows)
    if summary.false_alarms is not None:
        say(f"Nothing was hidden, and something was found missing in {times(summary.false_alarms)}.")
    if summary.first_right is not None:
        say(f"Hidden: {', '.join(summary.hidden)}. The first answer is right, or declared equivalent to what is, in "
            f"{times(summary.first_right)}.")  # fmt: skip
    for effect, found in summary.found.items() if len(summary.hidden) > 1 else ():
        say(f"  {effect} is named, or declared equivalent, in {times(found)}.")


def show_recovered(title: str, rows: dict[str, Recovered]) -> None:
    """Print parameters of simulated logs beside the truth."""
    columns = ("parameter", "truth", "bias", "±", "spread", "mean σ", "95 %")
    table(title, columns, [
        (n, number(r.truth), small(r.bias), small(r.bias_sigma), small(r.spread), small(r.sigma),
         f"{r.inside.hits}/{r.inside.of}")
        for n, r in rows.items()
    ])  # fmt: skip
    inside = Rate(sum(r.inside.hits for r in rows.values()), sum(r.inside.of for r in rows.values()))
    if inside.of:
        say(f"The truth lies in {100 * inside.share:.3g} % of the 95 % intervals.")


def show_agreement(title: str, rows: dict[str, Agreement], summary: Summary, method: str | None) -> None:
    """Print whether logs agree on parameters."""
    columns = ("parameter", "logs", "mean", "±", "spread", "mean σ", "χ²/dof", "p")
    table(title, columns, [
        (n, str(r.logs), number(r.mean), small(r.mean_sigma), small(r.spread), small(r.sigma),
         small(r.chi_square / r.degrees if r.degrees else None), small(r.p_value))
        for n, r in rows.items()
    ])  # fmt: skip
    for name in summary.disagreeing:
        if (far := rows[name].furthest) is not None:
            which = f"furthest off is {far.log}, by" if rows[name].logs > 2 else "they differ by"
            say(f"The logs do not agree on {name}: {which} {far.sigmas:.3g} standard errors.")
    if summary.disagreeing:
        noise = ", or noise biases the method, which --method shooting does not suffer" * (method in LEAST_SQUARES)
        say(f"The machine changes from log to log, or the model misses something{noise}. --do diagnose asks each log "
            "what is missing.")  # fmt: skip
    elif any(r.degrees for r in rows.values()):
        say("The logs agree: they scatter no more than their standard errors allow.")


def small(value: float | None) -> str:
    """Two significant digits."""
    return "-" if value is None else f"{value:.2g}"


def times(found: Rate) -> str:
    """So many of so many logs, with the interval of the share."""
    return f"{found.hits} of {found.of} {_logs(found.of)} ({interval(found)})"


def interval(found: Rate) -> str:
    """The 95 % interval of a share."""
    low, high = found.interval
    return f"{100 * low:.0f}-{100 * high:.0f} %"


def _logs(count: int) -> str:
    return "log" if count == 1 else "logs"


def _list(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return ", ".join(names[:MOST]) + more
