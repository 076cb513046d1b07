"""Checks of what a TOML file holds: every key known, every value of its kind.

A check takes a value and its place in the file, and returns the value as it is used; it raises InvalidValue where the
value is not of the kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import MISSING, fields
from typing import Any, NoReturn, TypeVar

from wheelpend.errors import Failure, did_you_mean

MAX_SIZE = 1e100  # of a number; also a standard error that knows nothing is smaller
Check = Callable[[Any, str], Any]


class InvalidValue(ValueError):
    """Values that are not of their kind; the arguments are a phrase for each place."""


def refuse(must: str, value: object, place: str) -> NoReturn:
    """Raise InvalidValue with the place, what must hold and what came."""
    try:
        came = f"{value!r:.60}"
    except (ValueError, RecursionError):  # a whole number of thousands of digits, which Python does not write
        came = "a value that is too long to be written"
    raise InvalidValue(f"{place}: must be {must}, not {came}")


def number(value: object, place: str) -> float:
    """A finite number whose square is one too."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        refuse("a number", value, place)
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        refuse("a finite number", value, place)
    return found if abs(found) <= MAX_SIZE else refuse(f"at most {MAX_SIZE:g} in size", value, place)


def nonnegative(value: object, place: str) -> float:
    """A number that is not negative."""
    found = number(value, place)
    return found if found >= 0.0 else refuse("at least 0", value, place)


def positive(value: object, place: str) -> float:
    """A number above 0."""
    found = number(value, place)
    return found if found > 0.0 else refuse("greater than 0", value, place)


def boolean(value: object, place: str) -> bool:
    """True or false."""
    return value if isinstance(value, bool) else refuse("true or false", value, place)


def any_value(value: object, place: str) -> object:
    """Any value, unchanged."""
    return value


def text(value: object, place: str, max_length: int | None = None) -> str:
    """Text, of at most so many characters."""
    if not isinstance(value, str):
        refuse("text", value, place)
    return (
        value
        if max_length is None or len(value) <= max_length
        else refuse(f"at most {max_length} characters", value, place)
    )


def short_text(max_length: int) -> Check:
    """Text of at most so many characters."""
    return lambda value, place: text(value, place, max_length)


def one_of(*choices: object) -> Check:
    """One of some choices."""

    def check(value: object, place: str) -> object:
        for choice in choices:
            if value == choice and isinstance(value, bool) == isinstance(choice, bool):
                return choice
        refuse(" or ".join(map(repr, choices)), value, place)

    return check


def keyword_or(word: str, check: Check) -> Check:
    """A word, or what another check takes."""

    def either(value: object, place: str) -> object:
        if value == word:
            return value
        return check(value, place) if not isinstance(value, str) else refuse(f"a number or {word!r}", value, place)

    return either


def list_of(check: Check, count: int | None = None, max_entries: int | None = None) -> Check:
    """A list as a tuple; of so many entries, or of at most so many."""

    def entries(value: object, place: str) -> tuple:
        if not isinstance(value, list | tuple) or (count is not None and len(value) != count):
            refuse("a list" if count is None else f"a list of {count}", value, place)
        if max_entries is not None and len(value) > max_entries:
            refuse(f"a list of at most {max_entries}", value, place)
        return tuple(run_checks((check, v, f"{place}.{k}") for k, v in enumerate(value)))

    return entries


def mapping(check: Check, min_entries: int = 0, max_entries: int | None = None) -> Check:
    """A table with keys of any name, of at least and at most so many."""

    def entries(value: object, place: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            refuse("a table", value, place)
        if len(value) < min_entries or (max_entries is not None and len(value) > max_entries):
            refuse(f"a table of {min_entries} to {max_entries} entries", value, place)
        return dict(zip(value, run_checks((check, v, f"{place}.{k}") for k, v in value.items()), strict=True))

    return entries


def table(make: Callable[..., Any], **checks: Check) -> Check:
    """A table with known keys, as a dataclass."""
    needed = [f.name for f in fields(make) if f.default is f.default_factory is MISSING]  # type: ignore[arg-type]

    def entries(value: object, place: str) -> Any:
        if not isinstance(value, dict):
            refuse("a table", value, place)
        try:
            check_known("key", value, checks)
        except Failure as failure:
            raise InvalidValue((f"[{place}]: " if place else "") + str(failure).rstrip(".")) from None
        inside = f"{place}." if place else ""
        missing = [(_refuse_missing, None, inside + n) for n in needed if n not in value]
        results = run_checks([*missing, *((checks[n], v, inside + n) for n, v in value.items())])
        return make(**dict(zip(value, results, strict=True)))

    return entries


def table_with_rest(make: Callable[..., Any], rest: str, **checks: Check) -> Check:
    """A table with known keys, as a dataclass with what stands under all other keys in its field ``rest``."""
    known = table(make, **checks, **{rest: any_value})

    def entries(value: object, place: str) -> Any:
        if not isinstance(value, dict):
            refuse("a table", value, place)
        others = {k: v for k, v in value.items() if k not in checks}
        return known({k: v for k, v in value.items() if k in checks} | {rest: others}, place)

    return entries


def number_or_table(key: str, check: Check) -> Check:
    """A table, or a plain number that stands for one with this key."""

    def either(value: object, place: str) -> Any:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return check({key: value}, place)
        return check(value, place) if isinstance(value, dict) else refuse("a number or a table", value, place)

    return either


def _refuse_missing(value: object, place: str) -> NoReturn:
    raise InvalidValue(f"{place} is missing")


def run_checks(checks: Iterable[tuple[Check, object, str]]) -> list:
    """The results of several checks; raises InvalidValue with the phrases of all that fail."""
    results: list = []
    phrases: list[str] = []
    for check, value, place in checks:
        try:
            results.append(check(value, place))
        except InvalidValue as wrong:
            phrases += wrong.args
    if phrases:
        raise InvalidValue(*phrases)
    return results


def checked(check: Check, value: object, place: str = "") -> Any:
    """The value as a check takes it; raises Failure with the phrases of all that is not of its kind."""
    try:
        return check(value, place)
    except InvalidValue as wrong:
        said = "; ".join(wrong.args)
        raise Failure(said if said.endswith((".", "?")) else f"{said}.") from wrong


def check_known(what: str, names: Iterable[str], known: Collection[str], place: str = "") -> None:
    """Raise Failure naming the known names when one is not among them."""
    for name in names:
        if name not in known:
            plural = "quantities" if what == "quantity" else what + "s"
            hint = did_you_mean(name, known)
            raise Failure(f"No {what} named '{name}'{place}. Known {plural}: {', '.join(known)}.{hint}")


T = TypeVar("T")


def call_look_up(look_up: Callable[..., T], *arguments: Any) -> T:
    """Call a look-up; its KeyError, whose text names the choices, becomes a Failure."""
    try:
        return look_up(*arguments)
    except KeyError as error:
        raise Failure(error.args[0]) from error
