"""Progress on a terminal that nobody watches."""

from wheelpend.reports import console


def test_long_work_says_how_far_it_is_though_nobody_watches_a_terminal(monkeypatch, capsys):
    clock = iter([0.0, 5.0, 11.0, 11.0, 12.0])
    monkeypatch.setattr(console, "monotonic", lambda: next(clock))
    with console.progress("begin") as update:
        for number in range(3):
            update(f"step {number}")
    assert capsys.readouterr().err == "step 1\n"
