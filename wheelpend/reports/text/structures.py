"""Probabilities of what is missing, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from wheelpend.diagnosis.structures import NONE_OF_THESE, Structure
from wheelpend.reports.numbers import share_text

MAX_NAMED_STRUCTURES = 4
MIN_NAMED_PROBABILITY = 0.01
CERTAIN_PROBABILITY = 0.995  # from here on a probability is given as more than 99 %


def structures_text(known: Sequence[Structure]) -> Iterator[str]:
    """The likeliest structures with their probabilities, in a sentence; none where there are none."""
    named = [s for s in known[:MAX_NAMED_STRUCTURES] if s.probability >= MIN_NAMED_PROBABILITY]
    if named:
        yield f"Probabilities: {', '.join(f'{_name(s)} {_percent(s.probability)}' for s in named)}."


def _name(one: Structure) -> str:
    if not one.effects:
        return "nothing is missing"
    if one.effects == (NONE_OF_THESE,):
        return "something that is not among these"
    return " with ".join(one.effects)


def _percent(probability: float) -> str:
    return "> 99 %" if probability > CERTAIN_PROBABILITY else share_text(probability)
