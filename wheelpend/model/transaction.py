"""Files of a workspace changed together, by one process at a time: all of them, or none, whatever happens meanwhile.

New contents are written into a folder beside the files. Renaming that folder makes the change: what is in it then only
has to be moved to its places, which a process that is killed leaves to the next one that opens the workspace.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from errno import EXDEV
from pathlib import Path

from derive.files import replaceable
from wheelpend.errors import Failure
from wheelpend.files import replacing, write_errors
from wheelpend.parallel import without_interruption

PREPARED_FOLDER, MADE_FOLDER = (
    ".wheelpend-prepared",
    ".wheelpend-made",
)  # folders: of a change that is being written, and of one made
LOCKS_FILE = Path("/proc/locks")  # where Linux tells who holds a lock
WAIT_FOR_MOVES_S = 10.0  # s that whoever opens a workspace waits for another process to move its files into place
POLL_INTERVAL_S = 0.05

_held: set[Path] = set()  # folders that this process holds


def replace_together(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by their names in a folder, all of them or none; raises Failure where one cannot be written."""
    with write_errors(f"The files of {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
        with held(folder):
            finish_change(folder)
            try:
                for name, data in files.items():
                    replaceable(folder / name)
                    _write_durably(folder / PREPARED_FOLDER / name, data)
                with without_interruption():
                    (folder / PREPARED_FOLDER).rename(folder / MADE_FOLDER)
                    _move_all(folder, _files_below(folder / MADE_FOLDER))
            finally:
                shutil.rmtree(folder / PREPARED_FOLDER, ignore_errors=True)


def finish_change(folder: Path) -> None:
    """Move the files of a change into place that a process made and did not live to finish; without one do nothing.

    Whoever made the workspace may have made that change too, so it reaches nothing but the workspace. Raises Failure
    where its files cannot be moved, or where the process is still at it after some seconds.
    """
    if not _is_folder(folder / MADE_FOLDER):
        return
    with held(folder, WAIT_FOR_MOVES_S), write_errors(f"A change of {folder} that was interrupted"):
        if not _is_folder(folder / MADE_FOLDER):
            return
        files, inside = _files_below(folder / MADE_FOLDER), folder.resolve()
        if any(not (folder / file).resolve().is_relative_to(inside) for file in files):
            raise Failure(
                f"{folder / MADE_FOLDER} must hold files of this workspace, but links lead out of it. Remove that "
                "folder, and repeat the command that was interrupted."
            )
        _move_all(folder, files)


def _move_all(folder: Path, files: list[Path]) -> None:
    for file in files:
        _move(folder / MADE_FOLDER / file, folder / file)
    shutil.rmtree(folder / MADE_FOLDER, ignore_errors=True)


def _is_folder(path: Path) -> bool:
    """True for a folder that is no link to one."""
    return path.is_dir() and not path.is_symlink()


def _files_below(folder: Path) -> list[Path]:
    """Files in a folder and those below it, relative to it; nothing that a link stands for."""
    paths = (Path(place, name) for place, _, names in os.walk(folder) for name in sorted(names))
    return [path.relative_to(folder) for path in paths if path.is_file() and not path.is_symlink()]


@contextmanager
def held(folder: Path, wait: float = 0.0) -> Iterator[None]:
    """Keep other processes from changing a workspace; raises Failure, after so many seconds, where one holds it.

    The operating system lets go where this process ends, however it does. Without a folder, or on a file system without
    locks, nothing is held.
    """
    folder = folder.resolve()
    if folder in _held or not folder.is_dir():
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        _lock(folder, descriptor, time.monotonic() + wait)
        _held.add(folder)
        yield
    finally:
        _held.discard(folder)
        os.close(descriptor)


def _lock(folder: Path, descriptor: int, deadline: float) -> None:
    import fcntl  # imported late: only writing needs it

    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise Failure(
                    f"{folder} is being changed by {_holder(descriptor)}. Wait until that has ended, or end it."
                ) from None
            time.sleep(POLL_INTERVAL_S)
        except OSError:
            return  # there are no locks here


def _holder(descriptor: int) -> str:
    """The process that holds a lock, with its command as far as the system tells."""
    inode = f":{os.fstat(descriptor).st_ino}"
    try:
        locks = [line.split() for line in LOCKS_FILE.read_text(encoding="utf-8").splitlines() if " FLOCK " in line]
        number = next(fields[4] for fields in locks if fields[5].endswith(inode))
        command = Path(f"/proc/{number}/cmdline").read_bytes().decode(errors="replace").replace("\0", " ").strip()
    except (OSError, StopIteration, IndexError):
        return "another process"
    return f"process {number} ({command})"


def _write_durably(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _move(source: Path, target: Path) -> None:
    """Move a file onto the one that another stands for, in a folder that may be a link to another file system."""
    place = Path(os.path.realpath(target))
    place.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.replace(source, place)
    except OSError as error:
        if error.errno != EXDEV:
            raise
        with replacing(place) as partial:
            shutil.copyfile(source, partial)
        source.unlink()
