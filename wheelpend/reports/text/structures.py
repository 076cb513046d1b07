"""Probabilities of what is missing, in words."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from wheelpend.diagnosis.structures import NONE_OF_THESE, Structure
from wheelpend.reports.numbers import share_text

MAX_NAMED_STRUCTURES = 4
MIN_NAMED_PROBABILITY = 0.01
CERTAIN_PROBABILITY = 0.995  # from here on a probability is given as more than 99 %


def structures_text(known: Sequence[Structure], *, beside_force: bool = False) -> Iterator[str]:
    """The likeliest structures with their probabilities, in a sentence; none where there are none.

    ``beside_force`` of those that take a random force for granted.
    """
    if told := named_probabilities(known, beside_force=beside_force):
        yield f"Probabilities: {', '.join(f'{n} {_percent(p)}' for n, p in told)}."


def named_probabilities(known: Sequence[Structure], *, beside_force: bool = False) -> list[tuple[str, float]]:
    """What may be missing in words, with its probability, the likeliest first."""
    nothing = "nothing that repeats is missing" if beside_force else "nothing is missing"
    named: dict[str, float] = defaultdict(float)
    for one in known:
        named[_name(one) or nothing] += one.probability - one.unseen
    for one in (s for s in known if s.unseen):
        named[_with_unseen(one, known)] += one.unseen
    likeliest = sorted(named.items(), key=lambda pair: -pair[1])[:MAX_NAMED_STRUCTURES]
    return [(n, p) for n, p in likeliest if p >= MIN_NAMED_PROBABILITY]


def _name(one: Structure) -> str:
    """Its effects in words; nothing of none."""
    if one.effects == (NONE_OF_THESE,):
        return "something that is not among these"
    return " with ".join(one.effects)


def _with_unseen(one: Structure, known: Sequence[Structure]) -> str:
    """What is seen of a structure, and that there is another effect."""
    seen = [s for s in known if {*s.effects} < {*one.effects} and len(s.effects) == len(one.effects) - 1]
    likeliest = max(seen, key=lambda s: s.probability - s.unseen, default=None)
    if likeliest is None or not likeliest.effects:
        return "an effect too small to be seen here"
    return f"{_name(likeliest)} with another too small to be seen here"


def _percent(probability: float) -> str:
    return "> 99 %" if probability > CERTAIN_PROBABILITY else share_text(probability)
