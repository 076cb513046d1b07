"""The study as a section of docs/fleets.md, between its marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.benchmarks.fleets.cases import (
    AGED_SHARE,
    AGED_UNITS,
    AGEING_SIDES,
    ALL_FLEETS,
    FLEET_UNITS,
    LACKED_EFFECTS,
    LACKING_FLEET_UNITS,
    LACKING_FLEETS,
    SCATTER_SHARE,
)
from wheelpend.benchmarks.fleets.made_up import ODD_SIGMAS, PARAMETER_NAMES, MadeUpCount
from wheelpend.benchmarks.fleets.summary import FleetCount, LackCount
from wheelpend.benchmarks.fleets.trial import LOG_DURATION_S
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.proportion import Proportion
from wheelpend.reports.numbers import number_text, percent_range_text, percent_text

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.fleets -->", "<!-- end of fleets -->"
COMMAND_LINE = "python -m wheelpend.benchmarks.fleets"


def section_text(found: FleetCount | None, lacking: LackCount | None, made_up: Sequence[MadeUpCount]) -> str:
    """What was counted, in Markdown: of numbers alone, then of simulated robots."""
    parts = (made_up_text(made_up), robots_text(found), *([lacks_text(lacking)] if lacking else []))
    return "\n\n".join((*parts, f"`{COMMAND_LINE} --out docs/fleets.md` writes all of it."))


def made_up_text(counts: Sequence[MadeUpCount]) -> str:
    """Fleets of made-up estimates."""
    head = (
        f"Made-up estimates of {len(PARAMETER_NAMES)} correlated parameters; odd units differ in one of them by "
        f"{ODD_SIGMAS:g} standard deviations of scatter and errors together:"
    )
    columns = (
        "units",
        "of them odd",
        "fleets",
        "odd ones found",
        "named that are not",
        "fleets that name such a one",
    )
    rows = [(c.units, c.odd, c.fleets, *map(_count_text, (c.found, c.accused, c.fleets_accusing))) for c in counts]
    return f"{head}\n\n{markdown_table(columns, rows)}"


def _count_text(counted: Proportion) -> str:
    return f"{counted.hits} of {counted.of}" if counted.of else ""


def robots_text(found: FleetCount | None) -> str:
    """Fleets of simulated robots."""
    if found is None:
        return "Simulated robots, each with its own log: no fleet was tried as a whole yet."
    rows = [
        ("aged units that stand out", found.found, "at least 95 %"),
        ("of these, whose first parameter is the one that aged", found.right, ""),
        ("units that stand out and did not age", found.accused, "at most 5 %"),
        ("changes that lie in their 95 % intervals", found.inside, "95 %"),
        ("true scatters that lie in their 95 % intervals", found.scatter, "95 %"),
    ]
    head = (
        f"{found.fleets} of {ALL_FLEETS} planned fleets of {FLEET_UNITS} robots, {AGED_UNITS} of each aged: "
        f"{found.units} logs of {LOG_DURATION_S:g} s, each identified by itself; {found.failed} could not be. Every "
        f"parameter scatters by {percent_text(SCATTER_SHARE)} from robot to robot, and one of "
        f"{', '.join(AGEING_SIDES)} of an aged one is off by a further {percent_text(AGED_SHARE)}."
    )
    table = markdown_table(("what", "count", "share", "95 % interval", "aim"), [_row(*row) for row in rows])
    return f"{head}\n\n{table}"


def lacks_text(found: LackCount) -> str:
    """Diagnoses of the units that stand out."""
    effects = ", ".join(f"{e} of {number_text(v)}" for e, v in LACKED_EFFECTS.items())
    head = (
        f"The {found.asked} units that stand out were diagnosed (`--then diagnose`), each by its log of "
        f"{LOG_DURATION_S:g} s; those of {LACKING_FLEETS} further fleets of {LACKING_FLEET_UNITS} are among them, in "
        f"which one unit each has an effect that the model lacks ({effects})."
    )
    rows = [
        ("units that lack an effect, that stand out", found.stand_out, ""),
        ("of these, whose diagnosis names it or declares it equivalent", found.named, ""),
        ("units that lack none, whose diagnosis says that something is missing", found.alarms, "at most 1 %"),
    ]
    table = markdown_table(("what", "count", "share", "95 % interval", "aim"), [_row(*row) for row in rows])
    return f"{head}\n\n{table}"


def _row(words: str, counted: Proportion, aim: str) -> tuple[str, ...]:
    share = percent_text(counted.share, 1) if counted.of else ""
    between = f"{percent_range_text(counted.interval)} %" if counted.of else ""
    return words, f"{counted.hits} of {counted.of}", share, between, aim


def write(path: Path, found: FleetCount | None, lacking: LackCount | None, made_up: Sequence[MadeUpCount]) -> None:
    """Write the section into a page between its marks."""
    text = section_text(found, lacking, made_up)
    write_between(path, path.read_text(encoding="utf-8"), BEGIN_MARK, END_MARK, text)
