"""Statements of a generated Python function as those of a Program."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from wheelpend.export.translate.idle import without_idle_stores
from wheelpend.export.translate.known import (
    Known,
    Value,
    expression,
    is_empty_kind,
    joined,
    read_by,
)
from wheelpend.export.translate.program import (
    NO_VALUE,
    REAL_NUMBER,
    WHOLE_NUMBER,
    Assign,
    Call,
    CopyRow,
    Count,
    Do,
    Element,
    Entry,
    Fill,
    Function,
    If,
    Kind,
    Leave,
    MakeArray,
    Name,
    Return,
    Several,
    Statement,
    While,
)
from wheelpend.export.translate.values import Values


class Body(Values):
    """Statements of Python in a function under translation."""

    def function(self, name: str, public: bool) -> Function:
        """Translate until the kinds of all variables have settled."""
        self.once = assigned_once(self.source)
        while True:
            before = dict(self.variables)
            self.spare, self.returns = 0, None
            body = tuple(self.block(self.source.body))
            if self.variables == before:
                break
        body, used = without_idle_stores(
            body, frozenset(self.variables) | frozenset(self.arrays) | frozenset(self.kinds)
        )
        names = [a.arg for a in self.source.args.args if a.arg in self.kinds and not is_empty_kind(self.kinds[a.arg])]
        parameters = tuple(Name(n, self.kinds[n]) for n in names if public or n in used)
        own = {n: k for n, k in self.variables.items() if n not in self.counters and n in used}
        text = ast.get_docstring(self.source) or ""
        written = frozenset(n for n in self.written if n in self.kinds)
        return Function(name, text, parameters, written, own, body, self.returns or NO_VALUE, public)

    def block(self, statements: Sequence[ast.stmt]) -> list[Statement]:
        """Statements in order, up to the first after which none is reached."""
        done: list[Statement] = []
        for statement in statements:
            made = self.statement(statement)
            done += made
            if made and isinstance(made[-1], Return | Leave):
                break
        return done

    def statement(self, node: ast.stmt) -> list[Statement]:
        """One statement of Python as some of a Program."""
        match node:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return []
            case ast.Expr(value=ast.Call() as call):
                made = self.call(call)
                return [Do(made)] if isinstance(made, Call) else []
            case ast.Assign(targets=targets, value=value):
                return self.assign(targets, value)
            case ast.AugAssign(target=target, op=op, value=value):
                loaded = ast.parse(ast.unparse(target), mode="eval").body
                return self.assign([target], ast.BinOp(loaded, op, value))
            case ast.If(test=test, body=body, orelse=orelse):
                return self.branch(test, body, orelse)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds), body=body):
                return self.count(name, bounds, body)
            case ast.For(target=ast.Name(id=name), iter=ast.Name() as values, body=body):
                return self.each(name, values, body)
            case ast.While(test=test, body=body):
                return [While(self.number(test), tuple(self.block(body)))]
            case ast.Return(value=value):
                return self.leave(value)
            case ast.Break():
                return [Leave("break")]
            case ast.Continue():
                return [Leave("continue")]
        raise NotImplementedError(f"{self.source.name}: {ast.unparse(node)}")

    def branch(self, test: ast.expr, body: list[ast.stmt], orelse: list[ast.stmt]) -> list[Statement]:
        """An ``if``; the branch that is taken alone where that is known."""
        decided = self.value(test)
        if isinstance(decided, Known):
            return self.block(body if decided.value else orelse)
        then, otherwise = self.block(body), self.block(orelse)
        return [If(decided, tuple(then), tuple(otherwise))] if then or otherwise else []

    def count(self, name: str, bounds: list[ast.expr], body: list[ast.stmt]) -> list[Statement]:
        """A ``for`` over a range; nothing where the range is empty."""
        values = [self.value(b) for b in bounds]
        start, stop = (Known(0), values[0]) if len(values) == 1 else values[:2]
        step = values[2].value if len(values) > 2 and isinstance(values[2], Known) else 1
        if isinstance(start, Known) and isinstance(stop, Known) and not range(start.value, stop.value, step):
            return []
        self.counters.add(name)
        self.variables[name] = WHOLE_NUMBER
        inside = self.block(body)
        return [Count(name, expression(start), expression(stop), step, tuple(inside))] if inside else []

    def each(self, name: str, values: ast.Name, body: list[ast.stmt]) -> list[Statement]:
        """A ``for`` over the entries of an array."""
        counter = f"{name}_place"
        entry = ast.parse(f"{name} = {values.id}[{counter}]").body
        size = ast.parse(f"{values.id}.size", mode="eval").body
        return self.count(counter, [size], [*entry, *body])

    def leave(self, value: ast.expr | None) -> list[Statement]:
        """A ``return``."""
        if value is None:
            self.returns = self.returns or NO_VALUE
            return [Return(None)]
        made = expression(self.value(value))
        if made.kind.base == "array":
            raise NotImplementedError(f"{self.source.name} returns an array")
        self.returns = made.kind if self.returns is None else joined(self.returns, made.kind)
        return [Return(made)]

    def assign(self, targets: Sequence[ast.expr], value: ast.expr) -> list[Statement]:
        """An assignment, to several targets where Python has several."""
        if len(targets) > 1:
            first = self.assign(targets[-1:], value)
            again = ast.parse(ast.unparse(targets[-1]), mode="eval").body
            return first + [s for t in targets[:-1] for s in self.assign([t], again)]
        (target,) = targets
        if isinstance(target, ast.Tuple):
            return self.unpack(target.elts, value)
        if isinstance(target, ast.Subscript) and has_slice(target):
            return self.copy(target, self.value(value))
        if isinstance(target, ast.Name) and (made := self.new_array(target.id, value)) is not None:
            return made
        return self.store(target, self.value(value))

    def store(self, target: ast.expr, value: Value) -> list[Statement]:
        """A value into a variable or an entry."""
        if isinstance(target, ast.Subscript) and has_slice(target):
            return self.copy(target, value)
        if isinstance(target, ast.Name):
            name = target.id
            if isinstance(value, Known) and name in self.once:
                self.known[name] = value
                return []
            made = expression(value)
            if made.kind.base == "array":
                self.aliases[name] = made
                return []
            kind = joined(self.variables.get(name, made.kind), made.kind)
            if name in self.kinds:
                return [Assign(Name(name, self.kinds[name]), made)]
            self.variables[name] = kind
            return [Assign(Name(name, kind), made)]
        place = self.value(target)
        if not isinstance(place, Element):
            raise NotImplementedError(f"{self.source.name}: assignment to {ast.unparse(target)}")
        self.written.add(place.array.name)
        made = expression(value)
        if place.kind.base == "array":
            if made.kind.base == "array":
                return [CopyRow(place, made)]  # type: ignore[arg-type]
            return [Fill(place, made)]
        return [Assign(place, made)]

    def copy(self, target: ast.Subscript, value: Value) -> list[Statement]:
        """All entries of an array: from another one, or one number."""
        array = self.value(target.value)
        if ast.unparse(target.slice) != ":" or not isinstance(array, Name):
            raise NotImplementedError(f"{self.source.name}: assignment to {ast.unparse(target)}")
        if is_empty_kind(array.kind):
            return []
        self.written.add(array.name)
        made = expression(value)
        if made.kind.base == "array":
            return [CopyRow(array, made)]  # type: ignore[arg-type]
        return [Fill(array, made)]

    def new_array(self, name: str, value: ast.expr) -> list[Statement] | None:
        """An array made with np.zeros, np.empty or np.full; None for any other value."""
        if not (isinstance(value, ast.Call) and ast.unparse(value.func) in ("np.zeros", "np.empty", "np.full")):
            return None
        size = self.value(value.args[0])
        shape = size.value if isinstance(size, Known) else None
        if shape is None:
            raise NotImplementedError(f"{self.source.name}: the size of {name} must be known beforehand")
        dims = tuple(int(n) for n in (shape if isinstance(shape, tuple) else (shape,)))
        entry = "int" if "np.int64" in map(ast.unparse, value.args) else "real"
        made = Name(name, Kind("array", dims, entry))  # type: ignore[arg-type]
        self.arrays[name] = made.kind
        if 0 in dims:
            return []
        fill = [Fill(made, self.number(value.args[1]))] if ast.unparse(value.func) == "np.full" else []
        return [MakeArray(made), *fill]

    def unpack(self, targets: Sequence[ast.expr], value: ast.expr) -> list[Statement]:
        """Several assignments at once, all of whose values are taken before any is stored."""
        value = self.arrays_made_by(value) or value
        if isinstance(value, ast.Tuple):
            arrays = [self.new_array(t.id, v) if isinstance(t, ast.Name) else None
                      for t, v in zip(targets, value.elts, strict=True)]  # fmt: skip
            if all(a is not None for a in arrays):
                return [s for a in arrays for s in a or []]
            return self.store_together(targets, [self.value(v) for v in value.elts])
        if isinstance(value, ast.Subscript) and isinstance(value.slice, ast.Slice):  # the first ones of a call's
            value = value.value
        made = self.value(value)
        if isinstance(made, Known):
            return self.store_together(targets, [Known(v) for v in made.value][: len(targets)])
        if isinstance(made, Several):
            return self.store_together(targets, list(made.values)[: len(targets)])
        if made.kind.base != "tuple":
            raise NotImplementedError(f"{self.source.name}: unpacking {ast.unparse(value)}")
        self.spare += 1
        kept = Name(f"result_{self.spare}", made.kind)
        self.variables[kept.name] = made.kind
        stores = [Assign(kept, made)]
        return stores + [
            s
            for i, t in enumerate(targets)
            if not (isinstance(t, ast.Name) and t.id == "_")
            for s in self.store(t, Entry(kept, i, REAL_NUMBER))
        ]

    def arrays_made_by(self, value: ast.expr) -> ast.Tuple | None:
        """The new arrays that a function without arguments returns, to be made where it is called."""
        source = self.owner.sources.get(ast.unparse(value.func)) if isinstance(value, ast.Call) else None
        last = source.body[-1] if source is not None and not source.args.args else None
        return last.value if isinstance(last, ast.Return) and isinstance(last.value, ast.Tuple) else None

    def store_together(self, targets: Sequence[ast.expr], values: Sequence[Value]) -> list[Statement]:
        """Values into targets, by way of spare variables where a later value needs what an earlier store changes."""
        clash = any(stored_name(t) in read_by(later) for n, t in enumerate(targets) for later in values[n + 1 :])
        if not clash:
            return [s for t, v in zip(targets, values, strict=True) for s in self.store(t, v)]
        first: list[Statement] = []
        spares: list[Value] = []
        for v in values:
            self.spare += 1
            made = expression(v)
            kept = Name(f"kept_{self.spare}", made.kind)
            self.variables[kept.name] = made.kind
            first.append(Assign(kept, made))
            spares.append(kept)
        return first + [s for t, v in zip(targets, spares, strict=True) for s in self.store(t, v)]


def stored_name(target: ast.expr) -> str:
    """The variable or the array that a store changes."""
    while isinstance(target, ast.Subscript):
        target = target.value
    return ast.unparse(target)


def has_slice(node: ast.Subscript) -> bool:
    """True of a part of an array."""
    places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    return any(isinstance(p, ast.Slice) for p in places)


def assigned_once(source: ast.FunctionDef) -> set[str]:
    """Variables with one assignment in the whole function."""
    counts: dict[str, int] = {a.arg: 1 for a in source.args.args}
    for node in ast.walk(source):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            counts[node.id] = counts.get(node.id, 0) + 1
    return {n for n, c in counts.items() if c == 1}
