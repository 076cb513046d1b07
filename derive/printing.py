"""The border where SymPy ends: expressions become statements, and from here on a kernel is only strings."""

from __future__ import annotations

import keyword
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from derive.algebra import symbols_in
from derive.files import TEMPLATE_FOLDER


class Kernel(NamedTuple):
    """The body of a generated function as text."""

    unpack: tuple[str, ...]  # statements that name the entries of the arguments
    steps: tuple[str, ...]  # common subexpressions, one assignment each
    results: tuple[str, ...]  # assignments of the results
    operations: int  # arithmetic operations and function calls


class Target(NamedTuple):
    """One entry of an output array and the expression it is assigned."""

    place: str  # for instance "rate[0]"
    value: sp.Expr


class KernelPrinter(PythonCodePrinter):
    """Prints scalars for a Numba kernel: math.* functions and our own piecewise ones."""

    def _print_Sign(self, e: sp.Expr) -> str:
        return f"_sign({self._print(e.args[0])})"

    def _print_Step(self, e: sp.Expr) -> str:
        return f"_step({self._print(e.args[0])})"

    def _print_Magnitude(self, e: sp.Expr) -> str:
        return f"abs({self._print(e.args[0])})"

    def _print_Ramp(self, e: sp.Expr) -> str:
        return f"max({self._print(e.args[0])}, 0.0)"

    def _print_Least(self, e: sp.Expr) -> str:
        return f"min({self._print(e.args[0])}, {self._print(e.args[1])})"

    def _print_Decay(self, e: sp.Expr) -> str:
        return f"_decay({self._print(e.args[0])}, {self._print(e.args[1])})"

    def _print_Inverse(self, e: sp.Expr) -> str:
        return f"_inverse({self._print(e.args[0])})"

    def _print_Symbol(self, e: sp.Symbol) -> str:
        return local_name(e.name)

    def _print_Pow(self, e: sp.Expr, **kwargs) -> str:
        base, exponent = e.args
        if exponent.is_Integer and 2 <= int(exponent) <= 4:
            factor = self.parenthesize(base, sp.printing.precedence.PRECEDENCE["Mul"] + 1)
            return f"({'*'.join([factor] * int(exponent))})"  # in parentheses: it may stand in a denominator
        return super()._print_Pow(e, **kwargs)


KERNEL_PRINTER = KernelPrinter({"fully_qualified_modules": True})


def local_name(name: str) -> str:
    """A symbol's name as a Python variable, which is none that the templates use already: phi becomes phi_."""
    plain = name.replace(".", "_")
    return f"{plain}_" if plain in reserved_names() else plain


NO_CODE_PATTERN = re.compile(
    r'"""(?:.|\n)*?"""|\{[{%#](?:.|\n)*?[}%#]\}|#.*|"[^"\n]*"'
)  # of a template: docstrings, Jinja, comments and texts


@lru_cache
def reserved_names() -> frozenset[str]:
    """Names that the code of the templates, or Python, gives a meaning of its own."""
    code = [NO_CODE_PATTERN.sub(" ", p.read_text(encoding="utf-8")) for p in sorted(TEMPLATE_FOLDER.glob("*.j2"))]
    core = [p.read_text(encoding="utf-8") for p in sorted((TEMPLATE_FOLDER / "core").glob("*.py"))]
    used = (re.findall(r"(?<![\w.])[A-Za-z_]\w*", text) for text in code)
    functions = (re.findall(r"^def (\w+)", text, re.MULTILINE) for text in core)
    return frozenset(keyword.kwlist).union(*used, *functions) - {"t"}  # the time, here as there


def kernel(targets: Sequence[Target], sources: dict[str, str]) -> Kernel:
    """Turn targets into statements with common subexpressions taken out.

    ``sources`` says where each symbol comes from, for instance {"theta_w": "state[0]"}; only those in use are unpacked,
    in the order given. Raises KeyError for a symbol without a source.
    """
    values = [sp.sympify(t.value) for t in targets]
    used = set().union(*map(symbols_in, values))
    missing = sorted(s.name for s in used if s.name not in sources)
    if missing:
        raise KeyError(f"No source for {', '.join(missing)}")
    names = {s.name for s in used}
    unpack = [f"{local_name(n)} = {s}" for n, s in sources.items() if n in names and s != local_name(n)]
    free = sp.numbered_symbols("c", real=True, exclude=used)
    shared, reduced = sp.cse(values, symbols=free, order="canonical")
    steps = [f"{s.name} = {KERNEL_PRINTER.doprint(e)}" for s, e in shared]
    results = [f"{t.place} = {KERNEL_PRINTER.doprint(e)}" for t, e in zip(targets, reduced, strict=True)]
    operations = sum(int(sp.count_ops(e)) for _, e in shared) + sum(int(sp.count_ops(e)) for e in reduced)
    return Kernel(tuple(unpack), tuple(steps), tuple(results), operations)
