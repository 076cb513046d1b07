"""A speed in the place of a position: it is summed over time."""

import numpy as np
import pytest

from wheelpend import Failure, Model
from wheelpend.identification.identify import identify
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.noise import sensor_noise
from wheelpend.logs.read import load_log, signals_of_file
from wheelpend.logs.summed_speed import lead_of_counts, speed_of_count, summed_over_time
from wheelpend.model.settings import Setting, with_settings

SLIDE, ROBOT = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n'), Model.default()
T = np.arange(0.0, 20.0, 0.01)
SPEED = 3.0 + np.sin(2.0 * T)
WAY = 3.0 * T + (1.0 - np.cos(2.0 * T)) / 2.0
VOLTS = np.sign(np.sin(T))


def read(speed, unit="m/s", **changed):
    table = {"t": T, "v_in": VOLTS, "speed": speed}
    return load_log(table, {"x": ColumnMap("speed", unit, **changed)}, SLIDE.table)


@pytest.mark.parametrize(("unit", "factor"), [("m/s", 1.0), ("cm/s", 100.0), ("mm/s", 1000.0)])
def test_the_way_is_the_integral_of_the_speed_in_any_unit(unit, factor):
    assert read(factor * SPEED, unit).measured[:, 0] == pytest.approx(WAY, abs=2e-4)
    turned = read(-factor * SPEED, unit, sign=-1, offset=0.5).measured[:, 0]
    assert turned == pytest.approx(WAY + 0.5, abs=2e-4)


def test_where_no_speed_was_read_the_way_is_missing_and_goes_on_behind():
    holes = SPEED.copy()
    holes[[0, 500, 501, 1999]] = np.nan
    way = read(holes).measured[:, 0]
    assert np.isnan(way[[0, 500, 501, 1999]]).all() and np.isfinite(way).sum() == len(T) - 4
    assert way[502:1999] == pytest.approx(WAY[502:1999], abs=2e-3)


COUNTS = np.round(1024 / (2.0 * np.pi) * WAY)  # of an encoder with 1024 per turn
COUNTED_RPM = np.diff(COUNTS, prepend=COUNTS[0]) / 1024 * 60.0 / 0.01


@pytest.mark.parametrize("digits", [12, 3])
def test_a_speed_of_counts_per_row_sums_to_what_the_encoder_read(digits):
    rpm = np.round(COUNTED_RPM, digits)
    assert speed_of_count(rpm * np.pi / 30.0, T) == pytest.approx(2.0 * np.pi / 1024 / 0.01, rel=1e-4)
    way = load_log({"t": T, "v_in": VOLTS, "n": rpm}, {"x": ColumnMap("n", "m/s", scale=np.pi / 30.0)}, SLIDE.table)
    late = np.abs(way.measured[:, 0] - COUNTS * 2.0 * np.pi / 1024).max()
    assert late < 0.002, "half an interval is 0.015 of the way"


def test_two_decimals_are_enough_for_a_speed_of_many_counts():
    counts = np.round(1320 / (2.0 * np.pi) * 20.0 * WAY)
    rpm = np.round(np.diff(counts, prepend=counts[0]) / 1320 * 60.0 / 0.01, 2)
    assert speed_of_count(rpm * np.pi / 30.0, T) == pytest.approx(2.0 * np.pi / 1320 / 0.01, rel=1e-4)
    way = summed_over_time(rpm * np.pi / 30.0, T) * 1320 / (2.0 * np.pi)
    assert np.abs(way - counts).max() < 0.1, "its digits do not add up"


def test_counts_behind_a_gear_of_which_no_whole_number_makes_a_turn_are_told_by_their_errors():
    counts = np.floor(937.2 / (2.0 * np.pi) * 6.0 * WAY[:500])  # 44 at the motor, behind 21.3 to 1
    rpm = np.round(np.diff(counts, prepend=counts[0]) / 937.2 * 60.0 / 0.01, 2)
    assert speed_of_count(rpm * np.pi / 30.0, T[:500]) == pytest.approx(2.0 * np.pi / 937.2 / 0.01, rel=1e-4)
    way = summed_over_time(rpm * np.pi / 30.0, T[:500]) * 937.2 / (2.0 * np.pi)
    assert np.abs(way - (counts - counts[0])).max() < 0.1
    between = np.gradient(counts) / 937.2 * 2.0 * np.pi / 0.01  # from the row before to the one behind
    assert lead_of_counts(np.round(between * 2.0 * 937.2 * 0.01 / (2.0 * np.pi))) < 0.0
    assert np.abs(summed_over_time(between, T[:500]) * 937.2 / (2.0 * np.pi) - (counts - counts[0])).max() > 0.4


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_what_a_converter_rounds_is_no_count_however_long_it_is_watched(noise):
    steps = SPEED * 0.01 * 937.2 / (2.0 * np.pi) * 6.0 + noise * np.random.default_rng(1).standard_normal(len(T))
    assert lead_of_counts(np.round(steps)) < -50.0 and lead_of_counts(np.round(steps[:500])) < 0.0
    assert lead_of_counts(np.arange(300.0)) == 0.0, "what goes on evenly has no errors"
    assert lead_of_counts(np.round(steps[:20])) == 0.0 and lead_of_counts(np.zeros(100)) == 0.0


def test_counts_sum_to_counts_however_late_a_row_comes_and_their_error_is_that_of_rounding():
    late = T + 0.0003 * np.random.default_rng(3).uniform(size=len(T)) * (np.arange(len(T)) % 40 == 0)
    columns = {"t": late, "v_in": VOLTS, "n": COUNTED_RPM}
    log = load_log(columns, {"x": ColumnMap("n", "m/s", scale=np.pi / 30.0)}, SLIDE.table)
    count = 2.0 * np.pi / 1024
    ways = np.diff(log.measured[5:, 0]) / count
    assert ways == pytest.approx(np.round(ways), abs=1e-3)
    assert sensor_noise(log, {}, {}).sigma[0] == pytest.approx(count / np.sqrt(12.0), rel=0.05)


def test_cells_that_are_empty_cost_no_other_reading():
    counts = np.round(1374 / (2.0 * np.pi) * 20.0 * WAY)
    rpm = np.round(np.diff(counts, prepend=counts[0]) / 1374 * 60.0 / 0.01, 2)
    for hole in range(200, 1600, 53):
        holed = rpm.copy()
        holed[hole : hole + 7] = np.nan
        way = summed_over_time(holed * np.pi / 30.0, T) * 1374 / (2.0 * np.pi)
        assert np.isfinite(way).sum() == len(T) - 7
        assert np.abs(way - counts)[: hole - 1].max() < 0.1 and np.abs(way - counts)[hole + 8 :].max() < 20.0


@pytest.mark.parametrize(
    ("speed", "unit"),
    [
        (np.round(SPEED * 30.0 / np.pi, 1), np.pi / 30.0),  # rpm to a digit: 60000 in a turn and an interval
        (np.round(SPEED * 180.0 / np.pi), np.pi / 180.0),
        (np.round(SPEED / 0.0371) * 0.0371, 1.0),  # of a tachometer's converter
        (SPEED, 1.0),
        (np.full(len(T), np.nan), 1.0),
    ],
)
def test_digits_and_other_steps_are_no_counts(speed, unit):
    assert speed_of_count(speed * unit, T) == 0.0


def test_counts_between_rows_at_uneven_times_are_no_steps_of_a_speed():
    t = T + 0.003 * np.sin(np.arange(len(T)))
    assert speed_of_count(COUNTED_RPM * np.pi / 30.0, t) == 0.0
    gap = T + 0.3 * (T > 5.0)
    assert speed_of_count(COUNTED_RPM * np.pi / 30.0, gap) == pytest.approx(2.0 * np.pi / 1024 / 0.01, rel=1e-4)
    assert speed_of_count(COUNTED_RPM * np.pi / 30.0, np.zeros(len(T))) == 0.0


def test_it_neither_wraps_nor_starts_again():
    steps = np.where(np.arange(len(T)) % 400 == 0, -600.0, 1.0)  # as far as an encoder that starts again
    assert np.diff(read(steps).measured[:, 0]).min() < -2.0


def test_raw_signals_are_summed_too(tmp_path):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{t:.2f},{v:.0f},{s:.6f}" for t, v, s in zip(T, VOLTS, SPEED, strict=True))
    path.write_text(f"t,v_in,speed\n{rows}\n")
    t, signals = signals_of_file(path, {"x": ColumnMap("speed", "m/s")}, SLIDE.table)
    assert signals["x"] == pytest.approx(WAY, abs=2e-4) and len(t) == len(T)


def test_a_pitch_that_a_gyro_sums_is_refused_and_so_is_a_unit_of_another_kind():
    columns = dict.fromkeys(("t", "v_in", "theta_w", "theta_p", "dtheta_p"), T)
    found = load_log(columns, {"theta_w": ColumnMap("theta_w", "rpm")}, ROBOT.table)
    assert found.measured[-1, 0] == pytest.approx(T[-1] ** 2 / 2 * np.pi / 30, rel=1e-6)
    with pytest.raises(Failure, match="theta_p must have a unit that turns into rad"):
        load_log(columns, {"theta_p": ColumnMap("theta_p", "deg/s")}, ROBOT.table)
    with pytest.raises(Failure, match="x must have a unit that turns into m "):
        read(SPEED, "rpm")
    settings = [Setting.parse(text) for text in ("columns.x.column=speed", "columns.x.unit=m/s")]
    assert with_settings(SLIDE, settings).columns["x"].unit == "m/s"


def test_single_readings_that_are_far_off_are_left_out_of_the_sum():
    spiked = SPEED.copy()
    spiked[[300, 900]] = 500.0
    way = read(spiked).measured[:, 0]
    assert np.isnan(way[[300, 900]]).all() and way[901:] == pytest.approx(WAY[901:], abs=5e-3)
    with pytest.raises(Failure, match=r"inf"):
        read(np.where(np.arange(len(T)) == 7, np.inf, SPEED))


def test_a_speed_by_the_row_of_units_is_summed(tmp_path):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{t:.2f},{v:.0f},{s:.6f}" for t, v, s in zip(T, VOLTS, 100.0 * SPEED, strict=True))
    path.write_text(f"t,v_in,x\ns,V,cm/s\n{rows}\n")
    log = load_log(path, {}, SLIDE.table)
    assert log.measured[:, 0] == pytest.approx(WAY, abs=2e-4)
    assert any("x is in cm/s by the file's row of units, a speed, and is summed over time." in w for w in log.warnings)


def test_a_speed_without_noise_is_not_trusted_beyond_what_can_be_integrated():
    assert sensor_noise(read(np.full(len(T), 3.0)), {}, {}).sigma[0] > 0.0


def test_pauses_between_bursts_count_by_their_length_in_the_noise():
    intervals = np.where(np.arange(len(T) - 1) % 5 == 0, 0.014, 0.002)
    t = np.concatenate([[0.0], np.cumsum(intervals)])
    noise = 0.02 * np.random.default_rng(3).normal(size=len(t))
    log = load_log({"t": t, "v_in": VOLTS, "speed": SPEED + noise}, {"x": ColumnMap("speed", "m/s")}, SLIDE.table)
    even = load_log({"t": 0.0044 * np.arange(len(t)), "v_in": VOLTS, "speed": SPEED + noise},
                    {"x": ColumnMap("speed", "m/s")}, SLIDE.table)  # fmt: skip
    sigma = [sensor_noise(one, {}, {}).sigma[0] for one in (log, even)]
    assert sigma[0] / sigma[1] == pytest.approx(np.sqrt(0.0096 / 0.0044), rel=0.15)


def test_its_noise_is_how_far_the_sum_wanders_from_a_line_within_a_segment():
    noise = 0.02 * np.random.default_rng(3).normal(size=len(T))
    sigma = sensor_noise(read(SPEED + noise), {}, {}).sigma[0]
    wander = np.cumsum(noise) * 0.01
    pieces = wander.reshape(-1, 50)
    line = np.arange(50.0)
    rest = [np.std(p - np.polyval(np.polyfit(line, p, 1), line)) for p in pieces]
    assert sigma == pytest.approx(np.sqrt(np.mean(np.square(rest))), rel=0.25)
    assert sensor_noise(read(SPEED + noise), {"x": 0.1}, {}).sigma[0] == 0.1


def test_inertia_and_friction_are_found_from_a_speed_alone():
    """A slide of 0.3 V s²/m and 2 V s/m, by its closed form, behind a tachometer of 0.01 m/s of noise."""
    volts = np.repeat(np.random.default_rng(4).uniform(-4.0, 4.0, 40), 50)
    speed, decay = np.zeros(len(T)), np.exp(-0.01 * 2.0 / 0.3)
    for k in range(len(T) - 1):
        speed[k + 1] = decay * speed[k] + (1.0 - decay) * volts[k] / 2.0
    table = {"t": T, "v_in": volts, "speed": speed + 0.01 * np.random.default_rng(5).normal(size=len(T))}
    log = load_log(table, {"x": ColumnMap("speed", "m/s")}, SLIDE.table)
    found = identify(SLIDE, [log]).parameters
    for name, truth in (("X1", 0.3), ("viscous_drive.coefficient", 2.0)):
        assert abs(found[name].value - truth) < 4.0 * found[name].sigma < 0.2 * truth
