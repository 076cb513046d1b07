"""The generated kernels against physics and against independent numerics."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import derive
from tests.support import CONSTANTS, X, energy, simulated
from wheelpend.estimation.parameters import kernel_parameters

HIDDEN = {
    "coulomb_drive.torque": 0.3, "rolling_resistance.torque": 0.1, "actuator_delay.delay": 0.0013, "slope.angle": 0.02,
    "com_offset.angle": 0.01, "voltage_dead_zone.threshold": 0.2, "cogging.sine": 0.1, "cogging.cosine": 0.1,
    "cogging.periods": 7.0, "quadratic_drive.coefficient": 0.01, "voltage_sag.rate": 0.01, "gyro_scale.scale": 0.1,
    "winding_inductance.time_constant": 0.003, "stribeck_drive.static": 0.2, "stribeck_drive.sliding": 0.1,
    "stribeck_drive.speed": 0.7, "coulomb_asymmetry.torque": 0.05, "viscous_asymmetry.coefficient": 0.01,
    "voltage_saturation.limit": 9.0, "wheel_runout.sine": 0.1, "wheel_runout.cosine": 0.05, "pitch_scale.scale": 0.05,
    "payload_step.time": 99.0, "external_push.start": 99.0, "external_push.end": 99.0,  # never
    "presliding_drive.torque": 0.1, "presliding_drive.stiffness": 50.0,
    "encoder_scale.scale": 0.02, "encoder_eccentricity.sine": 0.01, "encoder_eccentricity.cosine": 0.005,
}  # fmt: skip


def test_without_drive_and_friction_energy_is_kept(lean):
    values = {**X, "X6": 0.0, "X7": 0.0}
    t = np.arange(2001) * 1e-3
    states = lean.simulate(t, np.zeros_like(t), np.array([0.0, 0.3, 0.5, 0.0]), np.array(list(values.values())), 0.001)
    assert np.ptp(energy(states, values)) < 1e-9 * abs(energy(states, values)[0])


def test_a_released_body_falls(lean):
    t = np.arange(1001) * 1e-3
    states = lean.simulate(t, np.zeros_like(t), np.array([0.0, 0.01, 0.0, 0.0]), np.array(list(X.values())), 0.001)
    assert np.all(np.diff(states[:, 1]) > 0)


def test_the_simulation_agrees_with_an_adaptive_integrator_on_equations_typed_by_hand(lean):
    def motion(t, s):
        pitch, dw, dp = s[1:]
        c, drive = np.cos(pitch), np.sin(3 * 0.0) - X["X6"] * dw + X["X7"] * dp
        mass = [[X["X1"] + X["X2"], X["X3"] * c - X["X2"]], [X["X3"] * c - X["X2"], X["X4"] + X["X2"]]]
        right = [drive + X["X3"] * dp**2 * np.sin(pitch), -drive + X["X5"] * np.sin(pitch)]
        return [dw, dp, *np.linalg.solve(mass, right)]

    t, start = np.arange(501) * 1e-3, np.array([0.2, 0.1, 1.0, -0.5])
    states = lean.simulate(t, np.zeros_like(t), start, np.array(list(X.values())), 0.001)
    reference = solve_ivp(motion, (0, 0.5), start, rtol=1e-10, atol=1e-12, t_eval=t).y.T
    assert np.abs(states - reference).max() < 1e-6


@pytest.mark.parametrize("lag", [2e-4, 1e-3, 0.02])
def test_a_lagging_input_agrees_with_an_adaptive_integrator_however_short_the_lag(library, lean, lag):
    t, start = np.arange(200) * 1e-3, np.array([0.1, 0.05, 1.0, -0.3])
    command = np.repeat(np.random.default_rng(0).normal(size=20) * 5, 10)
    parameters = kernel_parameters(library, {**X, "winding_inductance.time_constant": lag}, simulated(duration=3.0))
    plain, state, reference = np.array(list(X.values())), np.r_[start, command[0]], [start]
    for voltage in command[:-1]:

        def motion(_, s, voltage=voltage):
            return np.r_[s[2:4], lean.acceleration(0.0, s[:4].copy(), s[4], plain), (voltage - s[4]) / lag]

        state = solve_ivp(motion, (0, 1e-3), state, method="LSODA", rtol=1e-10, atol=1e-12).y[:, -1]
        reference.append(state[:4])
    states = library.simulate(t, command, start, parameters, 0.001)
    assert np.abs(states - np.array(reference)).max() < 1e-6


def test_a_short_lag_and_a_short_delay_have_the_same_sensitivity(library):
    log = simulated(duration=3.0)
    columns = np.array([library.LAG, library.DELAY])
    parameters = kernel_parameters(library, {**X, **CONSTANTS}, log)
    found = library.sensitivities(
        log.t[:400], log.voltage[:400], np.array([0.0, 0.05, 0.5, 0.0]), parameters, columns, 1e-3
    )[2]
    assert np.abs(found[:, :, 4] - found[:, :, 5]).max() < 1e-3 * np.abs(found[:, :, 5]).max()


def test_sensitivities_agree_with_finite_differences_through_stick_slip_and_delays(library):
    log = simulated(duration=3.0, noise=False, **{k.replace(".", "__"): v for k, v in HIDDEN.items()})
    parameters, cut = kernel_parameters(library, {**X, **CONSTANTS, **HIDDEN}, log), slice(0, 700)
    start, columns = np.array([0.0, 0.01, 0.1, 0.05]), np.arange(library.FITTED)

    def readings(changed, state=start):
        return library.sensitivities(log.t[cut], log.voltage[cut], state, changed, columns[:0], 0.002)[1]

    exact = library.sensitivities(log.t[cut], log.voltage[cut], start, parameters, columns, 0.002)[2]
    for column, name in enumerate(library.PARAMETERS[: library.FITTED]):
        if column == library.SENSOR_DELAY:
            continue  # at zero a delay has one side only; test_states looks at others
        step = np.zeros_like(parameters)
        step[column] = 1e-7 if column in (library.DELAY, library.LAG) else 1e-6
        numeric = (readings(parameters + step) - readings(parameters - step)) / (2 * step[column])
        # friction that falls within 0.7 rad/s is steep for steps of 2 ms; without it the two agree to 2e-5
        assert np.abs(numeric - exact[:, :, 4 + column]).max() < 1e-4 * np.abs(numeric).max() + 1e-9, name


def test_the_same_call_gives_the_same_bits_and_any_number_of_columns_the_same_derivatives(library):
    log = simulated(duration=3.0)
    parameters, start = kernel_parameters(library, {**X, **CONSTANTS, **HIDDEN}, log), np.array([0.0, 0.01, 0.1, 0.05])
    columns = np.tile(np.arange(library.FITTED), 2)  # more than there are parameters, in no multiple of the lanes

    def derivatives(columns):
        return library.sensitivities(log.t[:200], log.voltage[:200], start, parameters, columns, 0.002)[2]

    together = derivatives(columns)
    assert together.tobytes() == derivatives(columns).tobytes()
    for column in (0, library.LAG, library.DELAY, library.FITTED - 1):
        alone = derivatives(np.array([column]))[:, :, 4]
        assert np.array_equal(alone, together[:, :, 4 + column])
        assert np.array_equal(alone, together[:, :, 4 + library.FITTED + column])


def test_both_surfaces_at_rest_hold_the_machine_still(library):
    held = {"coulomb_drive.torque": 5.0, "rolling_resistance.torque": 5.0}
    parameters = kernel_parameters(library, {**X, **CONSTANTS, **held}, simulated(duration=3.0))
    t, start = np.arange(101) * 1e-3, np.array([0.0, 0.05, 0.0, 0.0])
    assert np.abs(library.acceleration(0.0, start, 2.0, parameters)).max() < 1e-12
    assert np.abs(library.simulate(t, np.full_like(t, 2.0), start, parameters, 0.001) - start).max() < 1e-12


def test_vanishing_dry_friction_is_none(library):
    t, start = np.arange(501) * 1e-3, np.array([0.0, 0.05, 0.4, -0.3])
    voltage = np.sin(20 * t)
    smooth, rough = (
        kernel_parameters(library, {**X, **CONSTANTS, "coulomb_drive.torque": torque}, simulated(duration=3.0))
        for torque in (0, 1e-13)
    )
    difference = library.simulate(t, voltage, start, smooth, 1e-3) - library.simulate(t, voltage, start, rough, 1e-3)
    assert np.abs(difference).max() < 1e-9


def test_dry_friction_holds_the_gearbox_completely_still(library):
    parameters = kernel_parameters(library, {**X, **CONSTANTS, "coulomb_drive.torque": 5.0}, simulated(duration=3.0))
    t = np.arange(301) * 1e-3
    states = library.simulate(t, np.full_like(t, 0.5), np.array([0.0, 0.05, 0.0, 0.0]), parameters, 0.001)
    assert np.abs(states[:, 2] - states[:, 3]).max() < 1e-9
    assert states[-1, 1] > 0.05


@pytest.mark.parametrize(
    "effect", [e for e in derive.effects.EFFECT_LIBRARY.values() if e.dissipates], ids=lambda e: e.name
)
def test_friction_and_drag_never_add_energy(library, effect):
    sizes = {f"{effect.name}.{p.name}": p.typical for p in effect.parameters}
    if not set(sizes) <= set(library.PARAMETERS):
        absorbed = set(sizes) <= set(library.ABSORBED)
        pytest.skip(
            "is part of the plant's own parameters" if absorbed else "test_plants, test_states: it is elsewhere"
        )
    values = {**X, **CONSTANTS, "X6": 0.0, "X7": 0.0, **sizes}
    t = np.arange(1501) * 1e-3
    states = library.simulate(
        t,
        np.zeros_like(t),
        np.array([0.0, 0.1, 2.0, -1.0]),
        kernel_parameters(library, values, simulated(duration=3.0)),
        0.001,
    )
    stored = values["presliding_drive.torque"] ** 2 / values["presliding_drive.stiffness"] if effect.carries else 0.0
    assert np.diff(energy(states, values)).max() < 1e-9 + stored / 2  # a contact that winds up gives that back


def test_the_filtered_regressor_reproduces_the_filtered_voltage_on_ideal_data(lean):
    log = simulated(duration=5.0, noise=False)
    parameters = np.array(list(X.values()))
    states = lean.simulate(log.t, log.voltage, np.zeros(4), parameters, 0.001)
    for tau in (0.014, 0.14, 2.0):
        left, right = lean.filter_regressor(log.t, states, log.voltage, parameters, tau, 1.3 * tau, True, np.zeros(4))
        assert np.abs(left - right @ parameters).max() < 2e-3 * np.abs(left).max()


def test_recursive_least_squares_ends_at_the_batch_solution(lean):
    rng = np.random.default_rng(1)
    rows, truth = rng.normal(size=(200, 7)), np.arange(1.0, 8.0)
    estimate, covariance = np.zeros(7), 1e8 * np.eye(7)
    for row in rows:
        lean.recursive_update(estimate, covariance, row, row @ truth, 1.0)
    assert np.abs(estimate - truth).max() < 1e-6


def test_the_acceleration_satisfies_the_regressor(lean):
    state, parameters = np.array([0.3, 0.2, 1.0, -0.7]), np.array(list(X.values()))
    rate = lean.acceleration(0.0, state, 2.0, parameters)
    tau, phi = lean.regressor(0.0, state, rate, 2.0, parameters)
    assert np.abs(phi @ parameters - tau).max() < 1e-12


def test_the_lean_kernel_and_the_library_simulate_the_same(lean, library):
    log = simulated(duration=3.0)
    lean_states = lean.simulate(log.t, log.voltage, np.zeros(4), np.array(list(X.values())), 0.001)
    full = library.simulate(log.t, log.voltage, np.zeros(4), kernel_parameters(library, {**X, **CONSTANTS}, log), 0.001)
    assert np.abs(lean_states - full).max() < 1e-9
