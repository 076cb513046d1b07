"""Measurement files that a command is to read, named where they are missing before anything is done for the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

_given: list[Path] = []  # measurement files of the command line that runs


def note_logs(paths: Sequence[str]) -> None:
    """Note the measurement files of a command line that begins; none when it has ended."""
    _given[:] = map(Path, paths)


def check_logs() -> None:
    """Raise Failure where one of them is missing, empty, a folder, or cannot be read."""
    if _given:
        from wheelpend.logs.read import check_file  # imported late: loads NumPy

        for path in _given:
            check_file(path)
