"""Which files a report was made from: name, digest and day, so that they can be told from others of the same name."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from hashlib import file_digest, sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.problem import EstimationProblem
from wheelpend.logs.log import Log

DIGEST_LENGTH = 12  # hexadecimal digits that are shown


class FileRow(NamedTuple):
    """A file as the provenance shows it, or a log that is in none."""

    name: str
    digest: str  # first digits of SHA-256
    changed: str  # day on which the file was changed last; of a log in memory that it is one
    size: int  # bytes


def file_rows(paths: Sequence[Path]) -> list[FileRow]:
    """Rows of the files that can be read; folders have none."""
    return [_file_row(path) for path in dict.fromkeys(map(Path, paths)) if path.is_file()]


def log_file_rows(problem: EstimationProblem) -> list[FileRow]:
    """Rows of the files from which a problem's logs were read; of a log in memory the digest is that of its values."""
    held_out = [v.part.log for v in problem.data.validation if v.estimation_log is None]
    return list(dict.fromkeys(map(_log_row, (*problem.logs, *held_out))))


def _file_row(path: Path) -> FileRow:
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()[:DIGEST_LENGTH]
    found = path.stat()
    return FileRow(path.name, digest, date.fromtimestamp(found.st_mtime).isoformat(), found.st_size)


def _log_row(log: Log) -> FileRow:
    """The row of a log's file; where there is none, or none any more, that of its times, inputs and readings."""
    if log.source and log.source.is_file():
        return _file_row(log.source)
    content = b"".join(np.ascontiguousarray(values).tobytes() for values in (log.t, log.voltage, log.measured))
    where = "values read from a file that has gone" if log.source else "values in memory"
    return FileRow(log.name, sha256(content).hexdigest()[:DIGEST_LENGTH], where, len(content))
