"""What happened to the model before an explanation: the changes that its workspace's history tells."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import PurePath
from typing import Any, NamedTuple

from wheelpend.diagnosis.explain import Ladder
from wheelpend.errors import Failure
from wheelpend.model.workspace import history
from wheelpend.reports.ladder import Rung
from wheelpend.reports.numbers import error_text

CHANGE_PATTERN = re.compile(r"(add|remove) ([A-Za-z_]\w*)")
CHANGE_SIGNS = {"add": "+", "remove": "−"}
MAX_ERROR = 1e12  # σ, beyond which a number of the history is none
UNKNOWN_ERROR = float("nan")  # of a change after which nothing was refitted


class EarlierChange(NamedTuple):
    """A change of the model before the explanation, with its errors on the logs of its day."""

    label: str
    date: str  # nothing where the history has none
    before: float  # σ, NaN where it is not known
    after: float  # σ, likewise
    logs: str


def earlier_changes(explanation: Ladder) -> tuple[list[EarlierChange], list[str]]:
    """Changes in the history of the model's workspace before the explanation's own steps, and a warning if any."""
    if explanation.model.path is None:
        return [], []
    try:
        entries = history(explanation.model.workspace)
    except Failure as failure:
        return [], [f"What was changed earlier is not told: {failure}"]
    found = [(CHANGE_PATTERN.fullmatch(str(e.get("change"))), e) for e in _before(entries, explanation)]
    return [_change(k, match, e) for k, (match, e) in enumerate(found, 1) if match], []


def _before(entries: Sequence[Mapping[str, Any]], explanation: Ladder) -> Sequence[Mapping[str, Any]]:
    """The entries without the explanation's own steps, which are the last ones where it was saved already."""
    own = [(f"add {s.effect}", s.error_before, s.error_after) for s in explanation.steps]
    last = [(e.get("change"), e.get("error_before"), e.get("error_after")) for e in entries[len(entries) - len(own) :]]
    return entries[: len(entries) - len(own)] if own and last == own else entries


def _change(number: int, match: re.Match[str], entry: Mapping[str, Any]) -> EarlierChange:
    logs, day = entry.get("logs"), entry.get("date")
    names = [PurePath(str(name)).name for name in logs] if isinstance(logs, list) else []
    before, after = (_error(entry.get(key)) for key in ("error_before", "error_after"))
    label = f"{number}. {CHANGE_SIGNS[match[1]]} {match[2]}"
    return EarlierChange(label, str(day or ""), before, after, ", ".join(names))


def _error(value: Any) -> float:
    known = isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < MAX_ERROR
    return float(value) if known else UNKNOWN_ERROR


def earlier_rungs(changes: Sequence[EarlierChange]) -> list[Rung]:
    """Rungs of the model before the first change that was judged, and after each change."""
    rungs = [Rung("earlier", c.label, c.after, said=_when_text(c)) for c in changes]
    first = next((k for k, c in enumerate(changes) if isfinite(c.before)), None)
    if first is not None:
        label = "first model" if first == 0 else "as it was then"
        rungs.insert(first, Rung("earlier", label, changes[first].before, said=_when_text(changes[first])))
    return rungs


def _when_text(change: EarlierChange) -> str:
    return ", ".join(filter(None, (change.date, change.logs and f"on {change.logs}")))


def story_sentences(changes: Sequence[EarlierChange]) -> list[str]:
    """What was changed before the report, in a sentence; none where nothing was."""
    if not changes:
        return []
    days = sorted({c.date for c in changes if c.date})
    when = f" ({' to '.join(dict.fromkeys((days[0], days[-1])))})" if days else ""
    names = ", ".join(c.label.partition(" ")[2] for c in changes)
    judged = [c for c in changes if isfinite(c.before) and isfinite(c.after)]
    errors = (f"; the error was {error_text(judged[0].before)} before the first and {error_text(judged[-1].after)} "
              "after the last, each on the logs of its day") if judged else ""  # fmt: skip
    return [f"The story began earlier{when}: {names}{errors}."]
