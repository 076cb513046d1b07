"""Warnings on standard error."""

from wheelpend.reports.console import print_warnings


def test_a_warning_that_stands_in_one_that_was_said_is_not_said_again(capsys):
    said = ["a.csv: theta_p was filtered. State its error."]
    print_warnings(["a.csv: theta_p was filtered.", "b.csv: theta_p was filtered."], said)
    print_warnings(["once", "twice"])
    printed = capsys.readouterr().err
    assert printed.count("a.csv") == 0 and printed.count("b.csv") == 1
    assert printed.count("once") == printed.count("twice") == 1
