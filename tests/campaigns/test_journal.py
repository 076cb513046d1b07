"""A journal goes on where it was cut off, and a campaign's table has every number."""

import csv
from types import SimpleNamespace

from wheelpend.campaigns.journal import Journal, fingerprint_of
from wheelpend.campaigns.one_log import Estimate, LogResult
from wheelpend.campaigns.table import csv_text


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
