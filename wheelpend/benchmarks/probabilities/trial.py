"""One log: made, diagnosed, and the truth beside the probabilities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any

import numpy as np
from scipy.signal import lfilter

import derive
from wheelpend.api import diagnose
from wheelpend.benchmarks.hidden_effects.cases import SIZE_REDUCTION_FACTOR, draw_effect, size_parameters
from wheelpend.benchmarks.hidden_effects.trial import MAX_REDRAWS
from wheelpend.benchmarks.probabilities.cases import Case
from wheelpend.benchmarks.random_force.machine import rough_log
from wheelpend.diagnosis.structures import NONE_OF_THESE
from wheelpend.errors import Failure, OutOfRange
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.simulate import simulate

DURATION_S, LATE_BEGIN_S = 8.0, 3.0  # s, of a log; into the motion, where it begins late
LOG_COMMAND = "aggressive"
GYRO_CHANNEL, GYRO_LAG_S = "dtheta_p", 0.005  # s, of a gyro's low-pass filter of first order
ROUGH_PLACE = "drive"  # of a random force
PILOT_SEED = 999_999  # of the logs that say which sizes such a log just shows

Sizes = Mapping[str, Mapping[str, float]]  # by effect and parameter, that a log just shows


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis held for how probable, and what was true."""

    key: str
    kind: str
    truth: tuple[str, ...]  # the hidden effects, or none_of_these
    sizes: tuple[float, ...] = ()  # as planned, times those that such a log just shows
    structures: tuple[tuple[tuple[str, ...], float], ...] = ()  # effects and probability
    verdict: str = ""
    library: int = 0  # effects that were judged
    rough: bool = False
    failure: str | None = None
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """The outcome under the keys of its journal."""
        return {
            "key": self.key,
            "kind": self.kind,
            "truth": self.truth,
            "sizes": self.sizes,
            "structures": self.structures,
            "verdict": self.verdict,
            "library": self.library,
            "rough": self.rough,
            "failure": self.failure,
            "seconds": self.seconds,
        }


def shown_sizes(rough: bool) -> dict[str, dict[str, float]]:
    """Sizes of effects that a log of a complete machine would just have shown, on smooth or on rough ground."""
    pilot = Case("pilot", PILOT_SEED, "complete", force="first_order" if rough else "")
    return diagnose(Model.default(), [made_log(pilot, {})]).detectable


def try_case(case: Case, shown: Sizes) -> Outcome:
    """Make a case's log, diagnose it, and keep the probabilities beside the truth."""
    begin = monotonic()
    truth = (NONE_OF_THESE,) if case.without else tuple(sorted(case.effects))
    outcome = Outcome(case.key, case.kind, truth, case.sizes, rough=bool(case.force))
    try:
        found = diagnose(Model.default(), [standing_log(case, shown)], without=case.without)
        told = tuple((s.effects, s.probability) for s in found.structures)
        outcome = replace(outcome, structures=told, verdict=found.verdict, library=len(found.problem.candidates()))
    except (Failure, np.linalg.LinAlgError) as failure:
        outcome = replace(outcome, failure=str(failure))
    return replace(outcome, seconds=monotonic() - begin)


def standing_log(case: Case, shown: Sizes) -> Log:
    """The measured log, with smaller effects than planned where the robot would fall."""
    for k in range(MAX_REDRAWS):
        try:
            return made_log(case, hidden_values(case, shown, SIZE_REDUCTION_FACTOR**k))
        except OutOfRange:
            continue
    return made_log(case, hidden_values(case, shown, SIZE_REDUCTION_FACTOR**MAX_REDRAWS))


def hidden_values(case: Case, shown: Sizes, factor: float = 1.0) -> dict[str, float]:
    """Parameters of the hidden effects: sizes in multiples of those that a log just shows, the others typical ones."""
    random = np.random.default_rng((case.number, len(case.of)))
    found: dict[str, float] = {}
    for name, size in zip(case.effects, case.sizes, strict=True):
        effect = derive.effects.find(name)
        ratio = [
            shown[name][p.name] / abs(p.typical)
            for p in size_parameters(effect)
            if p.absent == 0.0 and p.typical and p.name in shown.get(name, {})
        ]
        found |= dict(draw_effect(effect, factor * size * (ratio[0] if ratio else 1.0), random))
    return found


def made_log(case: Case, hide: Mapping[str, float]) -> Log:
    """A log with these effects in it; raises OutOfRange where the robot falls."""
    duration = DURATION_S + LATE_BEGIN_S * case.late
    if case.force:
        log = rough_log(case.force, ROUGH_PLACE, case.number, hide, duration).log
    else:
        log = simulate(Model.default(), command=LOG_COMMAND, duration=duration, hide=hide, seed=case.number)
    log = filtered(log) if case.filtered else log
    return begun_at(log, LATE_BEGIN_S) if case.late else log


def filtered(log: Log) -> Log:
    """The log with its gyro, noise and all, behind a low-pass filter of first order."""
    channel, fade = log.channels.index(GYRO_CHANNEL), np.exp(-log.dt / GYRO_LAG_S)
    measured = log.measured.copy()
    rate = measured[:, channel]
    measured[:, channel] = lfilter([1.0 - fade], [1.0, -fade], rate, zi=[fade * rate[0]])[0]
    return replace(log, measured=measured)


def begun_at(log: Log, begin: float) -> Log:
    """The log from a moment [s] on, as if nothing had been recorded before."""
    first = int(np.searchsorted(log.t, begin))
    part = log.part(first, len(log))
    return replace(part, t=part.t - part.t[0], earlier=None)
