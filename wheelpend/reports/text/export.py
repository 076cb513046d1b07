"""What an export carries, as lines and a table."""

from __future__ import annotations

from pathlib import Path

from wheelpend.export.ledger import Ledger
from wheelpend.reports.text.table import Table, TextBlocks


def export_text(ledger: Ledger, folder: Path) -> TextBlocks:
    """Where it is, what it carries, and its error there."""
    yield f"Exported {ledger.plant} to {folder}: {', '.join(sorted(ledger.files))}; EXPORT.md says what they carry."
    rows = [(name, c.carried, c.note) for name, c in ledger.effects.items()]
    if any(note for _, _, note in rows):
        yield Table("", ("effect", "carried", ""), rows)
    elif rows:
        yield Table("", ("effect", "carried"), [row[:2] for row in rows])
    yield from ledger.error_lines()
    yield from (f"- {note}" for note in ledger.notes)
