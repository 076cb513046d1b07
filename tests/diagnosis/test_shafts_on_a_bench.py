"""Pairs of effects on a motor's shaft that a simulation apart from the tool has, and that hide each other."""

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
