"""The missing force as smoothed: it follows the true one within its band, and sees jumps where there are jumps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import CONSTANTS, X, simulated
from wheelpend import Log, Model
from wheelpend.diagnosis.missing_force import smoothed_force
from wheelpend.diagnosis.missing_force.estimate import MissingForce, estimate_missing_force
from wheelpend.diagnosis.missing_force.smoothed_force import missing_forces, pooled, where_it_shows
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.states import fit_states, initial_states

MASS, FINE = 2.7058, 4  # V s²/m; steps of the simulation in a sample
ENCODER_SIGMA_M = 2e-6


def pushed_carriage(seed, rms=1.5, time=0.05, duration=4.0):
    """A carriage under a voltage and a random force of first order, simulated here, and that force at the samples."""
    random, t = np.random.default_rng(seed), np.arange(0.0, duration, 1e-3)
    voltage = 4.0 * np.sin(2 * np.pi * 0.7 * t) + 2.0 * np.sin(2 * np.pi * 2.3 * t + 1.0)
    h, x, dx = 1e-3 / FINE, 0.0, 0.0
    keep = np.exp(-h / time)
    force, position, acting = rms * random.normal(), np.zeros(len(t)), np.zeros(len(t))
    for k in range(len(t)):
        position[k], acting[k] = x, force
        for _ in range(FINE):
            rate = (voltage[k] + force) / MASS
            x, dx = x + h * dx + 0.5 * h * h * rate, dx + h * rate
            force = keep * force + rms * np.sqrt(1 - keep**2) * random.normal()
    reading = position + ENCODER_SIGMA_M * random.normal(size=len(t))
    return Log("carriage", t, voltage, reading[:, None], ("x",)), acting


def at_values(model, logs, values):
    """The problem of a model on logs, and a fit at these values in which nothing but initial states is fitted."""
    problem, states = prepare(model, logs, use_all=True), []
    for segments in problem.data.estimation:
        parameters = kernel_parameters(problem.module, values, segments.log)
        states.append(fit_states(problem.simulator, segments, initial_states(problem.module, segments), parameters)[0])
    return problem, Fit.at(values, [values] * len(logs), states)


def test_the_band_holds_a_random_force_95_times_out_of_100():
    misses = []
    for seed in range(3):
        log, acting = pushed_carriage(seed)
        (found,) = missing_forces(*at_values(Model.default("slide"), [log], {"X1": MASS, "gain": 35.1507}))
        true = np.interp(found.t, log.t, acting)
        misses.append((found.force[:, 0] - true) / found.sigma[:, 0])
        assert np.std(found.force[:, 0] - true) < 0.5 * np.std(true)
    inside = np.mean(np.abs(misses) < 1.96)
    assert 0.92 < inside < 0.98
    assert 0.85 < np.std(misses) < 1.15


@pytest.fixture(scope="module")
def dry():
    """The missing force of a robot with dry friction in the drive, at its true parameters: smoothed and piecewise."""
    problem, fit = at_values(
        Model.default(), [simulated(seed=4, duration=9.0, coulomb_drive__torque=0.3)], X | CONSTANTS
    )
    return *missing_forces(problem, fit), estimate_missing_force(problem, fit)


def friction(missing: MissingForce):
    return -0.3 * np.sign(missing.variables["dtheta_w - dtheta_p"])[:, None] * [1.0, -1.0]


def test_dry_friction_is_seen_as_jumps_far_sharper_than_in_pieces(dry):
    smooth, piecewise = (np.sqrt(np.mean((m.force - friction(m)) ** 2, axis=0)) for m in dry)
    assert np.all(smooth < 0.04)
    assert np.all(smooth < 0.3 * piecewise)
    found = dry[0]
    inside = np.mean(np.abs(found.force - friction(found)) < 2 * found.sigma)
    assert inside > 0.93
    assert 0.015 < np.sqrt(np.mean(found.sigma**2)) < 0.05


def test_a_force_between_two_parts_is_equal_and_opposite(dry):
    assert dry[0].force[:, 0] == pytest.approx(-dry[0].force[:, 1])


def test_the_missing_force_is_at_every_sample_of_every_log():
    logs = [pushed_carriage(seed, duration=3.0 + seed)[0] for seed in (1, 2)]
    logs[1] = replace(logs[1], name="another")
    problem, fit = at_values(Model.default("slide"), logs, {"X1": MASS, "gain": 35.1507})
    found = missing_forces(problem, fit)
    assert [f.log for f in found] == ["carriage", "another"]
    assert [len(f.t) for f in found] == [sum(np.diff(s.bounds)[:, 0]) for s in problem.data.estimation]
    together = pooled(found)
    assert len(together.force) == len(found[0].t) + len(found[1].t)
    assert set(found[0].variables) - set(together.variables) == {"t"}
    assert all(c.state != "t" for c in where_it_shows(problem, found, fit))


def test_long_logs_are_smoothed_in_parts_that_agree(monkeypatch):
    log, _ = pushed_carriage(3, duration=3.0)
    problem, fit = at_values(Model.default("slide"), [log], {"X1": MASS, "gain": 35.1507})
    (whole,) = missing_forces(problem, fit)
    monkeypatch.setattr(smoothed_force, "PART_SAMPLES", 1000)
    (parts,) = missing_forces(problem, fit)
    assert parts.t == pytest.approx(whole.t)
    assert np.mean((parts.force - whole.force) ** 2) < 0.1 * np.mean(whole.sigma**2)


def test_where_no_filter_can_run_the_piecewise_force_stands_in(monkeypatch):
    log, _ = pushed_carriage(3, duration=3.0)
    problem, fit = at_values(Model.default("slide"), [log], {"X1": MASS, "gain": 35.1507})
    monkeypatch.setattr(smoothed_force, "likeliest_forces", lambda *_: SimpleNamespace(deviance=np.inf))
    (found,) = missing_forces(problem, fit)
    assert found.t == pytest.approx(estimate_missing_force(problem, fit).t)
