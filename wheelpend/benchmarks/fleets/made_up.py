"""Fleets of numbers alone, which cost nothing: estimates of correlated parameters, some of them odd."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.campaigns.fleet import UnitEstimate, fleet_of
from wheelpend.proportion import Proportion, proportion_of

PARAMETER_NAMES = ("a", "b", "c", "d")
TRUE_SCATTERS, TYPICAL_ERRORS = np.array([0.4, 1.0, 20.0, 10.0]), np.array([2.0, 2.0, 10.0, 5.0])
ERROR_CORRELATION = np.array(
    [[1.0, -0.95, 0.3, 0.0], [-0.95, 1.0, -0.2, 0.0], [0.3, -0.2, 1.0, 0.4], [0.0, 0.0, 0.4, 1.0]]
)
ERROR_FACTORS = (0.5, 2.0)  # between which a unit's covariance lies
ODD_PARAMETERS, ODD_SIGMAS = ("c", "d"), 6.0  # by turns, and by how many deviations of scatter and errors together
FLEET_SIZES = ((8, 0, 100), (8, 1, 100), (20, 0, 100), (20, 2, 100), (100, 0, 24), (100, 5, 24))  # units, odd, fleets


class MadeUpCount(NamedTuple):
    """What was said of fleets of one size."""

    units: int
    odd: int
    fleets: int
    found: Proportion  # of the odd units
    accused: Proportion  # of the units that were named, that are not odd
    fleets_accusing: Proportion  # of the fleets, that name one that is not odd


def count_made_up() -> list[MadeUpCount]:
    """Fleets of all sizes, always the same."""
    return [_count(*size) for size in FLEET_SIZES]


def _count(units: int, odd: int, fleets: int) -> MadeUpCount:
    named = [_named(np.random.default_rng((units, odd, number)), units, odd) for number in range(fleets)]
    truth = set(range(odd))
    return MadeUpCount(
        units,
        odd,
        fleets,
        proportion_of(k in found for found in named for k in truth),
        proportion_of(k not in truth for found in named for k in found),
        proportion_of(bool(found - truth) for found in named),
    )


def _named(rng: np.random.Generator, units: int, odd: int) -> set[int]:
    """The numbers of the units that stand out in a fleet whose first ones are odd."""
    made = []
    for number in range(units):
        covariance = ERROR_CORRELATION * np.outer(TYPICAL_ERRORS, TYPICAL_ERRORS) * rng.uniform(*ERROR_FACTORS)
        truth = TRUE_SCATTERS * rng.normal(size=len(PARAMETER_NAMES))
        if number < odd:
            k = PARAMETER_NAMES.index(ODD_PARAMETERS[number % len(ODD_PARAMETERS)])
            truth[k] += ODD_SIGMAS * np.hypot(TYPICAL_ERRORS[k], TRUE_SCATTERS[k])
        made.append(UnitEstimate(str(number), PARAMETER_NAMES, rng.multivariate_normal(truth, covariance), covariance))
    found = fleet_of(made)
    return {int(o.unit) for o in found.odd} if found else set()
