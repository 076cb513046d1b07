"""Files written complete or not at all: beside their place first, then renamed onto it.

A file that is there already stays as it is until the new one is whole; a symbolic link is followed to the file that it
stands for.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from errno import EACCES, ENOENT
from pathlib import Path

from wheelpend.errors import Failure
from wheelpend.interruption import note_written

SPECIAL_FILES = {stat.S_ISFIFO: "a pipe", stat.S_ISSOCK: "a socket", stat.S_ISCHR: "a device", stat.S_ISBLK: "a device"}


def refuse_special_file(path: Path) -> None:
    """Raise Failure for a pipe, a socket or a device, since reading one may never end; a path without a file passes."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return
    if kind := next((words for is_kind, words in SPECIAL_FILES.items() if is_kind(mode)), ""):
        raise Failure(f"{path} must be a file, but it is {kind}. Save what it gives to a file first.")


def read_text(path: Path) -> str:
    """The text of a UTF-8 file, without a byte-order mark; raises Failure where it is none or cannot be read.

    Where there is no file FileNotFoundError is raised: what that means its reader says.
    """
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Failure(f"{path} must be UTF-8 text; byte {error.start} is not. Save it as UTF-8.") from error


def read_bytes(path: Path) -> bytes:
    """What a file holds; raises Failure where it cannot be read, FileNotFoundError where there is none."""
    refuse_special_file(path)
    with read_errors(str(path)):
        return path.read_bytes()


def check_writable(path: Path) -> None:
    """Raise Failure where a file cannot be written, as far as can be told before it is."""
    from derive.files import replaceable  # imported late: the command line starts without the derivation

    with write_errors(str(path)):
        folder = replaceable(path).parent
        if not folder.is_dir():
            raise FileNotFoundError(ENOENT, os.strerror(ENOENT), str(folder))
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(EACCES, os.strerror(EACCES), str(folder))


def write_text(path: Path, text: str) -> None:
    """Write a file as UTF-8 with the line ends that the text has; raises Failure where it cannot be written."""
    write_bytes(path, text.encode(errors="backslashreplace"))  # of a file's name that is no UTF-8


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file; raises Failure where it cannot be written."""
    with replacing(path) as partial:
        partial.write_bytes(data)


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by name, all of them before the first takes its place; raises Failure where one cannot be written."""
    from derive import files as generated_files  # imported late: the command line starts without the derivation

    paths = [folder / name for name in files]
    with write_errors(f"The files of {folder}"), generated_files.replacing(paths) as partial_paths:
        for partial, data in zip(partial_paths, files.values(), strict=True):
            partial.write_bytes(data)
    for path in paths:
        note_written(path)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Path of a partial file that replaces ``path`` once the block has ended; raises Failure where it cannot."""
    from derive import files as generated_files  # imported late: the command line starts without the derivation

    with write_errors(str(path)), generated_files.replacing([path]) as (partial,):
        yield partial
    note_written(path)


def rename(path: Path, name: str) -> Path:
    """Give a file another name in its folder, in place of what has it; raises Failure where that is not possible."""
    target = path.with_name(name)
    with write_errors(str(target)):
        return path.replace(target)


@contextmanager
def read_errors(what: str) -> Iterator[None]:
    """Turn an OSError of the block into a Failure that says what could not be read, but for FileNotFoundError."""
    try:
        yield
    except FileNotFoundError:
        raise
    except OSError as error:
        raise Failure(
            f"{what} cannot be read: {error.strerror or error}. It must be a file that may be read; name another."
        ) from error


@contextmanager
def write_errors(what: str) -> Iterator[None]:
    """Turn an OSError of the block into a Failure that says what could not be written."""
    try:
        yield
    except OSError as error:
        raise Failure(
            f"{what} cannot be written: {error.strerror or error}. "
            "A file must lie in a folder that exists and can be written to; name another."
        ) from error
