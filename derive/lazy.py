"""SymPy and the functions made with it, loaded when they are first used.

Importing SymPy takes a quarter of a second, and most commands find all that was ever derived in the cache. Rows of
effects and plants are read at every start, but they state laws and geometry in functions, which only a derivation
calls: their files take SymPy from here. The files of the derivation itself import it as usual.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any


class _LazyModule:
    """A module that is imported as soon as something in it is asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        return getattr(import_module(self._name), attribute)


def _lazy_function(name: str) -> Callable:
    """One of ``derive.functions`` that is imported as soon as it is called."""
    return lambda *arguments: getattr(functions, name)(*arguments)


if TYPE_CHECKING:
    import sympy as sp

    from derive import functions
    from derive.functions import Decay, Least, Magnitude, Ramp, Sign, Step, symbol
else:
    sp, functions = _LazyModule("sympy"), _LazyModule("derive.functions")
    names = ("Decay", "Least", "Magnitude", "Ramp", "Sign", "Step", "symbol")
    Decay, Least, Magnitude, Ramp, Sign, Step, symbol = map(_lazy_function, names)

__all__ = ["Decay", "Least", "Magnitude", "Ramp", "Sign", "Step", "functions", "sp", "symbol"]
