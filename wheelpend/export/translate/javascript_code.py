"""A Program as an ECMAScript module: arrays are Float64Array, row after row; several numbers come back as an array."""

from __future__ import annotations

import math

from wheelpend.export.translate.idle import every_statement
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
    MakeArray,
    Name,
    Number,
    Program,
    Several,
)

RESERVED_WORDS = frozenset(
    [
        "arguments",
        "await",
        "break",
        "case",
        "catch",
        "class",
        "const",
        "continue",
        "debugger",
        "default",
        "delete",
        "do",
        "else",
        "enum",
        "eval",
        "export",
        "extends",
        "false",
        "finally",
        "for",
        "function",
        "if",
        "implements",
        "import",
        "in",
        "instanceof",
        "interface",
        "let",
        "new",
        "null",
        "package",
        "private",
        "protected",
        "public",
        "return",
        "static",
        "super",
        "switch",
        "this",
        "throw",
        "true",
        "try",
        "typeof",
        "undefined",
        "NaN",
        "Infinity",
        "Math",
        "var",
        "void",
        "while",
        "with",
        "yield",
    ]
)
MATHEMATICS_NAMES = {
    "sin": "Math.sin", "cos": "Math.cos", "tan": "Math.tan", "exp": "Math.exp", "log": "Math.log", "sqrt": "Math.sqrt",
    "tanh": "Math.tanh", "atan": "Math.atan", "ceil": "Math.ceil", "pow": "Math.pow", "power": "Math.pow",
    "abs": "Math.abs", "abs_int": "Math.abs", "min": "Math.min", "min_int": "Math.min", "max": "Math.max",
    "max_int": "Math.max", "whole": "Math.trunc", "isnan": "Number.isNaN", "erfc": "erfc",
}  # fmt: skip


class JavaScriptPrinter(Printer):
    """Prints functions as JavaScript."""

    keywords = RESERVED_WORDS
    counter_type = "let"
    words = Printer.words | {"==": "===", "!=": "!=="}

    def number(self, value: Number, kind: Kind) -> str:
        """A number where one of that kind is wanted."""
        if kind == TRUTH_VALUE:
            return str(bool(value.value)).lower()
        number = value.value
        if isinstance(number, float) and math.isinf(number):
            return "Infinity" if number > 0 else "-Infinity"
        return repr(number + 0) if isinstance(number, bool) else repr(number)

    def converted(self, text: str, kind: Kind) -> str:
        """A whole number as a real one."""
        return text if kind.base == "int" else f"Number({text})"

    def element(self, element: Element) -> str:
        """An entry or a row of an array."""
        shape = element.array.kind.shape
        terms = []
        for n, index in enumerate(element.indices):
            size = math.prod(shape[n + 1 :])
            terms.append(self.value(index) if size == 1 else f"{self.written(index, 6)} * {size}")
        name, place = self.name(element.array.name), " + ".join(terms)
        if len(element.indices) == len(shape):
            return f"{name}[{place}]"
        return f"{name}.subarray({place}, {place} + {math.prod(element.kind.shape)})"

    def entry(self, entry: Entry) -> str:
        """One of the numbers that a call returned."""
        return f"{entry.source.name}[{entry.index}]"

    def several(self, several: Several) -> str:
        """Numbers that are returned at once."""
        return f"[{', '.join(self.value(v, REAL_NUMBER) for v in several.values)}]"

    def call(self, call: Call) -> str:
        """A call."""
        arguments = ", ".join(self.value(a) for a in call.arguments)
        if call.is_builtin and call.function == "sine_pair":
            return f"[Math.sin({arguments}), Math.cos({arguments})]"
        return f"{MATHEMATICS_NAMES[call.function] if call.is_builtin else call.function}({arguments})"

    def declaration(self, variable: Name, value: str, constant: bool) -> str:
        """A new variable."""
        return f"{'const' if constant else 'let'} {self.name(variable.name)} = {value};"

    def nothing(self, kind: Kind) -> str:
        """The value of a variable that has none yet."""
        return {"bool": "false", "tuple": "[]"}.get(kind.base, "0")

    def new_array(self, name: Name) -> str:
        """A new array of zeros."""
        return f"const {self.name(name.name)} = {self.buffers[name.name]}.fill(0);"

    def copied(self, target: Name | Element, source: Name | Element) -> list[str]:
        """All entries of one row into another."""
        return [f"{self.bare(target)[0]}.set({self.bare(source)[0]});"]

    def filled(self, target: Name | Element, value: Expression) -> list[str]:
        """A number into all entries of a row."""
        return [f"{self.bare(target)[0]}.fill({self.value(value)});"]

    def text(self, program: Program) -> str:
        """All functions, after the tables that they read; scratch arrays are made once, since nothing calls itself."""
        self.keywords = RESERVED_WORDS.union(f.name for f in program.functions)  # they share one room of names
        tables = [f"const {n} = [{', '.join(self.number(Number(e, Kind(k.entry)), Kind(k.entry)) for e in v)}];"
                  for n, (k, v) in program.tables.items()]  # fmt: skip
        return "\n\n".join(["\n".join(tables), *map(self.function, program.functions)])

    def function(self, function: Function) -> str:
        """A function with its docstring as a comment, after its scratch arrays."""
        made = [s.name for s in every_statement(function.body) if isinstance(s, MakeArray)]
        self.buffers = {n.name: f"scratch_{function.name}_{n.name}" for n in made}
        scratch = [f"const {self.buffers[n.name]} = new Float64Array({math.prod(n.kind.shape)});" for n in made]
        text = " ".join(line.strip() for line in function.text.splitlines()).replace("*/", "* /")
        head = f"function {function.name}({', '.join(self.name(p.name) for p in function.parameters)}) {{"
        lines = [INDENT_TEXT + line for line in self.lines(function)]
        export = "export " if function.public else ""
        return "\n".join([*scratch, f"/** {text} */", export + head, *lines, "}"])


__all__ = ["JavaScriptPrinter"]
