"""The packages that a notebook has beside this one: pandas, python-control, and the tutorial itself."""

import json

import numpy as np
import pytest

from tests.support import CHANNELS, ROOT, simulated
from wheelpend import Log, Model, identify, linearize, load_log, predict
from wheelpend.estimation.data import read_logs

pytestmark = pytest.mark.extras
TUTORIAL = ROOT / "docs" / "tutorial.ipynb"


@pytest.fixture
def frame():
    """A simulated log as a DataFrame of pandas."""
    pandas = pytest.importorskip("pandas")
    log = simulated(duration=4.0)
    channels = dict(zip(CHANNELS, log.measured.T, strict=True))
    return pandas.DataFrame({"t": log.t, "v_in": log.voltage, **channels})


def test_a_frame_of_pandas_is_the_log_that_it_was_made_from(frame):
    log = simulated(duration=4.0)
    for given in (frame, frame.set_index("t")):
        read = load_log(given)
        np.testing.assert_array_equal(read.measured, log.measured)
        np.testing.assert_array_equal(read.voltage, log.voltage)
        np.testing.assert_array_equal(read.t, log.t)


def test_missing_values_of_every_kind_are_no_measurements(frame):
    import pandas

    frame.loc[5, "theta_p"] = np.nan
    frame["theta_w"] = frame["theta_w"].astype("Float64")
    frame.loc[7, "theta_w"] = pandas.NA
    frame["dtheta_p"] = frame["dtheta_p"].astype(object).where(frame.index != 9, None)
    read = load_log(frame)
    assert [tuple(p) for p in np.argwhere(np.isnan(read.measured))] == [(5, 1), (7, 0), (9, 2)]


def test_an_index_of_instants_counts_in_seconds(frame):
    import pandas

    start = pandas.Timestamp("2024-05-01T10:00:00")
    stamps = start + pandas.to_timedelta(np.round(frame["t"].to_numpy() * 1e9), unit="ns")
    stamped = frame.drop(columns="t").set_index(pandas.DatetimeIndex(stamps, name="t"))
    np.testing.assert_allclose(load_log(stamped).t, frame["t"], atol=1e-9)
    series = {name: frame[name] for name in frame.columns if name != "t"}
    assert len(Log.from_arrays(frame["t"], **series)) == len(frame)


def test_a_slice_of_a_frame_is_identified_as_that_part_of_the_log(frame):
    part = frame[frame["t"] <= 2.0]
    model = Model.default()
    mine = identify(model, part, method="filtered", tau=(0.1, 0.2), test_bias=False)
    theirs = identify(
        model, read_logs(frame, model)[0].part(0, 2001), method="filtered", tau=(0.1, 0.2), test_bias=False
    )
    assert {n: e.value for n, e in mine.parameters.items()} == {n: e.value for n, e in theirs.parameters.items()}


def test_tables_become_frames_of_pandas(frame):
    pytest.importorskip("pyarrow")
    found = identify(Model.default(), frame, method="filtered", test_bias=False).to_frame().to_pandas()
    assert list(found["parameter"])[:2] == ["X1", "X2"] and found["value"].dtype == float
    samples = predict(Model.default(), frame).to_frame().to_pandas()
    assert len(samples) == len(frame) and samples["theta_p_predicted"].isna().sum() > 0


def test_python_control_has_the_same_poles_names_and_response():
    control = pytest.importorskip("control")
    linear = linearize(Model.default())
    plant = linear.to_control()
    assert (plant.state_labels, plant.input_labels) == (list(linear.states), ["v_in"])
    assert plant.output_labels == list(linear.outputs)
    np.testing.assert_allclose(sorted(plant.poles().real), sorted(np.linalg.eigvals(linear.A).real), atol=1e-9)
    t = np.linspace(0.0, 0.05, 51)
    answer = control.step_response(plant, t).outputs[:, 0]
    assert linear.outputs[2] == "dtheta_p" and linear.states[3] == "dtheta_p"
    np.testing.assert_allclose(answer[2, 1], linear.B[3, 0] * t[1], rtol=0.05)


def test_the_tutorial_is_stored_without_outputs():
    cells = json.loads(TUTORIAL.read_text(encoding="utf-8"))["cells"]
    assert all(not c["outputs"] and c["execution_count"] is None for c in cells if c["cell_type"] == "code")
    assert len({c["id"] for c in cells}) == len(cells) > 10


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of the kernel's transport
def test_the_tutorial_runs_and_names_what_is_missing():
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    for package in ("ipykernel", "pandas", "pyarrow", "control", "matplotlib"):
        pytest.importorskip(package)
    notebook = nbformat.read(TUTORIAL, 4)
    folder = {"metadata": {"path": str(TUTORIAL.parent)}}
    nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=folder).execute()
    outputs = [o for c in notebook.cells if c.cell_type == "code" for o in c.outputs]
    shown = "\n".join(o.get("text", "") + o.get("data", {}).get("text/plain", "") for o in outputs)
    assert "Diagnosis: effect_missing" in shown and "Change: coulomb_drive, error 5" in shown
    assert "Log simulated with a controller: 5001 samples" in shown
    assert sum("image/png" in o.get("data", {}) for o in outputs) == 5
