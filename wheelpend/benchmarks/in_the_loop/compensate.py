"""The robot in MuJoCo under its controller: without friction, with it, and with it compensated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wheelpend.benchmarks.hidden_effects.engine import Robot, engine_log, play, sample_count
from wheelpend.benchmarks.hidden_effects.laws import SAMPLE_INTERVAL_S
from wheelpend.benchmarks.hidden_effects.scene import MAX_ENGINE_STEP_S
from wheelpend.benchmarks.in_the_loop.observed import Compensated
from wheelpend.export.exported_model import exported_model
from wheelpend.identification.identify import identify
from wheelpend.model.record import Model

FRICTION_SIZES_V = (0.05, 0.1, 0.2, 0.3, 0.5)
PITCH_COMMANDS = ("aggressive", "upright")
RUN_DURATION_S, STANDING_S = 5.0, 2.0  # of a run, and of its end over which standing still is judged
PILOT_SEED = 1000  # of the log from which the model is identified
FRICTION_EFFECT, FRICTION_SIZE = "coulomb_drive", "coulomb_drive.torque"
LEAST_ERROR_SHARE = 0.05  # of the friction: its least standard error, that of a model which is no longer fresh


class Pitch(NamedTuple):
    """Standard deviations of the pitch [rad] over a run, for one size of friction and command."""

    friction: float  # V
    command: str
    before: float  # of what friction does to it: the run with friction less the one without
    after: float  # of what is left of that with compensation
    still_without: float  # over the last two seconds, on a machine without friction
    still_before: float
    still_after: float


@dataclass(frozen=True)
class Answer:
    """What one draw showed."""

    key: str
    failure: str = ""
    pitches: tuple[Pitch, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {"key": self.key, "failure": self.failure, "pitches": [list(p) for p in self.pitches]}


def try_draw(seed: int) -> Answer:
    """Every size of friction and command with one noise of the sensors and one draw of the model's errors."""
    found = []
    for command in PITCH_COMMANDS:
        smooth = pitch_of(0.0, None, command, seed)
        for friction in FRICTION_SIZES_V:
            rough = pitch_of(friction, None, command, seed)
            helped = pitch_of(friction, drawn_model(friction, seed), command, seed)
            spreads = [float(np.std(p)) for p in (rough - smooth, helped - smooth)]
            still = [float(np.std(p[-round(STANDING_S / SAMPLE_INTERVAL_S) :])) for p in (smooth, rough, helped)]
            found.append(Pitch(friction, command, *spreads, *still))
    return Answer(f"compensate {seed}", pitches=tuple(found))


def pitch_of(friction: float, known: Model | None, command: str, seed: int) -> np.ndarray:
    """True pitch (samples,) [rad] of the robot with this friction [V]; compensated by a model that is known."""
    robot = Robot({FRICTION_SIZE: friction} if friction else {}, 2 * MAX_ENGINE_STEP_S, sample_count(RUN_DURATION_S))
    if known is None:
        return play(robot, command, RUN_DURATION_S, seed).angles[:, 1]
    helper = Compensated(exported_model(known, period=SAMPLE_INTERVAL_S))
    return play(robot, command, RUN_DURATION_S, seed, through=helper.voltage).angles[:, 1]


def drawn_model(friction: float, seed: int) -> Model:
    """The robot's model with errors drawn from the covariance of its identification, and standard errors to match.

    The friction's own standard error is at least LEAST_ERROR_SHARE of its size; the others are as identified.
    """
    model, names, values, covariance = identified(friction)
    size = names.index(FRICTION_SIZE)
    wide = covariance.copy()
    wide[size, size] = max(wide[size, size], (LEAST_ERROR_SHARE * values[size]) ** 2)
    drawn = np.random.default_rng([seed, round(1000 * friction)]).multivariate_normal(values, wide)
    drawn[size] = max(drawn[size], 0.0)
    sigma = np.sqrt(np.diag(wide))
    return model.with_fit({n: (float(v), float(s)) for n, v, s in zip(names, drawn, sigma, strict=True)})


@lru_cache
def identified(friction: float) -> tuple[Model, list[str], np.ndarray, np.ndarray]:
    """The model with friction as identified from 20 s in MuJoCo: its names, values (n,) and covariance (n, n)."""
    log = engine_log({FRICTION_SIZE: friction}, seed=PILOT_SEED)
    found = identify(Model.default().with_effects([FRICTION_EFFECT]), [log])
    assert found.covariance, "a fit has a covariance"
    names = list(found.covariance.names)
    values = np.array([found.parameters[n].value for n in names])
    return found.model, names, values, np.asarray(found.covariance.matrix)
