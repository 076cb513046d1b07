"""Edits of the text of a model.toml, the fewest that will do: a person's comments and order survive."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import tomlkit
import tomlkit.exceptions
import tomlkit.items

from derive.parameter_name import ParameterName
from wheelpend.errors import Failure
from wheelpend.model.toml_file import GUESS_MARK, MODEL_FILE, UNKNOWN_MARK

UNSTATED_MARKS = (f"# {GUESS_MARK}", f"# {UNKNOWN_MARK}")


def with_value(text: str, name: str, value: float, sigma: float | None) -> str:
    """Text with an identified value, kept in the place and form that the file has for it."""
    effect, parameter = ParameterName.parse(name)
    header = ("effect", effect) if effect else ("parameters",)
    document = parsed(text)
    table: Any = document
    for key in header:
        table = table.get(key, {})
    entry = table.get(parameter)
    numbers = {"identified": value}
    if sigma is not None and math.isfinite(sigma):
        numbers["sigma"] = float(sigma)
    if entry is None and (not table or find_table(text.splitlines(), header)):
        return insert_line(text, header, f"{parameter} = {inline_table(numbers).as_string()}")
    if entry is None:  # the table is there without a header of its own, in dotted keys
        table[parameter] = inline_table(numbers)
    elif isinstance(entry, tomlkit.items.Table):
        entry.pop("sigma", None)
        entry.update(numbers)
    else:  # a plain number is the nominal value of a base parameter, the identified one of an effect's
        old = entry if isinstance(entry, Mapping) else {} if effect else {"nominal": entry}
        table[parameter] = inline_table({**{k: v for k, v in old.items() if k != "sigma"}, **numbers})
    return tomlkit.dumps(document)


def with_entry(text: str, place: tuple[str, ...], value: Any) -> str:
    """Text whose entry at a place such as (columns, theta_p, sign) has a value, or is gone where that is None."""
    *header, key = place
    document = parsed(text)
    table: Any = document
    for depth, name in enumerate(header):
        if name not in table:  # the rest of the place goes in braces into the last table that is there, or a new one
            if value is None:
                return text
            depth = max(depth, 1)
            for inner in reversed(place[depth + 1 :]):
                value = {inner: value}
            header, key = header[:depth], place[depth]
            break
        table = table[name]
    item = _nested_inline(value) if isinstance(value, dict) else value
    if isinstance(table, tomlkit.items.InlineTable):
        entries = {k: v for k, v in table.items() if k != key or value is not None}
        return _with_item(document, header, inline_table(entries if value is None else {**entries, key: item}))
    if value is None:
        if key in table:
            del table[key]
        return tomlkit.dumps(document)
    if key not in table and (table is document or find_table(text.splitlines(), tuple(header))):
        return insert_line(text, tuple(header), f"{key} = {tomlkit.item(item).as_string()}")
    table[key] = item
    return tomlkit.dumps(document)


def _nested_inline(entries: Mapping[str, Any]) -> tomlkit.items.Item:
    """Entries as an inline table, those in it too."""
    return inline_table({k: _nested_inline(v) if isinstance(v, dict) else v for k, v in entries.items()})


def _with_item(document: tomlkit.TOMLDocument, place: list[str], item: tomlkit.items.Item) -> str:
    """Text of a document in which an entry is another; the comment behind it stays."""
    table: Any = document
    for name in place[:-1]:
        table = table[name]
    if isinstance(table, tomlkit.items.InlineTable):
        return _with_item(document, place[:-1], inline_table({**table, place[-1]: item}))
    table[place[-1]] = item
    return tomlkit.dumps(document)


def without_guess_mark(text: str, place: tuple[str, ...]) -> str:
    """Text in which the entry at a place is marked as guessed, or not recognised, no more; other comments stay."""
    document = parsed(text)
    entry = _item_at(document, place)
    if entry is None or not entry.trivia.comment.startswith(UNSTATED_MARKS):
        return text
    entry.trivia.comment = entry.trivia.comment_ws = ""
    return tomlkit.dumps(document)


def has_guess_mark(text: str, place: tuple[str, ...]) -> bool:
    """True of an entry at a place that is there and marked as guessed."""
    entry = _item_at(parsed(text), place)
    return entry is not None and entry.trivia.comment.startswith(f"# {GUESS_MARK}")


def _item_at(document: tomlkit.TOMLDocument, place: tuple[str, ...]) -> tomlkit.items.Item | None:
    """The entry at a place, with the comment behind it; None where none is."""
    entry: Any = document
    for name in place:
        if name not in entry:
            return None
        entry = entry[name]
    return entry if isinstance(entry, tomlkit.items.Item) else None


def parsed(text: str) -> tomlkit.TOMLDocument:
    """A text as it can be edited; raises Failure where tomlkit, stricter than Python's own reader, does not take it."""
    try:
        return tomlkit.parse(text)
    except (tomlkit.exceptions.TOMLKitError, ValueError, RecursionError) as error:
        raise Failure(f"{MODEL_FILE} must be TOML that can be edited, but it cannot: {error}. "
                      "Write it more plainly.") from error  # fmt: skip


def inline_table(numbers: Mapping[str, Any]) -> tomlkit.items.Item:
    """Numbers as an inline table, spaced as people write it."""
    return tomlkit.value(
        "{ " + ", ".join(f"{key} = {tomlkit.item(v).as_string()}" for key, v in numbers.items()) + " }"
    )


def with_effect_list(text: str, wanted: tuple[str, ...]) -> str:
    """Text whose list of effects is the wanted one."""
    document = parsed(text)
    if "effects" not in document:
        array = tomlkit.array()
        array.extend(wanted)
        start = re.search(r"(?m)^\s*\[", text)
        at = start.start() if start else len(text)
        end = "\r\n" if "\r\n" in text else "\n"
        before = text[:at] if not at or text[:at].endswith("\n") else text[:at] + end
        return f"{before}effects = {array.as_string()}{end}{text[at:]}"
    array = document["effects"]  # type: ignore[assignment]
    for name in [n for n in array if n not in wanted]:
        array.remove(name)
    for name in [n for n in wanted if n not in array]:
        array.append(name)
    if list(array) != list(wanted):
        array.clear()
        array.extend(wanted)
    return tomlkit.dumps(document)


def insert_line(text: str, header: tuple[str, ...], line: str) -> str:
    """Text with a line after the last entry of a table, which is made at the end of the file where it is missing."""
    lines = text.splitlines(keepends=True)
    end = "\r\n" if "\r\n" in text else "\n"
    block = find_table(lines, header)
    if block is None:
        gap = "" if not text else end if text.endswith("\n") else 2 * end
        return f"{text}{gap}[{'.'.join(header)}]{end}{line}{end}"
    before, after = lines[: block[1]], lines[block[1] :]
    if not before[-1].endswith("\n"):
        before.append(end)
    return "".join([*before, line + end, *after])


def with_tables(text: str, section: str, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Text in which a section holds these tables of numbers and names, and no others."""
    for name in parsed(text).get(section, {}):
        if name not in tables:
            text = without_table(text, section, name)
    for name, entries in tables.items():
        text = _with_table(text, section, name, entries)
    return text


def _with_table(text: str, section: str, name: str, entries: Mapping[str, Any]) -> str:
    """Text in which a section's table holds these entries, in the form that the file has for it."""
    document = parsed(text)
    tables: Any = document.get(section)
    present = (tables or {}).get(name)
    if present is None and not isinstance(tables, tomlkit.items.InlineTable):
        for key, value in entries.items():
            text = insert_line(text, (section, name), f"{key} = {tomlkit.item(value).as_string()}")
        return text
    if present is None:
        tables[name] = inline_table(entries)
        return tomlkit.dumps(document)
    if not isinstance(present, tomlkit.items.AbstractTable):  # dotted keys in several lines
        return _with_table(without_table(text, section, name), section, name, entries)
    for key in [k for k in present if k not in entries]:
        present.remove(key)
    present.update(entries)
    return tomlkit.dumps(document)


def without_table(text: str, section: str, name: str) -> str:
    """Text without [section.name]; the comments that follow its last entry belong to what comes next and stay."""
    lines = text.splitlines(keepends=True)
    block = find_table(lines, (section, name))
    if block is not None:
        first, last = block
        if first and not lines[first - 1].strip() and not "".join(lines[last : last + 1]).strip():
            first -= 1  # of the blank lines before and after, one is enough
        text = "".join(lines[:first] + lines[last:])
    document = parsed(text)
    tables: Any = document.get(section, {})
    if name in tables:  # written in another form
        del tables[name]
        if not tables:
            document.remove(section)
        text = tomlkit.dumps(document)
    return text


def find_table(lines: list[str], header: tuple[str, ...]) -> tuple[int, int] | None:
    """Lines of a table from its header to its last entry, half open; None where it has no header of its own."""
    quoted = r"\s*\.\s*".join(rf"[\"']?{re.escape(key)}[\"']?" for key in header)
    pattern = re.compile(rf"\s*\[\s*{quoted}\s*\]\s*(#.*)?\s*")
    first = next((k for k, line in enumerate(lines) if pattern.fullmatch(line)), None)
    if first is None:
        return None
    end = next((k for k in range(first + 1, len(lines)) if re.match(r"\s*\[", lines[k])), len(lines))
    while end > first + 1 and re.fullmatch(r"\s*(#.*)?\s*", lines[end - 1]):
        end -= 1
    return first, end
