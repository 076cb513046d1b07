"""The engine's robot on rough ground feels the force that was played, where it was played."""

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, simulate
from wheelpend.benchmarks.hidden_effects.engine import engine_run, play, sample_count
from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS
from wheelpend.benchmarks.random_force import machine
from wheelpend.benchmarks.random_force.forces import ForceKind
from wheelpend.benchmarks.random_force.machine import (
    DRIVE_VOLTAGE_RMS_V,
    FORCE_SHARE,
    WHEEL_SPEED_RMS_RAD_S,
    RoughGround,
    rough_log,
)

pytest.importorskip("mujoco")
pytestmark = pytest.mark.extras

SIZE = FORCE_SHARE * DRIVE_VOLTAGE_RMS_V  # V
CONSTANT = ForceKind(lambda random, steps, step: np.ones(steps), None)


def engine_model():
    """The default model, which simulates the engine's robot."""
    model = Model.default()
    values = {n: (v, None) for n, v in TRUE_PARAMETERS.items()}
    return Model.parse(model.with_fit(values).text.split("[simulation]")[0])


def motion(run):
    """True wheel angle, pitch and pitch rate (samples, 3) of an engine's run."""
    return np.column_stack([run.angles[:, 1] + run.angles[:, 2], run.angles[:, 1], run.rates[:, 1]])


def test_without_noise_and_force_the_engine_moves_as_the_simulator_does():
    run, own = engine_run({}, duration=2.0, noise=0.0), simulate(engine_model(), duration=2.0, noise=False)
    assert motion(run) == pytest.approx(own.measured, abs=1e-6)
    assert run.log.voltage == pytest.approx(own.voltage, abs=1e-5)


@pytest.mark.parametrize(
    "place, hide",
    [
        ("wheel", {"external_push.start": 0.0, "external_push.end": 9.0, "external_push.torque": SIZE}),
        ("drive", {"voltage_offset.offset": -SIZE}),
    ],
)
def test_a_constant_force_does_what_the_effect_does_that_it_stands_for(place, hide):
    run = play(RoughGround({}, sample_count(1.0), CONSTANT, place, 1), "aggressive", 1.0, 0, 0.0)
    own = simulate(engine_model(), duration=1.0, noise=False, hide=hide)
    still = simulate(engine_model(), duration=1.0, noise=False)
    assert motion(run) == pytest.approx(own.measured, abs=1e-5)
    assert np.abs(own.measured - still.measured).max() > 1e-2


def test_forces_are_measured_by_what_a_log_without_one_shows():
    log = simulated()
    wheel = np.gradient(log.measured[::20, 0], log.t[::20])
    assert np.sqrt(np.mean(log.voltage**2)) == pytest.approx(DRIVE_VOLTAGE_RMS_V, rel=0.03)
    assert np.sqrt(np.mean(wheel**2)) == pytest.approx(WHEEL_SPEED_RMS_RAD_S, rel=0.03)


def test_the_force_that_is_told_is_the_one_that_was_drawn_and_grows_with_the_speed(monkeypatch):
    monkeypatch.setitem(machine.FORCE_KINDS, "constant", CONSTANT)
    monkeypatch.setitem(machine.FORCE_KINDS, "moving", ForceKind(CONSTANT.draw, None, with_speed=True))
    steady, moving = (rough_log(kind, "wheel", 1, duration=0.5) for kind in ("constant", "moving"))
    assert steady.force == pytest.approx(SIZE) and len(steady.force) == len(steady.log)
    speed = np.abs(np.gradient(moving.log.measured[:, 0], moving.log.t))[5:-5]
    told = moving.force[5:-5] / SIZE * WHEEL_SPEED_RMS_RAD_S
    assert told == pytest.approx(speed, abs=0.2 + 0.05 * speed.max())
