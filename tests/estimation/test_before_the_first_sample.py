"""What was commanded before a log begins, or in a gap, has no weight in what is found.

The logs come from an integration written here, of the paper's eqs. 19 and 20 with a motor that lags; it shares no code
with the kernels. The robot rests at 0 V until the log begins, with some 17 V.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support import CHANNELS, CONSTANTS, X
from wheelpend import Model, diagnose
from wheelpend.estimation import data
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.starts import best_start
from wheelpend.logs.log import Log

DT, SUBSTEPS = 1e-3, 2  # s between samples, and Runge-Kutta steps in each
QUANTUM, NOISE = 2 * np.pi / 60000, np.array([0.0, np.radians(0.5), np.radians(0.5)])  # rad of the encoder; rad, rad/s


def motion(state, volts, lag):
    """Time derivative of wheel angle, pitch, their rates and the voltage at the motor."""
    _, pitch, dw, dp, acting = state
    drive = acting - X["X6"] * dw + X["X7"] * dp
    coupling = -X["X2"] + X["X3"] * np.cos(pitch)
    wheel, body = X["X1"] + X["X2"], X["X2"] + X["X4"]
    first, second = drive + X["X3"] * dp**2 * np.sin(pitch), X["X5"] * np.sin(pitch) - drive
    det = wheel * body - coupling**2
    ddw, ddp = (body * first - coupling * second) / det, (wheel * second - coupling * first) / det
    return np.array([dw, dp, ddw, ddp, (volts - acting) / lag if lag else 0.0])


def advance(state, volts, h, lag):
    """One classical Runge-Kutta step; without a lag the command acts at once."""
    if not lag:
        state = np.append(state[:4], volts)
    a = motion(state, volts, lag)
    b = motion(state + h / 2 * a, volts, lag)
    c = motion(state + h / 2 * b, volts, lag)
    d = motion(state + h * c, volts, lag)
    return state + h / 6 * (a + 2 * b + 2 * c + d)


@lru_cache
def machine(delay_samples=0, lag=0.0, duration=8.0, seed=0, noise=1.0):
    """A closed-loop log whose commands act so many samples late, through a lag [s], after rest."""
    rng, count = np.random.default_rng(seed), round(duration / DT) + 1
    t = np.arange(count) * DT
    reference = np.radians(6.0) * np.cos(1.7 * t) + np.radians(4.0) * np.sin(4.3 * t)
    slope = np.gradient(reference, t)
    state, integral, readings, commands = np.zeros(5), 0.0, np.zeros((count, 3)), np.zeros(count)
    for k in range(count):
        readings[k] = state[:3] * [1, 1, 0] + [0, 0, state[3]] + noise * NOISE * rng.normal(size=3)
        readings[k, 0] = QUANTUM * np.round(readings[k, 0] / QUANTUM)
        error = reference[k] - readings[k, 1]
        integral += error * DT
        commands[k] = -168.0 * error - 800.0 * integral - 8.8 * (slope[k] - readings[k, 2])
        late = commands[k - delay_samples] if k >= delay_samples else 0.0
        for _ in range(SUBSTEPS):
            state = advance(state, late, DT / SUBSTEPS, lag)
    return Log("machine.csv", t, commands, readings, CHANNELS)


def fitted(log, effect, start, holdout=()):
    """Value and standard error of the first parameter of an effect, the error of the fit, and the problem."""
    model = Model.default().with_effects([effect])
    problem, values = best_start(prepare(model, [log], holdout, use_all=not holdout))
    name = {"actuator_delay": "actuator_delay.delay", "winding_inductance": "winding_inductance.time_constant"}[effect]
    found = fit_model(problem, {**values, name: start}, free_names(problem, model.effects))
    place = found.place(name)
    return found.values[name], np.sqrt(found.covariance[place, place]), found.error, problem


def without(log, first, last):
    """The log without these samples."""
    keep = np.r_[0:first, last : len(log)]
    return replace(log, t=log.t[keep], voltage=log.voltage[keep], measured=log.measured[keep])


def test_a_delay_comes_out_as_it_is_where_the_log_starts_with_a_jump():
    log = machine(delay_samples=6)
    assert abs(log.voltage[0]) > 10.0
    delay, sigma, error, _ = fitted(log, "actuator_delay", 0.004)
    assert 1e-7 < sigma < 2e-5 and abs(delay - 0.006) < 3 * sigma
    assert error == pytest.approx(1.0, abs=0.03)


def test_a_lag_comes_out_as_it_is_where_the_log_starts_with_a_jump():
    found, sigma, error, _ = fitted(machine(lag=0.007), "winding_inductance", 0.004)
    assert 1e-7 < sigma < 3e-5 and abs(found - 0.007) < 3 * sigma
    assert error == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("kind", ["missing samples", "missing commands"])
def test_a_delay_is_right_on_a_log_with_a_gap(kind):
    log = machine(delay_samples=6)
    if kind == "missing samples":
        log = without(log, 3000, 4203)
    else:
        voltage = log.voltage.copy()
        voltage[3000:3004] = np.nan
        log = replace(log, voltage=voltage)
    delay, sigma, error, _ = fitted(log, "actuator_delay", 0.004)
    assert abs(delay - 0.006) < 3 * sigma and error == pytest.approx(1.0, abs=0.06)


@pytest.mark.slow
def test_a_delay_is_right_where_commands_are_missing_all_the_time_and_the_log_says_so():
    log = machine(delay_samples=6)
    voltage = log.voltage.copy()
    voltage[::150] = np.nan
    delay, sigma, error, problem = fitted(replace(log, voltage=voltage), "actuator_delay", 0.004)
    assert abs(delay - 0.006) < 3 * sigma and error == pytest.approx(1.0, abs=0.06)
    assert any("leave out more than 0.038 s" in w for w in problem.warnings)


@pytest.mark.slow
def test_a_part_that_begins_in_mid_action_tells_the_same_as_the_whole():
    log = machine(delay_samples=6)
    whole, part = fitted(log, "actuator_delay", 0.004), fitted(log.part(2100, len(log)), "actuator_delay", 0.004)
    assert abs(part[0] - whole[0]) < 3 * part[1]
    assert part[2] == pytest.approx(whole[2], abs=0.03)


@pytest.mark.slow
def test_a_held_out_log_that_begins_in_mid_action_is_judged_at_the_noise():
    from wheelpend.estimation.validation import validation_residuals

    model = Model.default().with_effects(["actuator_delay"])
    other = machine(delay_samples=6, seed=1)
    problem, values = best_start(prepare(model, [machine(delay_samples=6)], [other.part(1300, 7000)]))
    found = fit_model(problem, {**values, "actuator_delay.delay": 0.004}, free_names(problem, model.effects))
    assert validation_residuals(problem, found)[0] == pytest.approx(1.0, abs=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, 4100])
def test_a_winding_is_named_and_not_an_elastic_shaft(first):
    log = machine(lag=0.007, duration=16.0)
    found = diagnose(Model.default(), [log.part(first, len(log))])
    assert (found.verdict, found.candidates[0].effect) == ("effect_missing", "winding_inductance")
    assert found.candidates[0].coefficients["time_constant"] == pytest.approx(0.007, rel=2e-3)


@pytest.mark.slow
def test_a_regression_begins_where_the_motor_remembers_only_what_is_in_the_log():
    from wheelpend import identify

    known = {"winding_inductance.time_constant": (0.02, 0.0)}
    model, log = Model.default().with_effects(["winding_inductance"]).with_fit(known), machine(lag=0.02, noise=0.0)
    found = identify(model, [log], method="energy", test_bias=False)
    assert found.parameters["X4"].value == pytest.approx(X["X4"], rel=5e-3)  # -0.38 from the first sample on
    assert len(log) - found.to_json()["samples"] == 150


def test_the_input_of_a_lagging_motor_in_a_part_is_that_in_the_whole():
    from wheelpend.estimation.parameters import kernel_parameters
    from wheelpend.estimation.regressor import acting_input
    from wheelpend.kernels.load import library_module

    log, module = machine(lag=0.02), library_module("wheel_pendulum", {}, ())
    parameters = kernel_parameters(module, {**X, "winding_inductance.time_constant": 0.02}, log)
    whole, part = (acting_input(module, x, parameters) for x in (log, log.part(2000, 4000)))
    assert part[:-1] == pytest.approx(whole[2000:3999], abs=1e-5)


def test_memory_of_friction_is_followed_through_the_warm_up():
    from tests.support import simulated
    from wheelpend.estimation.parameters import kernel_parameters
    from wheelpend.estimation.shooting import Simulator
    from wheelpend.estimation.states import fit_states, initial_states
    from wheelpend.kernels.load import library_module

    log = simulated(duration=9.0, presliding_drive__torque=0.3, presliding_drive__stiffness=3.0).part(2300, 7000)
    values = {**X, **CONSTANTS, "presliding_drive.torque": 0.3, "presliding_drive.stiffness": 3.0}
    module = library_module("wheel_pendulum", {}, ())
    segments = prepare(Model.default(), [log], use_all=True).data.estimation[0]
    assert segments.warm_up.tolist() == [[0, 150]] and segments.bounds[0, 0] == 150
    parameters = kernel_parameters(module, values, log)
    _, found = fit_states(Simulator(module), segments, initial_states(module, segments), parameters)
    per_value = found.gram[:, -1, -1] / (3 * 500 - 4)
    assert per_value[:-1] == pytest.approx(1.0, abs=0.25) and np.isnan(found.residual[:150]).all()


@pytest.mark.parametrize(("interval", "warned"), [(0.2, False), (0.1, True)])
def test_samples_further_apart_than_the_input_is_remembered_need_no_warning(interval, warned):
    t = np.arange(4) * interval
    log = Log("slow.csv", t, np.sin(t), np.sin(t)[:, None], ("x",), range_channel="", rates={}, memory_s=0.15)
    assert any("too short to leave out" in w for w in data._warnings_of(log)) == warned
