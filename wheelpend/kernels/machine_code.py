"""Machine code that was compiled before, loaded without what only compiling needs.

Before numba looks into its cache it makes ready to compile whatever Python can say, a third of a second, of which most
goes into loading SciPy for linear algebra. A function that is found there needs none of that; one that is not found is
compiled as ever.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys


class _FastLoadCache(FunctionCache):
    """numba's cache of a function's machine code."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The function for a signature; None where it has to be compiled."""
        rtsys.initialize(target_context)  # the code allocates its arrays with it
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
        return super().load_overload(sig, target_context) if found is None else found


def install_fast_load_cache(module: ModuleType) -> None:
    """Let a generated module's functions load their machine code in this way."""
    functions: list[Any] = [f for f in vars(module).values() if isinstance(f, Dispatcher)]
    for function in functions:
        if isinstance(getattr(function, "_cache", None), FunctionCache) and hasattr(FunctionCache, "_load_overload"):
            function._cache = _FastLoadCache(function.py_func)
