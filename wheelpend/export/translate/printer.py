"""A Program as text, as far as C and JavaScript agree: statements, precedence, and where a variable is declared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from wheelpend.export.translate.idle import blocks_of, every_statement, names_in, values_of
from wheelpend.export.translate.program import (
    REAL_NUMBER,
    WHOLE_NUMBER,
    Assign,
    Call,
    Choice,
    CopyRow,
    Count,
    Do,
    Element,
    Entry,
    Expression,
    Fill,
    Function,
    If,
    Kind,
    Leave,
    MakeArray,
    Name,
    Number,
    Operation,
    Return,
    Several,
    Statement,
    While,
)

OPERATOR_PRECEDENCE = {
    "or": 1,
    "and": 2,
    "==": 3,
    "!=": 3,
    "<": 4,
    "<=": 4,
    ">": 4,
    ">=": 4,
    "+": 5,
    "-": 5,
    "*": 6,
    "/": 6,
}
UNARY_PRECEDENCE, ATOM_PRECEDENCE, CHOICE_PRECEDENCE = 7, 9, 0
INDENT_TEXT = "    "


class Printer:
    """Prints functions; a language says how it writes numbers, arrays and calls."""

    keywords: frozenset[str] = frozenset()
    counter_type = ""
    words: ClassVar[dict[str, str]] = {"and": "&&", "or": "||"}

    # -- what a language says

    def number(self, value: Number, kind: Kind) -> str:
        """A number where one of that kind is wanted."""
        raise NotImplementedError

    def converted(self, text: str, kind: Kind) -> str:
        """A whole number as a real one."""
        raise NotImplementedError

    def element(self, element: Element) -> str:
        """An entry or a row of an array."""
        raise NotImplementedError

    def entry(self, entry: Entry) -> str:
        """One of the numbers that a call returned."""
        raise NotImplementedError

    def several(self, several: Several) -> str:
        """Numbers that are returned at once."""
        raise NotImplementedError

    def call(self, call: Call) -> str:
        """A call."""
        raise NotImplementedError

    def declaration(self, variable: Name, value: str, constant: bool) -> str:
        """A new variable."""
        raise NotImplementedError

    def new_array(self, name: Name) -> str:
        """A new array of zeros."""
        raise NotImplementedError

    def counter(self, count: Count) -> str:
        """The head of a loop that counts."""
        name = self.name(count.variable)
        test = "<" if count.step > 0 else ">"
        onward = {1: "++", -1: "--"}.get(count.step, f" += {count.step}")
        begin = f"{self.counter_type} {name} = {self.value(count.start)}"
        return f"for ({begin}; {name} {test} {self.written(count.stop, 5)}; {name}{onward})"

    def nothing(self, kind: Kind) -> str:
        """The value of a variable that has none yet."""
        raise NotImplementedError

    # -- expressions

    def name(self, name: str) -> str:
        """A variable's name, which is no word of the language."""
        return f"{name}_" if name in self.keywords else name

    def value(self, value: Expression, kind: Kind | None = None) -> str:
        """An expression that stands by itself, as a real number where one is wanted."""
        return self.written(value, CHOICE_PRECEDENCE, kind)

    def written(self, value: Expression, around: int, kind: Kind | None = None) -> str:
        """An expression inside another one that binds so tightly."""
        if isinstance(value, Number):
            text, own = self.number(value, kind or value.kind), UNARY_PRECEDENCE if value.value < 0 else ATOM_PRECEDENCE
        else:
            text, own = self.bare(value)
            if kind == REAL_NUMBER and value.kind.base in ("int", "bool"):
                text, own = self.converted(self.enclosed(text, own, UNARY_PRECEDENCE), value.kind), UNARY_PRECEDENCE
        return self.enclosed(text, own, around)

    def enclosed(self, text: str, own: int, around: int) -> str:
        """A text in parentheses where what stands around it binds tighter."""
        return f"({text})" if own < around else text

    def bare(self, value: Expression) -> tuple[str, int]:
        """An expression and how tightly it binds."""
        match value:
            case Name(name=name):
                return self.name(name), ATOM_PRECEDENCE
            case Element():
                return self.element(value), ATOM_PRECEDENCE
            case Entry():
                return self.entry(value), ATOM_PRECEDENCE
            case Call():
                return self.call(value), ATOM_PRECEDENCE
            case Several():
                return self.several(value), ATOM_PRECEDENCE
            case Choice(test=test, first=first, second=second, kind=kind):
                parts = self.written(test, 1), self.written(first, 1, kind), self.written(second, 0, kind)
                return "{} ? {} : {}".format(*parts), CHOICE_PRECEDENCE
            case Operation():
                return self.operation(value)
        raise NotImplementedError(f"{value!r}")

    def operation(self, operation: Operation) -> tuple[str, int]:
        """Operands under an operator."""
        operator, operands = operation.operator, operation.operands
        if len(operands) == 1:
            sign = "!" if operator == "not" else "-"
            return sign + self.written(operands[0], UNARY_PRECEDENCE + 1), UNARY_PRECEDENCE
        own = OPERATOR_PRECEDENCE[operator]
        inside = 5 if own in (3, 4) else own  # comparisons of comparisons want parentheses
        kind = REAL_NUMBER if any(o.kind == REAL_NUMBER for o in operands) or operation.kind == REAL_NUMBER else None
        left = self.written(operands[0], inside, kind)
        right = self.written(operands[1], inside + (operator in ("-", "/", "==", "!=", "*")), kind)
        if operator == "or":  # mixed with "and" it wants parentheses
            left, right = (self.written(o, 3 if _is_and(o) else 1, kind) for o in operands)
        return f"{left} {self.words.get(operator, operator)} {right}", own

    # -- statements

    def lines(self, function: Function) -> list[str]:
        """The body of a function."""
        self.stores = _stores(function.body)
        return self.block(function.body, dict(function.variables), function.returns)

    def block(self, body: Sequence[Statement], variables: dict[str, Kind], returns: Kind) -> list[str]:
        """Statements, with declarations of variables that nothing outside them knows."""
        lines: list[str] = []
        inner: dict[int, dict[str, Kind]] = {}
        here: dict[int, list[str]] = {}
        for name, kind in variables.items():
            places = [i for i, s in enumerate(body) if _mentions(s, name)]
            if not places:
                continue
            block = _only_block(body[places[0]], name) if len(places) == 1 else None
            if block is not None:
                inner.setdefault(id(block), {})[name] = kind
            else:
                here.setdefault(places[0], []).append(name)
        for i, statement in enumerate(body):
            new = here.get(i, [])
            for name in new:
                if not _begins(statement, name):
                    lines.append(self.declaration(Name(name, variables[name]), self.nothing(variables[name]), False))
            lines += self.statement(statement, [n for n in new if _begins(statement, n)], inner, returns)
        return lines

    def statement(self, s: Statement, new: list[str], inner: dict[int, dict[str, Kind]], returns: Kind) -> list[str]:
        """A statement; ``new`` are variables that it declares."""

        def indented(block: Sequence[Statement]) -> list[str]:
            return [INDENT_TEXT + line for line in self.block(block, inner.get(id(block), {}), returns)]

        match s:
            case Assign(target=Name() as target, value=value) if target.name in new:
                return [self.declaration(target, self.value(value, target.kind), self.stores[target.name] == 1)]
            case Assign(target=target, value=Operation(operator=operator, operands=(left, right))) if (
                left == target and operator in "+-*/" and target.kind in (REAL_NUMBER, WHOLE_NUMBER)
            ):
                return [f"{self.bare(target)[0]} {operator}= {self.value(right, target.kind)};"]
            case Assign(target=target, value=value):
                return [f"{self.bare(target)[0]} = {self.value(value, target.kind)};"]
            case CopyRow(target=target, source=source):
                return self.copied(target, source)
            case Fill(target=target, value=value):
                return self.filled(target, value)
            case MakeArray(name=name):
                return [self.new_array(name)]
            case If(test=test, then=then, otherwise=otherwise):
                lines = [f"if ({self.value(test)}) {{", *indented(then)]
                return [*lines, *(["} else {", *indented(otherwise)] if otherwise else []), "}"]
            case Count(body=body):
                return [f"{self.counter(s)} {{", *indented(body), "}"]
            case While(test=test, body=body):
                return [f"while ({self.value(test)}) {{", *indented(body), "}"]
            case Do(call=call):
                return [f"{self.call(call)};"]
            case Return(value=value):
                return ["return;"] if value is None else [f"return {self.value(value, returns)};"]
            case Leave(word=word):
                return [f"{word};"]
        raise NotImplementedError(f"{s!r}")

    def copied(self, target: Name | Element, source: Name | Element) -> list[str]:
        """All entries of one row into another."""
        raise NotImplementedError

    def filled(self, target: Name | Element, value: Expression) -> list[str]:
        """A number into all entries of a row."""
        raise NotImplementedError


def _is_and(value: Expression) -> bool:
    return isinstance(value, Operation) and value.operator == "and"


def _stores(body: Sequence[Statement]) -> dict[str, int]:
    """How often each variable is stored."""
    counts: dict[str, int] = {}
    for s in every_statement(body):
        if isinstance(s, Assign) and isinstance(s.target, Name):
            counts[s.target.name] = counts.get(s.target.name, 0) + 1
    return counts


def _mentions(statement: Statement, name: str) -> bool:
    """True where a statement reads or stores a variable, itself or within."""
    return any(name in names_in(v) for s in every_statement([statement]) for v in values_of(s)) or any(
        isinstance(s, Assign) and s.target == Name(name, s.target.kind) for s in every_statement([statement])
    )


def _only_block(statement: Statement, name: str) -> tuple[Statement, ...] | None:
    """The block of a statement that alone mentions a variable, and stores it before it reads it."""
    if any(name in names_in(v) for v in values_of(statement)):
        return None
    blocks = [b for b in blocks_of(statement) if any(_mentions(s, name) for s in b)]
    if len(blocks) != 1:
        return None
    first = next(s for s in blocks[0] if _mentions(s, name))
    return blocks[0] if _begins(first, name) or _only_block(first, name) is not None else None


def _begins(statement: Statement, name: str) -> bool:
    """True of a store into a variable that does not need it."""
    return (
        isinstance(statement, Assign)
        and isinstance(statement.target, Name)
        and statement.target.name == name
        and name not in names_in(statement.value)
    )
