"""Findings on the paper's numbered equations, and equations as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from wheelpend.paper.letters import Expression
from wheelpend.paper.notation import expression_text
from wheelpend.paper.printed_numbers import NumberCheck

FINDING_STATUSES = ("match", "misprint", "assumption", "definition", "not_available")


@dataclass(frozen=True)
class EquationFinding:
    """One finding on one numbered equation; an equation may have several."""

    number: str
    name: str  # left side of what was compared
    status: str  # one of FINDING_STATUSES
    printed: str
    derived: str
    note: str
    how: str = ""  # symbolic, numeric, or empty where no comparison was possible
    assumption: str = ""  # name of the choice the equation makes
    shows: tuple[str, ...] = ()  # relations that hold once a misprint is corrected
    agrees_with: tuple[str, ...] = ()  # right equations that agree with the correct form only

    def to_json(self) -> dict[str, Any]:
        """The finding under the keys of JSON."""
        return {
            "number": self.number,
            "name": self.name,
            "status": self.status,
            "printed": self.printed,
            "derived": self.derived,
            "note": self.note,
            "how": self.how,
            "assumption": self.assumption,
            "shows": self.shows,
            "agrees_with": self.agrees_with,
        }


@dataclass(frozen=True)
class Verification:
    """Findings on every equation, checks of every number."""

    equations: tuple[EquationFinding, ...]
    parameters: tuple[NumberCheck, ...]

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {"equations": self.equations, "parameters": self.parameters}

    def of(self, status: str) -> tuple[EquationFinding, ...]:
        """The findings with a status."""
        return tuple(c for c in self.equations if c.status == status)


def equation_text(name: str, expression: Expression) -> str:
    """An equation as text."""
    return f"{name} = {expression_text(expression)}"


def equations_text(components: Mapping[str, Expression]) -> str:
    """Several equations as text."""
    return "; ".join(equation_text(name, e) for name, e in components.items())
