"""What stands out in each fleet, beside what aged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.fleets.cases import SCATTER_SHARE, Unit, usual_values
from wheelpend.benchmarks.fleets.trial import Answer
from wheelpend.campaigns.fleet import Fleet, OddUnit, UnitEstimate, fleet_of
from wheelpend.proportion import Proportion, proportion_of


class FleetCount(NamedTuple):
    """What was said of all fleets, beside the truth."""

    fleets: int
    units: int  # with an estimate
    failed: int
    found: Proportion  # of the aged units, that stand out
    right: Proportion  # of those, whose first parameter is the one that aged
    accused: Proportion  # of the units that stand out, that did not age
    inside: Proportion  # of the aged units' changes, that lie in their intervals
    scatter: Proportion  # of the parameters' true scatter, that lies in its interval


def count_fleets(units: Sequence[Unit], answers: Mapping[str, Answer]) -> FleetCount | None:
    """Counts over the fleets all of whose units were tried; None where there is none."""
    by_fleet: dict[int, list[Unit]] = {}
    for unit in units:
        by_fleet.setdefault(unit.fleet, []).append(unit)
    whole = [own for own in by_fleet.values() if all(u.key in answers for u in own)]
    if not whole:
        return None
    told = [(own, found) for own in whole if (found := _fleet(own, answers)) is not None]
    usable = [u for own in whole for u in own if answers[u.key].failure is None]
    odd = [(u, o) for own, found in told for u, o in _odd_units(own, found)]
    aged, stand_out, usual = [u for u in usable if u.aged], {u.key for u, _ in odd}, usual_values()
    return FleetCount(
        fleets=len(whole),
        units=len(usable),
        failed=sum(map(len, whole)) - len(usable),
        found=proportion_of(u.key in stand_out for u in aged),
        right=proportion_of(o.difference.parameters[0].parameter == u.aged for u, o in odd if u.aged),
        accused=proportion_of(not u.aged for u, _ in odd),
        inside=proportion_of(_covers(u, o, found) for own, found in told for u, o in _odd_units(own, found) if u.aged),
        scatter=proportion_of(
            p.scatter_interval[0] <= SCATTER_SHARE * usual[n] <= p.scatter_interval[1]
            for _, found in told
            for n, p in found.parameters.items()
        ),
    )


def _fleet(own: Sequence[Unit], answers: Mapping[str, Answer]) -> Fleet | None:
    known = [answers[u.key] for u in own if answers[u.key].failure is None]
    return fleet_of([UnitEstimate(a.key, a.names, np.array(a.values), np.array(a.covariance)) for a in known])


def _odd_units(own: Sequence[Unit], found: Fleet) -> Iterator[tuple[Unit, OddUnit]]:
    by_key = {u.key: u for u in own}
    for odd in found.odd:
        if odd.difference.parameters:
            yield by_key[odd.unit], odd


def _covers(unit: Unit, odd: OddUnit, found: Fleet) -> bool:
    """True where the interval of the parameter that aged holds how far the unit is from the fleet."""
    told = {e.parameter: e for e in odd.difference.parameters}
    if unit.aged not in told:
        return False
    low, high = told[unit.aged].interval
    return low <= dict(unit.truth)[unit.aged] - found.parameters[unit.aged].mean <= high
