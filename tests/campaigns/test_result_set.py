"""Results are kept in a Parquet data set: whole, by question, of logs as they are; it grows, and is repaired."""

import os
import random

import polars
import pytest

from tests.support import simulated
from wheelpend import Failure, Model
from wheelpend.campaigns import result_set
from wheelpend.campaigns.manifest import Listed
from wheelpend.campaigns.one_log import CampaignSetting, ErrorCovariance, Estimate, LogResult, NamedEffect
from wheelpend.campaigns.result_rows import read_rows, result_of, row_of, write_rows
from wheelpend.campaigns.result_set import ResultSet, is_result_set, key_of, question_of, version_of

FULL = LogResult(
    "log.csv", verdict="ambiguous", named=(NamedEffect("slope", ("com_offset",)),), effects=("slope", "coulomb_drive"),
    error=1.5, error_after=1.0 / 3.0, parameters={"X1": Estimate(0.04, None), "X2": Estimate(-0.1, 1e-3)},
    covariance=ErrorCovariance(("X1", "X2"), ((1.0, 0.1), (0.1, 2.0))), fit_percent={"theta_w": 99.0},
    warnings=("odd",), unit="robot 3", date="2026-03-31", conditions={"surface": "felt"},
)  # fmt: skip
BARE = LogResult("seed 3", 3)


@pytest.fixture
def few_rows(monkeypatch):
    monkeypatch.setattr(result_set, "PART_ROWS", 3)


def filled(folder, sources, question="identify-1"):
    """The set with a result of each source that it does not know, and how many these were."""
    known = ResultSet(folder, question)
    new = [s for s in map(as_listed, sources) if not known.knows(s)]
    known.begin()
    for one in new:
        known.add(one, LogResult(key_of(one.log), error=float(len(key_of(one.log)))))
    return known, len(new)


def as_listed(source):
    return source if isinstance(source, Listed) else Listed(source)


def everything(folder):
    return polars.read_parquet(folder / "*" / "*.parquet", hive_partitioning=True)


def log_files(folder, count):
    paths = [folder / f"log{k}.csv" for k in range(count)]
    for path in paths:
        path.write_text("t\n0\n")
    return paths


@pytest.mark.parametrize("result", [FULL, BARE])
def test_a_result_comes_back_from_its_row_as_it_was(tmp_path, result):
    write_rows(tmp_path / "part.parquet", [row_of("12 34", result)])
    (row,) = read_rows(tmp_path / "part.parquet")
    assert result_of(row) == result and row["version"] == "12 34"


def test_a_log_that_has_changed_is_another_and_one_in_memory_is_in_no_file(tmp_path):
    (path,) = log_files(tmp_path, 1)
    before = version_of(path)
    assert before == version_of(path) and version_of(3) == "" and version_of(tmp_path / "gone.csv") is None
    os.utime(path, ns=(1, 2))
    assert version_of(path) not in (before, None) and version_of(simulated(duration=1.0)) is None


def test_results_are_rows_that_others_can_query(tmp_path, few_rows):
    known, _ = filled(tmp_path / "c.results", range(8))
    assert [r.seed is None and r.error for r in known.results(list(map(Listed, range(8))))] == [6.0] * 8
    table = everything(tmp_path / "c.results")
    assert sorted(table["log"]) == [f"seed {k}" for k in range(8)] and set(table["question"]) == {"identify-1"}
    assert sorted(p.name[:10] for p in (tmp_path / "c.results").rglob("*.parquet")) == [
        "part-00000", "part-00001", "part-00002"
    ]  # fmt: skip
    assert not list((tmp_path / "c.results").rglob("_journal*"))
    assert is_result_set(tmp_path / "c.results") and not is_result_set(tmp_path)


def test_a_set_grows_and_knows_what_it_holds(tmp_path, few_rows):
    known, new = filled(tmp_path / "c", range(4))
    known.results(list(map(Listed, range(4))))
    known, new = filled(tmp_path / "c", range(2, 7))
    assert new == 3 and [r.log for r in known.results(list(map(Listed, (6, 2))))] == ["seed 6", "seed 2"]
    assert filled(tmp_path / "c", range(7))[1] == 0
    assert filled(tmp_path / "c", range(7), "identify-2")[1] == 7


def test_a_part_and_the_journal_that_it_came_from_are_one_result(tmp_path, few_rows):
    """As a process leaves them that is killed between writing the one and emptying the other."""
    known, _ = filled(tmp_path / "c", range(2))
    journal = next((tmp_path / "c").glob("*/_journal.partial"))
    text = journal.read_text()
    known.results(list(map(Listed, range(2))))
    journal.write_text(text + '{"key": "seed 2", "ans')
    known, new = filled(tmp_path / "c", range(3))
    assert new == 1 and len(known.results(list(map(Listed, range(3))))) == 3
    assert sorted(everything(tmp_path / "c")["log"]) == ["seed 0", "seed 1", "seed 2"]


def test_a_changed_log_takes_the_place_of_what_it_was(tmp_path, few_rows):
    paths = log_files(tmp_path, 5)
    known, _ = filled(tmp_path / "c", paths)
    known.results(list(map(Listed, paths)))
    os.utime(paths[1], ns=(1, 2))
    known, new = filled(tmp_path / "c", paths)
    assert new == 1
    known.results(list(map(Listed, paths)))
    assert sorted(everything(tmp_path / "c")["log"]) == sorted(map(str, paths))
    assert filled(tmp_path / "c", paths)[1] == 0


def test_what_a_manifest_says_anew_is_in_the_rows_without_another_analysis(tmp_path, few_rows):
    paths = log_files(tmp_path, 5)
    known, _ = filled(tmp_path / "c", [Listed(p, "old") for p in paths])
    known.results([Listed(p, "old") for p in paths])
    stated = [Listed(p, f"robot {k}", "2026-03-31", {"surface": "felt"}) for k, p in enumerate(paths)]
    known, new = filled(tmp_path / "c", stated)
    assert new == 0 and [r.unit for r in known.results(stated)] == [f"robot {k}" for k in range(5)]
    table = everything(tmp_path / "c").sort("log")
    assert table["unit"].to_list() == [f"robot {k}" for k in range(5)] and set(table["date"]) == {"2026-03-31"}
    assert table["conditions"].to_list() == [[{"name": "surface", "value": "felt"}]] * 5


def test_what_failed_says_why_and_is_asked_again(tmp_path):
    folder, sources = tmp_path / "c", [Listed(1), Listed(2), Listed(tmp_path / "gone.csv")]
    known = ResultSet(folder, "identify-1")
    known.begin()
    known.add(sources[0], LogResult("seed 1", 1, error=1.5))
    known.add(sources[1], LogResult("seed 2", 2, failure="It fell."))
    known.add(sources[2], LogResult(str(tmp_path / "gone.csv"), failure="It is not there."))
    assert [r.failure for r in known.results(sources)] == [None, "It fell.", "It is not there."]
    failed = read_rows(next(folder.glob("*/failed.parquet")))
    assert {row["log"]: row["failure"] for row in failed} == {
        "seed 2": "It fell.", str(tmp_path / "gone.csv"): "It is not there."
    }  # fmt: skip
    again = ResultSet(folder, "identify-1")
    assert again.knows(sources[0]) and not again.knows(sources[1]) and not again.knows(sources[2])
    again.begin()
    again.add(sources[1], LogResult("seed 2", 2, error=1.0))
    again.results(sources[:2])
    assert [row["log"] for row in read_rows(next(folder.glob("*/failed.parquet")))] == [str(tmp_path / "gone.csv")]


def test_a_part_that_holds_something_else_is_said(tmp_path):
    known, _ = filled(tmp_path / "c", range(3))
    known.results(list(map(Listed, range(3))))
    (part,) = (tmp_path / "c").glob("*/part-*.parquet")
    whole, rng = part.read_bytes(), random.Random(1)
    damaged = [whole[:cut] for cut in (0, 3, 100, len(whole) - 9, len(whole) - 1)]
    for _ in range(60):
        bytes_ = bytearray(whole)
        for _ in range(3):
            bytes_[rng.randrange(len(bytes_))] = rng.randrange(256)
        damaged.append(bytes(bytes_))
    refused = 0
    for data in damaged:
        part.write_bytes(data)
        try:
            ResultSet(tmp_path / "c", "identify-1").results(list(map(Listed, range(3))))
        except Failure as failure:
            assert "Delete it" in str(failure)
            refused += 1
    assert refused > 30
    polars.DataFrame({"log": ["a"], "version": [3]}).write_parquet(part)
    with pytest.raises(Failure, match="must hold results of a campaign"):
        ResultSet(tmp_path / "c", "identify-1")


def test_without_a_folder_results_stay_in_memory():
    log = simulated(duration=1.0)
    known, listed = ResultSet(None, "identify-1"), [Listed(log, "a"), Listed(3)]
    known.begin()
    assert not any(map(known.knows, listed))
    known.add(listed[0], LogResult("log 1", error=1.0))
    known.add(listed[1], LogResult("seed 3", 3, error=2.0))
    assert [(r.log, r.error, r.unit) for r in known.results(listed)] == [("log 1", 1.0, "a"), ("seed 3", 2.0, "")]


def test_a_question_is_the_analysis_and_the_model():
    def asked(**changes):
        return question_of(CampaignSetting(Model.default().text, None, None, "compare")._replace(**changes), model)

    model = Model.default()
    assert asked().startswith("compare-") and asked() == asked()
    assert len({asked(), asked(do="identify"), asked(text=model.text + "\n"), asked(tau=(0.1, 0.2))}) == 4
