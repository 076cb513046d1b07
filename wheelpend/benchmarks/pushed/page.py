"""The study as a section of docs/statistics.md, between its marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.benchmarks.hidden_effects.page import rate_text
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.benchmarks.pushed.cases import DEFAULT_COUNT, SIZE_RANGE_SIGMAS
from wheelpend.benchmarks.pushed.trial import DURATION_S, Outcome
from wheelpend.benchmarks.random_force.machine import FORCE_SHARE
from wheelpend.proportion import proportion_of
from wheelpend.reports.numbers import percent_text

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.pushed -->", "<!-- end of pushed -->"
UNEXPECTED_VERDICTS = {"nothing": "unexplained", "left_out": "nothing_missing"}  # by kind, though nothing is named
COMMAND_LINE = "python -m wheelpend.benchmarks.pushed"


def section_text(outcomes: Sequence[Outcome]) -> str:
    """The study in Markdown: rates beside their goals, and every log on which the answer was not right."""
    used = [o for o in outcomes if not o.failure]
    if not used:
        return f"`{COMMAND_LINE}`: not tried yet."
    low, high = SIZE_RANGE_SIGMAS
    failed = "" if len(used) == len(outcomes) else f" {len(outcomes) - len(used)} more could not be diagnosed."
    head = (
        f"`{COMMAND_LINE}`, {len(used)} of {DEFAULT_COUNT} planned logs of MuJoCo, {DURATION_S:g} s each: the paper's "
        f"robot with a random force of {percent_text(FORCE_SHARE)} of the drive, on the wheel's row or in the drive, "
        "of first order, as shots, between 0.5 and 5 Hz, or in proportion to the speed. A hidden effect has "
        f"{low:g} to {high:g} of the standard errors that the force leaves. Effects that the plant's equations cannot "
        f"tell from it count as it, and are left out with it.{failed}"
    )
    parts = [head, markdown_table(("", "measured", "goal"), rates(used))]
    if wrong := [o for o in used if not o.is_right or o.verdict == UNEXPECTED_VERDICTS.get(o.kind)]:
        parts.append(markdown_table(("log", "verdict", "named"), map(_wrong_row, wrong)))
    return "\n\n".join(parts)


def rates(outcomes: Sequence[Outcome]) -> list[tuple[str, str, str]]:
    """Rates beside their goals."""
    quiet, single, out = ([o for o in outcomes if o.kind == k] for k in ("nothing", "single", "left_out"))
    rows = (
        ("nothing hidden: an effect named", (bool(o.named) for o in quiet), "≤ 1 %"),
        ("nothing hidden: `unexplained`", (o.verdict == "unexplained" for o in quiet), "≤ 5 %"),
        ("one effect hidden: named first", (o.is_right for o in single), "≥ 95 %"),
        (
            "one effect hidden: named first, or said to predict as well",
            (o.is_told for o in single),
            "–",
        ),
        ("its effect left out: `unexplained`", (o.verdict == "unexplained" for o in out), "≥ 90 %"),
        ("its effect left out: no other named as the only one", (not o.is_confidently_wrong for o in out), "≥ 98 %"),
    )
    return [(words, rate_text(proportion_of(hits)), goal) for words, hits, goal in rows]


def _wrong_row(outcome: Outcome) -> tuple[str, str, str]:
    return outcome.key, f"`{outcome.verdict}`", ", ".join(f"`{n}`" for n in outcome.named) or "–"


def write(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Write the section between its marks in a page; raises Failure where the page has no such place."""
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    write_between(path, page, BEGIN_MARK, END_MARK, section_text(outcomes))
