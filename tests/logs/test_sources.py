"""Logs from what is in memory: arrays, dicts and DataFrames."""

import numpy as np
import polars as pl
import pytest

from tests.support import CHANNELS, simulated
from wheelpend import Failure, Log, Model, load_log, save_log
from wheelpend.estimation.data import prepare, read_logs
from wheelpend.logs.sources import as_list


def columns(**changed) -> dict:
    """A simulated log as a dict of arrays."""
    log = simulated(duration=4.0)
    return {
        "t": log.t.copy(),
        "v_in": log.voltage.copy(),
        **dict(zip(CHANNELS, log.measured.T.copy(), strict=True)),
        **changed,
    }


class PandasLikeFrame:
    """The part of pandas that a log is taken through: columns, items with to_numpy, and an index."""

    class Series:
        def __init__(self, values):
            self.values = values

        def to_numpy(self):
            return np.asarray(self.values)

    class Index:
        def __init__(self, name):
            self.name = name

    def __init__(self, data, index_name=None):
        self.data, self.index = data, self.Index(index_name)

    @property
    def columns(self):
        shown = [n for n in self.data if n != self.index.name]
        return np.array(shown)

    def __getitem__(self, name):
        return self.Series(self.data[name])

    def __bool__(self):
        raise ValueError("The truth value of a DataFrame is ambiguous.")

    def reset_index(self):
        return PandasLikeFrame(self.data)


@pytest.mark.parametrize(
    "make",
    [dict, pl.DataFrame, PandasLikeFrame, lambda data: PandasLikeFrame(data, "t")],
    ids=["dict", "polars", "pandas", "pandas with an index of times"],
)
def test_a_log_in_memory_is_read_as_its_file_is(make, tmp_path):
    save_log(tmp_path / "drive.parquet", simulated(duration=4.0))
    (from_memory,), (from_file,) = (
        read_logs(given, Model.default()) for given in (make(columns()), tmp_path / "drive.parquet")
    )
    assert from_memory.channels == from_file.channels
    for mine, read in ((from_memory.t, from_file.t), (from_memory.voltage, from_file.voltage)):
        np.testing.assert_array_equal(mine, read)
    np.testing.assert_array_equal(from_memory.measured, from_file.measured)


def test_arrays_become_a_log_of_their_own():
    data = columns()
    log = Log.from_arrays(**data, name="drive")
    expected, commanded = log.measured.copy(), log.voltage.copy()
    for values in data.values():
        values[:] = 7.0
    assert log.name == "drive" and log.channels == CHANNELS
    np.testing.assert_array_equal(log.measured, expected)
    np.testing.assert_array_equal(log.voltage, commanded)


def test_lists_and_masked_arrays_and_missing_values_are_taken():
    data = columns()
    pitch = list(data["theta_p"])
    pitch[7] = None
    wheel = np.ma.MaskedArray(data["theta_w"], mask=np.arange(len(pitch)) == 9)
    log = Log.from_arrays(
        data["t"].tolist(), v_in=data["v_in"], theta_w=wheel, theta_p=pitch, dtheta_p=data["dtheta_p"]
    )
    assert np.isnan(log.measured[7, 1]) and np.isnan(log.measured[9, 0])
    assert np.isnan(log.measured).sum() == 2


def test_a_wrapped_angle_in_memory_is_made_continuous():
    wheel = np.linspace(0.0, 20.0, len(columns()["t"]))
    log = Log.from_arrays(**columns(theta_w=np.angle(np.exp(1j * wheel))))
    np.testing.assert_allclose(log.measured[:, 0], wheel, atol=1e-9)


def test_instants_of_a_calendar_are_times_in_seconds():
    t = columns()["t"]
    stamps = np.datetime64("2024-05-01T10:00:00", "ns") + np.round(t * 1e9).astype("timedelta64[ns]")
    np.testing.assert_allclose(load_log(columns(t=stamps)).t, t, atol=1e-9)


def test_the_columns_of_a_model_apply_to_a_frame():
    data = columns()
    text = Model.default().text.replace("[columns]", '[columns]\nt = { column = "time", unit = "ms" }')
    model = Model.parse(text)
    frame = pl.DataFrame({"time": np.round(data["t"] * 1e3).astype(int), "note": "x", **data}).drop("t")
    (log,) = read_logs(frame, model)
    np.testing.assert_allclose(log.t, data["t"], atol=1e-9)


def test_a_log_of_another_plant_has_that_plants_columns():
    model = Model.default("slide")
    names = model.table.required[1:]
    t = np.arange(200) * 1e-2
    log = Log.from_arrays(t, table=model.table, **{n: np.sin(3.0 * t) for n in names})
    assert log.channels == model.table.channels


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"theta_q": 0}, "one is called 'theta_q'. Did you mean 'theta_"),
        (
            {"theta_p": np.zeros((40, 2))},
            r"theta_p must have one value per sample, of shape (N,), but its shape is (40",
        ),
        ({"theta_p": np.zeros(7)}, "their lengths differ: "),
        ({"theta_p": [[1.0], [1.0, 2.0]]}, "its rows differ in length"),
        ({"theta_p": 3.0}, "but its shape is ()"),
        ({"theta_p": ["a"] * 40}, "theta_p must hold real numbers, but it is of type <U1"),
        ({"theta_p": [1.0, "2.0"] * 20}, "theta_p must hold real numbers"),
        ({"theta_p": np.ones(40) * 1j}, "real numbers, but it is of type complex128"),
        ({"v_in": np.ones(40, dtype=bool)}, "real numbers, but it is of type bool"),
        ({"t": -np.arange(4001.0)}, "t must grow from row to row"),
    ],
)
def test_arrays_that_are_no_log_are_refused_in_words(changed, said):
    with pytest.raises(Failure) as caught:
        Log.from_arrays(**columns(**changed))
    assert said in str(caught.value)


def test_milliseconds_are_refused_with_what_to_divide_them_by():
    with pytest.raises(Failure, match=r"Or give it in s: divide it by 1000\."):
        Log.from_arrays(**columns(t=np.arange(len(columns()["t"]))))


def test_a_channel_that_is_not_given_is_named():
    data = columns()
    del data["dtheta_p"]
    with pytest.raises(Failure, match="must be given; missing: dtheta_p"):
        Log.from_arrays(**data)
    with pytest.raises(Failure, match=r"the column dtheta_p is missing\. The dict has: t, v_in"):
        load_log(data)


def test_times_that_are_not_given_are_named():
    data = columns()
    del data["t"]
    with pytest.raises(Failure, match=r"the column t is missing\. The DataFrame has: v_in"):
        load_log(pl.DataFrame(data))


@pytest.mark.parametrize("source", [3, None, np.zeros((40, 5)), pl.DataFrame({"t": [0.0]}).lazy(), {}])
def test_what_is_no_log_is_refused_in_words(source):
    with pytest.raises(Failure, match="log"):
        load_log(source)


def test_one_log_counts_as_a_list_of_one():
    frame, log = PandasLikeFrame(columns()), simulated(duration=4.0)
    for one in ("drive.csv", frame, log, columns()):
        assert len(as_list(one)) == 1
    assert as_list((frame, log)) == [frame, log]
    for wrong, kind in ((3, "int"), (np.zeros((4, 5)), "ndarray"), ((one for one in (log,)), "generator")):
        with pytest.raises(Failure, match=f"not {kind}"):
            as_list(wrong)


def test_without_a_log_nothing_can_be_learnt():
    with pytest.raises(Failure, match="the list of logs is empty"):
        prepare(Model.default(), [])


def test_logs_in_memory_are_called_by_their_place():
    logs = read_logs([columns(), simulated(duration=4.0), columns()], Model.default())
    assert [log.name for log in logs][::2] == ["log 1", "log 3"]


def test_frames_on_both_sides_that_share_rows_are_refused():
    with pytest.raises(Failure, match="A record must not be on both sides"):
        prepare(Model.default(), PandasLikeFrame(columns()), PandasLikeFrame(columns()))


def test_a_log_shows_itself_by_its_size_and_ranges():
    log = Log.from_arrays(**columns(), name="drive")
    lines = repr(log).splitlines()
    assert lines[0] == "Log drive: 4001 samples, 4 s at 1000 Hz"
    assert lines[1].split() == ["column", "least", "most", "missing"]
    rows = {name: row for name, *row in log.table().rows}
    assert list(rows) == ["v_in", *CHANNELS]
    assert rows["v_in"] == [log.voltage.min(), log.voltage.max(), 0]


def test_a_logs_frame_is_a_log_again():
    log = load_log(columns(theta_p=np.where(np.arange(4001) == 5, np.nan, columns()["theta_p"])))
    frame = log.to_frame()
    assert frame.columns == ["t", "v_in", *CHANNELS] and frame["theta_p"].null_count() == 1
    again = load_log(frame)
    np.testing.assert_array_equal(again.measured, log.measured)
    np.testing.assert_array_equal(again.voltage, log.voltage)


def test_the_frame_of_another_plants_log_has_its_names_where_its_table_is_given():
    model = Model.default("slide")
    t = np.arange(200) * 1e-2
    log = Log.from_arrays(t, table=model.table, **{n: np.sin(3.0 * t) for n in model.table.required[1:]})
    assert log.to_frame(model.table).columns == list(model.table.required)
    assert log.to_frame().columns == ["t", "input", *model.table.channels]
