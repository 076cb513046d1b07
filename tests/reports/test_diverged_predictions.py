"""Predictions that diverged, in words and as bars."""

from types import SimpleNamespace

import pytest

from wheelpend import Model
from wheelpend.reports.ladder import Rung, bar_lengths, draw_ladder
from wheelpend.reports.numbers import prediction_error_text, unexplained_input_text
from wheelpend.reports.text.explanation import ladder_lines
from wheelpend.reports.text.verdict import fall_text, relative_fall_text

RUNGS = [Rung("nominal", "nominal", float("inf")), Rung("refitted", "refitted", 100.0), Rung("step", "+ a", 10.0)]


def ladder(nominal: float | None, base: float, *after: float):
    unknown = {"force_before": None, "force_after": None}
    steps = [SimpleNamespace(effect=f"effect_{k}", error_after=e, **unknown) for k, e in enumerate(after)]
    problem = SimpleNamespace(plant=Model.default().plant_signature)
    return SimpleNamespace(nominal_error=nominal, base_error=base, steps=steps, noise_floor=1.0, problem=problem)


def test_the_bar_of_a_prediction_that_diverged_is_the_longest():
    assert bar_lengths(RUNGS, 1.0, 40) == [40, 40, 20]
    assert bar_lengths(RUNGS[:1], 1.0, 40) == [40]


def test_a_ladder_with_a_rung_that_diverged_is_printed_and_drawn(tmp_path):
    found = ladder(float("inf"), 100.0, 1.0)
    lines = list(ladder_lines(found))
    assert "diverged ████" in lines[1] and "inf" not in "".join(lines)
    picture = draw_ladder(found, tmp_path / "ladder.svg").read_text()
    assert "diverged" in picture and "inf<" not in picture


@pytest.mark.parametrize(("error", "text"), [(1.25, "1.25"), (float("inf"), "diverged"), (None, "diverged")])
def test_an_error_that_is_not_finite_is_said_to_have_diverged(error, text):
    assert prediction_error_text(error) == text


def test_equations_that_leave_more_than_the_input_are_said_not_to_describe_the_log():
    assert unexplained_input_text(5.98) == "leave 5.98 % of the input unexplained."
    assert "119 times" in unexplained_input_text(11900.0) and "they do not describe this log" in unexplained_input_text(
        11900.0
    )


def test_a_fall_from_a_prediction_that_diverged_has_no_percentage():
    assert relative_fall_text(4.0, 1.0) == "the held-out error falls by 75 %"
    assert relative_fall_text(float("inf"), 1.0) == "the held-out prediction no longer diverges: its error is 1"
    assert fall_text(4.0, float("inf")) == "the held-out error rises from 4 to diverged"
    assert fall_text(85.9, 89.2) == "the held-out error rises from 85.9 to 89.2"
