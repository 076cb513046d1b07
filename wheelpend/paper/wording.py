"""What `wheelpend verify` prints."""

from __future__ import annotations

from wheelpend.paper.verification import STATUSES, Checked, Verification
from wheelpend.reports.console import say, table

WORDS = {"not_available": "not readable"}


def finding(checked: Checked) -> str:
    """A finding in one line."""
    if checked.status == "misprint":
        return f"{checked.name}: {checked.note}"
    if checked.status == "assumption":
        return f"{checked.assumption}: {checked.note.split('; it reaches')[0].split('. The rotor')[0]}"
    return checked.note or {"match": "as derived"}.get(checked.status, "")


def summary(result: Verification) -> str:
    """How many equations have which status."""
    counts = {s: len({c.number for c in result.of(s)}) for s in STATUSES}
    numbers = len({c.number for c in result.equations})
    parts = [
        f"{counts[s]} with {WORDS.get(s, s)}" if s == "assumption" else f"{counts[s]} {WORDS.get(s, s)}"
        for s in STATUSES
    ]
    return f"{numbers} numbered equations: {', '.join(parts)}. An equation may have more than one finding."


def show_verification(result: Verification) -> None:
    """Print a verification."""
    rows = [(f"({c.number})", WORDS.get(c.status, c.status), finding(c)) for c in result.equations]
    table("The paper's equations against the derivation", ("equation", "status", "finding"), rows, words=True)
    say(summary(result))
    for status, title, other in (("misprint", "Misprints", "correct"), ("assumption", "Assumptions", "otherwise")):
        if result.of(status):
            say(f"\n{title}")
        for checked in result.of(status):
            show_details(checked, other)
    table("The paper's numbers against each other", ("number", "status", "printed", "needed"),
          [(c.name, c.status, c.printed or "-", c.derived or "-") for c in result.parameters], words=True)  # fmt: skip
    for number in result.parameters:
        if number.status != "match":
            say(f"  {number.name}: {number.note}")


def show_details(checked: Checked, other: str) -> None:
    """Print one misprint or assumption: as printed, the other form, how it shows."""
    say(f"  ({checked.number}) {checked.assumption or checked.name}: {checked.note}")
    say(f"      {'printed':9} {checked.printed}")
    say(f"      {other:9} {checked.derived}")
    for sentence in checked.shows:
        say(f"      {'shows':9} {sentence}: not as printed, but as corrected")
    if checked.agrees_with:
        say(f"      {'right':9} {', '.join(f'({n})' for n in checked.agrees_with)}")
