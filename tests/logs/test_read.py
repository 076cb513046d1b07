"""Measurement files: what is read, what is refused, what is remarked on."""

import numpy as np
import polars as pl
import pytest

from tests.support import CHANNELS, simulated
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.estimation.data import prepare
from wheelpend.inspection.inspect import inspect_log
from wheelpend.logs.checks import moves, silent_channels
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log
from wheelpend.logs.units import UNIT_CONVERSIONS

HEADER = "t,v_in,theta_w,theta_p,dtheta_p"


def rows(n=30, dt=0.01):
    """Text cells of n plausible samples, one list per row."""
    return [[f"{k * dt:.6f}", f"{(-1) ** k}", f"{0.1 * k:.3f}", f"{0.01 * k:.3f}", f"{0.02 * k:.3f}"] for k in range(n)]


def write(folder, cells, header=HEADER, name="walk.csv"):
    """A CSV file of the given cells."""
    path = folder / name
    path.write_text("\n".join([header, *(",".join(row) for row in cells)]) + "\n")
    return path


def synthetic(n=1000, dt=0.01, t=None):
    """A log in memory, standing still but for its input."""
    t = np.arange(n) * dt if t is None else t
    return Log("made.csv", t, np.sin(9 * t), np.zeros((len(t), 3)), CHANNELS)


def failure(path, **options):
    """The message with which a file is refused."""
    with pytest.raises(Failure) as caught:
        load_log(path, **options)
    return str(caught.value)


# ---- reading


def test_a_plain_file_is_read_without_remarks(tmp_path):
    log = load_log(write(tmp_path, rows()))
    assert (log.name, log.channels, log.warnings, len(log)) == ("walk.csv", CHANNELS, (), 30)
    assert log.measured.shape == (30, 3)
    assert log.reference is None
    assert (log.dt, log.duration) == (pytest.approx(0.01), pytest.approx(0.29))


def test_time_counts_from_the_first_sample(tmp_path):
    cells = [[str(1_700_000_000 + k), *row[1:]] for k, row in enumerate(rows())]
    log = load_log(write(tmp_path, cells), {"t": ColumnMap("t", "ms")})
    np.testing.assert_allclose(log.t, np.arange(30) * 1e-3, atol=1e-15)


def test_spaces_quotes_a_byte_order_mark_and_blank_lines_at_the_end_do_no_harm(tmp_path):
    cells = [[f" {cell} " for cell in row] for row in rows()]
    path = write(tmp_path, cells, header='\ufefft , v_in, "theta_w",theta_p , dtheta_p')
    path.write_text(path.read_text() + "\n\n")
    np.testing.assert_array_equal(load_log(path).measured, load_log(write(tmp_path, rows(), name="b.csv")).measured)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_are_recognised(tmp_path, separator):
    path = write(tmp_path, rows())
    path.write_text(path.read_text().replace(",", separator))
    assert len(load_log(path)) == 30


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", " "])
def test_missing_cells_become_nan_and_are_counted(tmp_path, cell):
    cells = rows()
    cells[7][3] = cell
    log = load_log(write(tmp_path, cells))
    assert np.flatnonzero(np.isnan(log.measured[:, 1])).tolist() == [7]
    assert log.warnings == ("theta_p is missing in 1 of 30 samples (3.33 %).",)


def test_further_columns_are_ignored_whatever_they_hold(tmp_path):
    cells = [[*row, "fine", "0.1"] for row in rows()]
    log = load_log(write(tmp_path, cells, header=HEADER + ",remark,theta_ref"))
    np.testing.assert_array_equal(log.reference, np.full(30, 0.1))


def test_mapped_columns_are_converted_in_unit_and_sign(tmp_path):
    path = write(tmp_path, rows(), header="ms,mv,turns,pitch_deg,rpm")
    columns = {
        "t": ColumnMap("ms", "ms"),
        "v_in": ColumnMap("mv", "mV"),
        "theta_w": ColumnMap("turns", "rev", sign=-1),
        "theta_p": ColumnMap("pitch_deg", "deg"),
        "dtheta_p": ColumnMap("rpm", "rpm"),
    }
    log = load_log(path, columns)
    expected = [-2 * np.pi, np.pi / 180 * 0.1, 2 * np.pi / 60 * 0.2]
    np.testing.assert_allclose(log.measured[10], expected, rtol=1e-12)
    np.testing.assert_allclose([log.t[10], log.voltage[10]], [1e-4, 1e-3])


def test_a_map_to_an_absent_column_falls_back_to_our_name_and_says_so(tmp_path):
    log = load_log(write(tmp_path, rows()), {"theta_p": ColumnMap("pitch_deg", "deg")})
    assert log.measured[10, 1] == pytest.approx(0.1)
    assert "pitch_deg" in log.warnings[0]


@pytest.mark.parametrize("name", ["log.csv", "log.parquet"])
def test_a_saved_log_comes_back_exactly(tmp_path, name):
    rng = np.random.default_rng(1)
    measured = rng.normal(size=(40, 3)) * 0.1
    measured[3, 2] = np.nan
    log = Log("x", np.arange(40) * 0.01, rng.normal(size=40), measured, CHANNELS, rng.normal(size=40))
    save_log(tmp_path / name, log, extra={"current": np.ones(40)})
    back = load_log(tmp_path / name)
    for field in ("t", "voltage", "measured", "reference"):
        np.testing.assert_array_equal(getattr(back, field), getattr(log, field))
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_saving_where_no_folder_is_fails_in_words(tmp_path):
    with pytest.raises(Failure, match="cannot be written"):
        save_log(tmp_path / "absent" / "log.csv", synthetic())


# ---- refusals


def test_a_missing_file_an_empty_one_a_folder_and_a_binary_one_are_refused(tmp_path):
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "binary.mat").write_bytes(b"MATLAB\0\1\2")
    (tmp_path / "broken.parquet").write_bytes(b"PAR1 but no more")
    assert "there is none at" in failure(tmp_path / "absent.csv")
    assert "empty" in failure(tmp_path / "empty.csv")
    assert "is a folder" in failure(tmp_path)
    assert "neither CSV" in failure(tmp_path / "binary.mat")
    assert "damaged" in failure(tmp_path / "broken.parquet")


def test_missing_columns_are_refused_with_the_lines_that_would_map_them(tmp_path):
    message = failure(write(tmp_path, rows(), header="time_ms,v_in,theta_w,pitch_deg,pitch_rate"))
    assert "The file has: time_ms, v_in, theta_w, pitch_deg, pitch_rate" in message
    assert "[columns]\n" in message
    assert 't = { column = "time_ms", unit = "ms" }' in message
    assert 'theta_p = { column = "pitch_deg", unit = "deg" }' in message
    assert 'dtheta_p = { column = "pitch_rate", unit = "rad/s" }' in message


def test_a_cell_that_is_no_number_is_refused_with_row_and_column(tmp_path):
    cells = rows()
    cells[11][2] = "oops"
    assert "row 12 of column theta_w has 'oops'" in failure(write(tmp_path, cells))


def test_a_row_with_too_many_cells_is_refused(tmp_path):
    cells = rows()
    cells[5].append("1")
    assert "as many cells as the header; row 6 has 6, the header 5" in failure(write(tmp_path, cells))


def test_a_parquet_column_of_another_kind_is_refused(tmp_path):
    table = pl.DataFrame({name: np.arange(30.0) for name in HEADER.split(",")})
    table.with_columns(theta_w=pl.lit(True)).write_parquet(tmp_path / "log.parquet")
    assert "theta_w must hold numbers; it holds Boolean" in failure(tmp_path / "log.parquet")


@pytest.mark.parametrize("n", [0, 1, 19])
def test_fewer_than_twenty_samples_are_too_short(tmp_path, n):
    assert f"too short. It must have at least 20 samples; it has {n}" in failure(write(tmp_path, rows(n)))


def test_time_that_does_not_grow_is_refused_with_row_and_values(tmp_path):
    cells = rows()
    cells[9][0] = "0.08"
    assert "row 10 has 0.08 after 0.08 in row 9" in failure(write(tmp_path, cells))


@pytest.mark.parametrize("cell", ["", "inf"])
def test_a_sample_without_a_time_is_refused(tmp_path, cell):
    cells = rows()
    cells[4][0] = cell
    assert "row 5 of t has none" in failure(write(tmp_path, cells))


def test_infinite_values_a_dead_sensor_and_a_still_input_are_refused(tmp_path):
    infinite = [*rows(29), ["1", "1", "0", "-inf", "0"]]
    assert "row 30 of theta_p is infinite" in failure(write(tmp_path, infinite))
    assert "dtheta_p has no values" in failure(write(tmp_path, [[*row[:4], ""] for row in rows()]))
    assert "it is 2 V throughout" in failure(write(tmp_path, [[row[0], "2", *row[2:]] for row in rows()]))


def test_duplicate_columns_are_refused(tmp_path):
    twice = HEADER.replace("theta_p", "theta_w", 1)
    assert "theta_w is there more than once" in failure(write(tmp_path, rows(), header=twice))


def test_a_wrong_or_unfitting_unit_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(Failure, match="Did you mean 'deg'"):
        ColumnMap("pitch", "degree")
    unfitting = {"theta_p": ColumnMap("theta_p", "deg/s")}
    assert "(rad, mrad, deg, rev), not 'deg/s'" in failure(write(tmp_path, rows()), columns=unfitting)


# ---- remarks


def test_gaps_are_counted_and_the_longest_named(tmp_path):
    cells = rows(60)
    log = load_log(write(tmp_path, cells[:20] + cells[30:40] + cells[46:]))
    assert log.warnings == ("2 gaps in the sampling, the longest 0.11 s after t = 0.19 s.",)


def test_a_pitch_in_degrees_a_fall_and_a_still_sensor_are_remarked_on(tmp_path):
    degrees = [[*row[:3], str(0.5 * k), row[4]] for k, row in enumerate(rows())]
    fall = [[*row[:3], str(0.06 * k), row[4]] for k, row in enumerate(rows())]
    still = [[*row[:2], "0.5", *row[3:]] for row in rows()]
    assert 'theta_p = { column = "theta_p", unit = "deg" }' in load_log(write(tmp_path, degrees)).warnings[0]
    (fell,) = load_log(write(tmp_path, fall)).warnings
    assert "from t = 0.27 s: the robot fell over" in fell and 'a swing-up, set range = "any" in [assumptions].' in fell
    late = [[*row[:3], str(0.06 * k if k > 28 else 0.1 * (k % 2)), row[4]] for k, row in enumerate(rows())]
    assert "swing-up" not in load_log(write(tmp_path, late)).warnings[0]  # it stood for nearly all of the log
    hanging = [[*row[:3], str(3.1 + 0.01 * (k % 30)), row[4]] for k, row in enumerate(rows())]
    (hung,) = load_log(write(tmp_path, hanging)).warnings  # all of it, and in rad though it goes beyond π
    assert "Those samples (100 %) are left out" in hung and "degrees" not in hung
    assert load_log(write(tmp_path, still)).warnings == ("theta_w is 0.5 throughout: this sensor says nothing.",)


UNITS = {
    "rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180, "rev": 2 * np.pi, "rad/s": 1.0, "deg/s": np.pi / 180,
    "rev/s": 2 * np.pi, "rpm": np.pi / 30, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "m/s": 1.0, "cm/s": 1e-2,
    "mm/s": 1e-3, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9,
    "V": 1.0, "mV": 1e-3, "A": 1.0, "mA": 1e-3, "N m": 1.0, "N cm": 1e-2,
    "mN m": 1e-3, "N": 1.0, "mN": 1e-3, "kN": 1e3,
}  # fmt: skip


def test_every_unit_has_its_size():
    assert {unit: size for unit, (_, size) in UNIT_CONVERSIONS.items()} == pytest.approx(UNITS)


def test_a_columns_scale_and_sign_multiply_its_unit(tmp_path):
    path = write(tmp_path, rows(), header="t,duty,theta_w,theta_p,gyro")
    columns = {"v_in": ColumnMap("duty", sign=-1, scale=12.0), "dtheta_p": ColumnMap("gyro", "deg/s", scale=2.0)}
    log = load_log(path, columns)
    assert log.voltage[1] == -12.0 * -1.0
    assert log.measured[10, 2] == pytest.approx(2.0 * np.radians(0.2))


def test_further_columns_are_saved_with_a_log(tmp_path):
    save_log(tmp_path / "log.csv", synthetic(30), extra={"current": np.arange(30.0)})
    frame = pl.read_csv(tmp_path / "log.csv")
    assert frame.columns == ["t", "v_in", *CHANNELS, "current"]
    assert frame["current"].to_list() == list(range(30))
    with pytest.raises(Failure, match="must have 30 values to be saved; current has 29"):
        save_log(tmp_path / "log.csv", synthetic(30), extra={"current": np.arange(29.0)})


def test_the_longest_gap_is_named_wherever_it_is(tmp_path):
    cells = rows(60)
    log = load_log(write(tmp_path, cells[:20] + cells[26:40] + cells[50:]))
    assert log.warnings == ("2 gaps in the sampling, the longest 0.11 s after t = 0.39 s.",)


def test_missing_samples_are_counted(tmp_path):
    cells = rows(40)
    for k in (3, 7, 9, 20):
        cells[k][3] = ""
    assert load_log(write(tmp_path, cells)).warnings == ("theta_p is missing in 4 of 40 samples (10 %).",)


def test_an_offset_is_added_after_unit_sign_and_scale(tmp_path):
    path = write(tmp_path, rows(), header="t,v_in,theta_w,pitch_deg,dtheta_p")
    pitch = ColumnMap("pitch_deg", "deg", sign=-1, scale=2.0, offset=0.5)
    log = load_log(path, {"theta_p": pitch, "v_in": ColumnMap("v_in", offset=1.0)})
    assert log.measured[10, 1] == pytest.approx(-2.0 * np.radians(0.1) + 0.5)
    assert log.voltage[:2].tolist() == [2.0, 0.0]


def test_an_encoder_with_an_offset_still_starts_again_at_its_own_zero(tmp_path):
    cells = rows(200)
    for k in range(120, 200):
        cells[k][2] = f"{0.1 * (k - 120):.3f}"
    log = load_log(write(tmp_path, cells), {"theta_w": ColumnMap("theta_w", offset=-3.0)})
    assert "jumps to zero once" in log.warnings[0]
    assert np.max(np.abs(np.diff(log.measured[:, 0]))) < 0.11
    assert log.measured[0, 0] == pytest.approx(-3.0)


def test_an_offset_of_the_times_and_one_that_is_no_number_are_refused(tmp_path):
    with pytest.raises(Failure, match="offset must be a finite number"):
        ColumnMap("pitch", offset=float("nan"))
    message = failure(write(tmp_path, rows()), columns={"t": ColumnMap("t", offset=1.0)})
    assert "t must have no offset" in message


def test_a_torque_for_a_voltage_is_refused_with_the_entry_that_cures_it(tmp_path):
    with pytest.raises(Failure, match="Did you mean 'N m'"):
        ColumnMap("tau", "Nm")
    message = failure(write(tmp_path, rows()), columns={"v_in": ColumnMap("v_in", "mN m")})
    assert 'If the machine is commanded a torque, say so: [input] unit = "N m".' in message


def test_what_shakes_fast_about_one_place_moves():
    t = np.arange(2500) * 4e-4
    noise = 2e-6 * np.random.default_rng(7).standard_normal(t.size)
    assert moves(0.015 * np.sin(2 * np.pi * 50.0 * t) + noise, 4e-4)  # whole periods in a tenth of a second
    assert not moves(noise, 4e-4)


@pytest.mark.parametrize(
    ("readings", "said"),
    [(0.0, r"dtheta_p must change where theta_p does.*0 rad/s throughout.*gyro"), (None, "but has 3 values")],
)
def test_a_sensor_that_is_not_there_is_named_by_inspect_and_refused_by_every_fit(readings, said):
    log = simulated(duration=2.0)
    columns = {"t": log.t, "v_in": log.voltage, **dict(zip(log.channels, log.measured.T.copy(), strict=True))}
    if readings is None:
        columns["dtheta_p"][3:] = np.nan
    else:
        columns["dtheta_p"][:] = readings
    silent = load_log(columns)
    assert "dtheta_p" in [f.channel for f in inspect_log(silent).findings if f.kind == "silent_sensor"]
    with pytest.raises(Failure, match=said):
        prepare(Model.default(), silent)


def test_a_rate_that_is_one_value_where_the_machine_goes_evenly_is_right():
    t = 0.01 * np.arange(200)
    table = Model.parse('plant = "shaft"\n\n[assumptions]\nrate_sensor = true\n').table
    place = 3.0 * t + 1e-4 * np.random.default_rng(1).standard_normal(t.size)
    even = Log.from_arrays(t, table=table, v_in=np.sin(t), theta_m=place, dtheta_m=np.full(t.size, 3.0))
    assert not silent_channels(even, table)
    stuck = Log.from_arrays(t, table=table, v_in=np.sin(t), theta_m=place, dtheta_m=np.zeros(t.size))
    assert list(silent_channels(stuck, table)) == ["dtheta_m"]
