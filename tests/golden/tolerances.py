"""To which tolerance a committed number is compared: 1e-6 of itself, or more where that was measured to be needed."""

from __future__ import annotations

import re
from typing import NamedTuple

from differences import Rule, Tolerance

USUAL = Tolerance(rtol=1e-6, atol=1e-9)


class Looser(NamedTuple):
    """A tolerance that some places need."""

    place: str  # regular expression of CHAIN.STEP.answer.KEY...
    tolerance: Tolerance


LOOSER: tuple[Looser, ...] = ()


def rule(chain: str) -> Rule:
    """Tolerance of each place of a chain's committed results."""
    return lambda place: next((row.tolerance for row in LOOSER if re.match(row.place, chain + place)), USUAL)
