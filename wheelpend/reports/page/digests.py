"""Which files a report was made from: name, digest and day, so that they can be told from others of the same name."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from hashlib import file_digest
from pathlib import Path
from typing import NamedTuple

DIGEST_LENGTH = 12  # hexadecimal digits that are shown


class FileRow(NamedTuple):
    """A file as the provenance shows it."""

    name: str
    digest: str  # first digits of SHA-256
    changed: str  # day on which the file was changed last
    size: int  # bytes


def file_rows(paths: Sequence[Path]) -> list[FileRow]:
    """Rows of the files that can be read; folders have none."""
    return [_file_row(path) for path in dict.fromkeys(map(Path, paths)) if path.is_file()]


def _file_row(path: Path) -> FileRow:
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()[:DIGEST_LENGTH]
    found = path.stat()
    return FileRow(path.name, digest, date.fromtimestamp(found.st_mtime).isoformat(), found.st_size)
