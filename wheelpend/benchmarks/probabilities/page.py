"""The study as a section of docs/trust.md, between its marks, with the reliability diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.benchmarks.measured.drawing import AFTER_COLOUR, INK_COLOUR, MUTED_COLOUR, new_figure, save_svg
from wheelpend.benchmarks.probabilities.cases import DEFAULT_COUNTS, KIND_SHARES
from wheelpend.benchmarks.probabilities.summary import Bin, middle_count, reliability, score
from wheelpend.benchmarks.probabilities.trial import Outcome
from wheelpend.reports.numbers import percent_range_text, percent_text

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.probabilities -->", "<!-- end of probabilities -->"
COMMAND_LINE = "python -m wheelpend.benchmarks.probabilities"
DIAGRAM_NAME = "reliability.svg"
SET_WORDS = {
    "first": "one log in five with nothing hidden, one in five with an effect that was taken out of the library, "
    "two in five with one effect, one in five with two",
    "second": "other base rates, half of the logs with nothing hidden, a tenth with an effect that was taken out, "
    "three tenths with one effect, a tenth with two",
}


def section_text(outcomes: Mapping[str, Sequence[Outcome]]) -> str:
    """The study in Markdown, a part for each set."""
    return "\n\n".join(set_text(of, outcomes.get(of, ())) for of in KIND_SHARES)


def set_text(of: str, outcomes: Sequence[Outcome]) -> str:
    """Reliability and score of one set."""
    head = f"### The {of} set: {SET_WORDS[of]}"
    found = score(outcomes, of)
    if found is None:
        return f"{head}\n\n`{COMMAND_LINE}`: not tried yet."
    failed, rough = sum(bool(o.failure) for o in outcomes), sum(o.rough for o in outcomes)
    better = "better" if found.found > found.base_rate else "not better"
    return "\n\n".join(
        [
            head,
            f"{found.logs} of {DEFAULT_COUNTS[of]} planned logs ({rough} with a random force of 5 % of the drive, "
            f"played by MuJoCo), {failed} more could not be diagnosed. {middle_count(outcomes)} answers lie "
            f"between 0.2 and 0.8. The truth got {found.found:.2f} nats on average; always saying the base rates gets "
            f"{found.base_rate:.2f}: {better}.",
            markdown_table(
                ("mean probability", "answers", "right", "95 % interval"), map(bin_row, reliability(outcomes))
            ),
        ]
    )


def bin_row(one: Bin) -> tuple[str, ...]:
    """One line of the reliability table."""
    return (
        percent_text(one.mean),
        f"{one.right.of}",
        percent_text(one.right.share),
        percent_range_text(one.right.interval) + ("" if one.is_reliable else " (off)"),
    )


def draw_reliability(path: Path, outcomes: Mapping[str, Sequence[Outcome]]) -> None:
    """Share of right answers over their probability, with the interval of each bin."""
    figure, (ax,) = new_figure(5, 4.2)
    ax.plot([0, 1], [0, 1], color=MUTED_COLOUR, lw=1)
    for (of, found), colour, shift in zip(outcomes.items(), (AFTER_COLOUR, INK_COLOUR), (-0.004, 0.004), strict=False):
        bins = reliability(found)
        if not bins:
            continue
        x, y = np.array([b.mean for b in bins]), np.array([b.right.share for b in bins])
        low, high = np.array([b.right.interval for b in bins]).T
        ax.errorbar(x + shift, y, [y - low, high - y], fmt="o", color=colour, ms=4, lw=1, label=f"{of} set")
    ax.set_xlabel("probability that the tool gave")
    ax.set_ylabel("share that was right")
    ax.legend(frameon=False)
    save_svg(figure, path)


def write(path: Path, outcomes: Mapping[str, Sequence[Outcome]]) -> None:
    """Write the section into a page between its marks, and the diagram beside the page."""
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    write_between(path, page, BEGIN_MARK, END_MARK, section_text(outcomes))
    draw_reliability(path.with_name(DIAGRAM_NAME), outcomes)
