"""Angles that wrap, encoders that start again, and files that are no CSV."""

import numpy as np
import pytest
from scipy.io import savemat

from wheelpend import Failure, Model
from wheelpend.inspection.inspect import inspect_file
from wheelpend.inspection.standstill import standstill_times
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.read import load_log, save_log
from wheelpend.logs.unwrap import make_continuous

T = np.arange(4000) * 0.002
TURNING = 30.0 * np.sin(0.5 * T) + 0.1 * np.sin(9 * T)


def test_a_wrapped_angle_is_made_continuous():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    found, remarks = make_continuous("theta_1", wrapped, T, "rad")
    np.testing.assert_allclose(np.diff(found), np.diff(TURNING), atol=1e-9)
    assert "was wrapped" in remarks[0]


def test_an_encoder_that_starts_again_goes_on_where_it_was():
    reset = TURNING.copy()
    reset[1500:] -= reset[1500]
    reset[2900:] -= reset[2900]
    found, remarks = make_continuous("theta_w", reset, T, "rad")
    np.testing.assert_allclose(found, TURNING, atol=0.1)  # a step's own motion is lost at each start
    assert "2 times, first 3" in remarks[0]


@pytest.mark.parametrize("name", ["still", "noise", "swing", "dropout", "fast start"])
def test_what_is_continuous_stays_as_it_is(name):
    rng = np.random.default_rng(4)
    signals = {
        "still": np.zeros(4000),
        "noise": rng.normal(size=4000),
        "swing": np.sin(20 * T),
        "dropout": np.where(np.arange(4000) == 700, 0.0, 3.0 + np.sin(3 * T)),
        "fast start": np.tanh(T) * 5.0,
    }
    found, remarks = make_continuous("x", signals[name], T, "m")
    assert found is signals[name] and remarks == []


def test_a_gap_does_not_hide_a_wrap():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    for first in range(300, 3600, 170):
        cut = wrapped.copy()
        cut[first : first + 100] = np.nan
        assert "was wrapped" in make_continuous("theta_1", cut, T, "rad")[1][0]


SQUARE = np.where(np.sin(4 * T) > 0, 0.1, 0.0) + 1e-5 * np.sin(50 * T)
RETURN = np.interp(T, [0, 2, 4, 8], [0, 0.2, 0.0, 0.0]) + 1e-5 * np.sin(50 * T)
SWING = np.where(T < 5, 0.7 * np.sin(3 * T), 0.0) + 1e-4 * np.sin(40 * T)


@pytest.mark.parametrize(
    ("motion", "lost"),
    [
        (SQUARE, slice(0, 0)),  # it jumps back
        (RETURN, slice(1000, 2100)),  # what happened in between is not known
        (SWING, slice(2490, 2520)),
        (np.where((T > 3) & (T < 3.2), 0.0, 0.4 + 0.01 * np.sin(9 * T)), slice(0, 0)),  # a sensor that gave nothing
    ],
)
def test_motion_and_dropouts_are_no_encoder_that_starts_again(motion, lost):
    values = motion.copy()
    values[lost] = np.nan
    found, remarks = make_continuous("x", values, T, "m")
    assert found is values and remarks == []


def test_missing_samples_do_not_hide_a_wrap():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    wrapped[::7] = np.nan
    found, _ = make_continuous("theta_1", wrapped, T, "rad")
    good = np.isfinite(found)
    assert np.abs(found[good] - TURNING[good] - (found[good] - TURNING[good])[0]).max() < 1e-9


def test_a_place_stands_still_where_it_moves_less_than_its_noise():
    place = np.concatenate([np.linspace(0, 1, 500), np.full(300, 1.0), np.linspace(1, 2, 500)])
    found = standstill_times(np.arange(1300) * 0.001, place + np.random.default_rng(1).normal(0, 1e-4, 1300), 1e-3)
    assert len(found) == 1 and found[0] == pytest.approx((0.5, 0.8), abs=0.01)


# ---- MATLAB files


def table(names):
    rng = np.random.default_rng(2)
    return {n: rng.normal(size=300) for n in names} | {"t": np.arange(300) * 0.01}


def test_a_matlab_file_is_read_with_its_structures_and_the_columns_of_its_matrices(tmp_path):
    rng = np.random.default_rng(3)
    q = np.column_stack([np.cumsum(rng.normal(size=300)), np.cumsum(rng.normal(size=300))])
    savemat(
        tmp_path / "log.mat", {"run": {"time": np.arange(300) * 0.01, "u": rng.normal(size=300)}, "q": q, "Ts": 0.01}
    )
    columns = {"t": ColumnMap("run.time"), "v_in": ColumnMap("run.u", scale=2.0), "x": ColumnMap("q[2]", "mm")}
    log = load_log(tmp_path / "log.mat", columns, Model.default("slide").table)
    np.testing.assert_allclose(log.measured[:, 0], 1e-3 * q[:, 1])
    assert len(log) == 300 and log.dt == pytest.approx(0.01)


@pytest.mark.parametrize(
    "content", [b"MATLAB 5.0 MAT-file" + b"\0" * 200, b"MATLAB 5.0 MAT-file, made" + bytes(range(256))]
)
def test_a_damaged_matlab_file_is_refused(tmp_path, content):
    (tmp_path / "log.mat").write_bytes(content)
    with pytest.raises(Failure, match=r"damaged|must hold numeric vectors"):
        load_log(tmp_path / "log.mat")


def test_a_matlab_file_without_vectors_is_refused(tmp_path):
    savemat(tmp_path / "log.mat", {"gain": 3.0, "name": "robot"})
    with pytest.raises(Failure, match="must hold numeric vectors"):
        load_log(tmp_path / "log.mat")


# ---- columns under other names


def test_columns_are_guessed_by_name_unit_and_by_what_grows(tmp_path):
    from tests.conftest import simulated

    log = simulated(duration=4.0)
    save_log(tmp_path / "plain.csv", log)
    header = "clock,motor_cmd,enc_wheel,pitch_deg,gyro_y [deg/s]"
    rows = np.column_stack([1e3 * log.t, log.voltage, log.measured[:, 0], np.degrees(log.measured[:, 1:])])
    np.savetxt(tmp_path / "odd.csv", rows, delimiter=",", header=header, comments="")
    plain, _ = inspect_file(Model.default(), tmp_path / "plain.csv")
    read, found = inspect_file(Model.default(), tmp_path / "odd.csv")
    np.testing.assert_allclose(read.measured, plain.measured, atol=1e-9)
    np.testing.assert_allclose(read.t, plain.t, atol=1e-9)
    assert 't = { column = "clock", unit = "ms" }' in found.proposal
    assert 'dtheta_p = { column = "gyro_y [deg/s]", unit = "deg/s" }' in found.proposal
    again = Model.parse(Model.default().text.partition("[columns]")[0] + found.proposal)
    assert again.columns["theta_p"].unit == "deg"
