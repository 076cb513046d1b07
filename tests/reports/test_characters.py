"""Characters that steer a terminal or turn a text around are shown, not obeyed."""

import pytest

from tests.support import run
from wheelpend.reports.characters import visible
from wheelpend.reports.console import print_line, print_table


@pytest.mark.parametrize("text", ["", "plain", "θ_p ± 0.1 °", "two\nlines\tand a tab", "[bold]", "日本"])
def test_what_people_write_stays_as_it_is(text):
    assert visible(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [("\x1b[2J", "\\x1b[2J"), ("\x9b1m", "\\x9b1m"), ("\u202evsc", "\\u202evsc"), ("\udcff.csv", "\\udcff.csv"),
     ("a\rb", "a\\x0db"), ("\x00", "\\x00"), ("\U000e0001", "\\U000e0001")],
)  # fmt: skip
def test_what_steers_is_shown_as_an_escape(text, shown):
    assert visible(text) == shown


def test_nothing_that_is_printed_steers(capsys):
    print_line("\x1b[31mred")
    print_table("\u202etitle", ["\x1b]0;title\x07"], [["\x1b[2J"]])
    said = capsys.readouterr().out
    assert not set("\x1b\x07\u202e") & set(said) and said.startswith("\\x1b[31mred")


def test_the_name_of_a_log_steers_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = run("inspect", "\x1b[2J\u202e.csv", code=1).output
    assert "\x1b" not in said and "\\x1b[2J\\u202e.csv" in said
