"""Times as they are shown, and what is left of counted steps."""

import pytest

from wheelpend import durations
from wheelpend.durations import StepTimer, clock_text, duration_text


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (99.0, "99 s"), (100.0, "2 min"), (5940.0, "99 min"), (6000.0, "1.7 h")]
)
def test_a_duration_has_a_unit_that_suits_it(seconds, text):
    assert duration_text(seconds) == text


@pytest.mark.parametrize(("seconds", "text"), [(7.9, "0:07"), (754.0, "12:34"), (3723.0, "1:02:03")])
def test_a_clock_shows_seconds_always_and_hours_where_there_are_some(seconds, text):
    assert clock_text(seconds) == text


def test_what_is_left_is_as_long_per_step_as_what_was_done(monkeypatch):
    monkeypatch.setattr(durations, "monotonic", lambda: 30.0)
    timer = StepTimer(10, begin_s=10.0)
    assert timer.left_text(4) == ", about 30 s left"
    assert timer.left_text(0) == timer.left_text(10) == ""
