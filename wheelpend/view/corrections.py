"""What cures a log, or is chosen otherwise than the model file has it, as settings of `wheelpend set`."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any


def setting_words(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Settings as the command line has them; nothing behind the sign takes an entry out."""
    return tuple(f"{key}={_value_text(value)}" for key, value in settings.items())


def settings_of(sections: str) -> dict[str, Any]:
    """Sections of a model.toml as settings, entry by entry."""
    return dict(_entries("", tomllib.loads(sections)))


def cures(findings: Sequence[Mapping[str, Any]], proposal: str) -> dict[str, Any]:
    """All that the model file can do about findings and guessed columns."""
    proposed = {
        k: v for k, v in settings_of(proposal).items() if k != f"columns.{v}.column"
    }  # which goes without saying
    return proposed | {k: v for found in findings for k, v in (found.get("settings") or {}).items()}


def changed(fields: Mapping[str, Any], before: Mapping[str, Any]) -> dict[str, Any]:
    """The settings whose field says something else than before."""
    return {key: value for key, value in fields.items() if _value_text(value) != _value_text(before.get(key))}


def _entries(place: str, tables: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from _entries(f"{place}{key}.", value)
        else:
            yield f"{place}{key}", value


def _value_text(value: Any) -> str:
    """A value as one types it."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)
