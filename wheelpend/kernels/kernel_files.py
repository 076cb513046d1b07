"""Machine code of kernels in sealed files, one for each function, signature and processor, in place of numba's cache.

Numba keeps an index per function, which it unpickles as it finds it, and numbers the files that it names: two processes
that compile at once may write one number twice. Here the name of a file says what is in it.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite
import numba
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from wheelpend.kernels.sealed_files import read_sealed, write_sealed

COMPILER_VERSIONS = (sys.implementation.cache_tag, numba.__version__, llvmlite.__version__)


class _KernelFiles:
    """Sealed files of one function, under names that carry what numba asks for them by."""

    def __init__(self, folder: Path, module: str, function: str) -> None:
        self._folder, self._module, self._function = folder, module, function

    def _path(self, key: Any) -> Path:
        digest = hashlib.sha256(repr((self._module, self._function, COMPILER_VERSIONS, key)).encode()).hexdigest()
        return self._folder / f"{self._function}_{digest[:24]}.kernel"

    def load(self, key: Any) -> Any:
        """What was kept; None where there is nothing."""
        content = read_sealed(self._path(key))
        return None if content is None else pickle.loads(content)

    def save(self, key: Any, data: Any) -> None:
        """Keep what numba compiled."""
        write_sealed(self._path(key), dumps(data))


class SealedCache(FunctionCache):
    """numba's cache of a function's machine code, in sealed files."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._cache_file = _KernelFiles(Path(self._cache_path), function.__module__, function.__qualname__)


def install_cache(module: ModuleType, kind: type[SealedCache]) -> None:
    """Replace the caches that numba gave a generated module's functions."""
    functions: list[Any] = [f for f in vars(module).values() if isinstance(f, Dispatcher)]
    for function in functions:
        if isinstance(getattr(function, "_cache", None), FunctionCache) and hasattr(FunctionCache, "_load_overload"):
            function._cache = kind(function.py_func)
