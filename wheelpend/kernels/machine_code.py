"""Loading of cached machine code without the preparations that only compiling needs, and compiling elsewhere.

Before numba looks into its cache it prepares to compile anything, which takes a third of a second, most of it to load
SciPy for linear algebra. A function found in the cache needs none of that; another one is compiled by another process
first, and here, as usual, only where that fails.
"""

from __future__ import annotations

from typing import Any

from numba.core.runtime import rtsys

from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.kernels.compilers import compile_elsewhere
from wheelpend.kernels.first_use import COMPILING_NOTICE, first_use_notice
from wheelpend.kernels.kernel_files import SealedCache
from wheelpend.kernels.kernel_module import KERNEL_MODULE_PREFIX


class FastLoadCache(SealedCache):
    """A function's cached machine code, which is looked into before anything is prepared."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The function for a signature; None where it has to be compiled."""
        rtsys.initialize(target_context)  # the code allocates its arrays with it
        found = self._found(sig, target_context)
        if found is None and self._is_compiled_elsewhere(sig):
            found = self._found(sig, target_context)
        return super().load_overload(sig, target_context) if found is None else found

    def _found(self, sig: Any, target_context: Any) -> Any:
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _is_compiled_elsewhere(self, sig: Any) -> bool:
        """Have another process compile the function for a signature; says so first, and whether it did."""
        function = self._py_func
        if not function.__module__.startswith(KERNEL_MODULE_PREFIX):
            return False
        first_use_notice().print_once(COMPILING_NOTICE)
        path = function.__code__.co_filename
        return compile_elsewhere(CompileRequest(function.__module__, path, function.__name__, sig))
