"""Names of columns from a legend: comments that begin with the numbers of the columns that they tell of."""

from __future__ import annotations

import re
from collections.abc import Sequence

from wheelpend.logs.units import is_unit

NUMBERED_LINE = re.compile(
    r"(?:col(?:umn)?s?\b)?\W*(?P<numbers>\d{1,4}(?:[\s,]+\d{1,4})*)[\s.:)=-]+(?P<text>[^\d\s].*)", re.IGNORECASE
)
SAMPLE_WITH_UNIT = re.compile(r"(?<![\w.])[-+]?\d+\.\d*\s+(?P<word>[A-Za-z/]+)")
SAMPLE_VALUE = re.compile(r"(?<![\w.])[-+]?\d+\.\d*(?!\w)")  # of the first row, for an example
CLOCK_HEADERS = ("t", "time", "tiempo", "tempo", "temps", "zeit", "timestamp", "ms", "t_ms", "time_ms", "millis")
BRACKETED_UNIT = re.compile(r"[\[(]([^\[\]()]*)[\])]")


def names_of_legend(comments: Sequence[str], width: int) -> list[str]:
    """The names of so many columns, of which numbered comments tell each in turn; none where they do not.

    Comments may be numbered that tell of no columns, so that one of the names must be a clock's.

    ``11 12 Motor voltage [V] left, right: 8.0 7.6`` is two of them, ``Motor voltage left [V]`` and ``... right [V]``.
    """
    names: list[str] = []
    for line in comments:
        if not (found := NUMBERED_LINE.fullmatch(line)):
            continue
        numbers = [int(n) for n in re.findall(r"\d+", found["numbers"])]
        if numbers[0] == 1:
            names = []
        if numbers == list(range(len(names) + 1, len(names) + len(numbers) + 1)):
            names += names_of_entry(found["text"], len(numbers))
    return names if has_clock(names) and len(names) == width and len(set(names)) == width else []


def has_clock(names: Sequence[str]) -> bool:
    """True where one of some names is that of a clock."""
    return any(re.split(r"[ (\[]", name.lower())[0] in CLOCK_HEADERS for name in names)


def names_of_entry(text: str, count: int) -> list[str]:
    """The names of so many columns that one entry of a legend tells of, each with its unit in brackets."""
    said = SAMPLE_WITH_UNIT.sub(lambda m: f"[{m['word']}]" if is_unit(m["word"]) else m["word"], text.split(":")[0])
    said = SAMPLE_VALUE.sub("", said)
    if count == 1:
        return [" ".join(said.split())]
    bare, units = BRACKETED_UNIT.sub(" ", said), BRACKETED_UNIT.findall(said)
    parts = [" ".join(part.split()) for part in bare.split(",")]
    if len(parts) != count:  # one name for all
        parts = [f"{' '.join(parts)} {k}" for k in range(1, count + 1)]
    elif all(" " not in part for part in parts[1:]):  # a name with endings
        base, _, first = parts[0].rpartition(" ")
        parts = [f"{base} {ending}".strip() for ending in (first, *parts[1:])]
    if len(units) == 1:
        units = units[0].split(",") if units[0].count(",") == count - 1 else units * count
    if len(units) != count:
        return parts
    return [f"{part} [{unit.strip()}]" for part, unit in zip(parts, units, strict=True)]
