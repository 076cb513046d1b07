"""Inverse dynamics: the cut-off of the motion's filter follows from the log."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import DATA, needs_data
from wheelpend import Model, identify
from wheelpend.errors import Failure
from wheelpend.estimation.data import read_logs
from wheelpend.estimation.linear_fit import solve_least_squares
from wheelpend.identification.bandwidth import Sides, cutoff_for, cutoffs_below, inertia_squares
from wheelpend.identification.inverse_dynamics import accelerated_columns, equations_by_stretch, stacked_equations
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log

AXIS = Model.parse('plant = "slide"\neffects = ["viscous_drive", "coulomb_drive"]\n')
INERTIA, FRICTION, DRY_FRICTION = 0.5, 1.2, 0.4  # V s²/m, V s/m, V


def controlled_axis(rate: float, step: float, damping: float, seconds: float = 10.0) -> Log:
    """An axis under a proportional and derivative controller that sees an encoder of a step [m] at a rate [Hz]."""
    substeps, samples = round(4000 / rate), int(seconds * rate)
    dt, frequencies, phases = 1 / rate / substeps, np.geomspace(0.3, 3.0, 4), np.array([0.1, 2.0, 4.0, 5.5])
    times = np.arange(samples) / rate
    angles = 2 * np.pi * np.outer(times, frequencies) + phases
    wanted, wanted_speed = 0.09 * (np.sin(angles) / frequencies).sum(1), 0.18 * np.pi * np.cos(angles).sum(1)
    place = speed = 0.0
    seen, voltage, last = np.zeros(samples), np.zeros(samples), 0.0
    for k in range(samples):
        seen[k] = np.round(place / step) * step
        volts = 60.0 * (wanted[k] - seen[k]) + damping * (wanted_speed[k] - (seen[k] - last) * rate)
        voltage[k], last = np.clip(volts, -50.0, 50.0), seen[k]
        for _ in range(substeps):
            force = voltage[k] - FRICTION * speed
            push = force - DRY_FRICTION * np.sign(speed or force)
            after = speed + dt * push / INERTIA if speed or abs(force) > DRY_FRICTION else 0.0
            after = 0.0 if speed * after < 0.0 else after
            place, speed = place + dt * (speed + after) / 2, after
    return Log("axis.csv", times, voltage, seen[:, None], ("x",), range_channel="", rates={})


@pytest.mark.parametrize(
    ("rate", "step", "damping"), [(100, 1e-3, 3.0), (100, 4e-3, 15.0), (300, 4e-3, 15.0), (1000, 4e-3, 3.0)]
)
def test_a_coarse_encoder_does_not_shrink_the_inertia_at_any_rate(rate, step, damping):
    found = identify(AXIS, [controlled_axis(rate, step, damping)], method="inverse")
    assert found.parameters["X1"].value == pytest.approx(INERTIA, rel=0.05)
    if rate > 100:  # below, the input's half a sample is felt
        assert found.parameters["coulomb_drive.torque"].value == pytest.approx(DRY_FRICTION, rel=0.1)
    assert 3.0 < found.cutoff_hz < 30.0


def test_at_the_published_cutoff_the_same_log_gives_a_fraction_of_the_inertia():
    log, module = controlled_axis(1000, 4e-3, 3.0), model_module("slide", {}, AXIS.effects)
    sides = stacked_equations(equations_by_stretch(module, log, np.zeros(len(module.PARAMETERS)), 100.0))
    fixed = np.linalg.lstsq(sides.regressor.reshape(-1, sides.regressor.shape[2]), sides.left.ravel(), rcond=None)[0]
    assert abs(fixed[0]) < 0.3 * INERTIA


def test_a_fine_encoder_leaves_the_published_cutoff():
    found = identify(AXIS, [controlled_axis(1000, 1e-6, 3.0)], method="inverse")
    assert found.cutoff_hz == pytest.approx(100.0)
    assert found.parameters["X1"].value == pytest.approx(INERTIA, rel=0.01)


def test_the_cutoff_is_said():
    from wheelpend.reports.text.identification import identification_text

    found = identify(AXIS, [controlled_axis(300, 4e-3, 15.0)], method="inverse")
    text = "\n".join(map(str, identification_text(found)))
    assert f"up to {found.cutoff_hz:.2g} Hz, chosen for this log" in text
    assert found.to_json()["cutoff_hz"] == found.cutoff_hz


def test_cutoffs_go_down_by_half_octaves_until_motion_would_be_removed():
    assert cutoffs_below(100.0, lambda f: 0.0 if f > 24.0 else 1.0) == pytest.approx(
        [100.0, 70.71, 50.0, 35.36, 25.0], rel=1e-3
    )


def sides_of(noise: float, rng: np.random.Generator) -> Sides:
    """A force of unit inertia and friction, with noise in the acceleration."""
    clean = np.random.default_rng(0).normal(size=(1000, 1, 2))
    seen = clean + noise * rng.normal(size=clean.shape) * [1.0, 0.0]
    return Sides(clean.sum(axis=2), seen, np.array([True, False]))


def test_the_highest_cutoff_is_taken_at_which_noise_bends_no_inertia_by_a_hundredth():
    rng = np.random.default_rng(1)
    table = {100.0: sides_of(0.5, rng), 50.0: sides_of(0.15, rng), 25.0: sides_of(0.05, rng), 12.5: sides_of(0.0, rng)}
    assert cutoff_for(table, np.array([1.0, 1.0])) == 25.0
    assert inertia_squares(table[12.5], np.array([2.0, 1.0])) == pytest.approx(4000.0, rel=0.1)


def test_inertias_are_the_columns_with_accelerations():
    module = model_module("slide", {}, AXIS.effects)
    assert accelerated_columns(module, np.zeros(len(module.PARAMETERS))).tolist() == [n == "X1" for n in module.LINEAR]


def test_a_log_too_short_to_differentiate_is_refused():
    with pytest.raises(Failure, match=r"uninterrupted stretch of at least 0\.4 s"):
        identify(AXIS, [controlled_axis(100, 1e-3, 3.0, seconds=0.3)], method="inverse")


def test_a_log_that_lost_samples_is_filtered_at_its_mean_interval():
    log = controlled_axis(100, 1e-5, 3.0, seconds=60.0)
    kept = np.cumsum(np.random.default_rng(0).choice([1, 5], p=[0.55, 0.45], size=1800))
    kept = kept[kept < len(log)]
    thinned = replace(log, t=log.t[kept], voltage=log.voltage[kept], measured=log.measured[kept])
    found = identify(AXIS, [thinned], method="inverse")
    assert 1.0 < found.cutoff_hz < 1.0 / (4.0 * np.diff(thinned.t).mean())


def test_a_short_stretch_of_a_long_log_is_compared_too(monkeypatch):
    monkeypatch.setattr("wheelpend.identification.inverse_dynamics.MAX_JUDGED_SAMPLES", 10)
    log = controlled_axis(300, 1e-5, 3.0, seconds=4.0)
    kept = np.r_[0:90, 300 : len(log)]  # thinned to a hundredth, not two samples of the first stretch are left
    cut = replace(log, t=log.t[kept], voltage=log.voltage[kept], measured=log.measured[kept])
    found = identify(AXIS, [cut], method="inverse")
    assert found.parameters["X1"].value == pytest.approx(INERTIA, rel=0.1)


@needs_data
def test_the_cutoff_on_a_measured_servo_follows_its_encoder():
    servo = Model.parse('plant = "pendulum"\neffects = ["coulomb_drive"]\n[assumptions]\ndriven = true\n')
    logs = [DATA / f"servo_pendulum/sin_time_square_{gain}.csv" for gain in (100, 200, 400)]
    found = [identify(servo, read_logs([log], servo), method="inverse") for log in logs]
    assert all(6.0 < f.cutoff_hz < 20.0 for f in found)
    assert all(0.05 < f.parameters["X1"].value < 0.09 for f in found)


def test_a_column_that_is_not_finite_is_left_out_and_named():
    model = Model.parse(
        'plant = "slide"\neffects = ["viscous_drive", "stribeck_drive"]\n'
        "[effect.stribeck_drive]\nspeed = { nominal = 0.0 }\n"
    )
    still = controlled_axis(300, 4e-3, 3.0)
    measured = still.measured.copy()
    measured[:300] = measured[300]
    for method in ("inverse", "differentiation"):
        found = identify(model, [replace(still, measured=measured)], method=method, test_bias=False)
        lost = found.parameters["stribeck_drive.static"]
        assert not lost.identifiable and lost.value == 0.0 and np.isfinite(found.condition_number)
        assert all(np.isfinite(row.value) and np.isfinite(row.sigma) for row in found.parameters.values())
        assert any("stribeck_drive.static" in w for w in found.warnings)


def test_least_squares_does_without_a_column_of_nan():
    rng = np.random.default_rng(0)
    regressor = rng.normal(size=(50, 1, 3))
    sides = regressor @ np.array([1.0, 0.0, 2.0])
    regressor[7, 0, 1] = np.nan
    found = solve_least_squares(SimpleNamespace(LINEAR=("a", "b", "c")), sides, regressor)
    assert found.values == pytest.approx({"a": 1.0, "b": 0.0, "c": 2.0})
    assert found.undefined == ("b",) and found.unidentifiable == ("b",) and found.condition < 10.0
