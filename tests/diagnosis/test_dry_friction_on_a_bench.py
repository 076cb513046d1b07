"""A geared motor on a bench, simulated sample by sample here: dry and viscous friction, seen by a 12-bit encoder."""

import math

import numpy as np
import pytest

from wheelpend import Log, Model
from wheelpend.diagnosis.explain import explain
from wheelpend.diagnosis.stepwise import diagnose
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.prediction import prediction_error
from wheelpend.estimation.ripple_search import strongest_ripple
from wheelpend.estimation.states import fit_states, initial_states

RATE_HZ, SUBSTEPS, STEP_RAD = 200, 20, 2.0 * np.pi / 4096
FORCE_PER_VOLT, FRICTION_V, VISCOUS_V, INERTIA_V = 5.0, 0.4, 0.4, 0.2  # of x, in volts per 1, per rad/s, per rad/s²
TRUE = {"X1": INERTIA_V, "viscous_drive.coefficient": VISCOUS_V, "coulomb_drive.torque": FRICTION_V}
RIPPLES = 14  # a turn
TOML = f'plant = "slide"\nsensors.step.x = {STEP_RAD}\n'


def bench(seed: int, amplitude_v: float, duration_s: float = 20.0, ripple_v: float = 0.0, name: str = "x") -> Log:
    """A log under a sum of ten sines; the motor stops where its friction can hold it, and lets go where it cannot."""
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.1, 3.0, 10), rng.uniform(0.0, 2.0 * np.pi, 10)
    t = np.arange(0.0, duration_s, 1.0 / RATE_HZ)
    voltage = amplitude_v * np.sin(2.0 * np.pi * np.outer(t, frequency) + phase).sum(axis=1) / np.sqrt(5.0)
    place, speed, h, places = 0.0, 0.0, 1.0 / RATE_HZ / SUBSTEPS, []
    for volts in voltage:
        places.append(place)
        for _ in range(SUBSTEPS):
            force = volts - VISCOUS_V * speed - ripple_v * math.sin(RIPPLES * place)
            holds = speed == 0.0 and abs(force) <= FRICTION_V
            direction = np.sign(force) if speed == 0.0 else np.sign(speed)
            after = 0.0 if holds else speed + h * (force - FRICTION_V * direction) / INERTIA_V
            after = 0.0 if after * speed < 0.0 else after  # it stops before it turns round
            place, speed = place + h * (speed + after) / 2.0, after
    seen = np.round(np.array(places) / STEP_RAD) * STEP_RAD
    return Log(f"bench{seed}", t, voltage, seen[:, None], (name,), rates={})


@pytest.fixture(scope="module")
def held_out():
    """A drive that friction all but holds: it moves for a moment at a time."""
    return bench(2, 0.5)


def test_every_stretch_of_stick_and_slip_is_followed_from_a_start_that_its_steps_leave_open(held_out):
    model = Model.parse(TOML + 'effects = ["viscous_drive", "coulomb_drive"]\n')
    problem = prepare(model, [bench(1, 2.0)], [held_out], lean=True)
    part = problem.data.validation[0].part
    _, residual = prediction_error(problem.simulator, part, TRUE)
    errors = [float(np.sqrt(np.nanmean(residual[a:b] ** 2))) for a, b in part.bounds]
    assert len(errors) > 20 and 0.8 < max(errors) < 1.5, errors


def test_a_start_in_the_wrong_direction_is_left_by_shorter_steps_and_alone_as_among_others(held_out):
    from wheelpend.estimation.parameters import kernel_parameters

    model = Model.parse(TOML + 'effects = ["viscous_drive", "coulomb_drive"]\n')
    problem = prepare(model, [bench(1, 2.0)], [held_out], lean=True)
    part, module = problem.data.validation[0].part, problem.module
    parameters = kernel_parameters(module, TRUE, part.log)
    begun = initial_states(module, part)
    begun[:, 1] += 0.3  # rad/s: wrong, and for slow ones in the wrong direction
    together, linear = fit_states(problem.simulator, part, begun, parameters)
    ends = linear.gram[:, -1, -1]
    for k in range(len(begun)):
        alone, own = fit_states(problem.simulator, part.chosen(np.array([k])), begun[k : k + 1], parameters)
        assert alone[0] == pytest.approx(together[k]) and own.gram[0, -1, -1] == pytest.approx(ends[k])
    assert np.median(ends / np.diff(part.bounds)[:, 0]) < 1.2


@pytest.mark.slow
def test_dry_friction_is_named_and_not_a_spring_so_stiff_that_it_is_dry_friction(held_out):
    found = diagnose(Model.parse(TOML), [bench(1, 2.0)], [held_out])
    assert set(found.steps) == {"coulomb_drive", "viscous_drive"}


@pytest.fixture(scope="module")
def rippled():
    """A shaft that its magnets pull to 14 places a turn, under a drive that turns it some times."""
    return [bench(seed, 3.0, 16.0, 0.2, "theta_m") for seed in (3, 4)]


def test_a_friction_that_the_fit_has_hides_no_ripple():
    log = bench(3, 2.0, 16.0, 0.06, "theta_m")
    problem = prepare(Model.parse(f'plant = "shaft"\nsensors.step.theta_m = {STEP_RAD}\n'), [log], use_all=True)
    plain = {"X1": INERTIA_V, "X2": VISCOUS_V}
    found = [
        strongest_ripple(problem, Fit.at({**plain, **friction}), "drive", 0.03)[0]
        for friction in ({"coulomb_drive.torque": FRICTION_V}, {})
    ]
    assert found[0] == pytest.approx(RIPPLES, abs=0.3) and abs(found[1] - RIPPLES) > 1.0


@pytest.mark.slow
def test_friction_and_ripple_of_a_shaft_are_both_named_with_their_sizes(rippled):
    found = explain(Model.parse(f'plant = "shaft"\nsensors.step.theta_m = {STEP_RAD}\n'), rippled[:1], rippled[1:])
    assert set(found.effects) == {"coulomb_drive", "cogging"} and found.error < 1.1 * found.problem.floor
    sizes = found.parameters
    assert sizes["coulomb_drive.torque"].value == pytest.approx(FRICTION_V, rel=0.02)
    assert sizes["cogging.periods"].value == pytest.approx(RIPPLES, rel=0.001)
    assert math.hypot(sizes["cogging.sine"].value, sizes["cogging.cosine"].value) == pytest.approx(0.2, rel=0.05)
