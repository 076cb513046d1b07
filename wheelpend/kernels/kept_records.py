"""Results in sealed files of the cache, as pickles: a later process takes up what an earlier one found.

Kernel modules and effects are not written but named: a module by its text, which must still be in the cache, an effect
by its name in the library.
"""

from __future__ import annotations

import io
import pickle
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import derive
from derive.effects import Effect
from wheelpend.kernels.cache_folder import cache_folder
from wheelpend.kernels.generated_text import text_name
from wheelpend.kernels.kernel_module import KERNEL_MODULE_PREFIX
from wheelpend.kernels.load import load_module
from wheelpend.kernels.sealed_files import read_sealed, write_sealed

RECORD_SUFFIX = ".record"
LARGEST_RECORD = 1 << 26  # bytes; a search of hours of log is long because of the log, and would fill the disk


def kept_record(kind: str, key: str) -> Any:
    """The record that was kept under a key; None where there is none, or what it names has gone."""
    path = _path_of(kind, key)
    content = read_sealed(path)
    if content is None:
        return None
    with suppress(KeyError, OSError, AttributeError, ImportError, pickle.UnpicklingError):
        found = _Reader(io.BytesIO(content)).load()
        path.touch()  # the least used go first
        return found
    return None


def keep_record(kind: str, key: str, record: Any, most: int) -> None:
    """Keep a record under a key, and of its kind the ``most`` that were used last; nothing of what is no plain record.

    Raises OSError where the cache cannot be written.
    """
    content = io.BytesIO()
    try:
        _Writer(content, protocol=5).dump(record)
    except (pickle.PicklingError, TypeError, AttributeError):
        return
    if content.tell() <= LARGEST_RECORD:
        write_sealed(_path_of(kind, key), content.getvalue())
    kept = sorted(record_folder().glob(f"{kind}_*{RECORD_SUFFIX}"), key=_last_use, reverse=True)
    for path in kept[most:]:
        path.unlink(missing_ok=True)


def record_folder() -> Path:
    """Where records are kept: with the rest of the cache."""
    return cache_folder()


def _path_of(kind: str, key: str) -> Path:
    return record_folder() / f"{kind}_{key}{RECORD_SUFFIX}"


def _last_use(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:  # another process put it away
        return 0.0


class _Writer(pickle.Pickler):
    def persistent_id(self, obj: Any) -> tuple[str, str] | None:
        """What stands for a kernel module or an effect."""
        if isinstance(obj, ModuleType) and obj.__name__.startswith(KERNEL_MODULE_PREFIX):
            return "module", obj.__name__
        return ("effect", obj.name) if isinstance(obj, Effect) else None


class _Reader(pickle.Unpickler):
    def persistent_load(self, pid: tuple[str, str]) -> Any:
        """The module or the effect of this process that a name stands for."""
        kind, name = pid
        return derive.effects.find(name) if kind == "effect" else _module_named(name)


def _module_named(name: str) -> Any:
    """A generated module, from its text in the cache; raises KeyError where that is not the text of the name."""
    text = (cache_folder() / f"{name}.py").read_bytes().decode()
    module = load_module(text, text_name(name))
    if module.__name__ != name:
        raise KeyError(name)
    return module
