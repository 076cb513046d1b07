"""Results of `explain` as text: the error ladder, step by step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.reports.ladder import bar_lengths, ladder_rungs
from wheelpend.reports.numbers import digits_text, prediction_error_text, share_text
from wheelpend.reports.text.effect_sizes import log_size_lines, moved_size_text, rms_input
from wheelpend.reports.text.remainder import leaves_a_force, remainder_sentences
from wheelpend.reports.text.structures import structures_text
from wheelpend.reports.text.table import TextBlocks
from wheelpend.reports.text.unexplained import LawRequest, unexplained_text
from wheelpend.reports.text.verdict import (
    closing_sentence,
    effect_meaning_text,
    equivalents_text,
    evidence_text,
    force_change_text,
)

if TYPE_CHECKING:
    from wheelpend.diagnosis.explain import Ladder, Step

LONGEST_BAR = 44  # characters


def explanation_text(result: Ladder, asked: LawRequest | None = None) -> TextBlocks:
    """The ladder, every step with its evidence, and what stays unexplained."""
    yield from ladder_lines(result)
    for step in result.steps:
        yield from _step_lines(step, result)
    yield closing_sentence(result)
    if not result.last.determines_nothing:  # else they are what was assumed
        yield from structures_text(result.structures, beside_force=leaves_a_force(result.remainder))
    yield from remainder_sentences(result.remainder, result.model)
    yield from unexplained_text(result, asked or LawRequest())


def ladder_lines(result: Ladder) -> Iterator[str]:
    """The error ladder as bars."""
    rungs = ladder_rungs(result, "nominal parameters", "after refitting")
    lengths = bar_lengths(rungs, result.noise_floor, LONGEST_BAR)
    yield f"{'held-out error':>24}   (noise floor {digits_text(result.noise_floor)})"
    of_all = f"of {result.problem.plant.drive_words}"
    for rung, length in zip(rungs, lengths, strict=True):
        force = "" if rung.force is None else f" random force {share_text(rung.force)} {of_all}"
        bar = "█" * length or "▏"
        yield f"{rung.label:>24} {prediction_error_text(rung.error):>9} {bar}{force}"


def _step_lines(step: Step, result: Ladder) -> Iterator[str]:
    yield f"{step.effect}: {effect_meaning_text(step, result.model, rms_input(result.problem))}"
    yield f"  {evidence_text(step)}"
    if step.force_before is not None and step.force_after is not None:
        yield f"  {force_change_text(step.force_before, step.force_after, result.problem.plant)}"
    if moved := moved_size_text(step, result):
        yield f"  {moved}"
    yield from log_size_lines(step)
    if step.equivalent_to:
        of_advice = next(s for s in result.steps if s.equivalent_to)  # whose effects the experiment tells apart
        advice = result.experiment if step is of_advice else None
        yield "  " + " ".join(filter(None, (equivalents_text(step, "it"), advice)))
