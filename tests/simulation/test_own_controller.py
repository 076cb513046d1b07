"""`simulate` under a controller of the user's own, a Python function called once per sample."""

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Failure, Model, identify, simulate
from wheelpend.errors import OutOfRange
from wheelpend.simulation.references import reference


def model_pid(model, t, command="aggressive"):
    """The model's own PID as a function of the time and the readings."""
    kp, ki, kd = model.controller.gains
    goal, rate = reference(command, t, model.table)
    memory = {"integral": 0.0, "calls": 0}

    def controller(now, measured):
        k = memory["calls"]
        error = goal[k] - measured["theta_p"]
        memory["integral"] += error * (t[k] - t[k - 1]) if k else 0.0
        memory["calls"] += 1
        assert now == t[k]
        return kp * error + ki * memory["integral"] + kd * (rate[k] - measured["dtheta_p"])

    return controller, memory


HIDDEN = [
    {},
    {"coulomb_drive.torque": 0.3},
    {"actuator_delay.delay": 0.0034},
    {"imu_lag.delay": 0.0026},
    {"backlash.gap": 0.01},
    {"actuator_delay.delay": 0.002, "coulomb_drive.torque": 0.1},
]


@pytest.mark.parametrize("hide", HIDDEN)
def test_the_models_own_law_as_a_function_gives_the_models_own_loop(hide):
    model, t = Model.default(), np.arange(1001) * 1e-3
    controller, memory = model_pid(model, t)
    own = simulate(model, duration=1.0, hide=hide, seed=3, controller=controller)
    kernel = simulate(model, duration=1.0, hide=hide, seed=3)
    assert memory["calls"] == 1001
    np.testing.assert_allclose(own.measured, kernel.measured, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.voltage, kernel.voltage, rtol=0, atol=1e-6)
    assert own.reference is None and own.name == "simulated with a controller"


def test_a_stabilising_law_needs_no_controller_in_the_model_and_gives_a_log_to_identify():
    model = Model.parse(Model.default().text.partition("[controller]")[0])
    assert model.controller is None
    rng = np.random.default_rng(1)

    def controller(t, measured):
        return 150.0 * measured["theta_p"] + 15.0 * measured["dtheta_p"] + 3.0 * rng.normal()

    log = simulate(model, duration=2.0, controller=controller)
    found = identify(model, log, method="shooting")
    assert found.parameters["X6"].value == pytest.approx(model.value("X6"), rel=0.02)


@pytest.mark.parametrize(
    ("returned", "said"),
    [(None, "None"), (float("nan"), "nan"), ("12", "'12'"), ([1.0, 2.0], r"\[1.0, 2.0\]"), (True, "True"), (1j, "1j")],
)
def test_what_is_no_finite_number_is_refused_with_the_time_at_which_it_came(returned, said):
    def controller(t, measured):
        return returned if t >= 0.005 else 0.0

    with pytest.raises(Failure, match=f"must return a finite number at every sample, but at t = 0.005 s.* {said}"):
        simulate(Model.default(), duration=1.0, controller=controller)


def test_an_exception_in_the_controller_is_a_failure_that_keeps_it():
    def controller(t, measured):
        return measured["pitch"]

    with pytest.raises(Failure, match="at t = 0 s it raised KeyError: 'pitch'") as caught:
        simulate(Model.default(), duration=1.0, controller=controller)
    assert isinstance(caught.value.__cause__, KeyError)


def test_a_controller_that_lets_the_robot_fall_is_called_no_more_and_the_fall_is_told():
    called = []

    def controller(t, measured):
        called.append(t)
        return np.float64(1.0)

    with pytest.raises(OutOfRange, match=r"robot must stay up, but it falls at 1.76 s.*or another controller"):
        simulate(Model.default(), duration=20.0, noise=False, controller=controller)
    assert 1.7 < called[-1] < 1.77


def test_an_input_that_lags_is_refused():
    with pytest.raises(Failure, match="cannot drive an input that lags"):
        simulate(Model.default(), duration=1.0, hide={"winding_inductance": 0.01}, controller=lambda t, measured: 0.0)


def test_quantised_sensors_are_read_in_steps():
    model = Model.parse(Model.default().text + "\n[sensors.step]\ntheta_p = 0.01\n")
    log = simulate(model, duration=0.2, controller=lambda t, m: 150.0 * m["theta_p"] + 15.0 * m["dtheta_p"])
    steps = log.measured[:, 1] / 0.01
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert simulated(duration=0.2).measured[:, 1].std() > 0.0
