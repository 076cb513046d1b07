"""What the results of a campaign say of units: what they have in common, which stand out by what, and what drifts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wheelpend.campaigns.drift import Drift, drifts
from wheelpend.campaigns.fleet import Difference, Fleet, UnitEstimate, combined, difference_between, fleet_of
from wheelpend.campaigns.manifest import day_of
from wheelpend.campaigns.misfits import Misfit, misfits
from wheelpend.campaigns.one_log import LogResult
from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.free_parameters import per_log_names


class EffectSpread(NamedTuple):
    """In how many units an effect was named."""

    effect: str
    units: tuple[str, ...]
    of: int  # units that were asked

    def to_json(self) -> dict[str, Any]:
        """The effect under the keys of JSON."""
        return {"effect": self.effect, "units": self.units, "of": self.of}


class UnitDifference(NamedTuple):
    """Why two units differ."""

    units: tuple[str, str]
    difference: Difference  # of the second from the first

    def to_json(self) -> dict[str, Any]:
        """The difference under the keys of JSON."""
        return {"units": self.units, **self.difference.to_json()}


@dataclass(frozen=True)
class UnitsAnswer:
    """What a campaign says of its units."""

    units: tuple[UnitEstimate, ...]  # in their order
    fleet: Fleet | None  # None where there are too few units, or none has errors
    effects: tuple[EffectSpread, ...]  # that were named, the most frequent first
    drifts: tuple[Drift, ...]
    differ: UnitDifference | None = None
    misfits: tuple[Misfit, ...] = ()  # units that the model describes worse, which the fleet leaves out
    judged: int = 0  # units by what the model leaves of them

    @property
    def standing_out(self) -> tuple[str, ...]:
        """Units that stand out, by their parameters or by what the model leaves."""
        odd = self.fleet.odd if self.fleet else ()
        return tuple(dict.fromkeys([*(m.unit for m in self.misfits), *(o.unit for o in odd)]))

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of JSON."""
        return {
            "units": {u.unit: dict(zip(u.names, u.values, strict=True)) for u in self.units},
            "parameters": self.fleet.parameters if self.fleet else {},
            "odd": self.fleet.odd if self.fleet else (),
            "misfits": self.misfits,
            "effects": self.effects,
            "drifts": self.drifts,
            "differ": self.differ,
        }


def units_answer(results: Sequence[LogResult], differ: Sequence[str] = ()) -> UnitsAnswer | None:
    """What results say of their units; None where none has a unit. ``differ`` names two that are compared.

    A unit with several logs has one estimate of them, its errors widened where the logs scatter more than they say.
    Raises Failure where a unit that is to be compared has no estimate.
    """
    if not any(r.unit for r in results):
        return None
    known = [
        _Known(e, tuple(sorted(r.effects)), r.date) for r in results if r.unit and (e := log_estimate(r)) is not None
    ]
    alike = _alike(known)
    by_unit: dict[str, list[UnitEstimate]] = {}
    for one in alike:
        by_unit.setdefault(one.estimate.unit, []).append(one.estimate)
    units = {unit: combined(unit, estimates) for unit, estimates in by_unit.items()}
    errors = unit_errors(results)
    worse = misfits(errors)
    fitting = [estimate for unit, estimate in units.items() if unit not in {m.unit for m in worse}]
    dated = [(one.estimate, day_of(one.date)) for one in alike if one.date]
    return UnitsAnswer(
        tuple(units.values()),
        fleet_of(fitting),
        effect_spreads(results),
        drifts([e for e, _ in dated], [day for _, day in dated]) if dated else (),
        _difference(units, differ) if differ else None,
        worse,
        len(errors),
    )


def unit_errors(results: Sequence[LogResult]) -> dict[str, list[float]]:
    """What the model leaves of each unit's logs, over their noise floors."""
    errors: dict[str, list[float]] = {}
    for result in results:
        if result.unit and result.failure is None and result.error and result.noise_floor:
            errors.setdefault(result.unit, []).append(result.error / result.noise_floor)
    return errors


class _Known(NamedTuple):
    """What a log says of its unit."""

    estimate: UnitEstimate
    effects: tuple[str, ...]  # of the model that the parameters belong to
    date: str


def log_estimate(result: LogResult) -> UnitEstimate | None:
    """A log's estimate of its unit's parameters with their covariance; None where it has none."""
    covariance = result.covariance
    if result.failure is not None or covariance is None:
        return None
    names = [n for n in covariance.names if n in result.parameters and not is_per_log(n)]
    places = [covariance.names.index(n) for n in names]
    matrix = np.asarray(covariance.matrix, dtype=float)[np.ix_(places, places)]
    good = np.isfinite(matrix).all() and bool(names) and (np.diag(matrix) > 0.0).all()
    values = np.array([result.parameters[n].value for n in names])
    return UnitEstimate(result.unit, tuple(names), values, matrix) if good else None


def is_per_log(name: str) -> bool:
    """True of a parameter that is another in every log: an encoder's zero, say."""
    return bool(per_log_names([name]))


def effect_spreads(results: Sequence[LogResult]) -> tuple[EffectSpread, ...]:
    """The effects that were named in units, the most frequent first."""
    asked, units = set[str](), dict[str, dict[str, None]]()
    for result in results:
        if result.unit and result.failure is None and result.verdict:
            asked.add(result.unit)
        for named in result.named if result.unit else ():
            units.setdefault(named.effect, {})[result.unit] = None
    rows = sorted(units.items(), key=lambda row: -len(row[1]))
    return tuple(EffectSpread(effect, tuple(own), len(asked)) for effect, own in rows)


def _alike(known: Sequence[_Known]) -> list[_Known]:
    """Those whose model has the effects that most have: parameters of others mean something else."""
    models = Counter(one.effects for one in known)
    return [one for one in known if one.effects == models.most_common(1)[0][0]]


def _difference(units: Mapping[str, UnitEstimate], differ: Sequence[str]) -> UnitDifference:
    for name in differ:
        if name not in units:
            raise Failure(
                f"--differ must name units that have an estimate with errors: {', '.join(units) or 'none has'}, "
                f"not '{name}'.{did_you_mean(name, list(units))}"
            )
    one, other = differ
    return UnitDifference((one, other), difference_between(units[one], units[other]))
