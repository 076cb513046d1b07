"""A record that is given to fit is not held out as well, whatever its name, format and times are."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Failure, Model, load_log, save_log
from wheelpend.estimation.data import prepare
from wheelpend.logs.same_record import SharedRows, shared_rows

LOG = simulated(duration=4.0)


def part(log, start, stop, shift=0.0):
    """Some rows of a log as a log of their own."""
    return replace(log, t=log.t[start:stop] + shift, voltage=log.voltage[start:stop],
                   measured=log.measured[start:stop], reference=None)  # fmt: skip


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_log("log.csv", LOG)
    return tmp_path


@pytest.mark.parametrize(("name", "shift"), [("copy.csv", 0.0), ("later.csv", 100.0), ("copy.parquet", 0.0)])
def test_a_copy_is_refused_under_another_name_at_another_time_and_in_another_format(here, name, shift):
    save_log(name, replace(LOG, t=LOG.t + shift))
    with pytest.raises(Failure, match=rf"log.csv to fit and {name} to hold out have all their samples in common"):
        prepare(Model.default(), ["log.csv"], [name])


def test_a_part_of_the_same_record_is_refused_with_its_rows(here):
    save_log("part.csv", part(LOG, 2000, 4001, shift=-2.0))
    with pytest.raises(Failure, match=r"2001 samples in a row in common \(from row 2001 and row 1 on\)"):
        prepare(Model.default(), ["log.csv"], ["part.csv"])
    save_log("begin.csv", part(LOG, 0, 2100))
    with pytest.raises(Failure, match=r"100 samples in a row in common \(from row 2001 and row 1 on\)"):
        prepare(Model.default(), ["begin.csv"], ["part.csv"])


def test_other_records_and_parts_that_follow_each_other_are_taken(here):
    save_log("begin.csv", part(LOG, 0, 2000))
    save_log("end.csv", part(LOG, 2000, 4001))
    save_log("other.csv", simulated(duration=4.0, seed=1))
    for log, holdout in (("begin.csv", "end.csv"), ("log.csv", "other.csv")):
        assert prepare(Model.default(), [log], [holdout]).logs


def test_missing_values_are_alike_and_a_machine_at_rest_is_not(here):
    gaps = LOG.measured.copy()
    gaps[::7, 1] = np.nan
    assert shared_rows(replace(LOG, measured=gaps), replace(LOG, measured=gaps)) == SharedRows(1, 1, len(LOG))
    rest = replace(LOG, voltage=np.zeros_like(LOG.voltage), measured=np.zeros_like(LOG.measured))
    assert shared_rows(rest, rest) is None


def test_an_hour_is_compared_in_less_time_than_it_takes_to_read(here):
    from time import process_time

    log = load_log("log.csv")
    rows = 360_000
    long = replace(log, t=np.arange(rows) * 1e-2, voltage=np.random.default_rng(0).normal(size=rows),
                   measured=np.random.default_rng(1).normal(size=(rows, 3)), reference=None)  # fmt: skip
    begin = process_time()
    assert shared_rows(long, replace(long, measured=long.measured + 1.0)) is None
    assert process_time() - begin < 1.0
