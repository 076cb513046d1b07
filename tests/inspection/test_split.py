"""A log is split into what judges and what is fitted to: each file holds its own samples, read as the log was."""

import json

import numpy as np
import pytest

from tests.support import run, simulated
from wheelpend import Failure, Model, load_log, save_log
from wheelpend.inspection.split import split_log
from wheelpend.logs.columns import ColumnMap

LOG = simulated(duration=4.0)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_log(tmp_path / "log.csv", LOG)
    return tmp_path


def test_each_sample_is_in_one_of_the_two_with_all_of_its_digits(here):
    found = split_log(here / "log.csv", 1.0, 2.5, here)
    rest, held_out = load_log(found.rest), load_log(found.held_out)
    inside = (LOG.t >= 1.0) & (LOG.t < 2.5)
    assert found.samples == (int(np.sum(~inside)), int(np.sum(inside))) == (len(rest), len(held_out))
    np.testing.assert_array_equal(held_out.measured, LOG.measured[inside])
    np.testing.assert_array_equal(rest.measured, LOG.measured[~inside])
    np.testing.assert_array_equal(held_out.voltage, LOG.voltage[inside])
    assert len(rest.stretches) == 2 and len(held_out.stretches) == 1  # the rest has a gap where the stretch was


def test_columns_keep_names_units_and_clock(here):
    rows = np.column_stack([5000.0 + 1e3 * LOG.t, LOG.voltage, np.degrees(LOG.measured), np.full(len(LOG), np.nan)])
    rows[7, -1] = 3.25
    lines = "\n".join(",".join("" if v != v else repr(v) for v in row) for row in rows.tolist())
    head = 't,v_in,theta_w,theta_p,dtheta_p,"odd, name"\nms,V,deg,deg,deg/s,\n'
    (here / "raw.csv").write_text(head + lines + "\n", encoding="utf-8")
    found = split_log(here / "raw.csv", 1.0, 2.0, here)
    assert found.held_out.read_text().splitlines()[:2] == head.splitlines()
    whole, part = load_log(here / "raw.csv"), load_log(found.held_out)
    np.testing.assert_allclose(part.measured, whole.measured[(whole.t >= 1.0) & (whole.t < 2.0)], rtol=1e-12)
    assert found.rest.read_text().splitlines()[2 + 7].endswith(",3.25")


def test_the_models_clock_counts_where_it_states_one(here):
    text = "row,stamp,x\n" + "\n".join(f"{k},{50 * k},{float(np.sin(k))!r}" for k in map(float, range(4000)))
    (here / "counted.csv").write_text(text, encoding="utf-8")
    found = split_log(here / "counted.csv", 0.1, 0.15, here, ColumnMap("stamp", "us"))
    assert found.samples[1] == 1000


@pytest.mark.parametrize(
    ("begin", "end", "words"),
    [
        (2.0, 2.0, "must end after it begins"),
        (3.0, 1.0, "must end after it begins"),
        (float("nan"), 1.0, "must end after it begins"),
        (0.0, 9.0, "4000 samples must|there are 40"),
        (8.0, 9.0, "there are 0"),
        (1.0, 1.01, "there are 10"),
    ],
)
def test_a_stretch_that_leaves_too_little_is_refused(here, begin, end, words):
    with pytest.raises(Failure, match=words):
        split_log(here / "log.csv", begin, end, here)
    assert [p.name for p in here.iterdir()] == ["log.csv"]


def test_a_log_without_a_clock_is_refused(here):
    (here / "still.csv").write_text("a,b\n" + "1,2\n3,1\n" * 200, encoding="utf-8")
    with pytest.raises(Failure, match="grow as a clock"):
        split_log(here / "still.csv", 0.1, 0.2, here)


def test_the_command_says_what_it_wrote_and_what_to_do_next(here):
    Model.default().save(here)
    result = run("split", "log.csv", "--from", "1", "--to", "2", "--json", "found.json")
    said = " ".join(result.output.split())
    assert "Wrote log_1-2s.csv: 1000 samples" in said
    assert "wheelpend compare log_without_1-2s.csv --holdout log_1-2s.csv" in said
    data = json.loads((here / "found.json").read_text())
    assert (data["from_s"], data["to_s"], data["samples"]["held_out"]) == (1.0, 2.0, 1000)
