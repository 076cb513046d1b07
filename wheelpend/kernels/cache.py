"""Cache of derived texts: files under names that carry a hash of everything that decides their content."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import derive
from derive.files import DERIVE_FOLDER, TEMPLATE_FOLDER

_texts_in_memory: dict[Path, str] = {}  # by file, those that this process has read or made


def cache_folder() -> Path:
    """Folder of texts and machine code: in $WHEELPEND_CACHE, else in the user's cache, else a temporary one.

    What lies in it is executed. So it must belong to the user and be writable by nobody else, or another is taken.
    """
    root = os.environ.get("WHEELPEND_CACHE") or os.environ.get("XDG_CACHE_HOME")
    return _folder(Path(root) / "wheelpend" if root else Path.home() / ".cache" / "wheelpend")


@lru_cache
def _folder(wanted: Path) -> Path:
    for folder in (wanted, Path(tempfile.gettempdir()) / f"wheelpend-{os.getuid()}"):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError:
            continue
        if not (reason := distrust(folder)):
            return folder
        print(f"{folder} is not used as a cache, because it {reason}.", file=sys.stderr, flush=True)
    passing = Path(tempfile.mkdtemp(prefix="wheelpend-"))  # of this process alone
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return passing


def distrust(folder: Path) -> str:
    """Why machine code in a folder may be somebody else's, with the cure; empty where it is the user's alone."""
    status = folder.stat()
    if status.st_uid != os.getuid():
        return "belongs to another user; give one of your own in $WHEELPEND_CACHE"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"can be written by others; empty it and run: chmod go-w {folder}"
    return ""


@lru_cache
def derivation_fingerprint() -> str:
    """Hash of everything that decides what the derivation produces: its sources, its templates, sympy and Jinja."""
    from importlib.metadata import version

    digest = hashlib.sha256((version("sympy") + version("jinja2")).encode())
    for path in sorted({*DERIVE_FOLDER.rglob("*.py"), *TEMPLATE_FOLDER.rglob("*.j2"), *TEMPLATE_FOLDER.rglob("*.py")}):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cached_text(kind: str, plant: str, depends_on: object, make: Callable[[], str]) -> str:
    """A text of a plant from the cache, made and kept where no text of these sources and ``depends_on`` is there."""
    key = repr((plant, derive.plants.fingerprint(plant), depends_on, derivation_fingerprint()))
    path = cache_folder() / f"{kind}_{hashlib.sha256(key.encode()).hexdigest()[:24]}.txt"
    if path not in _texts_in_memory:
        if not path.exists():
            derive.write(path.parent, {path.name: make()})
        _texts_in_memory[path] = path.read_text(encoding="utf-8")
    return _texts_in_memory[path]
