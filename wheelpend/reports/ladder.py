"""The error ladder: its rungs, the length of their bars, and a small picture (SVG) of it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from wheelpend.files import write_text
from wheelpend.reports.numbers import digits_text, prediction_error_text, share_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.explain import Ladder

PICTURE_WIDTH_PX, BAR_HEIGHT_PX, LABEL_WIDTH_PX, ERROR_WIDTH_PX = 720, 34, 190, 150  # px
TOP_MARGIN_PX = BOTTOM_MARGIN_PX = 36  # px
MIN_BAR_LENGTH_PX = 4  # px, of an error at the noise floor
SVG_COLOURS = {"nominal": "#9aa0a6", "refitted": "#d9622b", "step": "#2166ac"}

RungKind = Literal["earlier", "nominal", "refitted", "step"]


class Rung(NamedTuple):
    """A model of the ladder with its held-out error."""

    kind: RungKind
    label: str
    error: float  # σ
    force: float | None = None  # random force that is left, as a share of the drive; None unless every rung has one
    said: str = ""  # of an earlier one: when, and on which logs

    @property
    def text(self) -> str:
        """The error, and the random force where it is known."""
        error = prediction_error_text(self.error)
        return error if self.force is None else f"{error}, force {share_text(self.force)}"


def ladder_rungs(explanation: Ladder, nominal: str = "nominal", refitted: str = "parameters refitted") -> list[Rung]:
    """The nominal model where it has values, the refitted one, and one with each added effect."""
    forces = _remaining_forces(explanation)
    rungs = [Rung("refitted", refitted, explanation.base_error, forces[0])]
    if explanation.nominal_error is not None:
        rungs.insert(0, Rung("nominal", nominal, explanation.nominal_error))
    steps = zip(explanation.steps, forces[1:], strict=True)
    return rungs + [Rung("step", f"+ {s.effect}", s.error_after, force) for s, force in steps]


def _remaining_forces(explanation: Ladder) -> list[float | None]:
    """Random force that the refitted model and every step leave, as shares of the drive; None where one is unknown."""
    steps = explanation.steps
    forces = [s.force_before for s in steps[:1]] + [s.force_after for s in steps]
    known = len(forces) > 1 and all(f is not None for f in forces)
    return forces if known else [None] * (len(steps) + 1)


def bar_lengths(rungs: Sequence[Rung], noise_floor: float, longest: int, shortest: int = 0) -> list[int]:
    """Lengths of bars that are logarithmic above the noise floor, from ``shortest`` to ``shortest + longest``.

    The bar of a prediction that diverged is the longest.
    """
    heights = [log10(max(r.error / noise_floor, 1.0)) if isfinite(r.error) else None for r in rungs]
    highest = max((h for h in heights if h is not None), default=0.0) or 1.0
    return [round(shortest + longest * (1.0 if h is None else h / highest)) for h in heights]


def draw_ladder(explanation: Ladder, path: Path) -> Path:
    """Write the ladder of an explanation as SVG."""
    import jinja2  # imported late: a diagnosis on the terminal does not need it

    folder = jinja2.FileSystemLoader(Path(__file__).parent)
    template = jinja2.Environment(loader=folder, autoescape=True, trim_blocks=True).get_template("ladder.svg.j2")
    rungs = ladder_rungs(explanation)
    longest = PICTURE_WIDTH_PX - LABEL_WIDTH_PX - ERROR_WIDTH_PX
    lengths = bar_lengths(rungs, explanation.noise_floor, longest, MIN_BAR_LENGTH_PX)
    bars = [
        {
            "label": rung.label,
            "error": rung.text,
            "colour": SVG_COLOURS[rung.kind],
            "y": TOP_MARGIN_PX + BAR_HEIGHT_PX * k,
            "length": length,
        }
        for k, (rung, length) in enumerate(zip(rungs, lengths, strict=True))
    ]
    text = template.render(
        bars=bars,
        width=PICTURE_WIDTH_PX,
        label_width=LABEL_WIDTH_PX,
        height=TOP_MARGIN_PX + BAR_HEIGHT_PX * len(bars) + BOTTOM_MARGIN_PX,
        floor=digits_text(explanation.noise_floor),
        drive_words=explanation.problem.plant.drive_words,
        has_forces=any(r.force is not None for r in rungs),
    )
    write_text(path, text)
    return path
