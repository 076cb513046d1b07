"""Units that the model describes worse than the others: something acts there that it does not have.

Such a unit may hide among the parameters, whose errors are as wide as the model is wrong. What is compared is the
logarithm of its error over the noise floor, around the units' median, by median absolute deviations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtr

from wheelpend.campaigns.fleet import MAD_TO_SIGMA, MIN_UNITS, discoveries
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO

MAD_EFFICIENCY = 0.37  # of a median absolute deviation: it is known as a variance from so much fewer units is
BISECTIONS_TO_SCATTER = 50
MIN_ERROR_SCATTER = 0.02  # of a logarithm: an error is not known better


class Misfit(NamedTuple):
    """A unit that the model describes worse than the others."""

    unit: str
    error: float  # that the model leaves there, over the noise floor: the geometric mean of its logs
    usual: float  # the median of all units
    p_value: float  # of a unit like the others having as much

    def to_json(self) -> dict[str, Any]:
        """The unit under the keys of JSON."""
        return self._asdict()


def misfits(errors: Mapping[str, Sequence[float]]) -> tuple[Misfit, ...]:
    """The units, by the errors of their logs over the noise floor, that have more than chance gives; the worst first.

    A unit's logarithm is the mean of its logs', which scatter too, so that it is the less certain the fewer they are.
    Of those that are named FALSE_DISCOVERY_RATE are meant to be there by chance.
    """
    if len(errors) < MIN_UNITS:
        return ()
    logarithms = [np.log(np.asarray(own, dtype=float)) for own in errors.values()]
    means, counts = np.array([own.mean() for own in logarithms]), np.array([len(own) for own in logarithms])
    usual = float(np.median(means))
    scatter = np.maximum(_scatter(means - usual, counts, _scatter_of_logs(logarithms)), MIN_ERROR_SCATTER)
    p_values = stdtr(MAD_EFFICIENCY * (len(errors) - 1), (usual - means) / scatter)
    found = [
        Misfit(unit, float(np.exp(mean)), float(np.exp(usual)), float(p_value))
        for unit, mean, p_value, is_odd in zip(errors, means, p_values, discoveries(p_values), strict=True)
        if is_odd and mean > usual + np.log(MAX_EXPLAINED_ERROR_RATIO)
    ]
    return tuple(sorted(found, key=lambda m: -m.error))


def _scatter_of_logs(logarithms: Sequence[np.ndarray]) -> float:
    """Standard deviation from log to log of a unit; zero where no unit has several."""
    off = [(own - own.mean()) * np.sqrt(len(own) / (len(own) - 1.0)) for own in logarithms if len(own) > 1]
    return MAD_TO_SIGMA * float(np.median(np.abs(np.concatenate(off)))) if off else 0.0


def _scatter(deviations: np.ndarray, counts: np.ndarray, of_logs: float) -> np.ndarray:
    """Standard deviations (units,) of the units' deviations (units,): that from unit to unit, and their logs'.

    The former is what makes the median of their ratio that of a normal distribution.
    """
    own = of_logs / np.sqrt(counts)

    def is_too_small(between: float) -> bool:
        return MAD_TO_SIGMA * float(np.median(np.abs(deviations) / np.hypot(between, np.maximum(own, 1e-12)))) > 1.0

    low, high = 0.0, MAD_TO_SIGMA * float(np.abs(deviations).max()) + 1e-12
    if not is_too_small(low):
        return np.asarray(own)
    for _ in range(BISECTIONS_TO_SCATTER):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_too_small(middle) else (low, middle)
    return np.hypot(high, own)
