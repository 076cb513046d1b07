"""The ladder is drawn from the history of the workspace: a bar for each change, and one for before the first."""

import pytest

from tests.view.serving import needs_nicegui

pytestmark = needs_nicegui


def entry(change, before, after):
    return {"change": change, "error_before": before, "error_after": after, "logs": ["a.csv"]}


def test_a_bar_for_each_change_and_one_for_before_the_first():
    from wheelpend.view.add_panel import ladder_figure

    history = [entry("add slope", 40.0, 12.0), entry("edit", None, None), entry("remove slope", 12.0, 40.0)]
    (bars,) = ladder_figure(history).data
    assert list(bars.x) == [40.0, 12.0, 40.0]
    assert list(bars.y) == ["before", "1: add slope", "2: remove slope"]


@pytest.mark.parametrize("history", [[], [entry("edit", None, None)]])
def test_what_was_not_judged_is_not_drawn(history):
    from wheelpend.view.add_panel import ladder_figure

    assert ladder_figure(history) is None
