"""What a campaign keeps: results of the same log only, in all their digits."""

import csv
import os
from types import SimpleNamespace

from wheelpend import Model
from wheelpend.campaigns.journal import Journal, fingerprint_of
from wheelpend.campaigns.one_log import CampaignSetting, Estimate, LogResult, NamedEffect
from wheelpend.campaigns.partial_results import PartialResults, result_from_json, source_key
from wheelpend.campaigns.table import csv_text
from wheelpend.serialise import plain_data


def test_a_file_that_has_changed_is_another_log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,v_in\n0,1\n")
    before = source_key(path)
    assert before == source_key(path) and source_key(3) == "3" and source_key(tmp_path / "gone.csv") is None
    path.write_text("t,v_in\n0,2\n")
    os.utime(path, ns=(1, 2))
    assert source_key(path) != before


def test_a_journal_is_read_again_as_it_was_written_without_a_line_that_was_cut_off(tmp_path):
    path = tmp_path / "c.partial"
    journal = Journal(path, "question")
    assert journal.begin() is None
    journal.add("1", {"a": 1.5})
    path.write_text(path.read_text() + '{"key": "2", "ans')
    again = Journal(path, "question")
    assert again.results == {"1": {"a": 1.5}} and not again.of_other_question
    other = Journal(path, "another")
    assert other.results == {} and other.begin() == tmp_path / "c.partial.other"


def test_a_result_comes_back_from_its_json():
    result = LogResult(
        "log.csv", verdict="ambiguous", named=(NamedEffect("slope", ("com_offset",)),), effects=("slope",),
        error=1.5, parameters={"X1": Estimate(0.04, None)}, fit_percent={"theta_w": 99.0}, warnings=("odd",),
    )  # fmt: skip
    assert result_from_json(plain_data(result)) == result


def test_a_fingerprint_depends_on_every_text_and_every_file(tmp_path):
    (tmp_path / "a").write_text("1")
    (tmp_path / "b").write_text("2")
    files = [tmp_path / "a", tmp_path / "b"]
    marks = {fingerprint_of(["x"], files), fingerprint_of(["y"], files), fingerprint_of(["x"], files[:1])}
    (tmp_path / "b").write_text("3")
    assert len({*marks, fingerprint_of(["x"], files)}) == 4


def test_a_table_has_nine_digits_and_a_column_for_each_number():
    logs = (
        LogResult("a.csv", error=1.23456789012, noise_floor=1.0, parameters={"X1": Estimate(0.04361234567, 1e-7)}),
        LogResult("b.csv", failure="no\nfile"),
    )
    first, second = csv.DictReader(csv_text(SimpleNamespace(logs=logs, simulated=None)).splitlines())
    assert first == {"log": "a.csv", "failure": "", "error": "1.23456789", "noise_floor": "1", "X1": "0.0436123457",
                     "X1_sigma": "1e-07"}  # fmt: skip
    assert (second["failure"], second["X1"]) == ("no file", "")


def test_a_failure_is_not_kept_for_its_cause_may_be_gone(tmp_path):
    path, setting = tmp_path / "c.partial", CampaignSetting(Model.default().text, None, None, "compare")
    results = PartialResults(path, setting, Model.default())
    results.begin()
    results.add(1, LogResult("seed 1", 1, error=1.5))
    results.add(2, LogResult("seed 2", 2, failure="It fell."))
    again = PartialResults(path, setting, Model.default())
    assert again.known(1) == LogResult("seed 1", 1, error=1.5) and again.known(2) is None
    assert PartialResults(path, setting._replace(do="identify"), Model.default()).known(1) is None
