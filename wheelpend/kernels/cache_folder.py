"""The folder of the cache. What lies in it is executed, so nobody but the user may have put it there."""

from __future__ import annotations

import atexit
import grp
import os
import pwd
import shutil
import stat
import tempfile
from collections.abc import Iterator
from functools import lru_cache
from multiprocessing import parent_process
from pathlib import Path

from wheelpend.isolation import current_folder
from wheelpend.kernels.first_use import first_use_notice
from wheelpend.kernels.sealed_files import is_private

FOLDER_VARIABLE = "WHEELPEND_CACHE"


def cache_folder() -> Path:
    """Folder of texts and machine code: in $WHEELPEND_CACHE, else in the user's cache, else a temporary one.

    It must belong to the user and be writable by nobody else, and nobody else may be able to put another in its place.
    """
    return _trusted_folder(os.environ.get(FOLDER_VARIABLE, ""), os.environ.get("XDG_CACHE_HOME", ""))


@lru_cache
def _trusted_folder(stated: str, user_cache: str) -> Path:
    """The first of the possible folders that can be trusted; of the others it is said why they cannot."""
    for wanted in _possible_folders(stated, user_cache):
        try:
            wanted.mkdir(mode=0o700, parents=True, exist_ok=True)
            folder = wanted.resolve()  # a link may lead elsewhere later on
            reason = distrust(folder)
        except OSError as error:
            reason = f"cannot be used: {error.strerror or error}"
        if not reason:
            return folder
        if parent_process() is None:  # workers need not say it again
            first_use_notice().print_once(f"{wanted} is not used as a cache, because it {reason}.")
    return _passing_folder()


def _possible_folders(stated: str, user_cache: str) -> Iterator[Path]:
    if stated:
        yield Path(current_folder(), stated, "wheelpend")
    elif os.path.isabs(user_cache):  # a relative one is to be ignored, as its specification says
        yield Path(user_cache, "wheelpend")
    elif os.path.isabs(home := os.path.expanduser("~")):
        yield Path(home, ".cache", "wheelpend")
    temporary = tempfile.gettempdir()
    if os.path.realpath(temporary) != current_folder():  # as it is where nothing but the folder of logs can be written
        yield Path(temporary, f"wheelpend-{os.getuid()}")


@lru_cache
def _passing_folder() -> Path:
    """A new folder, of this process and those that it starts, which find it in the environment."""
    root = tempfile.mkdtemp(prefix="wheelpend-")
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    os.environ[FOLDER_VARIABLE] = root
    folder = Path(root).resolve() / "wheelpend"
    folder.mkdir(mode=0o700)
    return folder


def distrust(folder: Path) -> str:
    """Why machine code in a folder may be somebody else's, with the cure; empty where it is the user's alone."""
    status = folder.stat()
    if status.st_uid != os.getuid():
        return f"belongs to another user; give one of your own in ${FOLDER_VARIABLE}"
    if not is_private(status):
        return f"can be written by others; empty it and run: chmod go-w {folder}"
    for parent in reversed(folder.parents):
        status = parent.stat()
        if status.st_uid == os.getuid() and not status.st_mode & (stat.S_IXGRP | stat.S_IXOTH):
            return ""  # nobody else comes further
        if reason := _distrust_parent(parent, status):
            return f"can be exchanged by others: {reason}"
    return ""


def _distrust_parent(folder: Path, status: os.stat_result) -> str:
    """Why others may rename what is in a folder; empty where they cannot."""
    if status.st_uid not in (os.getuid(), 0, Path(os.sep).stat().st_uid):
        return f"{folder} belongs to another user; give a folder of your own in ${FOLDER_VARIABLE}"
    writers = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if writers == stat.S_IWGRP and _is_own_group(status.st_gid):
        return ""
    if writers and not status.st_mode & stat.S_ISVTX:  # in a sticky one, such as /tmp, each only renames what is theirs
        return f"{folder} can be written by them; run: chmod go-w {folder}"
    return ""


def _is_own_group(number: int) -> bool:
    """True of the group that many systems give each user alone, under the user's name."""
    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
