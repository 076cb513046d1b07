"""An arm that a motor holds in place after place, simulated step by step here: most of the time friction holds it."""

import math

import numpy as np
import pytest

from wheelpend import Log, Model
from wheelpend.diagnosis.events import find_events
from wheelpend.diagnosis.explain import explain
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.problem import narrower_effects, simpler_effects

INTERVAL, SUBSTEPS, STEP_RAD = 0.005, 50, 2.0 * math.pi / 4096
INERTIA_V, VISCOUS_V, WEIGHT_V, FRICTION_V, OFFSET_V = 0.057, 0.6, 2.3, 0.29, 0.3
TRUE = {
    "X1": INERTIA_V,
    "X2": VISCOUS_V,
    "unbalance.sine": -WEIGHT_V,
    "unbalance.cosine": 0.0,
    "coulomb_drive.torque": FRICTION_V,
    "voltage_offset.offset": OFFSET_V,
}
TOML = f'plant = "shaft"\nsensors.step.theta_m = {STEP_RAD}\n'
ALL = TOML + 'effects = ["unbalance", "coulomb_drive", "voltage_offset"]\n'


@pytest.fixture(scope="module")
def held():
    """A log of places that a controller of 25 V/rad and 1 V s/rad goes to and stays at, 1.2 s each."""
    rng = np.random.default_rng(3)
    goals = np.repeat(rng.uniform(-1.4, 1.4, 20), 240)
    goal, angle, speed, seen, before, rate, h = 0.0, 0.0, 0.0, [], 0.0, 0.0, INTERVAL / SUBSTEPS
    command = []
    for wanted in goals:
        goal += INTERVAL / 0.15 * (wanted - goal)
        reading = round(angle / STEP_RAD) * STEP_RAD
        rate, before = 0.5 * rate + 0.5 * (reading - before) / INTERVAL, reading
        volts = min(max(round((25.0 * (goal - reading) - rate) / 12.0 * 255.0), -255), 255) * 12.0 / 255.0
        seen.append(reading)
        command.append(volts)
        for _ in range(SUBSTEPS):
            free = speed + h * (volts + OFFSET_V - VISCOUS_V * speed - WEIGHT_V * math.sin(angle)) / INERTIA_V
            stopped = h * FRICTION_V / INERTIA_V
            speed = 0.0 if abs(free) <= stopped else free - math.copysign(stopped, free)
            angle += h * speed
    t = INTERVAL * np.arange(len(seen))
    return Log("arm", t, np.array(command), np.array(seen)[:, None], ("theta_m",), rates={})


@pytest.mark.slow
def test_a_fit_passes_segments_that_friction_holds_to_what_acts_on_the_others(held):
    assert np.mean(np.diff(held.measured[:, 0]) == 0.0) > 0.5
    problem = prepare(Model.parse(ALL), [held])
    start = {**{n: 1.2 * v for n, v in TRUE.items()}, "unbalance.cosine": -0.3}
    per_log = [{n: start[n] for n in ("unbalance.sine", "unbalance.cosine", "voltage_offset.offset")}]
    found = fit_segments(problem, problem.data.estimation, start, list(TRUE), start_per_log=per_log, rounds=25)
    assert 0.8 < found.error < 1.1
    assert {n: found.of_log(0)[n] for n in TRUE} == pytest.approx(TRUE, rel=0.01, abs=0.003)


def test_what_acts_all_the_time_is_no_event(held):
    problem = prepare(Model.parse(TOML + 'effects = ["unbalance", "coulomb_drive"]\n'), [held])
    without = {n: v for n, v in TRUE.items() if not n.startswith("voltage")}
    fitted = fit_segments(problem, problem.data.estimation, without, (), rounds=0)
    (event,) = [e for e in find_events(problem, fitted, 10.0) if e.effect.name == "external_push"]
    assert event.gain > 1000.0 > 500.0 > event.gain_by_time


def test_a_ripple_of_one_period_a_turn_is_no_rival_of_a_load_out_of_balance(held):
    module = prepare(Model.parse(TOML), [held]).module
    assert "unbalance" in narrower_effects(module, "cogging") and "unbalance" not in simpler_effects(module, "cogging")


@pytest.mark.slow
def test_weight_friction_and_offset_are_named_with_their_sizes_and_no_push(held):
    found = explain(Model.parse(TOML), [held])
    assert set(found.effects) == {"unbalance", "coulomb_drive", "voltage_offset"}
    assert found.error < 1.1 * found.problem.floor
    assert not any("cogging" in s.equivalent_to for s in found.steps)
    for name, true in TRUE.items():
        if true and name in found.parameters:
            assert found.parameters[name].value == pytest.approx(true, rel=0.01)
