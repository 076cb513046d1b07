"""Files of a workspace changed together, by one process at a time: all of them, or none, whatever happens meanwhile.

New contents are written into a folder beside the files. Renaming that folder makes the change: what is in it then only
has to be moved to its places, which a process that is killed leaves to the next one that opens the workspace.
"""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EXDEV
from pathlib import Path

from derive.files import replaceable, temporary_paths
from wheelpend.errors import Failure
from wheelpend.files import check_writable, replacing, write_errors
from wheelpend.interruption import deferred, note_written

PREPARED_FOLDER, MADE_FOLDER = ".wheelpend-prepared", ".wheelpend-made"  # of a change that is being written, is made
GENERATED_FOLDER = "generated"  # the only folder of a workspace that changes
LOCKS_FILE = Path("/proc/locks")  # where Linux tells who holds a lock
WAIT_FOR_MOVES_S = 10.0  # s that whoever opens a workspace waits for another process to move its files into place
POLL_INTERVAL_S = 0.05

_held: set[tuple[str, int]] = set()  # folders that this process holds, each with the thread that does


def replace_together(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files by their names in a folder, all of them or none; raises Failure where one cannot be written."""
    with write_errors(f"The files of {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
        with held(folder):
            finish_change(folder)
            for path in (folder / name for name in files):
                replaceable(path).parent.mkdir(parents=True, exist_ok=True)
                check_writable(path)
            temporary_paths.add(folder / PREPARED_FOLDER)
            try:
                _write_anew(folder / PREPARED_FOLDER, files)
                with deferred():
                    (folder / PREPARED_FOLDER).rename(folder / MADE_FOLDER)
                    for name in files:
                        note_written(folder / name)
                    _move_all(folder, list(files))
            finally:
                _clear(folder / PREPARED_FOLDER)
                temporary_paths.discard(folder / PREPARED_FOLDER)


def finish_change(folder: Path) -> None:
    """Move the files of a change into place that a process made and did not live to finish; without one do nothing.

    Whoever made the workspace may have made that change too: it reaches nothing but what a change consists of, in the
    workspace itself. Raises Failure where its files cannot be moved, or where the process is still at it after some
    seconds.
    """
    made = folder / MADE_FOLDER
    if not _is_folder(made):
        return
    with held(folder, WAIT_FOR_MOVES_S):
        if not _is_folder(made):
            return
        names = _names_below(made)
        if not all(_belongs(folder, name) for name in names):
            raise Failure(
                f"{made} must hold files of this workspace, but some lead out of it, or are none that a change writes. "
                "Remove that folder, run `wheelpend generate`, and repeat the command that was interrupted."
            )
        try:
            _move_all(folder, names)
        except OSError as error:
            raise Failure(
                f"{made} holds a change that was interrupted, which cannot be finished: {error.strerror or error}. "
                "Make the workspace writable, or remove that folder and run `wheelpend generate`."
            ) from error


@contextmanager
def held(folder: Path, wait: float = 0.0) -> Iterator[None]:
    """Keep other processes from changing a workspace; raises Failure, after so many seconds, where one holds it.

    The operating system lets go where this process ends, however it does. Without a folder, or on a file system without
    locks, nothing is held.
    """
    place = os.path.realpath(folder)
    key = place, threading.get_ident()
    if key in _held or not os.path.isdir(place):
        yield
        return
    descriptor = os.open(place, os.O_RDONLY)
    try:
        _lock(place, descriptor, time.monotonic() + wait)
        _held.add(key)
        yield
    finally:
        _held.discard(key)
        os.close(descriptor)


def _lock(place: str, descriptor: int, deadline: float) -> None:
    import fcntl  # imported late: only writing needs it

    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise Failure(
                    f"{place} is being changed by {_holder(descriptor)}. Wait until that has ended, or end it."
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


def _write_anew(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a folder with these files and nothing else, to last through a loss of power."""
    _clear(folder)
    folder.mkdir()
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())


def _clear(path: Path) -> None:
    """Remove a folder, a file or a link, whatever is there; not what a link stands for."""
    if _is_folder(path):
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _move_all(folder: Path, names: Sequence[str]) -> None:
    """Move the files of a made change to their places, those first that links lead elsewhere."""
    for name in sorted(names, key=lambda name: _is_inside(folder, name)):
        _move(folder / MADE_FOLDER / name, folder / name)
    shutil.rmtree(folder / MADE_FOLDER, ignore_errors=True)


def _move(source: Path, target: Path) -> None:
    """Move a file onto the one that another stands for, which may be on another file system."""
    place = Path(os.path.realpath(target))
    place.parent.mkdir(parents=True, exist_ok=True)
    source.chmod(source.stat().st_mode & 0o666)
    try:
        os.replace(source, place)
    except OSError as error:
        if error.errno != EXDEV:
            raise
        with replacing(place) as partial:
            shutil.copyfile(source, partial)
        source.unlink()


def _belongs(folder: Path, name: str) -> bool:
    """True of a name that a change may write, of a place in the workspace itself."""
    parts = Path(name).parts
    known = len(parts) == 1 or (len(parts) == 2 and parts[0] == GENERATED_FOLDER)
    return known and not parts[-1].startswith(".") and _is_inside(folder, name)


def _is_inside(folder: Path, name: str) -> bool:
    """True where a file of a folder is below it, whatever links there are."""
    return Path(os.path.realpath(folder / name)).is_relative_to(os.path.realpath(folder))


def _is_folder(path: Path) -> bool:
    """True for a folder that is no link to one."""
    return path.is_dir() and not path.is_symlink()


def _names_below(folder: Path) -> list[str]:
    """Files in a folder and those below it, relative to it; nothing that a link stands for."""
    paths = (Path(place, name) for place, _, names in os.walk(folder) for name in sorted(names))
    return [str(path.relative_to(folder)) for path in paths if path.is_file() and not path.is_symlink()]
