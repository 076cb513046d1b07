"""Journal of a resumable run: results in a file as they come, from which an interrupted run goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from derive.files import replacing
from wheelpend.files import read_bytes, read_text, rename, write_errors


class Journal:
    """Results by key, in a file of JSON lines that is only appended to: the question's fingerprint, then one a line.

    Results of another question are not read, and their file is put aside, not written over. Without a path nothing is
    written.
    """

    def __init__(self, path: Path | None, fingerprint: str) -> None:
        self.path, self.fingerprint = path, fingerprint
        rows = _complete_rows(path)
        self.of_other_question = len(rows) > 1 and rows[0] != self._header()
        self.results: dict[str, Any] = {}  # as JSON has them
        if not self.of_other_question:
            self.results = {row["key"]: row["answer"] for row in rows[1:] if {"key", "answer"} <= row.keys()}

    def _header(self) -> dict[str, Any]:
        return {"setting": self.fingerprint}

    def begin(self) -> Path | None:
        """Write what is known, and return the path to which a file of another question was moved.

        Raises Failure where the file cannot be written.
        """
        if self.path is None:
            return None
        aside = rename(self.path, f"{self.path.name}.other") if self.of_other_question else None
        rows = [self._header(), *({"key": k, "answer": a} for k, a in self.results.items())]
        # no result, so that an interruption does not name it
        with write_errors(str(self.path)), replacing([self.path]) as (partial,):
            partial.write_text("".join(map(_line, rows)), encoding="utf-8")
        return aside

    def add(self, key: str, result: Any) -> None:
        """Append a result, given as plain data of JSON."""
        self.results[key] = result
        if self.path is not None:
            with write_errors(str(self.path)), self.path.open("a", encoding="utf-8") as file:
                file.write(_line({"key": key, "answer": result}))


def _complete_rows(path: Path | None) -> list[dict[str, Any]]:
    """Lines of a journal, without one that an interruption cut off."""
    if path is None or not path.exists():
        return []
    rows = []
    for line in read_text(path).splitlines():
        with suppress(ValueError, RecursionError):
            rows.append(json.loads(line))
    return [row for row in rows if isinstance(row, dict)]


def _line(row: Mapping[str, Any]) -> str:
    return json.dumps(row, allow_nan=False) + "\n"


def fingerprint_of(texts: Iterable[str], files: Iterable[Path]) -> str:
    """Hash (hexadecimal) of texts and of what files hold, in the given order."""
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode())
    for path in files:
        digest.update(read_bytes(path))
    return digest.hexdigest()


def with_tuples(value: Any) -> Any:
    """A value of JSON whose lists are tuples."""
    return tuple(map(with_tuples, value)) if isinstance(value, list) else value
