"""How a log is read, as settings of the model file: what inspection proposes, and what a user chooses."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from wheelpend.logs.columns import ColumnMap


def proposed_settings(proposal: str) -> dict[str, str]:
    """Sections of a model.toml as settings of `wheelpend set`, by key: of a column its whole entry."""
    return {key: f"{key}={_value_text(value)}" for key, value in _entries(tomllib.loads(proposal))}


def _entries(sections: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for section, entries in sections.items():
        for key, value in entries.items():
            if isinstance(value, Mapping) and section != "columns":
                yield from ((f"{section}.{key}.{inner}", own) for inner, own in value.items())
            else:
                yield f"{section}.{key}", value


def _value_text(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value_text(own)}" for key, own in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (str, bool)) else repr(value)


def cures_of(finding: Mapping[str, Any], proposed: Mapping[str, str]) -> list[str]:
    """The settings that cure a fault; none where no line of a model file does."""
    kind, channels = str(finding.get("kind", "")), str(finding.get("channel", "")).split(" and ")
    wanted = [f"columns.{channel}" for channel in channels]
    if kind.endswith("_encoder"):
        wanted.append("sensors.encoder")
    return [proposed[key] for key in wanted if key in proposed]


def changed_settings(chosen: Mapping[str, ColumnMap], stated: Mapping[str, ColumnMap]) -> list[str]:
    """The settings that make each quantity read as chosen, where the model file states otherwise."""
    found = []
    for name, column in chosen.items():
        if column == stated.get(name, ColumnMap(name)):
            continue
        plain = column == ColumnMap(name)
        found.append(f"columns.{name}=" if plain else f"columns.{name}={_value_text(_entry(column))}")
    return found


def _entry(column: ColumnMap) -> dict[str, Any]:
    """The entry of [columns] for a column, without what goes without saying."""
    plain = ColumnMap(column.column)
    return {"column": column.column} | {k: v for k, v in vars(column).items() if v != getattr(plain, k)}


def stated_columns(maps: Mapping[str, Mapping[str, Any]], keys: Sequence[str]) -> dict[str, ColumnMap]:
    """Column maps as a process told them."""
    return {name: ColumnMap(**{key: found[key] for key in keys}) for name, found in maps.items()}
