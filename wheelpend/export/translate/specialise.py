"""A generated Python function for arguments of one kind: a function of a Program.

What is read is the language of the templates and no more: numbers, arrays of fixed size, ``for`` over ``range``,
``while``, ``if``, calls of the module's own functions. Anything else ends in a NotImplementedError that names it.
Values that are known beforehand (sizes, switches) are folded in, branches that they close are left out, and so is all
that concerns an array without entries: a step that linearises and one that does not come from the same text.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wheelpend.export.translate.body import Body
from wheelpend.export.translate.known import (
    Argument,
    Known,
    Value,
)
from wheelpend.export.translate.program import (
    Base,
    Function,
    Kind,
    Name,
    Program,
)


class Specialiser:
    """Makes the functions of a Program from a module's text."""

    def __init__(self, text: str, constants: Mapping[str, Any]) -> None:
        tree = ast.parse(text)
        self.sources = {f.name: f for f in tree.body if isinstance(f, ast.FunctionDef)}
        self.constants = constants
        self.program = Program()
        self.made: dict[tuple, Function] = {}

    def add(self, name: str, arguments: Mapping[str, Argument], as_name: str) -> Function:
        """A function of the module, with all that it calls, under a name of its own; ``arguments`` by their names."""
        values: list[Value] = []
        for argument in (a.arg for a in self.sources[name].args.args):
            given = arguments[argument]
            known = Known(given, f"{as_name}_{argument}".upper())
            values.append(Name(argument, given) if isinstance(given, Kind) else known)
        return self.specialised(name, values, as_name)

    def specialised(self, name: str, arguments: Sequence[Value], as_name: str = "") -> Function:
        """A function for arguments of these kinds, of which switches are known."""
        key = (name, tuple(key_of(a) for a in arguments))
        if key not in self.made:
            source = self.sources[name]
            names = [a.arg for a in source.args.args]
            fixed = {n: a for n, a in zip(names, arguments, strict=True) if isinstance(a, Known)}
            kinds = {n: a.kind for n, a in zip(names, arguments, strict=True) if not isinstance(a, Known)}
            same = sum(1 for n, _ in self.made if n == name)
            body = Body(self, source, fixed, kinds)
            own_name = f"{name.lstrip('_')}{f'_{same + 1}' if same else ''}"
            function = body.function(as_name or own_name, bool(as_name))
            self.made[key] = function
            self.program.functions.append(function)
        return self.made[key]

    def table(self, known: Known) -> Name:
        """A table that the program keeps because it is read at places not known beforehand."""
        name, values = known.name, np.asarray(known.value)
        values = values if values.size else np.zeros(1, values.dtype)  # never read, but C wants an entry
        entry: Base = (
            "bool" if values.dtype == np.bool_ else "int" if np.issubdtype(values.dtype, np.integer) else "real"
        )
        kind = Kind("array", values.shape, entry)
        self.program.tables[name] = (kind, tuple(values.ravel().tolist()))
        return Name(name, kind)


def key_of(value: Value) -> tuple:
    """What of an argument decides which function is meant."""
    if isinstance(value, Known) and isinstance(value.value, np.ndarray):
        return ("known", tuple(value.value.tolist()))
    return ("known", repr(value.value)) if isinstance(value, Known) else (value.kind,)
