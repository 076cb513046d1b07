"""The report tells the whole story: it begins with the first model that the workspace's history knows."""

import json
import re
from dataclasses import replace

import pytest

from tests.reports.test_page import charts_of, explanation  # noqa: F401  # a fixture
from wheelpend.reports.page.page import page_html
from wheelpend.reports.text.history import history_block

SLOPE = {"change": "add slope", "error_before": 99.5, "error_after": 70.25, "logs": ["old/first.csv"],
         "date": "2026-01-31"}  # fmt: skip
UNJUDGED = {"change": "remove slope", "error_before": None, "error_after": None, "logs": []}


@pytest.fixture
def with_history(explanation, tmp_path):  # noqa: F811
    """A page of the explanation in a workspace with a given history."""

    def made(text):
        (tmp_path / "history.json").write_text(text if isinstance(text, str) else json.dumps(text), encoding="utf-8")
        return page_html(replace(explanation, model=replace(explanation.model, path=tmp_path / "model.toml")))

    return made


def bars(page):
    return charts_of(page)[0]["data"][0]["y"]


def test_changes_that_were_made_earlier_stand_before_the_explanations_own(with_history):
    page = with_history([SLOPE, UNJUDGED])
    rows = re.findall(r"<tr><td>(.*?)</td>\n<td class=\"n\">(.*?)</td>", page)
    assert [tuple(" ".join(re.sub("<.*?>", "", cell).split()) for cell in row) for row in rows[:4]] == [
        ("first model (2026-01-31, on first.csv)", "99.50"),
        ("1. + slope (2026-01-31, on first.csv)", "70.25"),
        ("2. − slope", "–"),
        ("nominal values", "99.00"),
    ]
    assert bars(page)[:3] == ["first model", "1. + slope", "nominal values"]
    assert "The story began earlier (2026-01-31): + slope, − slope; the error was 99.50 before the first" in page


def test_steps_that_were_saved_already_are_told_once(with_history, explanation):  # noqa: F811
    (step,) = explanation.steps
    own = {"change": f"add {step.effect}", "error_before": step.error_before, "error_after": step.error_after}
    page = with_history([SLOPE, own])
    assert bars(page).count("+ coulomb_drive") == 1 and not [b for b in bars(page) if b.startswith("2.")]
    assert "The story began" not in with_history([own])


def test_a_history_that_is_none_is_a_warning_and_strange_entries_are_left_out(with_history):
    assert "What was changed earlier is not told" in with_history("{")
    strange = [{"change": "<b>x</b>"}, {"change": 3}, {"change": "add slope", "error_after": 10**400, "logs": 5}]
    assert "3. + slope" in with_history(strange) and "<b>x</b>" not in with_history(strange)


def test_the_history_on_the_terminal_has_the_day_of_each_change():
    assert [row[:2] for row in history_block([SLOPE, UNJUDGED]).rows] == [
        ("2026-01-31", "add slope"),
        ("", "remove slope"),
    ]
