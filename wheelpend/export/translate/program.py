"""Functions of numbers and arrays of fixed size, of which every kind is known: what the languages print."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Base = Literal["real", "int", "bool", "array", "tuple", "nothing"]


@dataclass(frozen=True)
class Kind:
    """What a value is: a number, an array of numbers with a shape, or several numbers at once."""

    base: Base
    shape: tuple[int, ...] = ()  # of an array; of a tuple how many it holds
    entry: Base = "real"  # what an array holds


REAL_NUMBER, WHOLE_NUMBER, TRUTH_VALUE, NO_VALUE = Kind("real"), Kind("int"), Kind("bool"), Kind("nothing")


@dataclass(frozen=True)
class Number:
    """A number that is written as it stands."""

    value: float | int | bool
    kind: Kind


@dataclass(frozen=True)
class Name:
    """A variable, or a table of the module."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class Element:
    """An entry of an array; a row of it where there are fewer indices than dimensions."""

    array: Name
    indices: tuple[Expression, ...]
    kind: Kind


@dataclass(frozen=True)
class Operation:
    """One or two operands under an operator of Python's: + - * / < <= > >= == != and or not."""

    operator: str
    operands: tuple[Expression, ...]
    kind: Kind


@dataclass(frozen=True)
class Choice:
    """The first value where the test holds, else the second."""

    test: Expression
    first: Expression
    second: Expression
    kind: Kind


@dataclass(frozen=True)
class Call:
    """A function of the program, or one of the language's own mathematics."""

    function: str
    arguments: tuple[Expression, ...]
    kind: Kind
    is_builtin: bool = False


@dataclass(frozen=True)
class Entry:
    """One number of several that a call returned, kept under a name."""

    source: Name
    index: int
    kind: Kind


@dataclass(frozen=True)
class Several:
    """Several numbers at once, to be returned or passed on."""

    values: tuple[Expression, ...]
    kind: Kind


Expression = Number | Name | Element | Operation | Choice | Call | Entry | Several


@dataclass(frozen=True)
class Assign:
    """A number into a variable or an entry of an array; several into a name."""

    target: Name | Element
    value: Expression


@dataclass(frozen=True)
class CopyRow:
    """All entries of one array into another of the same size."""

    target: Name | Element
    source: Name | Element


@dataclass(frozen=True)
class Fill:
    """The same number into all entries of an array or a row."""

    target: Name | Element
    value: Expression


@dataclass(frozen=True)
class MakeArray:
    """An array that lives as long as its function runs, with zeros in it."""

    name: Name


@dataclass(frozen=True)
class If:
    """Statements where a test holds, and others where it does not."""

    test: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]


@dataclass(frozen=True)
class Count:
    """Statements for each whole number from ``start`` to before ``stop``, in steps."""

    variable: str
    start: Expression
    stop: Expression
    step: int
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class While:
    """Statements as long as a test holds."""

    test: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Do:
    """A call for what it writes."""

    call: Call


@dataclass(frozen=True)
class Return:
    """The end of a function, with its value where it has one."""

    value: Expression | None


@dataclass(frozen=True)
class Leave:
    """``break`` or ``continue``."""

    word: str


Statement = Assign | CopyRow | Fill | MakeArray | If | Count | While | Do | Return | Leave


@dataclass(frozen=True)
class Function:
    """A function for arguments of one kind each."""

    name: str
    text: str  # its docstring
    parameters: tuple[Name, ...]
    written: frozenset[str]  # array parameters that it writes, itself or by a function that it calls
    variables: Mapping[str, Kind]  # its own numbers; counters of loops apart
    body: tuple[Statement, ...]
    returns: Kind
    public: bool


@dataclass
class Program:
    """Functions, each after those that it calls, and the tables that they read."""

    functions: list[Function] = field(default_factory=list)
    tables: dict[str, tuple[Kind, tuple]] = field(default_factory=dict)  # by name: kind, entries in order
