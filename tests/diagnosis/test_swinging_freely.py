"""Damping of a pendulum that a camera watches is named, though no single half second shows it over the noise."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.bench import swing_log
from wheelpend import Log, Model, diagnose, explain
from wheelpend.diagnosis.verdict import Diagnosis

INERTIA = 0.0244  # s²: of the link over the torque that gravity has on it where it is level
RATE_HZ, SPAN_S, BEGIN_RAD, NOISE_RAD = 60.0, 40.0, 1.1, 0.002
MODEL = 'plant = "pendulum"\neffects = []\n'
SHARPNESS_S = 1e3  # 1/(rad/s): of a dry friction that the integrator can follow


def swinging_log(
    viscous: float = 0.0, dry: float = 0.0, quadratic: float = 0.0, scale: float = 0.0, begin: float = BEGIN_RAD
) -> Log:
    """A pendulum let go from 63 degrees, by SciPy's integrator, with the scale and the white noise of the sensor."""

    def rates(_, state):
        angle, speed = state
        drag = viscous * speed + dry * np.tanh(SHARPNESS_S * speed) + quadratic * speed * abs(speed)
        return speed, -(np.sin(angle) + drag) / INERTIA

    t = np.arange(0.0, SPAN_S, 1.0 / RATE_HZ)
    swing = solve_ivp(rates, (0.0, SPAN_S), (begin, 0.0), "LSODA", t, rtol=1e-9, atol=1e-9, max_step=0.02)
    seen = (1.0 + scale) * swing.y[0] + NOISE_RAD * np.random.default_rng(7).standard_normal(t.size)
    return Log("camera", t, np.zeros(t.size), seen[:, None], ("theta_1",), rates={})


def stopping_log(dry: float, zero: float) -> Log:
    """The same with dry friction that holds it where it stops, and a zero that is off: half a swing after the other."""
    t, angle, begin, now = np.arange(0.0, SPAN_S, 1.0 / RATE_HZ), BEGIN_RAD, 1e-6, 0.0
    seen = np.empty_like(t)
    while abs(np.sin(angle)) > dry:
        way = -np.sign(angle)

        def rates(_, state, way=way):
            return state[1], -(np.sin(state[0]) + dry * way) / INERTIA

        def stops(_, state):
            return state[1]

        stops.terminal, stops.direction = True, -way
        push = rates(0.0, (angle, 0.0))[1]
        first = (angle + 0.5 * push * begin**2, push * begin)
        swing = solve_ivp(rates, (begin, SPAN_S), first, rtol=1e-9, atol=1e-11, events=stops, dense_output=True)
        during = (t >= now) & (t <= now + swing.t[-1])
        seen[during] = swing.sol(np.maximum(t[during] - now, begin))[0]
        now, angle = now + swing.t[-1], swing.y[0, -1]
    seen[t >= now] = angle
    seen += zero + NOISE_RAD * np.random.default_rng(7).standard_normal(t.size)
    return Log("stopping", t, np.zeros(t.size), seen[:, None], ("theta_1",), rates={})


@lru_cache
def diagnosed(**sizes: float) -> Diagnosis:
    return diagnose(Model.parse(MODEL), [swinging_log(**sizes)])


def test_a_pendulum_without_damping_keeps_its_swing_and_lacks_nothing():
    assert np.abs(swinging_log().measured[-120:]).max() == pytest.approx(BEGIN_RAD, abs=0.02)
    found = diagnosed()
    assert found.verdict == "nothing_missing" and not found.named


def test_viscous_damping_is_named_with_its_size_where_every_prediction_is_already_as_good_as_the_noise():
    found = diagnosed(viscous=0.004)
    assert found.error < 1.1 * found.noise_floor and found.verdict == "effect_missing"
    assert found.named[0].effect == "viscous_drive"
    assert found.named[0].coefficients["coefficient"] == pytest.approx(0.004, rel=0.03)


@pytest.mark.slow
def test_a_sensor_with_another_scale_than_it_should_have_is_told_by_gravity():
    ladder = explain(Model.parse(MODEL), [swinging_log(viscous=0.004, scale=0.045)])
    assert {step.effect for step in ladder.steps} == {"viscous_drive", "link_scale"}
    assert ladder.parameters["link_scale.scale"].value == pytest.approx(0.045, abs=0.002)
    assert ladder.parameters["viscous_drive.coefficient"].value == pytest.approx(0.004, rel=0.05)


def test_where_the_pendulum_stops_its_log_is_judged_until_then_though_it_stands_still_for_most_of_it():
    ladder = explain(Model.parse(MODEL), [stopping_log(dry=0.03, zero=0.02)])
    assert [step.effect for step in ladder.steps] == ["coulomb_drive", "encoder_zero"]
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.03, rel=0.02)
    assert ladder.parameters["encoder_zero.bias"].value == pytest.approx(0.02, abs=0.001)
    assert any("tells no law from another, and is left out" in w for w in ladder.warnings)
    assert ladder.verdict == "nothing_missing" and not any(step.equivalent_to for step in ladder.steps)


@pytest.fixture(scope="module")
def magnetic():
    """A wide swing that a magnetic encoder reads, its magnet off the axis: errors of once and twice a turn."""
    log = swinging_log(viscous=0.006, begin=2.6)
    angle = log.measured[:, 0]
    seen = angle + 0.02 * np.sin(angle) - 0.01 * np.cos(angle) - 0.03 * np.sin(2.0 * angle) + 0.01
    return Log("magnetic", log.t, np.zeros(log.t.size), seen[:, None], ("theta_1",), rates={})


@pytest.mark.slow
def test_a_magnetic_encoder_whose_magnet_is_off_the_axis_is_named_with_its_errors(magnetic):
    ladder = explain(Model.parse(MODEL), [magnetic])
    assert {step.effect for step in ladder.steps} == {"link_nonlinearity", "viscous_drive"}
    sizes = {"zero": 0.01, "sine": 0.02, "cosine": -0.01, "second_sine": -0.03, "second_cosine": 0.0}
    for name, size in sizes.items():
        found = ladder.parameters[f"link_nonlinearity.{name}"]
        assert found.value == pytest.approx(size, abs=max(4.0 * found.sigma, 1e-3)) and found.sigma < 0.003
    assert ladder.parameters["viscous_drive.coefficient"].value == pytest.approx(0.006, rel=0.05)


@pytest.mark.slow
def test_three_frictions_and_a_zero_are_all_found_with_their_sizes_where_two_thirds_of_a_log_are_at_rest():
    log = swing_log(200.0, 15.0, 4096, 1.0, 0.01029, zero=0.0047, viscous=0.0034, dry=0.0102, quadratic=0.00091)
    ladder = explain(Model.parse(MODEL), [log])
    assert {s.effect for s in ladder.steps} == {"viscous_drive", "coulomb_drive", "quadratic_drive", "encoder_zero"}
    assert ladder.verdict == "nothing_missing"
    sizes = {
        "viscous_drive.coefficient": 0.0034,
        "coulomb_drive.torque": 0.0102,
        "quadratic_drive.coefficient": 0.00091,
    }
    for name, size in {**sizes, "encoder_zero.bias": 0.0047}.items():
        found = ladder.parameters[name]
        assert found.value == pytest.approx(size, abs=4.0 * found.sigma) and found.sigma < 0.2 * size


@pytest.mark.slow
def test_what_leaves_more_than_noise_in_held_out_data_is_left_for_what_was_likelier():
    log = swing_log(50.0, 4.0, 2048, 0.4, 0.0482, zero=0.0025, viscous=0.0041)
    ladder = explain(Model.parse(MODEL), [log])
    drag, zero = ladder.steps
    assert {drag.effect, *drag.equivalent_to} >= {"viscous_drive"} and drag.effect != "coulomb_drive"
    assert zero.effect == "encoder_zero" and ladder.verdict != "unexplained"


@pytest.mark.slow
def test_dry_friction_is_found_beside_viscous_where_a_force_of_a_thousandth_of_the_drive_is_all_it_leaves():
    log = swing_log(200.0, 8.0, 1024, 1.5, 0.04, viscous=0.004, dry=0.004)
    ladder = explain(Model.parse(MODEL), [log])
    assert [s.effect for s in ladder.steps] == ["viscous_drive", "coulomb_drive"]
    assert ladder.parameters["viscous_drive.coefficient"].value == pytest.approx(0.004, rel=0.1)
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.004, rel=0.2)


@pytest.mark.slow
def test_a_zero_is_told_from_a_ripple_of_the_torque_before_friction_is_there_and_behind_it():
    ladder = explain(Model.parse(MODEL), [stopping_log(dry=0.01, zero=0.02)])
    assert {step.effect for step in ladder.steps} == {"encoder_zero", "coulomb_drive"}
    assert ladder.parameters["encoder_zero.bias"].value == pytest.approx(0.02, abs=0.001)
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.01, rel=0.06)


@pytest.mark.slow
def test_dry_friction_and_drag_are_named_though_viscous_friction_alone_resembles_both():
    found = diagnosed(dry=0.004, quadratic=0.0004)
    assert set(found.steps) == {"coulomb_drive", "quadratic_drive"}
    first = found.named[0]
    largest = {"coulomb_drive": (0.0035, 0.009), "quadratic_drive": (0.00035, 0.0009)}[first.effect]
    assert largest[0] < next(iter(first.coefficients.values())) < largest[1]  # alone it stands for the other too
