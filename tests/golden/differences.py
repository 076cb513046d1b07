"""What differs between two results: exactly, or beyond a tolerance of numbers, in JSON and in text."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

NUMBER = re.compile(r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
DRAWN = re.compile(r"[\s\u2500-\u259f]+")  # white space, frames of tables and bars: their lengths follow the numbers
PICTURE = re.compile(r"sha256:[0-9a-f]{64}")  # no picture is equal to a tolerance
SHOWN_LINES = 5  # per file
SHOWN_WIDTH = 150  # characters of a line


class Tolerance(NamedTuple):
    """Numbers are equal within atol + rtol·|number|; zero for bit for bit."""

    rtol: float = 0.0
    atol: float = 0.0

    @property
    def exact(self) -> bool:
        """Nothing may differ."""
        return self == EXACT

    def holds(self, a: float, b: float) -> bool:
        """The two numbers are equal within it."""
        return a == b or abs(a - b) <= self.atol + self.rtol * max(abs(a), abs(b))


EXACT = Tolerance()
OF_ITS_KIND = Tolerance(rtol=float("inf"))  # whatever it is: a choice between two that are equally good
Rule = Callable[[str], Tolerance]  # the tolerance of a place in JSON, a path such as .parameters.X1.value


def folders_differ(old: Path, new: Path, tolerance: Tolerance = EXACT) -> Iterator[str]:
    """Differences between two records, file by file."""
    names = sorted({str(p.relative_to(root)) for root in (old, new) for p in root.rglob("*") if p.is_file()})
    for name in names:
        missing = [root for root in (old, new) if not (root / name).exists()]
        if missing:
            yield f"{name}: not in {missing[0]}"
            continue
        before, after = ((root / name).read_text(encoding="utf-8") for root in (old, new))
        yield from (f"{name}{found}" for found in files_differ(name, before, after, tolerance))


def files_differ(name: str, old: str, new: str, tolerance: Tolerance) -> Iterator[str]:
    """Differences between two files of one name."""
    if old == new:
        return
    if name.endswith(".json"):
        yield from json_differs(json.loads(old), json.loads(new), lambda _: tolerance)
    else:
        yield from lines_differ(old.splitlines(), new.splitlines(), tolerance)


def json_differs(old: Any, new: Any, rule: Rule, place: str = "") -> Iterator[str]:
    """Differences between two JSON values, each with its place."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            if key in old and key in new:
                yield from json_differs(old[key], new[key], rule, f"{place}.{key}")
            else:
                yield f"{place}.{key}: {'gone' if key in old else 'new'}"
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield f"{place}: {len(old)} entries became {len(new)}"
        for number, pair in enumerate(zip(old, new, strict=False)):
            yield from json_differs(*pair, rule, f"{place}[{number}]")
    elif not _equal(old, new, rule(place)):
        yield f"{place}: {_short(json.dumps(old))} became {_short(json.dumps(new))}{_distance(old, new)}"


def _equal(old: Any, new: Any, tolerance: Tolerance) -> bool:
    if tolerance == OF_ITS_KIND:
        return type(old) is type(new)
    if isinstance(old, str) and isinstance(new, str):
        return text_equal(old, new, tolerance)
    if _is_number(old) and _is_number(new) and not tolerance.exact:
        return tolerance.holds(old, new)
    return type(old) is type(new) and old == new


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _distance(old: Any, new: Any) -> str:
    if not (_is_number(old) and _is_number(new)):
        return ""
    return f", by {abs(old - new) / max(abs(old), abs(new)):.1e} of it"


def lines_differ(old: list[str], new: list[str], tolerance: Tolerance) -> Iterator[str]:
    """Differences between two texts, the first few lines of them."""
    pairs = enumerate(zip_longest(old, new, fillvalue=""), start=1)
    found = [(number, a, b) for number, (a, b) in pairs if not text_equal(a, b, tolerance)]
    for number, a, b in found[:SHOWN_LINES]:
        begin = max(0, next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), 0) - 40)
        yield f":{number}\n    - {_short(a[begin:])}\n    + {_short(b[begin:])}"
    if len(found) > SHOWN_LINES:
        yield f": {len(found) - SHOWN_LINES} more lines differ"
    if len(old) != len(new):
        yield f": {len(old)} lines became {len(new)}"


def text_equal(old: str, new: str, tolerance: Tolerance) -> bool:
    """Two texts are equal but for their numbers, and these are within the tolerance or one unit of their last digit."""
    if old == new or tolerance.exact:
        return old == new
    a, b = (PICTURE.sub("<picture>", DRAWN.sub(" ", text)) for text in (old, new))
    if [part.strip() for part in NUMBER.split(a)] != [part.strip() for part in NUMBER.split(b)]:
        return False
    return all(_printed_equal(x, y, tolerance) for x, y in zip(NUMBER.findall(a), NUMBER.findall(b), strict=True))


def _printed_equal(old: str, new: str, tolerance: Tolerance) -> bool:
    a, b = float(old), float(new)
    if tolerance.holds(a, b):
        return True
    return "." in old and "." in new and abs(a - b) <= 1.001 * max(_last_digit(old), _last_digit(new))


def _last_digit(printed: str) -> float:
    mantissa, _, exponent = printed.lower().partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def _short(text: str) -> str:
    return text if len(text) <= SHOWN_WIDTH else text[:SHOWN_WIDTH] + "…"
