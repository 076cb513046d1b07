"""Every law of the library's kernels against its closed form, typed by hand from docs/effects.md."""

import numpy as np
import pytest

from tests.support import CONSTANTS, X
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.logs.log import Log

CHANNELS = ("theta_w", "theta_p", "dtheta_p")
T, VOLTAGE, ORIGIN = 3.0, 6.0, 0.15
STATES = [np.array([0.4, 0.2, 1.5, -0.7]), np.array([-1.1, -0.3, -0.9, 0.5])]  # forward and backward
BOTH = np.array([1.0, -1.0])  # what a force between the wheel and the body does to each


def on_drive(law):
    """Forces on wheel and body of a resistance in the drive, by its angle and slip."""
    return lambda x, v: -law(x[0] - x[1], x[2] - x[3]) * BOTH


def on_wheel(law):
    return lambda x, v: np.array([-law(x[0], x[2]), 0.0])


def by_voltage(law):
    """What another voltage than the commanded one adds."""
    return lambda x, v: (law(v) - v) * BOTH


LAWS = {  # sizes, and the forces on wheel and body [V] in a state and under a voltage
    "coulomb_drive": ({"torque": 0.3}, on_drive(lambda a, s: 0.3 * np.sign(s))),
    "coulomb_asymmetry": ({"torque": 0.1}, on_drive(lambda a, s: 0.1)),
    "viscous_asymmetry": ({"coefficient": 0.02}, on_drive(lambda a, s: 0.02 * abs(s))),
    "quadratic_drive": ({"coefficient": 0.05}, on_drive(lambda a, s: 0.05 * s * abs(s))),
    "load_friction": (  # of the torque that the motor passes on: the voltage less that of its turning
        {"share": 0.1},
        lambda x, v: -0.1 * abs(v - X["X7"] * (x[2] - x[3])) * np.sign(x[2] - x[3]) * BOTH,
    ),
    "stribeck_drive": (
        {"static": 0.5, "sliding": 0.2, "speed": 2.0},
        on_drive(lambda a, s: (0.2 + 0.3 * np.exp(-((s / 2.0) ** 2))) * np.sign(s)),
    ),
    "cogging": (
        {"sine": 0.2, "cosine": 0.1, "periods": 7.0},
        on_drive(lambda a, s: -(0.2 * np.sin(7 * a) + 0.1 * np.cos(7 * a))),
    ),
    "coasting_driver": ({"rate": 0.02}, lambda x, v: -0.02 * abs(v) * (x[2] - x[3]) * BOTH),
    "ground_viscous": ({"coefficient": 0.05}, on_wheel(lambda a, v: 0.05 * v)),
    "rolling_resistance": ({"torque": 0.2}, on_wheel(lambda a, v: 0.2 * np.sign(v))),
    "wheel_runout": ({"sine": 0.1, "cosine": 0.05}, on_wheel(lambda a, v: -(0.1 * np.sin(a) + 0.05 * np.cos(a)))),
    "air_drag": ({"coefficient": 0.02}, on_wheel(lambda a, v: 0.02 * v * abs(v))),
    "tether_spring": ({"stiffness": 0.05}, on_wheel(lambda a, v: 0.05 * (a - ORIGIN))),
    "body_damping": ({"coefficient": 0.05}, lambda x, v: np.array([0.0, -0.05 * x[3]])),
    "voltage_saturation": ({"limit": 4.0}, by_voltage(lambda v: np.clip(v, -4.0, 4.0))),
    "voltage_dead_zone": ({"threshold": 0.3}, by_voltage(lambda v: np.sign(v) * (abs(v) - 0.3))),
    "voltage_sag": ({"rate": 0.02}, by_voltage(lambda v: v * (1.0 - 0.02 * T))),
    "voltage_asymmetry": ({"ratio": 0.05}, by_voltage(lambda v: v * (1.0 + 0.05 * np.sign(v)))),
    "voltage_offset": ({"offset": 0.2}, by_voltage(lambda v: v + 0.2)),
}


def parameters_with(library, effect, sizes):
    log = Log("", np.zeros(1), np.zeros(1), np.array([[ORIGIN, 0.0, 0.0]]), CHANNELS)
    return kernel_parameters(library, {**X, **CONSTANTS, **{f"{effect}.{n}": v for n, v in sizes.items()}}, log)


def forces_beside_the_papers(library, parameters, x, v):
    """What the accelerations say acts on wheel and body, beside the paper's equations (19), (20)."""
    c, s, (_, _, dw, dp) = np.cos(x[1]), np.sin(x[1]), x
    mass = np.array([[X["X1"] + X["X2"], X["X3"] * c - X["X2"]], [X["X3"] * c - X["X2"], X["X4"] + X["X2"]]])
    drive = v - X["X6"] * dw + X["X7"] * dp
    return mass @ library.acceleration(T, x, v, parameters) - [
        drive + X["X3"] * dp**2 * s, -drive + X["X5"] * s]  # fmt: skip


@pytest.mark.parametrize("effect", sorted(LAWS))
def test_a_force_is_its_closed_form_whichever_way_the_machine_moves(library, effect):
    sizes, forces = LAWS[effect]
    parameters = parameters_with(library, effect, sizes)
    for x, v in zip(STATES, (VOLTAGE, -VOLTAGE), strict=True):
        assert forces_beside_the_papers(library, parameters, x, v) == pytest.approx(forces(x, v), rel=1e-9, abs=1e-12)


def test_a_push_acts_forward_on_the_wheel_from_its_start_to_its_end(library):
    x, forward = STATES[0], np.array([0.5, 0.0])
    for start, end, pushed in ((2.0, 4.0, True), (3.5, 4.0, False), (1.0, 2.5, False)):
        sizes = {"start": start, "end": end, "torque": 0.5}
        found = forces_beside_the_papers(library, parameters_with(library, "external_push", sizes), x, VOLTAGE)
        assert found == pytest.approx(pushed * forward, abs=1e-12)


def test_a_centre_of_mass_ahead_of_the_line_is_a_body_that_leans_by_as_much(library, lean):
    parameters, plain = parameters_with(library, "com_offset", {"angle": 0.03}), np.array(list(X.values()))
    for x in STATES:
        leaning = lean.acceleration(T, x + 0.03 * np.eye(4)[1], VOLTAGE, plain)
        assert library.acceleration(T, x, VOLTAGE, parameters) == pytest.approx(leaning, rel=1e-9)


def test_a_slope_turns_what_couples_wheel_and_body_and_pulls_the_weight_downhill(library):
    slope, x = 0.05, STATES[0]
    parameters = parameters_with(library, "slope", {"angle": slope})
    weight = (X["X1"] - 2.0 * CONSTANTS["J_w"] / CONSTANTS["alpha"]) * CONSTANTS["g"] / CONSTANTS["R"]
    coupling, (_, pitch, dw, dp) = X["X3"] * np.cos(x[1] + slope) - X["X2"], x
    mass = np.array([[X["X1"] + X["X2"], coupling], [coupling, X["X4"] + X["X2"]]])
    drive = VOLTAGE - X["X6"] * dw + X["X7"] * dp
    right = [drive + X["X3"] * dp**2 * np.sin(pitch + slope) - weight * np.sin(slope),
             -drive + X["X5"] * np.sin(pitch)]  # fmt: skip
    assert library.acceleration(T, x, VOLTAGE, parameters) == pytest.approx(np.linalg.solve(mass, right), rel=1e-9)


READINGS = {  # sizes, and the readings of wheel, pitch and gyro
    "encoder_eccentricity": (
        {"sine": 0.01, "cosine": 0.005},
        lambda w, p, r: (w + 0.01 * np.sin(w) + 0.005 * np.cos(w), p, r),
    ),
    "encoder_scale": ({"scale": 0.05}, lambda w, p, r: (1.05 * w, p, r)),
    "pitch_scale": ({"scale": 0.05}, lambda w, p, r: (w, 1.05 * p, r)),
    "gyro_scale": ({"scale": 0.05}, lambda w, p, r: (w, p, 1.05 * r)),
    "imu_bias": ({"bias": 0.02}, lambda w, p, r: (w, p + 0.02, r)),
    "gyro_bias": ({"bias": 0.02}, lambda w, p, r: (w, p, r + 0.02)),
}


@pytest.mark.parametrize("effect", sorted(READINGS))
def test_a_sensor_reads_its_closed_form(library, effect):
    sizes, readings = READINGS[effect]
    found, parameters = np.zeros(3), parameters_with(library, effect, sizes)
    for x in STATES:
        library.read_sensors(T, x, parameters, found)
        assert found == pytest.approx(readings(x[0], x[1], x[3]), rel=1e-12)


def test_a_command_acts_late_by_exactly_the_delay_whatever_part_of_a_sample_it_is(library, lean):
    t, delay = np.arange(101) * 1e-3, 0.0133
    command = np.where(np.arange(101) < 40, 1.0, -3.0)
    late = library.simulate(t, command, STATES[0], parameters_with(library, "actuator_delay", {"delay": delay}), 1e-3)
    switched = np.sort(np.append(t, 0.04 + delay))
    acting = np.where(switched < 0.04 + delay - 1e-9, 1.0, -3.0)
    exact = lean.simulate(switched, acting, STATES[0], np.array(list(X.values())), 1e-4)
    assert np.abs(late - np.delete(exact, np.searchsorted(switched, 0.04 + delay - 1e-9), axis=0)).max() < 1e-8
