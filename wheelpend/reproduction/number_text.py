"""Numbers of the reproduction as text."""

from __future__ import annotations

import numpy as np

from wheelpend.reproduction.tables import Cell


def number_text(value: float | None, digits: int = 2) -> str:
    """A few significant digits without an exponent, as far as that is readable."""
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0.0 or 1e-4 <= abs(value) < 1e5:
        return np.format_float_positional(value, digits, fractional=False, trim="-").replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa.replace('-', '−')}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def range_text(low: float, high: float, digits: int = 2) -> str:
    """A range; one number where both ends read the same."""
    first, last = number_text(low, digits), number_text(high, digits)
    return first if first == last else f"{first} to {last}"


def spread_text(cell: Cell) -> str:
    """Median and 10 to 90 % range."""
    return f"{number_text(cell.median)} ({number_text(cell.p10)}–{number_text(cell.p90)})"
