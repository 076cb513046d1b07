"""The studies as a section of docs/statistics.md, between its marks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from wheelpend.benchmarks.hidden_effects.page import NOT_TRIED, rate_text
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS
from wheelpend.benchmarks.random_force.machine import FORCE_SHARE
from wheelpend.benchmarks.random_force.summary import (
    CompleteSummary,
    Coverage,
    ForceSummary,
    LawfulSummary,
    Precision,
    complete_summary,
    coverage,
    failures,
    force_summaries,
    lawful_summaries,
    usable,
)
from wheelpend.benchmarks.random_force.trial import SIZE_IN_STANDARD_ERRORS, Answer
from wheelpend.proportion import Proportion
from wheelpend.reports.numbers import fixed_number_text, percent_range_text, percent_text

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.random_force -->", "<!-- end of random force -->"
COMMAND_LINE = "python -m wheelpend.benchmarks.random_force"
PART_HEADING, FAILURES_HEADING = "### ", "Logs that could not be used"


def section_text(answers: Sequence[Answer], known: str = "") -> str:
    """The three studies in Markdown, each with its command; one without answers as a section has it that is known."""
    earlier, tried = parts_of(known), {answer.case.study for answer in answers}
    parts = []
    for study, (heading, part_of) in STUDY_PARTS.items():
        nothing = f"`{COMMAND_LINE} --only {study}`: {NOT_TRIED}."
        text = "\n\n".join(part_of(answers)) if study in tried else earlier.get(heading, "")
        parts += [f"{PART_HEADING}{heading}", text or nothing]
    failed = [f"- {sentence}" for sentence in failures(answers)]
    kept = [line for line in earlier.get(FAILURES_HEADING, "").splitlines() if line.split()[1] not in tried]
    if lines := [*kept, *failed]:
        parts += [f"{PART_HEADING}{FAILURES_HEADING}", "\n".join(lines)]
    return "\n\n".join(parts)


def parts_of(section: str) -> dict[str, str]:
    """The text under each heading of a section."""
    parts = (part.partition("\n") for part in f"\n{section}".split(f"\n{PART_HEADING}")[1:])
    return {heading: text.strip() for heading, _, text in parts}


def complete_part(answers: Sequence[Answer]) -> Iterator[str]:
    """Precision, coverage and false forces on complete models; nothing where none was tried."""
    found = complete_summary(answers)
    if found is None:
        return
    logs = len(usable(answers, "complete"))
    yield (
        f"`{COMMAND_LINE} --only complete`, {logs} logs of this project's simulator: aggressive command, "
        "20 s at 1 kHz, the paper's noise; identified from nominal values that are a tenth too small. The Cramér-Rao "
        "bound of each record comes by another way than the filter: shooting segments tied by continuity, linearised "
        "at the truth. With the sensors' true errors they also tell what an efficient estimate is on each log; the "
        "distance from it does not depend on how the noise happened to fall."
    )
    head = ("", "rms error", "stated σ", "bound", "error over bound", "distance from the efficient one over bound",
            "in 95 % intervals")  # fmt: skip
    yield markdown_table(head, map(precision_row, found.precision))
    yield markdown_table(("", "measured", "goal"), complete_rows(found))


def precision_row(found: Precision) -> tuple[str, ...]:
    """Findings on one parameter."""
    return (
        found.name,
        scaled_percent(found.rms_error),
        scaled_percent(found.stated),
        scaled_percent(found.bound),
        f"{found.ratio:.3f} ± {fixed_number_text(found.ratio_sigma, 3, '?')}",
        f"{found.lost:.3f}",
        rate_text(found.inside),
    )


def complete_rows(found: CompleteSummary) -> list[tuple[str, str, str]]:
    """Findings on complete models beside their goals."""
    worst = max(found.precision, key=lambda p: p.ratio)
    return [
        ("largest error over bound", f"{worst.ratio:.3f} ({worst.name})", "≤ 1.1"),
        ("true values inside 95 % intervals, all parameters", coverage_text(found.coverage), "92 to 98 %"),
        ("a random force found where none acts", rate_text(found.force_found), "≤ 3 %"),
    ]


def force_part(answers: Sequence[Answer]) -> Iterator[str]:
    """Random forces that an independent engine plays; nothing where none was tried."""
    found = force_summaries(answers)
    if not found:
        return
    yield (
        f"`{COMMAND_LINE} --only forces`, logs of MuJoCo: the same command and noise, and a random force whose rms is "
        f"{percent_text(FORCE_SHARE)} of the drive's, on the wheel's row alone (rough ground) or in the drive (equal "
        "and opposite). Only the first kind is what the filter assumes."
    )
    head = ("force", "where", "rms found over played", "within 20 %", "correlation time over true",
            "within a factor of 2", "found there and nowhere else", "true values in 95 % intervals")  # fmt: skip
    yield markdown_table(head, map(force_row, found))
    whole = coverage(usable(answers, "forces"))
    yield f"Together {coverage_text(whole)} of the true values in their intervals, where 92 to 98 % is the goal."


def force_row(found: ForceSummary) -> tuple[str, ...]:
    """Findings on one kind of force at one place."""
    has_time = FORCE_KINDS[found.kind].correlation_time is not None
    return (
        FORCE_KINDS[found.kind].words,
        found.place,
        f"{found.rms_ratio:.2f}",
        counts_text(found.rms_right),
        "–" if found.time_ratio is None else f"{found.time_ratio:.2f}",
        counts_text(found.time_right) if has_time else "–",
        counts_text(found.place_right),
        coverage_text(found.coverage),
    )


def lawful_part(answers: Sequence[Answer]) -> Iterator[str]:
    """What is slow and lawful beside a random force; nothing where none was tried."""
    found = lawful_summaries(answers)
    if not found:
        return
    yield (
        f"`{COMMAND_LINE} --only lawful`, logs of MuJoCo with a force of first order on the wheel's row as above and "
        f"one lawful effect, {SIZE_IN_STANDARD_ERRORS:g} of the standard errors large that this force leaves. The "
        "model has the effect, its size unknown; the random force is free. Unbiased: the mean deviation within ± 0.6 "
        "standard errors (12 logs), the mean ratio within 20 %."
    )
    head = ("effect", "true size", "estimate over truth", "deviation [σ], mean", "its spread", "in 95 % intervals")
    yield markdown_table(head, map(lawful_row, found))


def lawful_row(found: LawfulSummary) -> tuple[str, ...]:
    """Findings on one lawful effect."""
    return (
        f"`{found.effect}`",
        f"{found.size:.3g}",
        f"{found.ratio:.3f} ± {fixed_number_text(found.ratio_sigma, 3, '?')}",
        f"{found.deviation:+.2f}",
        fixed_number_text(found.spread, 2, "?"),
        counts_text(found.inside),
    )


STUDY_PARTS = {
    "complete": ("Complete models: precision and intervals", complete_part),
    "forces": ("A random force: its size, its correlation time, and the parameters beside it", force_part),
    "lawful": ("What is slow and lawful is not swallowed", lawful_part),
}


def scaled_percent(percent: float) -> str:
    """A small number that is in percent already, with three digits."""
    return f"{percent:.3g} %"


def counts_text(rate: Proportion) -> str:
    """Hits and trials."""
    return f"{rate.hits} of {rate.of}" if rate.of else NOT_TRIED


def coverage_text(found: Coverage) -> str:
    """Hits, trials, percentage and an interval that knows that the parameters of a log err together."""
    if not found.inside.of:
        return NOT_TRIED
    share = percent_text(found.inside.share, 1)
    return f"{counts_text(found.inside)}, {share} ({percent_range_text(found.interval, '–')})"


def write(path: Path, answers: Sequence[Answer]) -> None:
    """Write the section between its marks in a page, where studies without answers keep what they have.

    Raises Failure where the page has no such place.
    """
    before = path.read_text(encoding="utf-8") if path.exists() else f"{BEGIN_MARK}\n{END_MARK}\n"
    known = before.partition(BEGIN_MARK)[2].partition(END_MARK)[0]
    write_between(path, before, BEGIN_MARK, END_MARK, section_text(answers, known))
