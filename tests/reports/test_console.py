"""Progress: a live line with the time on a terminal, few plain lines without it elsewhere."""

import io

import pytest
from rich.console import Console

from wheelpend.reports import console


def test_long_work_says_how_far_it_is_though_nobody_watches_a_terminal(monkeypatch, capsys):
    clock = iter([0.0, 5.0, 11.0, 11.0, 12.0])
    monkeypatch.setattr(console, "monotonic", lambda: next(clock))
    with console.progress("begin") as update:
        for number in range(3):
            update(f"step {number}")
    assert capsys.readouterr().err == "step 1\n"


@pytest.fixture
def terminal(monkeypatch):
    """What is drawn on a terminal, whose clock each step sets."""
    shown, clock = io.StringIO(), [0.0]
    monkeypatch.setattr(
        console, "err", Console(file=shown, force_terminal=True, width=80, highlight=False, soft_wrap=True)
    )
    monkeypatch.setattr(console, "monotonic", lambda: clock[0])

    def work(seconds):
        with console.progress("reading") as update:
            clock[0] += seconds
            update("fitting [1/3]")
        return shown.getvalue()

    return work


def test_a_terminal_shows_the_time_since_the_work_began(terminal):
    shown = terminal(3.0)
    assert "0:03 fitting [1/3]" in shown and "Took" not in shown


def test_long_work_ends_with_the_whole_time(terminal):
    assert "Took 75 s." in terminal(75.0)


def test_a_name_on_the_live_line_steers_no_terminal(terminal):
    assert "\x1b]0;" not in str(console._LiveLine("\x1b]0;owned").__rich__())
