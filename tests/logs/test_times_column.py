"""A column of a log may be multiplied by another, sample by sample: a duty by the battery's volts."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from tests.raw_logs import driven_axis, write_csv
from wheelpend import Failure, Model, load_log
from wheelpend.inspection.findings import LogCorrections
from wheelpend.logs.columns import ColumnMap

MODEL = """# mine
plant = "slide"
[columns]
v_in = {{ column = "pwm", scale = 0.004{entry} }}
"""


def duty_and_battery() -> dict[str, np.ndarray]:
    t, volts, way = driven_axis(400)
    return {"t": t, "pwm": np.round(20 * volts), "vb": 12.0 - 0.001 * np.arange(400), "x": way}


def model_with(entry: str = ', times = "vb"') -> Model:
    return Model.parse(MODEL.format(entry=entry))


def read(columns: dict[str, np.ndarray], entry: str = ', times = "vb"'):
    model = model_with(entry)
    return load_log(columns, model.columns, model.table)


def test_an_input_is_multiplied_by_another_column():
    columns = duty_and_battery()
    np.testing.assert_allclose(read(columns).voltage, 0.004 * columns["pwm"] * columns["vb"])


def test_sign_and_offset_apply_as_without_it():
    columns = duty_and_battery()
    found = read(columns, ', times = "vb", sign = -1, offset = 0.5').voltage
    np.testing.assert_allclose(found, 0.5 - 0.004 * columns["pwm"] * columns["vb"])


def test_files_frames_and_arrays_are_read_alike(tmp_path):
    columns, model = duty_and_battery(), model_with()
    path = write_csv(tmp_path / "log.csv", columns)
    pl.DataFrame(columns).write_parquet(tmp_path / "log.parquet")
    for source in (path, tmp_path / "log.parquet", pl.DataFrame(columns)):
        np.testing.assert_allclose(load_log(source, model.columns, model.table).voltage, read(columns).voltage)


def test_a_missing_factor_is_held_and_before_the_first_one_the_quantity_is_missing():
    columns = duty_and_battery()
    battery = columns["vb"].copy()
    columns["vb"] = np.where(np.arange(400) % 10 == 5, battery, np.nan)
    found = read(columns).voltage
    assert np.isnan(found[:5]).all() and not np.isnan(found[5:]).any()
    np.testing.assert_allclose(found[5:15], 0.004 * columns["pwm"][5:15] * battery[5])


def test_a_factor_that_is_not_there_is_named_with_what_is():
    with pytest.raises(Failure, match=r"v_in is multiplied by 'vbat'.*it has t, pwm, vb, x"):
        read(duty_and_battery(), ', times = "vbat"')


@pytest.mark.parametrize(("value", "said"), [(np.inf, "row 8 of vb is infinite"), (np.nan, "vb has no values")])
def test_a_factor_must_be_finite(value, said):
    columns = duty_and_battery()
    columns["vb"] = np.full(400, np.nan) if np.isnan(value) else np.where(np.arange(400) == 7, value, 12.0)
    with pytest.raises(Failure, match=said):
        read(columns)


def test_a_clock_is_multiplied_by_nothing():
    with pytest.raises(Failure, match="t must have no times"):
        load_log(duty_and_battery(), {"v_in": ColumnMap("pwm"), "t": ColumnMap("t", times="vb")}, model_with().table)


def test_a_factor_must_be_text():
    with pytest.raises(Failure, match="must be text"):
        model_with(", times = 3")


def test_a_model_file_keeps_it(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(MODEL.format(entry=', times = "vb"'), encoding="utf-8")
    Model.open(path).with_fit({"X1": (0.8, 0.01)}).save()
    assert Model.open(path).columns["v_in"].times == "vb" and 'times = "vb"' in path.read_text(encoding="utf-8")


def test_a_correction_of_an_entry_keeps_it():
    corrections = LogCorrections({"v_in": ColumnMap("pwm", scale=0.004, times="vb")}, sign={"v_in": -1})
    assert corrections.column("v_in") == '{ column = "pwm", scale = 0.004, sign = -1, times = "vb" }'
