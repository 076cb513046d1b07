"""A row of the table before and after its measurement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

from wheelpend.reports.numbers import time_text, whole_digits_text

if TYPE_CHECKING:
    from wheelpend.benchmarks.speed.setting import Setting


class NotMeasurableError(Exception):
    """Raised where a row cannot be measured on this machine; the message is the reason."""


class Times(NamedTuple):
    """Times of a piece of work [s], ours and the reference's."""

    ours: float
    reference: float

    def per(self, pieces: int) -> Times:
        """Times of one of so many equal pieces."""
        return Times(self.ours / pieces, self.reference / pieces)


class Goal(NamedTuple):
    """At least so many times as fast as the reference, at most so many times its time, or within so many seconds."""

    kind: Literal["at least", "at most", "within"]
    limit: float

    def __str__(self) -> str:
        return f"{self.kind} {self.limit:g}{' s' if self.kind == 'within' else ''}"

    def ratio(self, times: Times) -> float:
        """Speed relative to the reference; for 'at most' its inverse, the ratio of times."""
        faster = times.reference / times.ours
        return 1.0 / faster if self.kind == "at most" else faster

    def met(self, times: Times) -> bool:
        """True if measured times reach the goal."""
        if self.kind == "within":
            return times.ours <= self.limit
        return self.ratio(times) >= self.limit if self.kind == "at least" else self.ratio(times) <= self.limit


class Row(NamedTuple):
    """A piece of work, the contender that does it too, and the goal."""

    name: str
    work: str  # as the table names it
    reference: str  # who else does it
    goal: Goal
    measure: Callable[[Setting], Times]  # raises NotMeasurableError
    piece: str = ""  # what the times are of, where not of the whole


@dataclass(frozen=True)
class Measured:
    """A row with its times, or the reason for their absence."""

    row: Row
    times: Times | None
    absent: str = ""

    def __str__(self) -> str:
        if self.times is None:
            return f"absent: {self.absent}"
        ours, theirs = (time_text(x, self.row.piece) for x in self.times)
        return f"ours {ours}, {self.row.reference} {theirs}, ratio {whole_digits_text(self.row.goal.ratio(self.times))}"

    @property
    def met(self) -> bool | None:
        """True if the goal is met; None where it was not measured."""
        return None if self.times is None else self.row.goal.met(self.times)
