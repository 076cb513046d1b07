"""Folders of generated files: compared with what they should hold, or replaced by it; and where the sources lie."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

HERE = Path(__file__).resolve().parent
TEMPLATES = next(p for p in (HERE / "templates", HERE.parent / "templates") if p.is_dir())


def differences(folder: Path, files: dict[str, str]) -> str:
    """Unified diff from what is in the folder to what should be; empty when nothing is stale."""
    found: list[str] = []
    for name, text in files.items():
        path = folder / name
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        found += difflib.unified_diff(old.splitlines(True), text.splitlines(True), str(path), f"{path} (derived)")
    return "".join(found)


def write(folder: Path, files: dict[str, str]) -> None:
    """Write files: all of them beside their places first, then renamed onto them."""
    folder.mkdir(parents=True, exist_ok=True)
    beside = {name: folder / f".{name}.{os.getpid()}.new" for name in files}
    try:
        for name, text in files.items():
            beside[name].write_text(text, encoding="utf-8")
        for name, path in beside.items():
            os.replace(path, folder / name)
    finally:
        for path in beside.values():
            path.unlink(missing_ok=True)
