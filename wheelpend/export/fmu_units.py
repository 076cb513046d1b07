"""Units as FMI has them: names in the syntax of Modelica, and exponents of the base units of SI."""

from __future__ import annotations

import re
from collections import Counter
from typing import NamedTuple

# exponents of the base units in each unit that the library's parameters are made of
BASE_UNITS: dict[str, dict[str, int]] = {
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "A": {"A": 1},
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "rad": {"rad": 1},
    "1": {},
}
BASE_ORDER = ("kg", "m", "s", "A", "rad")  # as the schemas list them
RAISED_DIGITS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


class FmiUnit(NamedTuple):
    """A unit by its name, with exponents of base units; None where a factor is not known."""

    name: str
    base: tuple[tuple[str, int], ...] | None


def fmi_unit(text: str) -> FmiUnit:
    """The unit of a text such as "V s²/rad": V.s2/rad; what stands behind the stroke divides."""
    above, _, below = text.partition("/")
    factors = [(f, 1) for f in above.split()] + [(f, -1) for f in below.split()]
    parts = [(*_powered(factor), sign) for factor, sign in factors]
    upper = [f"{n}{p if p != 1 else ''}" for n, p, sign in parts if sign > 0]
    lower = [f"{n}{p if p != 1 else ''}" for n, p, sign in parts if sign < 0]
    divisor = "" if not lower else f"/{lower[0]}" if len(lower) == 1 else f"/({'.'.join(lower)})"
    if any(n not in BASE_UNITS for n, _, _ in parts):
        return FmiUnit(".".join(upper) + divisor, None)
    total: Counter[str] = Counter()
    for name, power, sign in parts:
        for base, exponent in BASE_UNITS[name].items():
            total[base] += sign * power * exponent
    return FmiUnit(".".join(upper) + divisor, tuple((b, total[b]) for b in BASE_ORDER if total[b]))


def _powered(factor: str) -> tuple[str, int]:
    """Name and power of a factor: s² is s to the second."""
    name, power = re.fullmatch(r"(.*?)([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]*)", factor).groups()  # type: ignore[union-attr]
    return name, int(power.translate(RAISED_DIGITS)) if power else 1
