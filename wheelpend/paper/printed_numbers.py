"""A printed number with its rounding, and the result of a check of it."""

from __future__ import annotations

from decimal import Decimal
from typing import Any, NamedTuple


class NumberCheck(NamedTuple):
    """Result of the check of a printed number, or of one that is not printed and needed."""

    name: str
    status: str  # match, contradiction, missing or misprint
    printed: str
    derived: str
    note: str
    how: str = "numeric"

    def to_json(self) -> dict[str, Any]:
        """The check under the keys of JSON."""
        return {
            "name": self.name,
            "status": self.status,
            "printed": self.printed,
            "derived": self.derived,
            "note": self.note,
            "how": self.how,
        }


class Interval(NamedTuple):
    """A value and the half width that the rounding of the numbers behind it leaves."""

    value: float
    half_width: float

    def overlaps(self, other: Interval) -> bool:
        """True if both can be the same number."""
        return abs(self.value - other.value) <= self.half_width + other.half_width

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.half_width:.1g}"


def rounding_half_width(value: float) -> float:
    """Half a unit in the last printed digit; a whole number counts as exact."""
    if value == int(value):
        return 0.0
    exponent = Decimal(repr(value)).as_tuple().exponent
    assert isinstance(exponent, int)
    return float(Decimal(5).scaleb(exponent - 1))


def printed_interval(value: float) -> Interval:
    """A printed number with its rounding."""
    return Interval(value, rounding_half_width(value))
