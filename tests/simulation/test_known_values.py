"""A simulated log has the command, the controller, the noise and the rounding that were asked for."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import CONSTANTS, X, simulated
from wheelpend import Model
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.simulation.closed_loop import first_sample_out_of_range
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import command_duration, reference
from wheelpend.simulation.simulate import sensor_errors, simulate

GAINS = np.array([-168.0, -800.0, -8.8])


def test_the_built_in_commands_are_the_papers():
    t = np.array([0.0, 0.3, 1.7])
    simple, rate = reference("simple", np.arange(2001) * 1e-3)
    assert simple[[0, 300, 1700]] == pytest.approx(np.radians(20.0 * np.sin(t)))
    assert rate[1000] == pytest.approx(np.radians(20.0 * np.cos(1.0)), rel=1e-5)
    degrees = 3 * np.sin(7 * t) + 6 * (np.cos(4 * t) - np.sin(t)) + 10 * np.cos(3 * t) * np.sin(5 * t) ** 2
    assert reference("aggressive", t)[0] == pytest.approx(np.radians(degrees))
    assert command_duration("simple") == 20.0


@pytest.mark.parametrize("effects", ["none", "all"])
def test_the_voltage_is_that_of_the_pid_on_what_the_sensors_read(effects, lean, library):
    module = {"none": lean, "all": library}[effects]
    t = np.arange(400) * 1e-3
    angle, rate = 0.1 * np.sin(3 * t), 0.3 * np.cos(3 * t)
    noise = 1e-3 * np.random.default_rng(0).normal(size=(400, 3))
    parameters, quantum = kernel_parameters(module, {**X, **CONSTANTS}, simulated(duration=1.0)), [0.05, 0.0, 0.0]
    states, measured, voltage = module.closed_loop(
        t, angle, rate, GAINS, np.zeros(4), parameters, noise, np.array(quantum), 1e-3
    )
    error = angle - measured[:, 1]
    integral = np.concatenate([[0.0], np.cumsum(error[1:] * np.diff(t))])
    assert voltage == pytest.approx(GAINS @ [error, integral, rate - measured[:, 2]], rel=1e-12)
    assert measured[:, 1:] == pytest.approx(states[:, [1, 3]] + noise[:, 1:])
    assert measured[:, 0] == pytest.approx(0.05 * np.round((states[:, 0] + noise[:, 0]) / 0.05))
    again = module.simulate(t, voltage, np.zeros(4), parameters, 1e-3)
    assert again == pytest.approx(states, abs=1e-9)


def test_noise_and_steps_are_those_of_the_sensors():
    model = Model.default()
    errors, quantum = sensor_errors(model, ("theta_w", "theta_p", "dtheta_p"), 20_000, 5)
    assert quantum == pytest.approx([2 * np.pi / 60000, 0.0, 0.0])
    assert errors.std(axis=0)[1:] == pytest.approx(np.radians([0.5, 0.5]), rel=0.03)
    assert not errors[:, 0].any() and np.abs(np.corrcoef(errors[:, 1], errors[:, 2])[0, 1]) < 0.03
    bare = replace(model, simulation={k: v for k, v in model.simulation.items() if "noise" not in k})
    plain, _ = sensor_errors(bare, ("theta_p", "dtheta_p"), 20_000, 5)
    assert plain.std(axis=0) == pytest.approx(np.radians([0.5, 0.5]), rel=0.03)  # the paper's
    assert not any(a.any() for a in sensor_errors(model, ("theta_w", "theta_p"), 10, None))


def test_the_simulated_machine_is_that_of_the_simulation_and_else_the_model():
    model = Model.default()
    assert {n: machine_values(model, {})[n] for n in X} == X
    other = replace(model, simulation=None)
    assert {n: machine_values(other, {})[n] for n in X} == {n: model.parameters[n].nominal for n in X}
    assert machine_values(model, {"slope.angle": 0.1}) == {**machine_values(model, {}), "slope.angle": 0.1}
    assert machine_values(model, {})["R"] == pytest.approx(CONSTANTS["R"])


def test_a_robot_has_fallen_once_its_pitch_is_beyond_a_right_angle(lean):
    states = np.zeros((5, 4))
    assert first_sample_out_of_range(lean, states) is None
    states[3:, 1] = [1.6, 2.0]
    assert first_sample_out_of_range(lean, states) == 3
    states[1, 2] = np.nan
    assert first_sample_out_of_range(lean, states) == 1


def test_a_log_lasts_as_long_as_asked_and_holds_its_reference():
    log = simulate(Model.default(), command="simple", duration=1.0, sample=0.002, noise=False)
    assert (len(log), log.dt, log.duration) == (501, pytest.approx(0.002), pytest.approx(1.0))
    assert log.reference == pytest.approx(np.radians(20.0 * np.sin(log.t)))
    assert np.abs(log.measured[:, 1] - log.reference).max() < 0.05
    assert simulated(duration=1.0).t[-1] == pytest.approx(1.0)
