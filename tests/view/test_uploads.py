"""Logs that are dropped on the page."""

import pytest

from wheelpend.errors import Failure
from wheelpend.view.uploads import free_path, safe_name


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("drive 1.csv", "drive_1.csv"),
        ("../../etc/cron.d/x.csv", "x.csv"),
        ("C:\\logs\\a.parquet", "a.parquet"),
        ("DATA.MAT", "DATA.MAT"),
        ("<img src=x>.csv", "img_src_x_.csv"),
        ("--save.csv", "save.csv"),
        ("..csv.csv", "csv.csv"),
        ("ü.csv", "ü.csv"),
    ],
)
def test_a_name_is_made_one_that_means_nothing_to_anybody(said, kept):
    assert safe_name(said) == kept


@pytest.mark.parametrize("said", ["", ".csv", "model.toml", "x.html", "../..", "a.csv/"])
def test_what_is_no_log_is_refused(said):
    with pytest.raises(Failure, match=r"must end in \.csv"):
        safe_name(said)


def test_no_file_is_written_over(tmp_path):
    for expected in ("a.csv", "a-2.csv", "a-3.csv"):
        path = free_path(tmp_path, "a.csv")
        assert path.name == expected
        path.touch()
