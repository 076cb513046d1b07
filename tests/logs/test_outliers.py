"""Readings that no motion explains are named and left out; motion, however sudden, loses nothing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, simulate
from wheelpend.estimation.data import noise_of, prepare, read_logs
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


def shifted(log, channel, sizes):
    """The log with these deviations of a channel, by sample."""
    measured = log.measured.copy()
    for sample, size in sizes.items():
        measured[sample, channel] += size
    return replace(log, measured=measured)


@pytest.mark.parametrize("apart", range(1, 9))
@pytest.mark.parametrize("second", [0.6, -0.6])
def test_two_spikes_are_found_however_close_they_are(apart, second):
    log = shifted(simulated(duration=8.0), 1, {3000: 0.6, 3000 + apart: second})
    assert [s.sample for s in found_in(log).spikes] == [3000, 3000 + apart]


@pytest.mark.parametrize("apart", range(2, 9))
def test_two_spikes_of_a_rate_are_found_with_readings_between_them(apart):
    log = shifted(simulated(duration=8.0), 2, {3000: 2.0, 3000 + apart: 1.5})
    assert [s.sample for s in found_in(log).spikes] == [3000, 3000 + apart]


def test_three_spikes_with_a_reading_between_them_are_found_with_their_sizes():
    found = found_in(shifted(simulated(duration=8.0), 1, {3000: 0.6, 3002: 0.7, 3004: -0.5})).spikes
    assert [s.sample for s in found] == [3000, 3002, 3004]
    assert [s.size for s in found] == pytest.approx([0.6, 0.7, -0.5], abs=0.05)


def with_wheel(log, wheel):
    return replace(log, measured=np.column_stack([wheel, log.measured[:, 1:]]))


def test_an_encoder_that_moves_by_one_count_in_all_has_not_jumped():
    log = simulated(duration=8.0)
    assert not found_in(with_wheel(log, 0.0015 * (log.t > 4.0))).jumps
    assert not found_in(with_wheel(log, 0.0015 * (log.t > 4.0) + 0.0015 * (log.t > 6.0))).jumps


def test_counts_that_were_rounded_as_degrees_are_no_jumps_and_lost_ones_are():
    log, count = simulated(duration=8.0), 2 * np.pi / 4096
    creeping = np.floor(0.01 * log.t**2 / count) * count
    rounded = np.radians(np.round(np.degrees(creeping), 3))
    assert not found_in(with_wheel(log, rounded)).jumps
    (jump,) = found_in(with_wheel(log, rounded + 20 * count * (log.t > 3.0))).jumps
    assert jump.sample == int(np.argmax(log.t > 3.0)) and jump.size == pytest.approx(20 * count, rel=0.1)


def test_a_log_that_was_split_already_is_not_split_again():
    log, _ = with_spikes(with_jump(simulated(duration=8.0), 5000))
    once = read_logs([log], MODEL)[0]
    twice = read_logs([once], MODEL)[0]
    assert once.breaks == twice.breaks == (5000,)
    assert twice.warnings == once.warnings and sum("jumps 1 time" in w for w in twice.warnings) == 1


def test_an_encoder_that_slips_now_and_then_splits_a_long_log_however_often():
    log = simulated(duration=60.0)
    slips = np.arange(1000, 60_000, 2000)
    slipped = with_wheel(log, log.measured[:, 0] + 0.7 * np.searchsorted(slips, np.arange(len(log)), side="right"))
    assert [j.sample for j in found_in(slipped).jumps] == slips.tolist()


def test_spikes_are_the_same_wherever_a_long_log_is_cut_to_save_memory(monkeypatch):
    log, places = with_spikes(shifted(simulated(duration=8.0), 1, {1999: 0.6, 2001: 0.6, 4000: 0.5}))
    whole = found_in(log)
    monkeypatch.setattr("wheelpend.logs.outliers.EXCERPT_SAMPLES", 1000)
    assert found_in(log) == whole and {*places, 1999, 2001, 4000} == {s.sample for s in whole.spikes}


def test_an_encoder_that_often_moves_by_some_counts_at_once_has_not_jumped():
    log, count = simulated(duration=20.0), 2 * np.pi / 4096
    counts = np.zeros(len(log))
    counts[40::50] = 1
    counts[515::1500] = 4
    assert not found_in(with_wheel(log, np.cumsum(counts) * count)).jumps
    counts[2015::1500] = 0
    (jump,) = found_in(with_wheel(log, np.cumsum(counts) * count)).jumps
    assert jump.sample == 515


def test_an_encoder_that_hops_has_not_jumped():
    log, count = simulated(duration=20.0), 2 * np.pi / 4096
    assert not found_in(with_wheel(log, 7 * count * (np.arange(len(log)) // 1700))).jumps


def test_a_slip_at_rest_is_found_in_a_log_with_fast_motion():
    log = simulate(MODEL, sample=0.01, duration=20.0)
    wheel = np.where(log.t < 10, 30.0 * np.sin(log.t - 10), 0.0) + 0.2 * (log.t > 15)
    (jump,) = found_in(with_wheel(log, np.round(wheel / 1.5e-3) * 1.5e-3)).jumps
    assert jump.size == pytest.approx(0.2, abs=0.01) and log.t[jump.sample] == pytest.approx(15.0, abs=0.02)


def test_a_rate_that_goes_elsewhere_for_four_readings_has_no_spikes():
    log = shifted(simulated(duration=8.0), 2, {3000: 2.0, 3001: 1.8, 3002: 1.7, 3003: 2.1})
    assert not found_in(log).spikes
    measured = np.column_stack([log.measured[:, :2], np.random.default_rng(0).uniform(-0.1, 0.1, len(log))])
    measured[3000:3004, 2] = [-0.52, -0.45, -0.4, -0.55]  # about twice the range of the neighbours away
    for scale in np.linspace(0.6, 1.6, 40):
        scaled = measured.copy()
        scaled[3000:3004, 2] *= scale
        assert not found_in(replace(log, measured=scaled)).spikes
