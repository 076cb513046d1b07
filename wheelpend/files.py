"""Files written complete or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from wheelpend.errors import Failure


def write_text(path: Path, text: str) -> None:
    """Write a file, complete or not at all; raises Failure where it cannot be written."""
    try:
        beside = path.with_name(f".{path.name}.{os.getpid()}.new")
        beside.write_text(text, encoding="utf-8")
        os.replace(beside, path)
    except OSError as error:
        raise Failure(f"{path} must be a file that can be written: {error.strerror}.") from None
