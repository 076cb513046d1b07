"""Readings that no motion explains are named and left out; motion, however sudden, loses nothing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, simulate
from wheelpend.estimation.data import noise_of, prepare
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.logs.log import segment_bounds
from wheelpend.logs.outliers import outliers_of, without_outliers

MODEL = Model.default()


def found_in(log):
    return outliers_of(log, MODEL.table)


def with_spikes(log, count=30):
    random, measured = np.random.default_rng(0), log.measured.copy()
    places = np.sort(random.choice(np.arange(10, len(log) - 10), count, replace=False))
    measured[places, 1] += random.choice([-1.0, 1.0], count) * random.uniform(0.2, 1.0, count)
    return replace(log, measured=measured), places


def with_jump(log, place, size=0.7):
    measured = log.measured.copy()
    measured[place:, 0] += size
    return replace(log, measured=measured)


def test_thirty_spikes_in_the_pitch_are_found_each_at_its_sample_and_nothing_else_is():
    log, places = with_spikes(simulated(duration=8.0))
    found = found_in(log)
    assert [s.sample for s in found.spikes] == list(places)
    assert {s.channel for s in found.spikes} == {"theta_p"} and not found.jumps


def test_spikes_count_as_missing_and_do_not_grow_the_noise():
    clean = simulated(duration=8.0)
    log, places = with_spikes(clean)
    problem = prepare(MODEL, [log], lean=True)
    assert list(np.flatnonzero(np.isnan(problem.logs[0].measured[:, 1]))) == list(places)
    assert problem.noise[0].sigma == pytest.approx(noise_of(clean, MODEL).sigma, rel=0.03)
    assert any("theta_p has 30 readings far off" in w for w in problem.warnings)


def test_an_encoder_that_slips_splits_the_log_where_it_does():
    log = with_jump(simulated(duration=8.0), 5000)
    (jump,) = found_in(log).jumps
    assert (jump.channel, jump.sample) == ("theta_w", 5000)
    assert jump.size == pytest.approx(0.7, abs=0.01)
    bounds = segment_bounds(without_outliers(log, found_in(log)), 0.5)
    assert not any(a < 5000 < b for a, b in bounds) and 5000 in bounds[:, 0]


def test_a_part_of_a_log_keeps_its_jumps():
    log = replace(simulated(duration=8.0), breaks=(2000, 5000))
    assert log.part(1000, 4000).breaks == (1000,)
    assert any(a == 5000 for a, b in segment_bounds(log, 0.3, 4200, 6000))


def test_inspect_names_spikes_and_jump_with_time_and_size():
    log, places = with_spikes(with_jump(simulated(duration=8.0), 5000))
    findings = {f.kind: f for f in inspect_for_model(MODEL, log).findings}
    assert findings["jump"].size == pytest.approx(0.7, abs=0.01) and "at t = 5 s" in findings["jump"].sentence
    assert 0.9 < abs(findings["spikes"].size) < 1.1
    assert f"first at t = {log.t[places[0]]:.6g} s" in findings["spikes"].sentence


SUDDEN = [
    {"coulomb_drive": 0.3},
    {"stribeck_drive.static": 0.5, "stribeck_drive.sliding": 0.2, "stribeck_drive.speed": 0.2},
    {"backlash": 0.05},
    {"external_push.start": 3.0, "external_push.end": 3.2, "external_push.torque": 2.0},
    {"voltage_dead_zone": 0.5},
    {"rolling_resistance": 0.3},
]


@pytest.mark.parametrize("hide", SUDDEN, ids=lambda h: next(iter(h)))
@pytest.mark.parametrize("sample", [0.001, 0.01])
@pytest.mark.parametrize("noise", [True, False])
def test_sudden_motion_loses_no_sample(hide, sample, noise):
    found = found_in(simulate(MODEL, hide=hide, sample=sample, duration=15.0, seed=3, noise=noise))
    assert not found.spikes and not found.jumps


def test_an_encoder_that_flickers_by_a_count_has_no_spikes():
    log = simulated(duration=8.0)
    random, measured = np.random.default_rng(0), log.measured.copy()
    measured[:, 0] = 0.01 * (np.arange(len(log)) // 1000) + 0.01 * (random.random(len(log)) < 0.01)
    assert not found_in(replace(log, measured=measured)).spikes
