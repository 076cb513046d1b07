"""Results are kept in a Parquet data set: whole, by question, of logs as they are; it grows, and is repaired."""

import os
import random
import subprocess
import sys

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
    """The results of all sources, after those that were not known were added, and how many these were."""
    known, listed = ResultSet(folder, question), list(map(as_listed, sources))
    new = [s for s in listed if not known.knows(s)]
    with known.held(bool(new)):
        for one in new:
            known.add(one, LogResult(str(one.log), error=float(len(key_of(one.log)))))
        return known.results(listed), len(new)


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
    write_rows(tmp_path / "part.parquet", [row_of(result.log, "12 34", result)])
    (row,) = read_rows(tmp_path / "part.parquet")
    assert result_of(row) == result and row["version"] == "12 34"


def test_a_log_that_has_changed_is_another_and_one_in_memory_is_in_no_file(tmp_path):
    (path,) = log_files(tmp_path, 1)
    before = version_of(path)
    assert before == version_of(path) != "" and version_of(3) != ""
    os.utime(path, ns=(1, 2))
    assert version_of(path) not in (before, "")
    assert (
        version_of(tmp_path / "gone.csv") == version_of(tmp_path / "a\0b") == version_of(simulated(duration=1.0)) == ""
    )
    (tmp_path / "bag").mkdir()
    log_files(tmp_path / "bag", 2)
    bag = version_of(tmp_path / "bag")
    os.utime(tmp_path / "bag" / "log1.csv", ns=(1, 2))
    assert version_of(tmp_path / "bag") != bag, "what is in a folder counts"


def test_results_are_rows_that_others_can_query(tmp_path, few_rows):
    results, _ = filled(tmp_path / "c.results", range(8))
    assert [r.error for r in results] == [6.0] * 8
    table = everything(tmp_path / "c.results")
    assert sorted(table["log"]) == [f"seed {k}" for k in range(8)] and set(table["question"]) == {"identify-1"}
    names = sorted(p.name for p in (tmp_path / "c.results").rglob("*.*") if p.is_file())
    assert [name[:10] for name in names] == ["part-00000", "part-00001", "part-00002"]
    assert is_result_set(tmp_path / "c.results") and not is_result_set(tmp_path)


def test_a_set_grows_and_knows_what_it_holds(tmp_path, few_rows):
    filled(tmp_path / "c", range(4))
    results, new = filled(tmp_path / "c", range(2, 7))
    assert new == 3 and [r.log for r in results] == [f"seed {k}" for k in range(2, 7)]
    assert filled(tmp_path / "c", range(7))[1] == 0
    assert filled(tmp_path / "c", range(7), "identify-2")[1] == 7


def test_results_come_in_the_order_of_the_list_however_they_were_stored(tmp_path, few_rows, monkeypatch):
    filled(tmp_path / "c", range(20))
    order, read = [(7 * k) % 20 for k in range(20)], []
    results, new = filled(tmp_path / "c", order)
    monkeypatch.setattr(result_set, "read_rows", lambda path, *columns: read.append(path) or read_rows(path, *columns))
    assert new == 0 and [r.log for r in results] == [f"seed {k}" for k in order]
    assert len(read) <= 7, "each part once"
    monkeypatch.setattr(result_set, "WINDOW_LOGS", 6)
    assert [r.log for r in results] == [f"seed {k}" for k in order]
    assert [results[k].log for k in (0, 3, -1)] == [f"seed {order[k]}" for k in (0, 3, -1)]
    assert [r.log for r in results[2:4]] == [f"seed {k}" for k in order[2:4]]


def test_a_part_and_the_journal_that_it_came_from_are_one_result(tmp_path, few_rows):
    """As a process leaves them that is killed between writing the one and emptying the other."""
    known = ResultSet(tmp_path / "c", "identify-1")
    with known.held(is_new=True):
        for k in range(2):
            known.add(Listed(k), LogResult(f"seed {k}", error=6.0))
        journal = next((tmp_path / "c").glob("*/_journal.partial"))
        text = journal.read_text()
        known.results(list(map(Listed, range(2))))
    journal.write_text(text + '{"key": "seed 2", "ans')
    (journal.parent / ".part-00000-1.7.partial.parquet").write_bytes(b"PAR")
    results, new = filled(tmp_path / "c", range(3))
    assert new == 1 and len(results) == 3
    assert sorted(everything(tmp_path / "c")["log"]) == ["seed 0", "seed 1", "seed 2"]
    assert not list(journal.parent.glob(".*")), "what a killed process left half written is cleared up"


def test_a_journal_that_holds_something_else_is_passed_over(tmp_path):
    filled(tmp_path / "c", range(1))
    journal = next((tmp_path / "c").iterdir()) / "_journal.partial"
    lines = ['{"setting": "identify-1"}', "3", '{"answer": {}}', '{"key": "seed 5", "answer": 3}',
             '{"key": "seed 6", "answer": {"log": "seed 7", "version": "seed"}}']  # fmt: skip
    journal.write_text("\n".join(lines) + "\n")
    assert filled(tmp_path / "c", range(8))[1] == 7


def test_a_changed_log_takes_the_place_of_what_it_was(tmp_path, few_rows):
    paths = log_files(tmp_path, 5)
    filled(tmp_path / "c", paths)
    os.utime(paths[1], ns=(1, 2))
    assert filled(tmp_path / "c", paths)[1] == 1
    assert sorted(everything(tmp_path / "c")["log"]) == sorted(map(str, paths))
    assert filled(tmp_path / "c", paths)[1] == 0


def test_a_log_is_one_however_its_path_is_written(tmp_path, monkeypatch):
    (path,) = log_files(tmp_path, 1)
    filled(tmp_path / "c", [path])
    monkeypatch.chdir(tmp_path)
    results, new = filled(tmp_path / "c", ["log0.csv"])
    assert new == 0 and results[0].log == "log0.csv" and everything(tmp_path / "c")["log"].to_list() == [str(path)]


def test_a_name_that_is_no_text_is_a_name(tmp_path, few_rows):
    path = tmp_path / os.fsdecode(b"dr\xff.csv")
    path.write_text("t\n0\n")
    sources = [Listed(path, "a\udcff", "", {"b\udcfe": "c\udcfd"}), Listed(tmp_path / os.fsdecode(b"gone\xff.csv"))]
    known = ResultSet(tmp_path / "c", "identify-1")
    with known.held(is_new=True):
        known.add(sources[0], LogResult(str(path), error=1.0, warnings=("dr\udcff: odd",)))
        known.add(sources[1], LogResult(str(sources[1].log), failure="gone\udcff"))
        found = known.results(sources)
    assert [r.log for r in found] == [str(s.log) for s in sources] and found[0].unit == "a\udcff"
    assert filled(tmp_path / "c", sources[:1])[1] == 0
    assert (
        everything(tmp_path / "c")["log"].to_list()
        == [str(tmp_path / "dr\\udcff.csv"), str(tmp_path / "gone\\udcff.csv")][::-1]
    )


def test_what_a_manifest_says_anew_is_in_the_rows_without_another_analysis(tmp_path, few_rows):
    paths = log_files(tmp_path, 5)
    filled(tmp_path / "c", [Listed(p, "old") for p in paths])
    stated = [Listed(p, f"robot {k}", "2026-03-31", {"surface": "felt"}) for k, p in enumerate(paths)]
    results, new = filled(tmp_path / "c", stated)
    assert new == 0 and [r.unit for r in results] == [f"robot {k}" for k in range(5)]
    table = everything(tmp_path / "c").sort("log")
    assert table["unit"].to_list() == [f"robot {k}" for k in range(5)] and set(table["date"]) == {"2026-03-31"}
    assert table["conditions"].to_list() == [[{"name": "surface", "value": "felt"}]] * 5


def with_outcomes(folder, outcomes):
    """Add results and failures (a text) of logs, in one campaign; the results."""
    known, outcomes = ResultSet(folder, "identify-1"), list(outcomes)
    with known.held(is_new=True):
        for one, outcome in outcomes:
            text = str(one.log)
            known.add(
                one, LogResult(text, failure=outcome) if isinstance(outcome, str) else LogResult(text, error=outcome)
            )
        return known.results([one for one, _ in outcomes])


def test_what_failed_says_why_and_is_asked_again(tmp_path):
    folder, sources = tmp_path / "c", [Listed(1), Listed(2, "b", "2026-03-31"), Listed(tmp_path / "gone.csv")]
    found = with_outcomes(folder, zip(sources, (1.5, "It fell.", "It is not there."), strict=True))
    assert [r.failure for r in found] == [None, "It fell.", "It is not there."]
    failed = {row["log"]: row for row in read_rows(next(folder.glob("*/failed.parquet")))}
    assert {name: row["failure"] for name, row in failed.items()} == {
        "seed 2": "It fell.", str(tmp_path / "gone.csv"): "It is not there."
    }  # fmt: skip
    assert (failed["seed 2"]["unit"], failed["seed 2"]["date"]) == ("b", "2026-03-31")
    again = ResultSet(folder, "identify-1")
    assert again.knows(sources[0]) and not again.knows(sources[1]) and not again.knows(sources[2])
    with_outcomes(folder, [(sources[1], 1.0)])
    assert [row["log"] for row in read_rows(next(folder.glob("*/failed.parquet")))] == [str(tmp_path / "gone.csv")]


def test_a_log_that_fails_since_it_has_changed_is_in_the_set_once(tmp_path):
    (path,) = log_files(tmp_path, 1)
    with_outcomes(tmp_path / "c", [(Listed(path), 1.0), (Listed(1), 1.0)])
    os.utime(path, ns=(1, 2))
    with_outcomes(tmp_path / "c", [(Listed(path), "It fell."), (Listed(1), 1.0)])
    assert sorted(everything(tmp_path / "c").select("log", "failure").rows()) == [
        (str(path), "It fell."), ("seed 1", None)
    ]  # fmt: skip


def test_a_log_whose_version_nobody_tells_is_kept_and_asked_again(tmp_path, monkeypatch):
    monkeypatch.setattr(result_set, "address_version", lambda address: "")
    listed = Listed("https://host/a.csv")
    (found,) = with_outcomes(tmp_path / "c", [(listed, 1.25)])
    assert found.error == 1.25 and everything(tmp_path / "c")["log"].to_list() == ["https://host/a.csv"]
    assert not ResultSet(tmp_path / "c", "identify-1").knows(listed)


def test_what_another_campaign_moved_is_found_or_said_to_be_gone(tmp_path, few_rows):
    paths = log_files(tmp_path, 9)
    results, _ = filled(tmp_path / "c", paths)
    os.utime(paths[0], ns=(1, 2))
    filled(tmp_path / "c", paths)
    assert [r.log for r in results] == list(map(str, paths))
    assert [results[k].log for k in range(9)] == list(map(str, paths))
    for part in (tmp_path / "c").rglob("part-*"):
        part.unlink()
    with pytest.raises(Failure, match="Repeat the command"):
        list(results)


def test_one_campaign_at_a_time_writes_a_set(tmp_path):
    filled(tmp_path / "c", range(2))
    code = (
        "from pathlib import Path; import sys, time\n"
        "from wheelpend.campaigns.result_set import ResultSet\n"
        "with ResultSet(Path(sys.argv[1]), 'identify-1').held(True):\n"
        "    print('held', flush=True); time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "c")], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(Failure, match=f"process {process.pid}"):
            filled(tmp_path / "c", range(3))
    finally:
        process.kill()
        process.communicate()
    assert filled(tmp_path / "c", range(3))[1] == 1


def test_links_among_results_are_refused(tmp_path):
    filled(tmp_path / "c", range(1))
    (tmp_path / "precious").write_text("precious")
    (next((tmp_path / "c").iterdir()) / "_journal.partial").symlink_to(tmp_path / "precious")
    with pytest.raises(Failure, match="is a link"):
        ResultSet(tmp_path / "c", "identify-1")
    assert (tmp_path / "precious").read_text() == "precious"


def test_a_part_that_holds_something_else_is_said(tmp_path):
    filled(tmp_path / "c", range(3))
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
            list(ResultSet(tmp_path / "c", "identify-1").results(list(map(Listed, range(3)))))
        except Failure as failure:
            assert "Delete it" in str(failure) or "Repeat the command" in str(failure)
            refused += 1
    assert refused > 30
    part.write_bytes(whole)
    gaps = polars.read_parquet(part, hive_partitioning=False).with_columns(unit=polars.lit(None, polars.String))
    for table, words in ((polars.DataFrame({"log": ["a"], "version": [3]}), "must hold results"), (gaps, "gaps in")):
        table.write_parquet(part)
        with pytest.raises(Failure, match=words):
            ResultSet(tmp_path / "c", "identify-1")


def test_without_a_folder_results_stay_in_memory():
    log = simulated(duration=1.0)
    known, listed = ResultSet(None, "identify-1"), [Listed(log, "a"), Listed(3)]
    assert not any(map(known.knows, listed))
    with known.held(is_new=True):
        known.add(listed[0], LogResult("log 1", error=1.0))
        known.add(listed[1], LogResult("seed 3", 3, error=2.0))
        found = known.results(listed)
    assert [(r.log, r.error, r.unit) for r in found] == [("log 1", 1.0, "a"), ("seed 3", 2.0, "")]


def test_a_question_is_the_analysis_and_the_model_wherever_they_are(tmp_path):
    def asked(**changes):
        return question_of(CampaignSetting(Model.default().text, None, None, "compare")._replace(**changes), model)

    model = Model.default()
    assert asked().startswith("compare-") and asked() == asked(path=tmp_path / "model.toml")
    assert len({asked(), asked(do="identify"), asked(text=model.text + "\n"), asked(tau=(0.1, 0.2))}) == 4
