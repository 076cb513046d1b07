"""Random sources that are likelier the slower they may be: an offset, a drift or a slow law that the model lacks.

The correlation time of a source is bounded, since a slower one is a free offset and swallows everything slow. What is
at that bound may be chance of just this time. It is not where a source far slower makes the logs likelier, by the
scatter between blocks: chance of some time says nothing of the stretches that are longer than it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.diagnosis.likelihood.filtered_model import SETTLED_EFFORT, FilteredModel
from wheelpend.diagnosis.likelihood.held_out import one_sided_p_value
from wheelpend.estimation.filter_fit import SLOWER_FACTOR, FilterEstimator, FilterPoint
from wheelpend.estimation.random_source import with_one_changed

SIGNIFICANCE_LEVEL = 1e-3  # of all slow sources together


@dataclass(frozen=True)
class SlowSource:
    """A random force or error of a sensor at the longest correlation time that is allowed."""

    place: str  # the row or the port of a force, the channel of a sensor
    is_force: bool
    correlation_time_s: float  # that makes the logs likeliest, the bound aside
    gain: float  # of log-likelihood by it, over the longest time that is allowed [nats]
    p_value: float  # of that gain by its scatter between blocks, for all sources at the bound

    @property
    def repeats(self) -> bool:
        """True where it is slower than chance is allowed to be."""
        return self.p_value < SIGNIFICANCE_LEVEL

    def to_json(self) -> dict[str, Any]:
        """The finding under the keys of JSON."""
        return {
            "place": self.place,
            "is_force": self.is_force,
            "correlation_time_s": self.correlation_time_s,
            "gain": self.gain,
            "p_value": self.p_value,
        }


def slow_sources(model: FilteredModel) -> tuple[SlowSource, ...]:
    """The sources of a model that are at the longest correlation time, the slowest by evidence first."""
    longest = model.estimator.correlation_bounds[1]
    if not any(s.is_at_bound(longest) for s in model.point.kinds):
        return ()
    point = model.estimator.fit(model.point.theta, model.point.sources, SETTLED_EFFORT)
    places = [k for k, s in enumerate(point.kinds) if s.is_at_bound(longest)]
    found = (_slow_source(model.estimator, point, k, tests=len(places)) for k in places)
    return tuple(sorted(found, key=lambda s: (s.p_value, -s.gain)))


def _slow_source(estimator: FilterEstimator, point: FilterPoint, place: int, tests: int) -> SlowSource:
    """What a point's source of this number gains where it may be slower."""
    source = point.kinds[place]
    freed = replace(estimator, slow_kinds=(source.kind,))
    begun = with_one_changed(point.sources, place, slowness=float(np.sqrt(SLOWER_FACTOR)))
    slower = freed.fit(point.theta, begun, SETTLED_EFFORT)
    rises = slower.rises_over(point)
    return SlowSource(
        place=source.place,
        is_force=source.is_force,
        correlation_time_s=slower.kinds[place].correlation_time,
        gain=float(rises.sum()),
        p_value=min(1.0, tests * one_sided_p_value(rises)),
    )
