"""The files of a reproduction: tables, figures and page, written beside its place and then renamed."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EACCES
from math import isfinite
from pathlib import Path
from typing import Any

from wheelpend.errors import Failure
from wheelpend.files import write_files
from wheelpend.reproduction.figures import draw
from wheelpend.reproduction.gallery import render
from wheelpend.reproduction.record import Reproduction

GALLERY_FILE_NAME = "gallery.html"


def write_all(result: Reproduction, folder: Path) -> tuple[str, ...]:
    """Write tables, figures and gallery; returns their paths."""
    pictures = draw(result)
    files = {f"{name}.csv": text.encode() for name, text in csv_tables(result).items()}
    files |= {f"{name}.png": data for name, data in pictures.items()}
    files[GALLERY_FILE_NAME] = render(result, pictures).encode()
    return write(Path(folder), files)


def csv_tables(result: Reproduction) -> dict[str, str]:
    """One tidy CSV text per table."""
    found: dict[str, Sequence[Any]] = {
        "table1": result.table1,
        "table2": result.table2,
        "started_at_rest": result.started_at_rest,
        "condition_numbers": result.conditions,
        "table3": result.table3,
        "rmse": result.predictions,
    }
    texts = {name: csv_text([row.to_json() for row in rows]) for name, rows in found.items() if rows}
    rows = [
        {"choice": c.name, "open": c.open, "made": c.made, **e.to_json()} for c in result.choices for e in c.effects
    ]
    return texts | ({"choices": csv_text(rows)} if rows else {})


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows with the same keys as CSV; None, or what is not a number, is an empty cell."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: _cell(v) for k, v in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.6g}" if isfinite(value) else ""
    return value


def make_writable_folder(folder: Path) -> None:
    """Make a folder that can be written to; raises Failure where that is not possible."""
    with os_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(EACCES, os.strerror(EACCES))


def write(folder: Path, files: Mapping[str, bytes]) -> tuple[str, ...]:
    """Write files, all of them or none, and return their paths; raises Failure where that is not possible."""
    make_writable_folder(folder)
    write_files(folder, files)
    return tuple(str(folder / name) for name in files)


@contextmanager
def os_errors(folder: Path) -> Iterator[None]:
    """Turn what goes wrong with a folder into a Failure."""
    try:
        yield
    except OSError as error:
        raise Failure(f"{folder} must be a folder that can be written to: {error.strerror or error}. "
                      "Name another with --out.") from None  # fmt: skip
