"""Pairs of effects on a motor's shaft that a simulation apart from the tool has, and that hide each other."""

from dataclasses import replace

import numpy as np
import pytest

from tests.bench import shaft_log
from wheelpend import Model, explain

SHAFT = Model.parse('plant = "shaft"\n')


@pytest.mark.slow
def test_a_limit_and_dry_friction_are_told_though_friction_that_grows_with_the_load_does_as_well_alone():
    levels = [2.9452, 1.7216, -2.2723, -1.6454, 1.601, 2.501, -0.8771, 1.7142, -2.1197, 0.2504]
    log = shaft_log(200.0, np.repeat(levels, 87)[:800], 4096, 0.010433, 0.080648, dry=0.61133, limit=2.10835)
    ladder = explain(SHAFT, [log])
    assert {s.effect for s in ladder.steps} == {"coulomb_drive", "voltage_saturation"}
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.61133, rel=0.02)
    assert ladder.parameters["voltage_saturation.limit"].value == pytest.approx(2.10835, rel=0.002)
    assert ladder.verdict != "unexplained" and ladder.error < 1.1 * ladder.noise_floor


@pytest.mark.slow
def test_dry_friction_and_drag_are_told_though_friction_that_falls_with_the_speed_leaves_hardly_more_than_noise():
    t = np.arange(0.0, 4.0, 0.002)
    log = shaft_log(
        500.0, 6.0 * np.sin(2 * np.pi * (0.2 * t + 0.25 * t**2)), 1024, 0.0168, 0.165, dry=0.7, quadratic=8.9e-4
    )
    ladder = explain(SHAFT, [log])
    assert [s.effect for s in ladder.steps] == ["coulomb_drive", "quadratic_drive"]
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.7, rel=0.02)
    assert ladder.parameters["quadratic_drive.coefficient"].value == pytest.approx(8.9e-4, rel=0.02)


@pytest.mark.slow
def test_a_command_that_acts_late_is_no_lag_of_the_only_sensor():
    volts = np.repeat([189.0, 180.0, 172.0, 178.0, 185.0, 236.0, 234.0], 39)[:240] / 255.0 * 12.0
    volts[:6] = 0.0
    log = shaft_log(20.0, np.concatenate([[0.0], volts[:-1]]), 1320, 0.159, 0.447, dry=0.648)
    ladder = explain(SHAFT, [replace(log, voltage=volts)])
    late, resisted = ladder.steps  # one way a dead zone and dry friction are the same force
    assert late.effect == "actuator_delay" and resisted.effect in ("coulomb_drive", "voltage_dead_zone")
    assert late.coefficients["delay"] == pytest.approx(0.05, rel=0.02)
    assert next(iter(resisted.coefficients.values())) == pytest.approx(0.648, rel=0.1)
    assert ladder.verdict != "unexplained" and ladder.error < 1.1 * ladder.noise_floor


@pytest.mark.slow
def test_dry_friction_and_a_driver_that_lets_the_motor_coast_are_told_of_a_ramp_though_neither_alone_predicts_it():
    t = np.arange(0.0, 20.0, 0.01)
    volts = np.where(t < 0.3, 0.0, np.round(255.0 * (1.0 - np.abs(1.0 - t / 10.0))) / 255.0 * 12.0)
    log = shaft_log(100.0, volts, 1320, 0.0357, 0.0927, dry=0.81, back_emf=0.309, supply=12.0)
    ladder = explain(SHAFT, [log])
    assert {s.effect for s in ladder.steps} == {"coasting_driver", "coulomb_drive"}
    assert ladder.parameters["coasting_driver.rate"].value == pytest.approx(0.309 / 12.0, rel=0.005)
    assert ladder.parameters["coulomb_drive.torque"].value == pytest.approx(0.81, rel=0.01)
    assert ladder.parameters["X2"].value == pytest.approx(0.0927, rel=0.01)
    assert ladder.verdict == "nothing_missing" and ladder.error < 1.1 * ladder.noise_floor
