"""Expressions of a generated Python function: known beforehand, or expressions of a Program."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from wheelpend.export.translate.known import (
    Known,
    RuntimeConstant,
    Value,
    as_kind,
    computed,
    expression,
    is_switch,
    joined,
)
from wheelpend.export.translate.program import (
    REAL_NUMBER,
    TRUTH_VALUE,
    WHOLE_NUMBER,
    Call,
    Choice,
    Element,
    Entry,
    Expression,
    Function,
    Kind,
    Name,
    Number,
    Operation,
    Return,
    Several,
)

# of the language's own mathematics: by the name in the templates, that in a program
BUILTIN_FUNCTIONS = {
    "math.sin": "sin", "math.cos": "cos", "math.tan": "tan", "math.exp": "exp", "math.log": "log",
    "math.sqrt": "sqrt", "math.tanh": "tanh", "math.atan": "atan", "math.ceil": "ceil",
    "math.isnan": "isnan", "np.isnan": "isnan", "math.erfc": "erfc",
}  # fmt: skip
OPERATOR_TEXTS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
    ast.Eq: "==", ast.NotEq: "!=", ast.And: "and", ast.Or: "or",
}  # fmt: skip
MAX_WRITTEN_OUT_POWER = 8


class Functions(Protocol):
    """The functions of a module, of which translated ones are made as they are called."""

    sources: dict[str, ast.FunctionDef]
    constants: Mapping[str, Any]

    def specialised(self, name: str, arguments: Sequence[Value]) -> Function:
        """A function for arguments of these kinds, of which switches are known."""
        raise NotImplementedError

    def table(self, known: Known) -> Name:
        """A table that the program keeps because it is read at places not known beforehand."""
        raise NotImplementedError


@dataclass
class Values:
    """Expressions of Python in a function under translation, and what is known of its variables."""

    owner: Functions
    source: ast.FunctionDef
    fixed: Mapping[str, Known]
    kinds: Mapping[str, Kind]  # of the arguments that are passed
    variables: dict[str, Kind] = field(default_factory=dict)
    arrays: dict[str, Kind] = field(default_factory=dict)
    known: dict[str, Known] = field(default_factory=dict)
    aliases: dict[str, Expression] = field(default_factory=dict)  # other names of arrays
    written: set[str] = field(default_factory=set)
    returns: Kind | None = None
    counters: set[str] = field(default_factory=set)
    spare: int = 0

    def number(self, node: ast.expr) -> Expression:
        """A value as an expression."""
        return expression(self.value(node))

    def value(self, node: ast.expr) -> Value:
        """What an expression of Python is worth: known beforehand, or an expression of a Program."""
        match node:
            case ast.Constant(value=value):
                return Known(value)
            case ast.Name(id=name):
                return self.named(name)
            case ast.Tuple(elts=entries):
                values = [self.value(e) for e in entries]
                if all(isinstance(v, Known) for v in values):
                    return Known(tuple(v.value for v in values if isinstance(v, Known)))
                numbers = tuple(expression(v) for v in values)
                return Several(numbers, Kind("tuple", (len(numbers),)))
            case ast.Attribute():
                return self.attribute(node)
            case ast.Subscript():
                return self.subscript(node)
            case ast.UnaryOp(op=op, operand=operand):
                return self.unary(op, self.value(operand))
            case ast.BinOp(left=left, op=op, right=right):
                return self.binary(op, self.value(left), self.value(right))
            case ast.BoolOp(op=op, values=values):
                return self.logic(op, values)
            case ast.Compare():
                return self.compare(node)
            case ast.IfExp(test=test, body=first, orelse=second):
                decided = self.value(test)
                if isinstance(decided, Known):
                    return self.value(first if decided.value else second)
                one, other = self.number(first), self.number(second)
                return Choice(decided, one, other, joined(one.kind, other.kind))
            case ast.Call():
                return self.call(node)
        raise NotImplementedError(f"{self.source.name}: {ast.unparse(node)}")

    def named(self, name: str) -> Value:
        """A variable, an argument or a constant of the module."""
        if name in self.known:
            return self.known[name]
        if name in self.aliases:
            return self.aliases[name]
        if name in self.fixed:
            return self.fixed[name]
        if name in self.variables:
            return Name(name, self.variables[name])
        if name in self.arrays:
            return Name(name, self.arrays[name])
        if name in self.kinds:
            return Name(name, self.kinds[name])
        if name in self.owner.constants:
            constant = self.owner.constants[name]
            return Name(constant.name, REAL_NUMBER) if isinstance(constant, RuntimeConstant) else Known(constant, name)
        raise NotImplementedError(f"{self.source.name}: '{name}' is read before it has a value")

    def attribute(self, node: ast.Attribute) -> Value:
        """The size or shape of an array, or a constant of a library."""
        text = ast.unparse(node)
        if text in ("math.pi", "math.inf", "np.inf"):
            return Known(float(np.pi if text == "math.pi" else np.inf))
        array = self.value(node.value)
        if isinstance(array, Known):
            return Known(getattr(np.asarray(array.value), node.attr))
        if array.kind.base != "array" or node.attr not in ("size", "shape"):
            raise NotImplementedError(f"{self.source.name}: {text}")
        return Known(int(np.prod(array.kind.shape)) if node.attr == "size" else array.kind.shape)

    def subscript(self, node: ast.Subscript) -> Value:
        """An entry or a row of an array, or of a tuple."""
        base = self.value(node.value)
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if any(isinstance(p, ast.Slice) for p in places):
            raise NotImplementedError(f"{self.source.name}: {ast.unparse(node)}")
        indices = [self.value(p) for p in places]
        if isinstance(base, Known):
            if all(isinstance(i, Known) for i in indices):
                found = base.value
                for i in indices:
                    found = found[i.value] if isinstance(i, Known) else found
                return Known(found.item() if isinstance(found, np.generic) else found)
            base = self.owner.table(base)
        if isinstance(base, Several):
            (place,) = indices
            if isinstance(place, Known):
                return base.values[place.value]
        if base.kind.base == "tuple" and isinstance(base, Name):
            (place,) = indices
            if isinstance(place, Known):
                return Entry(base, place.value, REAL_NUMBER)
        if base.kind.base != "array" or not isinstance(base, Name):
            raise NotImplementedError(f"{self.source.name}: {ast.unparse(node)}")
        left = base.kind.shape[len(indices) :]
        kind = Kind("array", left, base.kind.entry) if left else Kind(base.kind.entry)
        return Element(base, tuple(expression(i) for i in indices), kind)

    def unary(self, op: ast.unaryop, value: Value) -> Value:
        """Minus or not."""
        if isinstance(value, Known):
            return Known((not value.value) if isinstance(op, ast.Not) else -value.value)
        if isinstance(op, ast.Not):
            return Operation("not", (value,), TRUTH_VALUE)
        if isinstance(op, ast.USub):
            return Operation("-", (value,), value.kind)
        raise NotImplementedError(f"{self.source.name}: {ast.dump(op)}")

    def binary(self, op: ast.operator, left: Value, right: Value) -> Value:
        """Arithmetic of two numbers."""
        if isinstance(op, ast.Pow):
            return self.power(left, right)
        if type(op) not in OPERATOR_TEXTS:
            raise NotImplementedError(f"{self.source.name}: {ast.dump(op)}")
        if isinstance(left, Known) and isinstance(right, Known):
            return Known(computed(OPERATOR_TEXTS[type(op)], left.value, right.value))
        one, other = expression(left), expression(right)
        kind = REAL_NUMBER if isinstance(op, ast.Div) else joined(one.kind, other.kind)
        return Operation(OPERATOR_TEXTS[type(op)], (one, other), kind)

    def power(self, base: Value, exponent: Value) -> Value:
        """A power: a product where the exponent is a small whole number."""
        if isinstance(base, Known) and isinstance(exponent, Known):
            return Known(base.value**exponent.value)
        number = expression(base)
        if not isinstance(exponent, Known):
            return Call("pow", (number, expression(exponent)), REAL_NUMBER, is_builtin=True)
        n = exponent.value
        if n in (0.5, -0.5):
            root = Call("sqrt", (number,), REAL_NUMBER, is_builtin=True)
            return root if n > 0 else Operation("/", (Number(1.0, REAL_NUMBER), root), REAL_NUMBER)
        if float(n).is_integer() and 1 <= abs(n) <= MAX_WRITTEN_OUT_POWER:
            raised = Call("power", (number, Number(int(abs(n)), WHOLE_NUMBER)), REAL_NUMBER, is_builtin=True)
            return raised if n > 0 else Operation("/", (Number(1.0, REAL_NUMBER), raised), REAL_NUMBER)
        return Call("pow", (number, Number(float(n), REAL_NUMBER)), REAL_NUMBER, is_builtin=True)

    def logic(self, op: ast.boolop, nodes: Sequence[ast.expr]) -> Value:
        """``and`` or ``or``, as far as it is not decided beforehand."""
        deciding = isinstance(op, ast.Or)
        left: list[Expression] = []
        for node in nodes:
            value = self.value(node)
            if isinstance(value, Known):
                if bool(value.value) == deciding:
                    return Known(deciding)  # what stands before it has no side effects
                continue
            left.append(value)
        if not left:
            return Known(not deciding)
        made = left[0]
        for value in left[1:]:
            made = Operation(OPERATOR_TEXTS[type(op)], (made, value), TRUTH_VALUE)
        return made

    def compare(self, node: ast.Compare) -> Value:
        """A comparison, of several in a row too, or membership in a few numbers."""
        left = self.value(node.left)
        parts: list[Value] = []
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self.value(right_node)
            if isinstance(op, ast.In) and isinstance(right, Known):
                parts.append(self.membership(left, right.value))
            elif isinstance(left, Known) and isinstance(right, Known):
                parts.append(Known(computed(OPERATOR_TEXTS[type(op)], left.value, right.value)))
            else:
                parts.append(Operation(OPERATOR_TEXTS[type(op)], (expression(left), expression(right)), TRUTH_VALUE))
            left = right
        if any(isinstance(p, Known) and not p.value for p in parts):
            return Known(False)
        open_parts = [p for p in parts if not isinstance(p, Known)]
        if not open_parts:
            return Known(True)
        made: Expression = open_parts[0]
        for p in open_parts[1:]:
            made = Operation("and", (made, p), TRUTH_VALUE)
        return made

    def membership(self, value: Value, among: Sequence[int]) -> Value:
        """True of a number that is one of these."""
        if isinstance(value, Known):
            return Known(value.value in among)
        made: Expression = Operation("==", (value, expression(Known(among[0]))), TRUTH_VALUE)
        for n in among[1:]:
            made = Operation("or", (made, Operation("==", (value, expression(Known(n))), TRUTH_VALUE)), TRUTH_VALUE)
        return made

    def call(self, node: ast.Call) -> Value:
        """A call of a function of the module, or of mathematics."""
        name = ast.unparse(node.func)
        arguments = [self.value(a) for a in node.args]
        if name in ("min", "max", "abs", "int", "float") or name in BUILTIN_FUNCTIONS or name == "_sine_pair":
            return self.builtin(name, arguments)
        if name not in self.owner.sources:
            raise NotImplementedError(f"{self.source.name}: {ast.unparse(node)}")
        settled = [a if is_switch(a) else expression(a) for a in arguments]
        function = self.owner.specialised(name, settled)
        names = [a.arg for a in self.owner.sources[name].args.args]
        if (whole := whole_array(self.owner.sources[name])) is not None:
            return settled[names.index(whole)]
        passed = dict(zip(names, settled, strict=True))
        for parameter, value in passed.items():
            if parameter in function.written and isinstance(value, Name | Element):
                self.written.add(value.name if isinstance(value, Name) else value.array.name)
        if len(function.body) == 1 and isinstance(function.body[0], Return):
            only = function.body[0].value
            if isinstance(only, Number):
                return Known(only.value)
        if not function.body:
            return Known(None)
        typed = [as_kind(expression(passed[p.name]), p.kind) for p in function.parameters]
        return Call(function.name, tuple(typed), function.returns)

    def builtin(self, name: str, arguments: Sequence[Value]) -> Value:
        """Mathematics of the language's own."""
        if all(isinstance(a, Known) for a in arguments) and name != "_sine_pair":
            values = [a.value for a in arguments if isinstance(a, Known)]
            functions: dict[str, Callable] = {"min": min, "max": max, "abs": abs, "int": int, "float": float}
            function = functions.get(name) or getattr(math, name.removeprefix("math."))
            return Known(function(*values))
        numbers = [expression(a) for a in arguments]
        if name == "_sine_pair":
            return Call(
                "sine_pair", tuple(as_kind(n, REAL_NUMBER) for n in numbers), Kind("tuple", (2,)), is_builtin=True
            )
        if name == "int":
            return Call("whole", (numbers[0],), WHOLE_NUMBER, is_builtin=True)
        if name in ("min", "max", "abs"):
            kind = numbers[0].kind
            for n in numbers[1:]:
                kind = joined(kind, n.kind)
            word = f"{name}_int" if kind == WHOLE_NUMBER else name
            return Call(word, tuple(as_kind(n, kind) for n in numbers), kind, is_builtin=True)
        if name == "float":
            return as_kind(numbers[0], REAL_NUMBER)
        return Call(
            BUILTIN_FUNCTIONS[name], tuple(as_kind(n, REAL_NUMBER) for n in numbers), REAL_NUMBER, is_builtin=True
        )


def whole_array(source: ast.FunctionDef) -> str | None:
    """The argument of a function that returns all its entries in their order: a copy that no store can change."""
    last = source.body[-1]
    if not (isinstance(last, ast.Return) and isinstance(last.value, ast.Tuple) and len(source.args.args) == 1):
        return None
    name = source.args.args[0].arg
    entries = [ast.unparse(e) for e in last.value.elts]
    return name if entries == [f"{name}[{i}]" for i in range(len(entries))] else None
