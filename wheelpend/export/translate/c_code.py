"""A Program as C99, without libraries, globals that change, recursion and memory of its own."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from importlib.resources import files
from typing import ClassVar

from wheelpend.export.translate.idle import every_statement, parts_of, values_of
from wheelpend.export.translate.printer import INDENT_TEXT, Printer
from wheelpend.export.translate.program import (
    REAL_NUMBER,
    TRUTH_VALUE,
    Call,
    Element,
    Entry,
    Expression,
    Function,
    Kind,
    Name,
    Number,
    Program,
    Several,
)

RESERVED_WORDS = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "true",
        "false",
        "bool",
        "I",
    ]
)
TYPE_NAMES = {"real": "wp_real", "int": "int", "bool": "bool", "nothing": "void"}
MATHEMATICS_FILE = "mathematics.c"
TINY_VARIANCE = 1e-60  # a variance that stands for none, which no float can be so small as to hold


class CPrinter(Printer):
    """Prints functions as C."""

    keywords = RESERVED_WORDS
    counter_type = "int"
    tuple_sizes: ClassVar[set[int]] = set()

    def number(self, value: Number, kind: Kind) -> str:
        """A number where one of that kind is wanted."""
        if kind == REAL_NUMBER:
            return real(float(value.value))
        return str(value.value).lower() if kind == TRUTH_VALUE else str(int(value.value))

    def converted(self, text: str, kind: Kind) -> str:
        """A whole number as a real one."""
        return f"(wp_real){text}"

    def element(self, element: Element) -> str:
        """An entry or a row of an array."""
        return self.name(element.array.name) + "".join(f"[{self.value(i)}]" for i in element.indices)

    def entry(self, entry: Entry) -> str:
        """One of the numbers that a call returned."""
        return f"{entry.source.name}.v[{entry.index}]"

    def several(self, several: Several) -> str:
        """Numbers that are returned at once."""
        return f"({self.type_of(several.kind)}){{{{{', '.join(self.value(v, REAL_NUMBER) for v in several.values)}}}}}"

    def call(self, call: Call) -> str:
        """A call."""
        if call.is_builtin and call.function == "whole":
            return f"wp_whole({self.value(call.arguments[0], REAL_NUMBER)})"
        kinds = [None if a.kind.base in ("array", "int", "bool") else REAL_NUMBER for a in call.arguments]
        if call.is_builtin and call.function not in ("power", "min_int", "max_int", "abs_int"):
            kinds = [REAL_NUMBER] * len(kinds)
        wanted = self.wanted.get(call.function) if not call.is_builtin else None
        arguments = [self.value(a, k) for a, k in zip(call.arguments, wanted or kinds, strict=True)]
        return f"wp_{call.function}({', '.join(arguments)})"

    def type_of(self, kind: Kind) -> str:
        """The C type of a number or of several."""
        if kind.base == "tuple":
            self.tuple_sizes.add(kind.shape[0])
            return f"wp_reals{kind.shape[0]}"
        return TYPE_NAMES[kind.base]

    def declaration(self, variable: Name, value: str, constant: bool) -> str:
        """A new variable."""
        return f"{'const ' if constant else ''}{self.type_of(variable.kind)} {self.name(variable.name)} = {value};"

    def nothing(self, kind: Kind) -> str:
        """The value of a variable that has none yet."""
        return {"real": real(0.0), "int": "0", "bool": "false"}.get(kind.base, f"{{{{{real(0.0)}}}}}")

    def new_array(self, name: Name) -> str:
        """A new array of zeros."""
        dims = "".join(f"[{n}]" for n in name.kind.shape)
        depth = len(name.kind.shape)
        zero = "0" if name.kind.entry == "int" else real(0.0)
        return f"{TYPE_NAMES[name.kind.entry]} {self.name(name.name)}{dims} = {'{' * depth}{zero}{'}' * depth};"

    def copied(self, target: Name | Element, source: Name | Element) -> list[str]:
        """All entries of one row into another."""
        (size,) = target.kind.shape
        one, other = self.bare(target)[0], self.bare(source)[0]
        return [
            f"for (int fill_1 = 0; fill_1 < {size}; fill_1++) {{",
            f"{INDENT_TEXT}{one}[fill_1] = {other}[fill_1];",
            "}",
        ]

    def filled(self, target: Name | Element, value: Expression) -> list[str]:
        """A number into all entries of a row."""
        names = ["fill_1", "fill_2", "fill_3"][: len(target.kind.shape)]
        heads = [f"for (int {n} = 0; {n} < {size}; {n}++) {{" for n, size in zip(names, target.kind.shape, strict=True)]
        place = self.bare(target)[0] + "".join(f"[{n}]" for n in names)
        lines = [INDENT_TEXT * i + head for i, head in enumerate(heads)]
        lines.append(f"{INDENT_TEXT * len(heads)}{place} = {self.value(value, Kind(target.kind.entry))};")
        return lines + [INDENT_TEXT * i + "}" for i in reversed(range(len(heads)))]

    def head(self, function: Function) -> str:
        """The first line of a function."""
        parameters = [self.parameter(p, p.name in function.written) for p in function.parameters]
        return f"static {self.type_of(function.returns)} wp_{function.name}({', '.join(parameters) or 'void'})"

    def parameter(self, name: Name, is_written: bool) -> str:
        """One parameter; an array that is not written is constant where C lets it be."""
        if name.kind.base != "array":
            return f"{self.type_of(name.kind)} {self.name(name.name)}"
        shape = name.kind.shape
        const = "const " if len(shape) == 1 and not is_written else ""
        return f"{const}{TYPE_NAMES[name.kind.entry]} {self.name(name.name)}{''.join(f'[{n}]' for n in shape)}"

    def text(self, program: Program) -> str:
        """All functions, after types, tables and the mathematics that they use."""
        self.tuple_sizes.clear()
        self.wanted = {
            f.name: [REAL_NUMBER if p.kind == REAL_NUMBER else None for p in f.parameters] for f in program.functions
        }
        functions = [self.function(f) for f in program.functions]
        tables = [self.table(n, k, v) for n, (k, v) in program.tables.items()]
        used = {
            p.function
            for f in program.functions
            for s in every_statement(f.body)
            for v in values_of(s)
            for p in parts_of(v)
            if isinstance(p, Call) and p.is_builtin
        }
        if "sine_pair" in used:
            self.tuple_sizes.add(2)
        mathematics = needed_mathematics(used)
        if "wp_reals2 " in mathematics:
            self.tuple_sizes.add(2)
        types = [f"typedef struct {{ wp_real v[{n}]; }} wp_reals{n};" for n in sorted(self.tuple_sizes)]
        return "\n\n".join(["\n".join(types), *tables, mathematics, *functions])

    def function(self, function: Function) -> str:
        """A function with its docstring as a comment."""
        used = {n for s in every_statement(function.body) for v in values_of(s) for p in parts_of(v)
                if isinstance(p, Name) for n in [p.name]}  # fmt: skip
        idle = [f"{INDENT_TEXT}(void){self.name(p.name)};" for p in function.parameters if p.name not in used]
        lines = [INDENT_TEXT + line for line in self.lines(function)]
        return "\n".join([comment(function.text), self.head(function) + " {", *idle, *lines, "}"])

    def table(self, name: str, kind: Kind, entries: tuple) -> str:
        """A table of constants."""
        dims = "".join(f"[{n}]" for n in kind.shape)
        return f"static const {TYPE_NAMES[kind.entry]} {name}{dims} = {self.nested(kind, entries)};"

    def nested(self, kind: Kind, entries: tuple) -> str:
        """Entries in braces, row by row."""
        if len(kind.shape) > 1:
            size = math.prod(kind.shape[1:])
            row = Kind("array", kind.shape[1:], kind.entry)
            rows = [self.nested(row, entries[i : i + size]) for i in range(0, len(entries), size)]
            return "{" + ", ".join(rows) + "}"
        return "{" + ", ".join(self.number(Number(v, Kind(kind.entry)), Kind(kind.entry)) for v in entries) + "}"


def real(value: float) -> str:
    """A real number, in the precision that the source is compiled for."""
    value = float(value)
    if math.isinf(value):
        return "WP_LARGEST" if value > 0 else "-WP_LARGEST"
    if value == TINY_VARIANCE:
        return "WP_TINY"
    return f"-WP_R({-value!r})" if value < 0 else f"WP_R({value!r})"


def comment(text: str) -> str:
    """A docstring as a comment."""
    lines = [line.strip().replace("*/", "* /") for line in text.splitlines()]
    return "/* " + "\n   ".join(lines).replace("\n   \n", "\n\n") + " */" if lines else ""


@lru_cache
def mathematics_by_name() -> dict[str, str]:
    """Each function of the mathematics, with its comment."""
    text = files("wheelpend.export").joinpath("c", MATHEMATICS_FILE).read_text(encoding="utf-8")
    found = re.findall(r"(^/\*(?:[^*]|\*(?!/))*\*/\nstatic [\w ]*?wp_(\w+)\(.*?^}$)", text, re.MULTILINE | re.DOTALL)
    return {name: body for body, name in found}


def needed_mathematics(used: set[str]) -> str:
    """The functions of these names and those that they call, in the order of the file."""
    known = mathematics_by_name()
    open_names, wanted = set(used), set()
    while open_names:
        name = open_names.pop()
        if name in known and name not in wanted:
            wanted.add(name)
            open_names |= set(re.findall(r"wp_(\w+)\(", known[name]))
    return "\n\n".join(body for name, body in known.items() if name in wanted)
