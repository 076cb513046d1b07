"""The kinds of hostile input, with how much of each the quick tests take."""

from __future__ import annotations

from typing import NamedTuple

from hypothesis import strategies as st

from tests.fuzz.cases import Case
from tests.fuzz.command_lines import command_cases
from tests.fuzz.logs import LENGTHY, log_cases
from tests.fuzz.models import law_cases, model_cases, number_cases


class Property(NamedTuple):
    """A strategy for cases and its share of the work."""

    cases: st.SearchStrategy[Case]
    quick: int  # cases in `make test`
    share: float  # of the time of `make fuzz`
    limit_s: float = 20.0  # of one command


PROPERTIES = {
    "logs": Property(log_cases(), 40, 0.3),
    "models": Property(model_cases(), 40, 0.2),
    "numbers": Property(number_cases(), 12, 0.1),
    "laws": Property(law_cases(), 40, 0.1),
    "command lines": Property(command_cases(), 35, 0.2),
    "long commands": Property(log_cases(commands=LENGTHY), 0, 0.1, 120.0),
}
