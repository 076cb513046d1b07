"""What stands out in each fleet, beside what aged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.fleets.cases import SCATTER_SHARE, Unit, usual_values
from wheelpend.benchmarks.fleets.trial import Answer, Lack
from wheelpend.campaigns.fleet import Fleet, OddUnit, UnitEstimate, fleet_of
from wheelpend.campaigns.misfits import Misfit, misfits
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


class LackCount(NamedTuple):
    """What diagnoses of the units that stand out said, beside the truth."""

    asked: int
    stand_out: Proportion  # of the units that lack an effect, that stand out
    named: Proportion  # of those, whose diagnosis names it, or one that declares it equivalent
    alarms: Proportion  # of the asked units that lack none, whose diagnosis names one or leaves something unexplained


def count_fleets(units: Sequence[Unit], answers: Mapping[str, Answer]) -> FleetCount | None:
    """Counts over the fleets of aged units all of which were tried; None where there is none."""
    whole = [own for own in whole_fleets(units, answers) if not any(u.lacked for u in own)]
    if not whole:
        return None
    told = [(own, found) for own in whole if (found := _fleet(own, answers)) is not None]
    usable = [u for own in whole for u in own if answers[u.key].failure is None]
    odd = [(u, o) for own, found in told for u, o in _odd_units(own, found)]
    of_aged = [u for own in whole for u in own]
    aged, stand_out, usual = [u for u in usable if u.aged], standing_out(of_aged, answers), usual_values()
    keys = {u.key for u in stand_out}
    return FleetCount(
        fleets=len(whole),
        units=len(usable),
        failed=sum(map(len, whole)) - len(usable),
        found=proportion_of(u.key in keys for u in aged),
        right=proportion_of(o.difference.parameters[0].parameter == u.aged for u, o in odd if u.aged),
        accused=proportion_of(not u.aged for u in stand_out),
        inside=proportion_of(_covers(u, o, found) for own, found in told for u, o in _odd_units(own, found) if u.aged),
        scatter=proportion_of(
            p.scatter_interval[0] <= SCATTER_SHARE * usual[n] <= p.scatter_interval[1]
            for _, found in told
            for n, p in found.parameters.items()
        ),
    )


def whole_fleets(units: Sequence[Unit], answers: Mapping[str, Answer]) -> list[list[Unit]]:
    """The fleets all of whose units were tried."""
    by_fleet: dict[int, list[Unit]] = {}
    for unit in units:
        by_fleet.setdefault(unit.fleet, []).append(unit)
    return [own for own in by_fleet.values() if all(u.key in answers for u in own)]


def standing_out(units: Sequence[Unit], answers: Mapping[str, Answer]) -> list[Unit]:
    """The units of whole fleets that stand out, by their parameters or by what the model leaves."""
    found = []
    for own in whole_fleets(units, answers):
        keys, told = {m.unit for m in _misfits(own, answers)}, _fleet(own, answers)
        keys.update(u.key for u, _ in _odd_units(own, told)) if told else None
        found += [u for u in own if u.key in keys]
    return found


def count_lacks(units: Sequence[Unit], odd: Sequence[Unit], lacks: Mapping[str, Lack]) -> LackCount | None:
    """Counts over the diagnoses of the units that stand out; None where one of them is still to be asked."""
    if not odd or any(u.key not in lacks for u in odd):
        return None
    keys = {u.key for u in odd}
    return LackCount(
        asked=len(odd),
        stand_out=proportion_of(u.key in keys for u in units if u.lacked),
        named=proportion_of(u.lacked in lacks[u.key].named for u in odd if u.lacked),
        alarms=proportion_of(lacks[u.key].verdict != "nothing_missing" for u in odd if not u.lacked),
    )


def _misfits(own: Sequence[Unit], answers: Mapping[str, Answer]) -> tuple[Misfit, ...]:
    return misfits({u.key: [answers[u.key].error] for u in own if answers[u.key].failure is None})


def _fleet(own: Sequence[Unit], answers: Mapping[str, Answer]) -> Fleet | None:
    worse = {m.unit for m in _misfits(own, answers)}
    known = [answers[u.key] for u in own if answers[u.key].failure is None and u.key not in worse]
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
