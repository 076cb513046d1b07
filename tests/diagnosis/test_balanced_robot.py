"""A robot that balances by a loop of its own, simulated apart from the tool: all that it lacks is named."""

from types import SimpleNamespace

import pytest

import derive
from wheelpend import explain, identify
from wheelpend.benchmarks.benches.cases import Case, made
from wheelpend.diagnosis.likelihood import refits


@pytest.mark.slow
def test_a_gyros_zero_as_small_as_its_noise_is_named_beside_friction_and_a_tilted_sensor():
    case = Case(29)
    robot = made(case)
    assert set(robot.hidden) == {"coulomb_drive.torque", "imu_bias.bias", "gyro_bias.bias"}
    ladder = explain(case.model, [robot.log])
    steps = [{step.effect, *step.equivalent_to} for step in ladder.steps]
    assert len(steps) == 3 and ladder.verdict != "unexplained"
    assert "coulomb_drive" in steps[0] and "imu_bias" in steps[1] and "gyro_bias" in steps[2]
    for name in ("coulomb_drive.torque", "gyro_bias.bias"):
        found = ladder.parameters[name]
        assert found.value == pytest.approx(robot.hidden[name], abs=4.0 * found.sigma)
        assert found.sigma < 0.1 * abs(robot.hidden[name])


@pytest.mark.slow
def test_the_zero_of_a_pitch_is_no_angle_that_no_sensor_is_off_by():
    case = Case(14)  # in which a gyro's zero and a fused pitch pull it
    robot = made(case)
    found = identify(case.model.with_effects(["imu_bias"]), [robot.log]).parameters["imu_bias.bias"]
    assert found.value == pytest.approx(robot.hidden["imu_bias.bias"], rel=0.2)  # had been -23 rad


@pytest.mark.parametrize(("time_constant", "begins_anew"), [(60.0, True), (0.02, True), (1.9, False)])
def test_a_shape_that_has_run_to_its_bound_begins_in_the_middle_again(time_constant, begins_anew, monkeypatch):
    middle = {"accelerometer_tilt.time_constant": 1.0}
    monkeypatch.setattr(refits, "profiled_start_values", lambda problem: middle)
    values = {"accelerometer_tilt.time_constant": time_constant, "accelerometer_tilt.gain": 0.003}
    model = SimpleNamespace(effects=("coulomb_drive", "accelerometer_tilt"))
    problem = SimpleNamespace(effect=derive.effects.find, model=model)
    assert refits._from_bounds(problem, values) == (middle if begins_anew else {})
