"""Parameters that change with the date, over the fleet and in single units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtr

from wheelpend.campaigns.fleet import UnitEstimate, discoveries

MIN_DATED_LOGS = 3  # of a unit, for a drift of its own


class Drift(NamedTuple):
    """A parameter's change with the date."""

    unit: str | None  # None: of all units alike
    parameter: str
    per_day: float
    sigma: float  # its standard error, the scatter from log to log in it
    p_value: float

    def to_json(self) -> dict[str, Any]:
        """The drift under the keys of JSON."""
        return self._asdict()


def drifts(estimates: Sequence[UnitEstimate], days: Sequence[float]) -> tuple[Drift, ...]:
    """Drifts that are no chance, the surest first, of estimates of units on some days [d].

    A line over the date of each parameter, weighted by its errors, from a level of each unit's own: with a slope for
    all units together, and with one for each unit that has MIN_DATED_LOGS logs. Errors are widened where the logs
    scatter more than they say. Of the drifts that are said to be none the usual share are.
    """
    found = list(_all_drifts(estimates, np.asarray(days, dtype=float)))
    kept = discoveries([d.p_value for d in found])
    return tuple(sorted((d for d, keep in zip(found, kept, strict=True) if keep), key=lambda d: d.p_value))


def _all_drifts(estimates: Sequence[UnitEstimate], days: np.ndarray) -> Iterator[Drift]:
    by_unit: dict[str, list[int]] = {}
    for k, estimate in enumerate(estimates):
        by_unit.setdefault(estimate.unit, []).append(k)
    for parameter in dict.fromkeys(n for e in estimates for n in e.names):
        known = {u: [k for k in own if parameter in estimates[k].names] for u, own in by_unit.items()}
        repeated = {u: own for u, own in known.items() if len(own) > 1 and np.ptp(days[own]) > 0.0}
        if len(repeated) > 1:
            yield from _drift(None, parameter, estimates, days, repeated)
        for unit, own in repeated.items():
            if len(own) >= MIN_DATED_LOGS:
                yield from _drift(unit, parameter, estimates, days, {unit: own})


def _drift(
    unit: str | None,
    parameter: str,
    estimates: Sequence[UnitEstimate],
    days: np.ndarray,
    groups: Mapping[str, Sequence[int]],
) -> Iterator[Drift]:
    """The common slope of some units' logs, each unit with a level of its own; nothing where no log is left over."""
    along = power = whole = 0.0
    degrees = -1
    for own in groups.values():
        places = [estimates[k].names.index(parameter) for k in own]
        values = np.array([estimates[k].values[p] for k, p in zip(own, places, strict=True)])
        weights = 1.0 / np.array([estimates[k].covariance[p, p] for k, p in zip(own, places, strict=True)])
        x = days[list(own)] - np.average(days[list(own)], weights=weights)
        y = values - np.average(values, weights=weights)
        along, power, whole = along + weights @ (x * y), power + weights @ x**2, whole + weights @ y**2
        degrees += len(own) - 1
    if degrees < 1:
        return
    slope = float(along / power)
    excess = max(1.0, float(whole - slope * along) / degrees)
    sigma = float(np.sqrt(excess / power))
    yield Drift(unit, parameter, slope, sigma, float(2.0 * stdtr(degrees, -abs(slope) / sigma)))
