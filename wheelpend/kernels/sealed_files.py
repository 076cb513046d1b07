"""Files of the cache that carry a hash of their name and content: what was emptied, cut or exchanged does not count.

What is in them is executed. So a file counts only where this user wrote it and nobody else could have.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from pathlib import Path

from derive.files import replacing
from wheelpend.kernels.first_use import first_use_notice

SEAL_BYTES = hashlib.sha256().digest_size


def _seal(name: str, content: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + content).digest()


def read_sealed(path: Path) -> bytes | None:
    """The content of a file; None where there is none, or it is not what was written, which is said and removed."""
    try:
        with path.open("rb") as file:
            is_own, data = is_private(os.fstat(file.fileno())), file.read()
    except FileNotFoundError:
        return None
    content = data[SEAL_BYTES:]
    if is_own and data[:SEAL_BYTES] == _seal(path.name, content):
        return content
    say_damaged(path)
    with suppress(OSError):
        path.unlink()  # no other process need say it
    return None


def write_sealed(path: Path, content: bytes) -> None:
    """Write a file that nobody else can write, whole or not at all; raises OSError where that is not possible."""
    with replacing([path]) as (partial,):
        descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, stat.S_IRUSR | stat.S_IWUSR)
        with os.fdopen(descriptor, "wb") as file:
            file.write(_seal(path.name, content) + content)


def say_damaged(path: Path) -> None:
    """Say, once for each folder, that its damaged files are made again."""
    first_use_notice().print_once(
        f"Files in {path.parent} are not what was written there, and are made again.",
    )


def is_private(status: os.stat_result) -> bool:
    """True of what belongs to this user and can be written by nobody else."""
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
