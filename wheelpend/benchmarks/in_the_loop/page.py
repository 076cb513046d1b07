"""Each study as a section of docs/export_c.md, between its marks, and the curve of what is left of friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from wheelpend.benchmarks.in_the_loop.compensate import FRICTION_SIZES_V, LEAST_ERROR_SHARE, PITCH_COMMANDS, Pitch
from wheelpend.benchmarks.in_the_loop.learn import Learnt
from wheelpend.benchmarks.in_the_loop.runner import STUDY_NAMES, Answers, failures_of, pitches_of, records_of
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.benchmarks.random_force.summary import rms

STUDY_MARKS = {
    name: (f"<!-- {name}: written by wheelpend.benchmarks.in_the_loop -->", f"<!-- end of {name} -->")
    for name in STUDY_NAMES
}
COMMAND_LINE = "python -m wheelpend.benchmarks.in_the_loop"
PICTURE_FILE = "friction_compensated.svg"
COMMAND_WORDS = {"aggressive": "a fast command", "upright": "standing"}


def section_text(answers: Answers) -> str:
    """The studies in Markdown, and what failed; nothing of one that has no answers."""
    failed = [f"- {sentence}" for sentence in failures_of(answers)]
    return "\n\n".join(filter(None, [*study_texts(answers).values(), "\n".join(failed)]))


def study_texts(answers: Answers) -> dict[str, str]:
    """Each study that has answers, in Markdown."""
    parts = {"compensate": compensator_part(pitches_of(answers)), "learn": identifier_part(records_of(answers))}
    texts = {name: "\n\n".join(part) for name, part in parts.items()}
    return {name: text for name, text in texts.items() if text}


def compensator_part(found: Sequence[Pitch]) -> Iterator[str]:
    """What is left of friction's part of the pitch, and how still the robot stands."""
    if not found:
        return
    draws = len(found) // max(len({(p.friction, p.command) for p in found}), 1)
    yield (
        f"`{COMMAND_LINE} --only compensate`: {draws} draws from the covariance of an identification in MuJoCo, "
        f"the friction known no better than to {100 * LEAST_ERROR_SHARE:g} %, each with its own noise of the sensors."
        " Friction's part of the pitch is the standard deviation of the run with "
        "friction less the run without; the table has what is left of it with compensation, median and worst draw, "
        "and over the last two seconds the pitch's standard deviation against that of a robot without friction."
    )
    head = ("friction [V]", "command", "left: median", "left: worst", "still: uncompensated", "still: worst")
    yield markdown_table(head, (pitch_row(*key, own) for key, own in _groups(found)))


def _groups(found: Sequence[Pitch]) -> Iterator[tuple[tuple[float, str], list[Pitch]]]:
    for command in PITCH_COMMANDS:
        for friction in FRICTION_SIZES_V:
            if own := [p for p in found if (p.friction, p.command) == (friction, command)]:
                yield (friction, command), own


def pitch_row(friction: float, command: str, own: Sequence[Pitch]) -> tuple[str, ...]:
    """Findings for one size of friction."""
    left = [p.after / p.before for p in own]
    still = [p.still_after / p.still_without for p in own]
    before = np.median([p.still_before / p.still_without for p in own])
    return (f"{friction:g}", COMMAND_WORDS[command], f"{100 * np.median(left):.0f} %",
            f"{100 * max(left):.0f} %", f"{before:.2f}", f"{max(still):.2f}")  # fmt: skip


def identifier_part(records: Sequence[dict[str, Learnt]]) -> Iterator[str]:
    """How far what was learnt is off, against the bound and against its own standard errors."""
    if not records:
        return
    yield (
        f"`{COMMAND_LINE} --only learn`: {len(records)} records of 20 s at 1 kHz with the paper's noise; every "
        "parameter begins off by a fifth (standard deviation; two at most). Errors at the end, root mean square over "
        "the records: against the Cramér-Rao bound of each record, in which no force acts at all, and against the "
        "standard errors that the identifier says of itself."
    )
    names = list(records[0])
    yield markdown_table(("", "at the start", "at the end", "over the bound", "over its own"),
                         (learnt_row(n, [r[n] for r in records]) for n in names))  # fmt: skip


def learnt_row(name: str, found: Sequence[Learnt]) -> tuple[str, ...]:
    """Findings on one parameter."""
    begin, value, sigma, truth, bound, _ = np.array(found).T
    percent, error = 100.0 / np.abs(truth), value - truth
    return (name, f"{rms(percent * (begin - truth)):.0f} %", f"{rms(percent * error):.2g} %",
            f"{rms(error / bound):.3g}", f"{rms(error / sigma):.2f}")  # fmt: skip


def draw_curve(path: Path, found: Sequence[Pitch]) -> None:
    """Friction's part of the pitch over friction, before and after, with the range of the draws."""
    from wheelpend.benchmarks.measured.drawing import AFTER_COLOUR, BEFORE_COLOUR, new_figure, save_svg

    figure, axes = new_figure(7, 4.2, len(PITCH_COMMANDS))
    for ax, command in zip(axes, PITCH_COMMANDS, strict=True):
        for label, colour, part in (("friction", BEFORE_COLOUR, "before"), ("compensated", AFTER_COLOUR, "after")):
            sizes = [[1e3 * getattr(p, part) for p in own] for (_, c), own in _groups(found) if c == command]
            low, middle, high = (np.quantile(sizes, q, axis=1) for q in (0.0, 0.5, 1.0))
            ax.fill_between(FRICTION_SIZES_V, low, high, color=colour, alpha=0.25, lw=0)
            ax.plot(FRICTION_SIZES_V, middle, color=colour, marker="o", ms=3, label=label)
        ax.set_title(COMMAND_WORDS[command], fontsize=9, loc="left")
        ax.set_ylabel("pitch [mrad]")
        ax.set_ylim(bottom=0.0)
    axes[0].legend(frameon=False, fontsize=8)
    axes[-1].set_xlabel("dry friction [V]; what it does to the pitch, band: all draws")
    save_svg(figure, path)


def write(path: Path, answers: Answers) -> None:
    """Write what was tried between its marks in a page, and the picture beside it.

    Raises Failure where the page has no place for it. What was not tried stays as it is.
    """
    for name, text in study_texts(answers).items():
        page = path.read_text(encoding="utf-8") if path.exists() else ""
        write_between(path, page, *STUDY_MARKS[name], text)
    if found := pitches_of(answers):
        draw_curve(path.with_name(PICTURE_FILE), found)
