"""Results of `inspect` as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.reports.numbers import digits_text, number_text
from wheelpend.reports.text.comparison import listed_text
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.inspection.inspect import Inspection
    from wheelpend.logs.log import Log


def inspection_text(log: Log, result: Inspection) -> TextBlocks:
    """Rate and channels of a log, findings with their cures, standstills, and lines for model.toml."""
    yield from summary_text(log, result)
    yield from findings_text(result)
    if result.proposal:
        yield f"Put this into model.toml:\n\n{result.proposal}"
    elif result.untested:
        yield untested_sentence(result)
    elif not (result.findings or log.warnings):
        yield "Nothing odd was found."
    if result.sensors:
        yield f"By this log, the sensors are:\n\n{result.sensors}"


def untested_sentence(result: Inspection) -> str:
    """What a log is too short to tell."""
    what = " and ".join(result.untested).capitalize()
    needed = " and ".join(str(n) for n in dict.fromkeys(result.untested.values()))
    least = f"{needed} samples or more without a gap, and {result.least_duration_s:.1g} s"
    return f"{what} were not tested: that takes {least}."


def summary_text(log: Log, result: Inspection) -> TextBlocks:
    """Rate and channels of a log."""
    duration, rate, jitter = digits_text(result.duration_s), digits_text(result.rate_hz, 6), 100 * result.jitter
    yield (
        f"{log.name}: {result.samples} samples over {duration} s, {rate} Hz, "
        f"jitter {digits_text(jitter, 2)} % of an interval."
    )
    first = ("minimum", "maximum")  # as in the table of a file's columns
    names = [*first, *sorted({name for row in result.channels.values() for name in row} - set(first))]
    rows = [(c, *(number_text(row.get(name)) for name in names)) for c, row in result.channels.items()]
    yield Table("Channels", ("channel", *names), rows)


def findings_text(result: Inspection) -> Iterator[str]:
    """Findings with their cures, and standstills."""
    for finding in result.findings:
        yield f"- {finding.sentence} {finding.cure}"
    yield from _standstill_sentences(result)


def _standstill_sentences(result: Inspection) -> Iterator[str]:
    for name, times in result.stand_still.items():
        total = digits_text(sum(end - begin for begin, end in times), 3)
        shown = listed_text([f"{begin:.2f}-{end:.2f}" for begin, end in times])
        yield f"{name} stands still within its noise for {total} s in all: {shown} s."
