"""Units that the model describes worse than the others: something acts there that it does not have.

Such a unit may hide among the parameters, whose errors are as wide as the model is wrong. What is compared is the
logarithm of its error over the noise floor, around the units' median, by their median absolute deviation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtr

from wheelpend.campaigns.fleet import MAD_TO_SIGMA, MIN_UNITS, discoveries
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO

MAD_EFFICIENCY = 0.37  # of a median absolute deviation: it is known as a variance from so much fewer units is
MIN_ERROR_SCATTER = 0.02  # of a logarithm: an error is not known better


class Misfit(NamedTuple):
    """A unit that the model describes worse than the others."""

    unit: str
    error: float  # that the model leaves there, over the noise floor
    usual: float  # the median of all units
    p_value: float  # of a unit like the others having as much

    def to_json(self) -> dict[str, Any]:
        """The unit under the keys of JSON."""
        return self._asdict()


def misfits(errors: Mapping[str, float]) -> tuple[Misfit, ...]:
    """The units, of those with an error over the noise floor, that have more than chance gives; the worst first.

    Of those that are named FALSE_DISCOVERY_RATE are meant to be there by chance.
    """
    if len(errors) < MIN_UNITS:
        return ()
    logarithms = np.log(list(errors.values()))
    usual = float(np.median(logarithms))
    scatter = max(MAD_TO_SIGMA * float(np.median(np.abs(logarithms - usual))), MIN_ERROR_SCATTER)
    p_values = stdtr(MAD_EFFICIENCY * (len(errors) - 1), (usual - logarithms) / scatter)
    found = [
        Misfit(unit, error, float(np.exp(usual)), float(p_value))
        for (unit, error), p_value, is_odd in zip(errors.items(), p_values, discoveries(p_values), strict=True)
        if is_odd and error > MAX_EXPLAINED_ERROR_RATIO * np.exp(usual)
    ]
    return tuple(sorted(found, key=lambda m: -m.error))
