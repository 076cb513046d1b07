"""The study as a section of docs/fleets.md, between its marks."""

from __future__ import annotations

from pathlib import Path

from wheelpend.benchmarks.fleets.cases import AGED_SHARE, AGED_UNITS, AGEING, FLEETS, SCATTER_SHARE, UNITS
from wheelpend.benchmarks.fleets.summary import FleetCount
from wheelpend.benchmarks.fleets.trial import LOG_DURATION_S
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.proportion import Proportion
from wheelpend.reports.numbers import percent_range_text, percent_text

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.fleets -->", "<!-- end of fleets -->"
COMMAND_LINE = "python -m wheelpend.benchmarks.fleets"


def section_text(found: FleetCount | None) -> str:
    """What was counted, in Markdown."""
    if found is None:
        return f"`{COMMAND_LINE}`: no fleet was tried as a whole yet."
    rows = [
        ("aged units that stand out", found.found, "at least 95 %"),
        ("of these, whose first parameter is the one that aged", found.right, ""),
        ("units that stand out and did not age", found.accused, "at most 5 %"),
        ("changes that lie in their 95 % intervals", found.inside, "95 %"),
        ("true scatters that lie in their 95 % intervals", found.scatter, "95 %"),
    ]
    head = (
        f"{found.fleets} of {FLEETS} planned fleets of {UNITS} robots, {AGED_UNITS} of each aged: {found.units} logs "
        f"of {LOG_DURATION_S:g} s, each identified by itself; {found.failed} could not be. Every parameter scatters by "
        f"{percent_text(SCATTER_SHARE)} from robot to robot, and one of {', '.join(AGEING)} of an aged one is off by a "
        f"further {percent_text(AGED_SHARE)}."
    )
    table = markdown_table(("what", "count", "share", "95 % interval", "aim"), [_row(*row) for row in rows])
    return f"{head}\n\n{table}\n\n`{COMMAND_LINE}`"


def _row(words: str, counted: Proportion, aim: str) -> tuple[str, ...]:
    share = percent_text(counted.share, 1) if counted.of else ""
    between = f"{percent_range_text(counted.interval)} %" if counted.of else ""
    return words, f"{counted.hits} of {counted.of}", share, between, aim


def write(path: Path, found: FleetCount | None) -> None:
    """Write the section into a page between its marks."""
    write_between(path, path.read_text(encoding="utf-8"), BEGIN_MARK, END_MARK, section_text(found))
