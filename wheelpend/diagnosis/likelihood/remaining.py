"""What a model leaves to chance, and what of it does not look like chance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import derive
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.judgement import Judged
from wheelpend.diagnosis.likelihood.repeatability import repeatable_share, what_repeats
from wheelpend.diagnosis.likelihood.resonance import resonances
from wheelpend.diagnosis.likelihood.slow_sources import slow_sources
from wheelpend.diagnosis.physical import is_physical
from wheelpend.identification.remainder import Remainder


@dataclass(frozen=True)
class ImpossibleLaw:
    """The law of an effect, which data follow with a size that nothing has: something else of its kind is missing.

    A friction that feeds energy is no friction, but so smooth a function of the speed is no chance either.
    """

    effect: str
    coefficients: Mapping[str, float]
    p_value: float

    @property
    def repeats(self) -> bool:
        """True: it is told only of laws that are certain but for their size."""
        return True

    def to_json(self) -> dict[str, Any]:
        """The finding under the keys of JSON."""
        return {"effect": self.effect, "coefficients": self.coefficients, "p_value": self.p_value}


def searched_remainder(model: FilteredModel, judged: Sequence[Judged] = ()) -> Remainder:
    """What a model leaves to chance, searched for what repeats.

    That is functions, resonances, sources that are too slow, and laws of effects that were judged, of impossible sizes.
    """
    repeating = what_repeats(model)
    followed = (j.candidate for j in judged if j.is_followed)
    impossible = sorted((c for c in followed if _has_impossible_size(c)), key=lambda c: c.p_value)
    return replace(
        model.remainder(),
        repeatable_share=repeatable_share(repeating),
        repeating=repeating,
        resonances=resonances(model),
        slow=slow_sources(model),
        impossible=tuple(ImpossibleLaw(c.effect, c.coefficients, c.p_value) for c in impossible),
    )


def _has_impossible_size(candidate: CandidateFit) -> bool:
    """True where a size is beyond what is possible by more than its errors."""
    sigma = {name: e.sigma for name, e in candidate.estimates.items()}
    return not is_physical(derive.effects.find(candidate.effect), candidate.coefficients, sigma)
