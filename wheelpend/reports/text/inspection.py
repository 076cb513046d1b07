"""Results of `inspect` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.reports.console import print_line, print_table
from wheelpend.reports.numbers import number_text
from wheelpend.reports.text.comparison import MAX_LISTED_BURSTS

if TYPE_CHECKING:
    from wheelpend.inspection.inspect import Inspection
    from wheelpend.logs.log import Log


def print_inspection(log: Log, result: Inspection) -> None:
    """Print what a log is like, what is wrong with it, and the lines for model.toml that say so."""
    print_line(f"{log.name}: {result.samples} samples over {result.duration_s:.4g} s, {result.rate_hz:.6g} Hz, "
        f"jitter {100 * result.jitter:.2g} % of an interval.")  # fmt: skip
    names = sorted({k for row in result.channels.values() for k in row})
    print_table("Channels", ("channel", *names), [
        (c, *(number_text(row.get(k)) for k in names)) for c, row in result.channels.items()
    ])  # fmt: skip
    for finding in result.findings:
        print_line(f"- {finding.sentence} {finding.cure}")
    for name, times in result.stand_still.items():
        shown = ", ".join(f"{a:.2f}-{b:.2f}" for a, b in times[:MAX_LISTED_BURSTS])
        print_line(f"{name} stands still within its noise for {sum(b - a for a, b in times):.3g} s in all: {shown}"
            f"{', …' if len(times) > MAX_LISTED_BURSTS else ''} s.")  # fmt: skip
    print_line(f"Put this into model.toml:\n\n{result.proposal}" if result.proposal else "Nothing odd was found.")
    if result.sensors:
        print_line(f"By this log, the sensors are:\n\n{result.sensors}")
