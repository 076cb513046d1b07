"""Sensor noise is read off the log alone, whatever its rate, its gaps and its distribution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.plants.machines import model_of
from tests.support import simulated
from wheelpend import Log, Model, simulate
from wheelpend.benchmarks.hidden_effects.nonideal_sensors import complete_log, student
from wheelpend.estimation import data
from wheelpend.logs import white_noise
from wheelpend.logs.coloured_noise import angle_rate_inconsistency
from wheelpend.logs.noise import find_quantum, sensor_noise
from wheelpend.logs.outliers import find_outliers, without_outliers
from wheelpend.simulation.simulate import noise_levels

STEP = 2 * np.pi / 60000
TRUE = np.array([STEP / np.sqrt(12), np.radians(0.5), np.radians(0.5)])


def noise_of(log, stated=None):
    return sensor_noise(log, {}, {"theta_w": stated})


@pytest.mark.parametrize("command", ["simple", "aggressive"])
def test_noise_is_estimated_within_a_tenth_though_the_controller_shakes_the_robot_with_it(command):
    assert np.abs(noise_of(simulated(command), STEP).sigma / TRUE - 1).max() < 0.1


def test_a_slow_log_with_stated_encoder_counts_keeps_the_rounding_error():
    log = simulate(Model.default(), sample=0.005, duration=20)
    assert abs(noise_of(log, STEP).sigma[0] / TRUE[0] - 1) < 0.001


@pytest.mark.parametrize("noise", [0.001, 0.01])
def test_samples_at_unequal_times_do_not_pass_for_noise(noise):
    random = np.random.default_rng(3)
    t = np.sort(random.uniform(0.0, 40.0, 1600))
    swing = np.sin(6.3 * t) + noise * random.standard_normal(t.size)
    sigma = noise_of(Log("camera", t, np.zeros(t.size), swing[:, None], ("theta_1",), rates={})).sigma[0]
    assert sigma == pytest.approx(noise, rel=0.15)


def test_a_gap_makes_no_times_unequal():
    t = np.r_[np.arange(500), np.arange(700, 1200)] * 0.01
    values = np.sin(t) + 0.01 * np.random.default_rng(4).standard_normal(t.size)
    with_gap, without = (white_noise.difference_estimates(values, own) for own in (t, None))
    assert np.array(with_gap) == pytest.approx(np.array(without), rel=0.03)


@pytest.mark.parametrize("rate", [10.0, 20.0, 100.0])
def test_what_happens_in_a_gap_does_not_pass_for_noise(rate):
    t = np.arange(0.0, 80.0, 1.0 / rate)
    t = t[t % 4.0 < 3.3]  # a pause of 0.7 s every 4 s
    values = np.sin(1.3 * t) + 1e-4 * np.random.default_rng(4).standard_normal(t.size)
    assert white_noise.white_sigma(values, t=t) == pytest.approx(1e-4, rel=0.15)


def test_missing_values_do_not_pass_for_noise():
    log = simulated()
    holes = np.where(np.random.default_rng(0).random(log.measured.shape) < 0.1, np.nan, log.measured)
    assert np.abs(noise_of(Log("holes", log.t, log.voltage, holes, log.channels), STEP).sigma / TRUE - 1).max() < 0.1


def test_noise_that_is_not_gaussian_is_measured_by_its_standard_deviation():
    log = simulated(noise=False)
    noise = np.random.default_rng(0).laplace(scale=np.radians(0.5) / np.sqrt(2), size=log.measured.shape) * [0, 1, 1]
    estimated = noise_of(Log("laplace", log.t, log.voltage, log.measured + noise, log.channels)).sigma
    assert np.abs(estimated[1:] / TRUE[1:] - 1).max() < 0.05


def test_noise_added_to_a_quantised_channel_is_not_overlooked():
    log = simulated()
    noisy = log.measured + np.random.default_rng(0).normal(size=log.measured.shape) * [1e-3, 0, 0]
    assert noise_of(Log("noisy", log.t, log.voltage, noisy, log.channels), STEP).sigma[0] == pytest.approx(
        1e-3, rel=0.05
    )


def test_an_encoder_that_stands_still_lowers_the_noise_floor():
    t = np.arange(2000) * 1e-3
    wheel = np.round((0.3 + 0.2 * (t > 1.0) * (t - 1.0)) / 0.01) * 0.01
    pitch = np.random.default_rng(0).normal(size=(2000, 2)) * 0.01
    log = Log("still", t, np.ones(2000), np.column_stack([wheel, pitch]), ("theta_w", "theta_p", "dtheta_p"))
    assert 0.8 < noise_of(log, 0.01).floor < 0.97


def test_a_rate_whose_noise_is_smooth_has_the_size_by_which_it_contradicts_its_angle():
    log, random = simulated("aggressive", noise=False), np.random.default_rng(0)
    smooth = lfilter([1], [1, -0.95], lfilter([1], [1, -0.95], random.standard_normal(len(log))))
    rate = log.measured[:, 2] + 0.03 * smooth / smooth.std()
    angle = log.measured[:, 1] + 1e-4 * random.standard_normal(len(log))
    measured = np.column_stack([log.measured[:, 0], angle, rate])
    sigma = noise_of(Log("smooth", log.t, log.voltage, measured, log.channels)).sigma
    assert 0.5 < sigma[2] / 0.03 < 1.5


HALF_DEGREE = np.radians(0.5)


@pytest.mark.parametrize("sample", [0.001, 0.002])
def test_a_pitch_whose_noise_has_colour_is_not_taken_for_a_better_one(sample):
    model, log = complete_log("pitch coloured, 10 ms", 1, sample=sample)
    assert data.noise_of(log, model).sigma[1] == pytest.approx(HALF_DEGREE, rel=0.1)


def test_a_rate_whose_noise_has_colour_is_not_given_up():
    model, log = complete_log("gyro coloured, 5 ms", 1, sample=0.001)
    assert HALF_DEGREE < data.noise_of(log, model).sigma[2] < 3 * HALF_DEGREE


def test_noise_with_heavy_tails_is_not_read_as_smaller_by_a_quarter():
    log, random = simulated(noise=False), np.random.default_rng(0)
    noise = np.column_stack([np.zeros(len(log)), *(HALF_DEGREE * student(random, len(log), 0.001) for _ in range(2))])
    found = sensor_noise(Log("tails", log.t, log.voltage, log.measured + noise, log.channels), {}, {})
    assert found.sigma[1:] / noise[:, 1:].std(axis=0) == pytest.approx([1, 1], abs=0.25)


def test_an_encoder_coarser_than_stated_is_believed():
    log = complete_log("coarse encoder", 1)[1]
    assert sensor_noise(log, {}, {"theta_w": 2 * np.pi / 60000}).quantum[0] == pytest.approx(2 * np.pi / 2000)


def test_fast_motion_is_not_taken_for_noise():
    t = np.arange(4000) * 0.005
    noise = 1e-3 * np.random.default_rng(0).normal(size=(4000, 2))
    motion = 0.3 * np.sin(2 * np.pi * 4.0 * t)[:, None] + noise
    log = Log("fast", t, t, np.column_stack([t, motion]), ("theta_w", "theta_p", "dtheta_p"))
    assert sensor_noise(log, {}, {}).sigma[1:] == pytest.approx([1e-3, 1e-3], rel=0.1)


def test_one_reading_in_a_hundred_far_off_does_not_grow_the_noise():
    random = np.random.default_rng(1)
    noise = 1e-2 * random.normal(size=(8000, 2))
    noise[::100] += 0.2 * random.choice([-1.0, 1.0], size=(80, 2))
    t = np.arange(8000) * 0.005
    log = Log("spikes", t, t, np.column_stack([t, noise]), ("theta_w", "theta_p", "dtheta_p"))
    found = find_outliers(log, [0.0, 0.0, 0.0], ["theta_w", "theta_p"])
    assert 156 <= len(found.spikes) <= 160
    cleaned = without_outliers(log, found)
    assert sensor_noise(cleaned, {}, {}).sigma[1:] == pytest.approx([1e-2, 1e-2], rel=0.05)


@pytest.mark.parametrize("rate, tolerance", [(100, 0.05), (200, 0.03), (500, 0.03), (1000, 0.03)])
@pytest.mark.parametrize("command", ["simple", "aggressive"])
def test_the_noise_of_a_robot_that_its_controller_shakes_is_right_at_every_rate(command, rate, tolerance):
    found = [noise_of(simulate(Model.default(), command=command, sample=1 / rate, seed=s), STEP).sigma for s in (2, 3)]
    assert np.abs(np.mean(found, axis=0) / TRUE - 1).max() < tolerance


@pytest.mark.parametrize(
    "name, rate", [("slide", 500), ("pendulum", 100), ("pendulum", 1000), ("driven pendulum", 100)]
)
def test_the_noise_of_other_machines_is_right_at_every_rate(name, rate):
    model = model_of(name)
    log = simulate(model, sample=1 / rate, duration=20.0)
    assert data.noise_of(log, model).sigma == pytest.approx(noise_levels(model, log.channels), rel=0.05)


def test_a_controllers_own_law_does_not_pass_for_a_prediction_of_the_sensor():
    random = np.random.default_rng(0)
    noise = 1e-3 * random.normal(size=4000)
    log = Log("law", np.arange(4000) * 0.01, -50.0 * noise, noise[:, None], ("theta_p",))
    assert sensor_noise(log, {}, {}).sigma[0] == pytest.approx(1e-3, rel=0.03)


def test_noise_on_a_quantised_pitch_with_a_stated_step_is_seen():
    random, t = np.random.default_rng(0), np.arange(4000) * 0.01
    pitch = np.round((0.1 * np.sin(t) + 5e-3 * random.normal(size=4000)) / 1e-3) * 1e-3
    log = Log("both", t, np.cos(t), pitch[:, None], ("theta_p",))
    sigma = sensor_noise(log, {}, {"theta_p": 1e-3}).sigma[0]
    assert sigma == pytest.approx(np.hypot(5e-3, 1e-3 / np.sqrt(12)), rel=0.05)


def test_a_fused_pitch_is_said_to_be_fused_and_weighed_by_how_far_it_contradicts_the_gyro():
    log, random = simulated("aggressive", noise=False), np.random.default_rng(0)
    slow = lfilter([1], [1, -0.99], lfilter([1], [1, -0.99], random.standard_normal(len(log))))
    pitch = log.measured[:, 1] + 2e-3 * slow / slow.std() + 1e-7 * random.standard_normal(len(log))
    rate = log.measured[:, 2] + 0.005 * random.standard_normal(len(log))
    measured = np.column_stack([log.measured[:, 0], pitch, rate])
    found = noise_of(Log("fused", log.t, log.voltage, measured, log.channels), STEP)
    assert 0.5e-3 < found.sigma[1] < 4e-3
    assert any(r.startswith("theta_p was filtered") and "[sensors.noise] theta_p" in r for r in found.remarks)


def test_white_noise_is_not_said_to_be_filtered():
    assert noise_of(simulated(), STEP).remarks == ()


def test_an_encoder_that_repeats_its_counts_is_known():
    t = np.arange(2000) * 0.01
    slow, fast = (np.round(s * np.sin(t) / 0.01)[:, None] * 0.01 for s in (0.1, 50.0))
    assert sensor_noise(Log("slow", t, t, slow, ("theta_w",)), {}, {}).repeats
    assert not sensor_noise(Log("fast", t, t, fast, ("theta_w",)), {}, {}).repeats


def test_steps_are_found_in_numbers_of_few_digits():
    random = np.random.default_rng(0)
    counts = np.cumsum(random.integers(-1, 2, size=3000)) * 1.3975e-3
    assert find_quantum(counts.astype(np.float32).astype(float)) == pytest.approx(1.3975e-3, rel=1e-3)


def smooth_pitch():
    """A log whose pitch has noise with colour of a thousandth of a rad, and the log's clean rate."""
    log, random = simulated("aggressive", noise=False), np.random.default_rng(0)
    coloured = lfilter([1], [1, -0.95], random.standard_normal(len(log)))
    measured = log.measured.copy()
    measured[:, 1] += 1e-3 * coloured / coloured.std()
    return replace(log, measured=measured)


def without_rows(log, *ranges):
    keep = ~np.any([(log.t >= a) & (log.t < b) for a, b in ranges], axis=0)
    return replace(log, t=log.t[keep], voltage=log.voltage[keep], measured=log.measured[keep], reference=None)


def test_an_angle_contradicts_its_rate_no_more_in_a_log_with_gaps_and_jumps():
    log = smooth_pitch()
    whole = angle_rate_inconsistency(log, "theta_p")
    assert 0.7e-3 < whole < 1.1e-3
    gappy = without_rows(log, (2.2, 3.1), (5.3, 6.7), (11.1, 12.9))
    assert angle_rate_inconsistency(gappy, "theta_p") == pytest.approx(whole, rel=0.15)
    measured = log.measured.copy()
    measured[7200:, 1] += 0.3
    jumped = replace(log, measured=measured, breaks=(7200,))
    assert angle_rate_inconsistency(jumped, "theta_p") == pytest.approx(whole, rel=0.1)


def test_the_pieces_of_a_long_log_are_not_taken_for_one(monkeypatch):
    monkeypatch.setattr("wheelpend.logs.log.EXCERPT_SAMPLES", 8_000)
    log = replace(smooth_pitch(), breaks=(300, 15_000, 19_500))
    pieces = log.excerpt()
    assert len(pieces) == 8_000 and pieces.breaks == (300, *range(1000, 8000, 1000), 7499)
    assert np.isnan(pieces.measured[1000]).all()
    whole = angle_rate_inconsistency(log, "theta_p")
    assert angle_rate_inconsistency(pieces, "theta_p") == pytest.approx(whole, rel=0.2)
    assert all(s.settled > s.begin for s in pieces.stretches if s.begin % 1000 == 0)


def test_an_angle_known_in_every_tenth_sample_only_still_contradicts_its_rate():
    log = smooth_pitch()
    measured = log.measured.copy()
    measured[np.arange(len(log)) % 10 > 0, 1] = np.nan
    assert 0.5e-3 < angle_rate_inconsistency(replace(log, measured=measured), "theta_p") < 2e-3


@pytest.mark.parametrize("every", [2, 3, 10])
def test_the_noise_of_a_channel_that_is_read_now_and_then_is_not_its_motion(every):
    t = np.arange(4000) * 0.005
    t += 0.001 * np.random.default_rng(5).uniform(size=t.size)
    values = np.sin(2.0 * t) + 0.5 * np.sin(5.0 * t) + np.random.default_rng(6).normal(size=t.size, scale=1e-3)
    values[np.arange(t.size) % every > 0] = np.nan
    assert 0.8e-3 < white_noise.white_sigma(values, t=t) < 1.25e-3


def test_rounded_digits_hide_no_grid_of_several_hundred_steps():
    step = 60.0 / 1320 / 0.02  # rpm, of a count in a row
    rpm = step * np.arange(-280.0, 281.0)
    assert find_quantum(np.round(rpm, 2)) == pytest.approx(step, rel=1e-5)
    assert find_quantum(np.round(rpm + 0.3 * step * np.sin(np.arange(561.0)), 2)) != pytest.approx(step, rel=1e-2)


def stepped_motor(interval: float = 0.05, rows: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], volts and angles [rad] (rows,) of a motor that other volts drive every fourth row, noise 1 mrad."""
    random = np.random.default_rng(4)
    t, volts = interval * np.arange(rows), np.repeat(random.uniform(-6.0, 6.0, rows // 4), 4)
    speed, angle, angles = 0.0, 0.0, []
    lost = 1.0 - np.exp(-interval / 0.1)
    for u in volts:
        angles.append(angle)
        angle += 10.0 * u * interval + (speed - 10.0 * u) * 0.1 * lost
        speed += (10.0 * u - speed) * lost
    return t, volts, np.array(angles) + 1e-3 * random.standard_normal(rows)


@pytest.mark.parametrize("fault", ["none", "a row is lost", "four readings are missing", "the encoder jumps"])
def test_one_fault_in_a_slow_log_is_no_noise_of_its_sensor(fault):
    t, volts, angle = stepped_motor()
    kept = np.arange(t.size) != 1200 if fault == "a row is lost" else np.full(t.size, True)
    angle[1200:1204] = np.nan if fault == "four readings are missing" else angle[1200:1204]
    angle[1200:] += 0.5 if fault == "the encoder jumps" else 0.0
    log = Log("motor", t[kept], volts[kept], angle[kept, None], ("theta_m",))
    assert sensor_noise(log, {}, {}).sigma[0] == pytest.approx(1e-3, rel=0.1)
