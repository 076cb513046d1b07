"""What `set` changed, as lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wheelpend.model.settings import Changed


def change_lines(changed: Sequence[Changed], path: Path | None, *, regenerated: bool) -> list[str]:
    """Each entry with its value before and after, then what was saved."""
    if not changed:
        return [f"Nothing to change: {path} has these values already."]
    lines = [f"{c.key}: {_value_text(c.before)} → {_value_text(c.after)}" for c in changed]
    return [*lines, f"Saved {path} and regenerated its kernels." if regenerated else f"Saved {path}."]


def _value_text(value: Any) -> str:
    return "not stated" if value is None else str(value)
