"""Folders of generated files: compared with their expected texts, or replaced by them; and the sources' folders."""

from __future__ import annotations

import difflib
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import EINVAL, EISDIR
from pathlib import Path
from threading import get_ident

LEFT_BEHIND_S = 600.0  # s for which a partial file has not changed where its process, on whatever machine, was killed
DERIVE_FOLDER = Path(__file__).resolve().parent
temporary_paths: set[Path] = set()  # files and folders that must not stay where this process ends all of a sudden
TEMPLATE_FOLDER = next(p for p in (DERIVE_FOLDER / "templates", DERIVE_FOLDER.parent / "templates") if p.is_dir())


def differences(folder: Path, files: dict[str, str]) -> str:
    """Unified diff from what is in the folder to what should be; empty when nothing is stale."""
    found: list[str] = []
    for name, text in files.items():
        path = folder / name
        old = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        found += difflib.unified_diff(old.splitlines(True), text.splitlines(True), str(path), f"{path} (derived)")
    return "".join(found)


def write(folder: Path, files: dict[str, str]) -> None:
    """Write the text files of a folder, all of them or none; raises OSError where that is not possible."""
    folder.mkdir(parents=True, exist_ok=True)
    with replacing([folder / name for name in files]) as partial_paths:
        for path, text in zip(partial_paths, files.values(), strict=True):
            path.write_bytes(text.encode())


@contextmanager
def replacing(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Paths of partial files, to be written in the block and renamed onto ``paths`` when it ends without an error.

    A partial file lies beside the file that it replaces, the one that a symbolic link stands for, and is removed where
    anything fails; those that a killed process left there are removed too. Raises OSError, before the block, where a
    path is no file to be replaced.
    """
    targets = list(map(replaceable, paths))
    for path in targets:
        _remove_left_behind(path)
    partial = [path.with_name(f".{path.stem}.{os.getpid()}{get_ident()}.partial{path.suffix}") for path in targets]
    temporary_paths.update(partial)
    try:
        yield partial
        for written, path in zip(partial, targets, strict=True):
            os.replace(written, path)
    finally:
        for path in partial:
            path.unlink(missing_ok=True)
        temporary_paths.difference_update(partial)


def _remove_left_behind(target: Path) -> None:
    """Remove partial files of a file that nobody is writing any more."""
    head, tail = f".{target.stem}.", f".partial{target.suffix}"
    with suppress(OSError):  # the folder is not there, or another process is as tidy
        for path in [p for p in target.parent.iterdir() if p.name.startswith(head) and p.name.endswith(tail)]:
            number = path.name[len(head) : -len(tail)]
            if number.isdecimal() and time.time() - path.lstat().st_mtime > LEFT_BEHIND_S:
                path.unlink()


def replaceable(path: Path) -> Path:
    """The file that a path stands for, which need not exist.

    Raises OSError where it is a folder, a device or a pipe: root could replace these by a file.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(EISDIR, os.strerror(EISDIR), str(target))
    if target.exists() and not target.is_file():
        raise OSError(EINVAL, "a device, pipe or socket is no file to be replaced", str(target))
    return target
