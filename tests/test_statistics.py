"""Statistics hold where sensors are not ideal: no false alarms, honest intervals, discoveries confirmed elsewhere."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.conftest import simulated
from wheelpend import Log
from wheelpend.benchmarks.hidden_effects.alarms import (
    EffectPValue,
    FalseAlarmTrial,
    alarm_table,
    diagnose_log,
    effect_p_values,
    p_value_table,
)
from wheelpend.benchmarks.hidden_effects.nonideal_sensors import coloured, complete_log, student
from wheelpend.diagnosis.evidence import confirmation_p_value
from wheelpend.estimation.covariance import block_numbers, is_autocorrelated, jackknife_covariance
from wheelpend.estimation.data import noise_of
from wheelpend.logs.noise import sensor_noise

HALF_DEGREE = np.radians(0.5)


def autoregressive(shape, share, seed=0):
    noise = np.random.default_rng(seed).normal(size=shape) * np.sqrt(1 - share**2)
    return lfilter([1.0], [1.0, -share], noise, axis=-1)


def slopes_and_covariances(share, logs=200, segments=26, samples=50):
    """Slope of many logs of a line with noise of a colour, with its covariance by information and by blocks."""
    x = np.random.default_rng(1).normal(size=(segments, samples)).cumsum(axis=1)
    x -= x.mean(axis=1, keepdims=True)
    noise = autoregressive((logs, segments * samples), share).reshape(logs, segments, samples)
    information = (x**2).sum(axis=1)
    slopes = (x * noise).sum(axis=(1, 2)) / information.sum()
    scores = (x * (noise - slopes[:, None, None] * x)).sum(axis=2)
    plain, block = np.array([[1.0 / information.sum()]]), block_numbers([segments])
    robust = [jackknife_covariance(plain, information[:, None, None], s[:, None], block)[0, 0] for s in scores]
    return slopes, plain[0, 0], np.array(robust)


def test_blocks_tell_the_scatter_of_an_estimate_whatever_the_colour_of_the_noise():
    for share in (0.0, 0.95):
        slopes, plain, robust = slopes_and_covariances(share)
        assert 0.75 < np.mean(robust) / np.var(slopes) < 1.5
    assert np.var(slopes) > 5 * plain


def test_a_block_holds_several_segments_of_one_log():
    block = block_numbers([26, 13])
    assert np.bincount(block).min() >= 2
    assert not set(block[:26]) & set(block[26:])
    assert (np.diff(block) >= 0).all()


def test_colour_is_seen_where_there_is_some_and_hardly_ever_where_there_is_none():
    bounds = np.array([[k, k + 250] for k in range(0, 3000, 250)])
    white = [is_autocorrelated(autoregressive((3, 3000), 0.0, seed).T, bounds) for seed in range(40)]
    assert sum(white) <= 1
    assert all(is_autocorrelated(autoregressive((3, 3000), 0.3, seed).T, bounds) for seed in range(10))


def held_out(residual, change):
    part = SimpleNamespace(values=residual.size)
    problem = SimpleNamespace(
        validation=[SimpleNamespace(part=part)], training=[SimpleNamespace(values=2 * residual.size)]
    )
    return confirmation_p_value(problem, [residual], [residual - change])


def test_held_out_data_confirm_an_effect_that_is_there_and_no_other():
    change = 0.3 * autoregressive((1, 1000), 0.98, 1).T
    by_chance = [held_out(autoregressive((1, 1000), 0.8, seed).T, change) for seed in range(10, 410)]
    assert np.mean(np.array(by_chance) < 0.05) < 0.08
    assert held_out(autoregressive((1, 1000), 0.8, 2).T + 3 * change, 3 * change) < 1e-4
    assert held_out(autoregressive((1, 1000), 0.0, 2).T - change, change) > 0.9


@pytest.mark.parametrize("sample", [0.001, 0.002])
def test_a_pitch_whose_noise_has_colour_is_not_taken_for_a_better_one(sample):
    model, log = complete_log("pitch coloured, 10 ms", 1, sample=sample)
    assert noise_of(log, model).sigma[1] == pytest.approx(HALF_DEGREE, rel=0.1)


def test_a_rate_whose_noise_has_colour_is_not_given_up():
    model, log = complete_log("gyro coloured, 5 ms", 1, sample=0.001)
    assert HALF_DEGREE < noise_of(log, model).sigma[2] < 3 * HALF_DEGREE


def test_single_readings_far_off_count_as_noise():
    log, random = simulated(noise=False), np.random.default_rng(0)
    noise = np.column_stack([np.zeros(len(log)), *(HALF_DEGREE * student(random, len(log), 0.001) for _ in range(2))])
    found = sensor_noise(Log("spikes", log.t, log.voltage, log.measured + noise, log.channels), {}, {})
    assert found.sigma[1:] / noise[:, 1:].std(axis=0) == pytest.approx([1, 1], abs=0.15)


def test_an_encoder_coarser_than_stated_is_believed():
    log = complete_log("coarse encoder", 1)[1]
    assert sensor_noise(log, {}, {"theta_w": 2 * np.pi / 60000}).quantum[0] == pytest.approx(2 * np.pi / 2000)


@pytest.mark.parametrize("kind", ["pitch coloured, 10 ms", "pitch wanders, 0.5 s", "coarse encoder", "outliers"])
def test_sensors_that_are_not_ideal_raise_no_alarm(kind):
    found = diagnose_log(kind, 7003)
    assert (found.verdict, found.named) == ("nothing_missing", ())
    assert np.abs(found.deviations).max() < 4


def test_where_absence_is_a_corner_the_count_of_starts_is_cautious():
    found = effect_p_values("white", 7001, ("voltage_dead_zone", "actuator_delay"))
    assert {c.effect for c in found} == {"voltage_dead_zone", "actuator_delay"}
    assert all(c.trials > 1 and c.p_value * c.trials > 0.05 for c in found)


def test_noise_of_a_colour_keeps_its_size():
    assert coloured(0.01)(np.random.default_rng(0), 100_000, 0.001).std() == pytest.approx(1, abs=0.03)


def test_tables_count_alarms_and_chances():
    alarm = FalseAlarmTrial("white", 1, "nothing_missing", (), 1.0, 1.0, (0.5, -2.5))
    assert "0 of 1" in alarm_table([alarm]) and "1 of 2" in alarm_table([alarm])
    assert "1 of 2" in p_value_table([EffectPValue("white", "slope", 0.01, 5), EffectPValue("white", "slope", 0.5, 5)])
