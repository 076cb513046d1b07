"""Answers kept in a file as they come, so that an interrupted campaign goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import derive
import wheelpend
from wheelpend.campaigns.one_log import CampaignSetting, Estimate, LogResult, LogSource, NamedEffect
from wheelpend.files import rename, write_text
from wheelpend.kernels.cache import derivation_fingerprint
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.serialise import plain_data


class PartialResults:
    """The file of a campaign's answers so far: its setting in the first line, then one answer a line.

    Answers of another setting, of other code or of a log that has changed since are not taken up. Nor are failures:
    what was wrong may be right by now. A file of another setting is put aside, not written over.
    """

    def __init__(self, path: Path | None, setting: CampaignSetting, model: Model) -> None:
        self.path, self.setting, self.other = path, fingerprint(setting, model), False
        self.lines = {row["key"]: row["answer"] for row in self._read()}

    def _read(self) -> list[dict]:
        if self.path is None or not self.path.exists():
            return []
        rows = []
        for line in self.path.read_text(encoding="utf-8").splitlines():
            with suppress(json.JSONDecodeError):  # a line that an interruption cut off
                rows.append(json.loads(line))
        self.other = len(rows) > 1 and rows[0] != {"setting": self.setting}
        return [] if self.other else rows[1:]

    def known(self, source: LogSource) -> LogResult | None:
        """The answer of a log that was asked before, or None."""
        found = self.lines.get(source_key(source))
        return result_from_json(found) if found else None

    def begin(self) -> Path | None:
        """Write down what is known, and say where a file of another setting went.

        Raises Failure where the file cannot be written.
        """
        if self.path is None:
            return None
        aside = rename(self.path, f"{self.path.name}.other") if self.other else None
        rows = [{"setting": self.setting}, *({"key": k, "answer": a} for k, a in self.lines.items())]
        write_text(self.path, "".join(map(_line, rows)))
        return aside

    def add(self, source: LogSource, found: LogResult) -> None:
        """Write down one more answer."""
        key = source_key(source)
        if self.path is None or key is None or found.failure is not None:
            return
        self.lines[key] = plain_data(found)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(_line({"key": key, "answer": self.lines[key]}))


def _line(row: Mapping[str, Any]) -> str:
    return json.dumps(row, allow_nan=False) + "\n"


def source_key(source: LogSource) -> str | None:
    """What a log is known by: its seed, or its file with size and time; None of one that is in no file."""
    if isinstance(source, Log):
        return None
    if isinstance(source, int):
        return str(source)
    try:
        found = os.stat(source)
    except OSError:
        return None
    return f"{source} {found.st_size} {found.st_mtime_ns}"


def result_from_json(data: Mapping[str, Any]) -> LogResult:
    """An answer from JSON, whose lists become tuples again."""
    again = {name: _tuples(value) for name, value in data.items()}
    again["parameters"] = {name: Estimate(**row) for name, row in data["parameters"].items()}
    again["named"] = tuple(NamedEffect(n["effect"], tuple(n["equivalent_to"])) for n in data["named"])
    return LogResult(**again)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def fingerprint(setting: CampaignSetting, model: Model) -> str:
    """Hash of everything besides a log that decides what it answers: the model, the question, and the code."""
    own = sorted(repr(derive.effects.USER_EFFECTS[n]) for n in model.own)
    digest = hashlib.sha256(repr((setting, own, derive.plants.fingerprint(model.plant))).encode())
    digest.update(derivation_fingerprint().encode())
    command = Path(setting.played.command) if setting.played else Path()
    for path in (command, *sorted(Path(wheelpend.__file__).parent.rglob("*.py"))):
        if path.is_file():
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


__all__ = ["PartialResults"]
