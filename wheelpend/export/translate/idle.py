"""What a function needs not do: numbers that it stores and never reads, functions that nobody calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from wheelpend.export.translate.program import (
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
    If,
    MakeArray,
    Name,
    Operation,
    Program,
    Return,
    Several,
    Statement,
    While,
)


def names_in(value: Expression) -> Iterator[str]:
    """Variables and arrays that an expression reads."""
    for part in parts_of(value):
        if isinstance(part, Name):
            yield part.name


def parts_of(value: Expression) -> Iterator[Expression]:
    """An expression and all expressions in it."""
    yield value
    inner: tuple[Expression, ...] = ()
    match value:
        case Element(array=array, indices=indices):
            inner = (array, *indices)
        case Operation(operands=operands):
            inner = operands
        case Choice(test=test, first=first, second=second):
            inner = (test, first, second)
        case Call(arguments=arguments):
            inner = arguments
        case Several(values=values):
            inner = values
        case Entry(source=source):
            inner = (source,)
    for part in inner:
        yield from parts_of(part)


def values_of(statement: Statement) -> Iterator[Expression]:
    """Expressions that a statement itself reads, those of its inner statements apart."""
    match statement:
        case Assign(target=target, value=value):
            yield value
            if isinstance(target, Element):
                yield from (target.array, *target.indices)
        case CopyRow(target=target, source=source):
            yield from (target, source)
        case Fill(target=target, value=value):
            yield from (target, value)
        case If(test=test) | While(test=test):
            yield test
        case Count(start=start, stop=stop):
            yield from (start, stop)
        case Do(call=call):
            yield call
        case Return(value=value) if value is not None:
            yield value


def blocks_of(statement: Statement) -> tuple[tuple[Statement, ...], ...]:
    """The blocks of statements in a statement."""
    match statement:
        case If(then=then, otherwise=otherwise):
            return then, otherwise
        case Count(body=body) | While(body=body):
            return (body,)
    return ()


def every_statement(body: Sequence[Statement]) -> Iterator[Statement]:
    """All statements, inner ones too."""
    for statement in body:
        yield statement
        for block in blocks_of(statement):
            yield from every_statement(block)


def names_read(body: Sequence[Statement]) -> set[str]:
    """Variables and arrays that statements read, or write an entry of; a variable that only counts itself apart."""
    return {
        n
        for s in every_statement(body)
        for v in values_of(s)
        for n in names_in(v)
        if not (isinstance(s, Assign) and isinstance(s.target, Name) and s.target.name == n)
    }


def without_idle_stores(
    body: tuple[Statement, ...], variables: frozenset[str]
) -> tuple[tuple[Statement, ...], set[str]]:
    """Statements without stores into variables that nothing reads; and what is read."""
    while True:
        used = names_read(body)
        idle = variables - used
        thinned = _thinned(body, idle)
        if thinned == body:
            return body, used
        body = thinned


def _thinned(body: Sequence[Statement], idle: frozenset[str]) -> tuple[Statement, ...]:
    made: list[Statement] = []
    for statement in body:
        match statement:
            case MakeArray(name=Name(name=name)) if name in idle:
                continue
            case Assign(target=Name(name=name), value=value) if name in idle:
                made += [Do(p) for p in parts_of(value) if isinstance(p, Call) and _writes(p)]
            case If(then=then, otherwise=otherwise):
                inner = replace(statement, then=_thinned(then, idle), otherwise=_thinned(otherwise, idle))
                made += [inner] if inner.then or inner.otherwise else []
            case Count() | While():
                made.append(replace(statement, body=_thinned(statement.body, idle)))
            case _:
                made.append(statement)
    return tuple(made)


def _writes(call: Call) -> bool:
    """True of a call that is passed an array, into which it may write."""
    return not call.is_builtin and any(a.kind.base == "array" for a in call.arguments)


def without_idle_functions(program: Program) -> Program:
    """A program without functions that nothing calls and tables that nothing reads."""
    wanted: set[str] = set()
    kept = []
    for function in reversed(program.functions):
        if function.public or function.name in wanted:
            kept.append(function)
            parts = [p for s in every_statement(function.body) for v in values_of(s) for p in parts_of(v)]
            wanted |= {p.function for p in parts if isinstance(p, Call)} | {
                p.name for p in parts if isinstance(p, Name)
            }
    return Program(kept[::-1], {n: t for n, t in program.tables.items() if n in wanted})
