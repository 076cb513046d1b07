"""Findings of a verification as text, for the terminal."""

from __future__ import annotations

from wheelpend.paper.findings import FINDING_STATUSES, EquationFinding, Verification
from wheelpend.reports.console import print_line, print_table

STATUS_TEXTS = {"not_available": "not readable"}


def finding_text(checked: EquationFinding) -> str:
    """One line on a finding."""
    if checked.status == "misprint":
        return f"{checked.name}: {checked.note}"
    if checked.status == "assumption":
        return f"{checked.assumption}: {checked.note.split('; it reaches')[0].split('. The rotor')[0]}"
    return checked.note or {"match": "as derived"}.get(checked.status, "")


def summary_text(result: Verification) -> str:
    """Numbers of equations by status."""
    counts = {s: len({c.number for c in result.of(s)}) for s in FINDING_STATUSES}
    numbers = len({c.number for c in result.equations})
    parts = [
        f"{counts[s]} with {STATUS_TEXTS.get(s, s)}" if s == "assumption" else f"{counts[s]} {STATUS_TEXTS.get(s, s)}"
        for s in FINDING_STATUSES
    ]
    return f"{numbers} numbered equations: {', '.join(parts)}. An equation may have more than one finding."


def print_verification(result: Verification) -> None:
    """Print the findings, misprints and assumptions in detail, and the checks of the numbers."""
    rows = [(f"({c.number})", STATUS_TEXTS.get(c.status, c.status), finding_text(c)) for c in result.equations]
    print_table(
        "The paper's equations against the derivation", ("equation", "status", "finding"), rows, text_columns=True
    )
    print_line(summary_text(result))
    for status, title, other in (("misprint", "Misprints", "correct"), ("assumption", "Assumptions", "otherwise")):
        if result.of(status):
            print_line(f"\n{title}")
        for checked in result.of(status):
            print_details(checked, other)
    print_table(
        "The paper's numbers against each other",
        ("number", "status", "printed", "needed"),
        [(c.name, c.status, c.printed or "-", c.derived or "-") for c in result.parameters],
        text_columns=True,
    )
    for number in result.parameters:
        if number.status != "match":
            print_line(f"  {number.name}: {number.note}")


def print_details(checked: EquationFinding, other: str) -> None:
    """Print one misprint or assumption: as printed, the other form, and the relations it violates."""
    print_line(f"  ({checked.number}) {checked.assumption or checked.name}: {checked.note}")
    print_line(f"      {'printed':9} {checked.printed}")
    print_line(f"      {other:9} {checked.derived}")
    for sentence in checked.shows:
        print_line(f"      {'shows':9} {sentence}: not as printed, but as corrected")
    if checked.agrees_with:
        print_line(f"      {'right':9} {', '.join(f'({n})' for n in checked.agrees_with)}")
