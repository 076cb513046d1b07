"""Logs that were dropped on the page become files of the workspace, under names that nothing else has."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from wheelpend.errors import Failure

LOGS_FOLDER = "logs"  # of a workspace
LOG_SUFFIXES = (".csv", ".txt", ".parquet", ".mat", ".mcap")
UNSAFE_CHARACTERS = re.compile(r"[^\w.+-]+")
MAX_NAME_LENGTH = 100


def safe_name(name: str) -> str:
    """The name of a log's file from whatever a browser says; raises Failure where it is no log's."""
    last = re.split(r"[/\\]", name)[-1]
    cleaned = UNSAFE_CHARACTERS.sub("_", last).lstrip(".-_")[-MAX_NAME_LENGTH:]
    if Path(cleaned).suffix.lower() not in LOG_SUFFIXES or not Path(cleaned).stem:
        raise Failure(
            f"A log's file must end in {', '.join(LOG_SUFFIXES[:-1])} or {LOG_SUFFIXES[-1]}, "
            f"but this one is '{last}'. Rename it."
        )
    return cleaned


def free_path(folder: Path, name: str) -> Path:
    """A path in a folder that nothing has yet."""
    path, number = folder / name, 1
    while path.exists():
        number += 1
        path = folder / f"{Path(name).stem}-{number}{Path(name).suffix}"
    return path


async def keep_upload(file: Any, workspace: Path) -> Path:
    """Keep a file that was dropped in the workspace's folder of logs; raises Failure where it is none."""
    folder = workspace / LOGS_FOLDER
    path = free_path(folder, safe_name(file.name))
    folder.mkdir(parents=True, exist_ok=True)
    await file.save(path)
    return path
