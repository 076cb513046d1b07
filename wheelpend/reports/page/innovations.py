"""The tests of the filter's residuals for the page: is what the final model leaves over noise?"""

from __future__ import annotations

from typing import NamedTuple

from wheelpend.diagnosis.explain import Ladder
from wheelpend.errors import Failure
from wheelpend.identification.residual_tests import NO_TESTS_WORDS, ResidualTests, require_short, residuals
from wheelpend.model.record import Model
from wheelpend.reports.names import display_text
from wheelpend.reports.text.residuals import CLOSING_SENTENCE, RESIDUAL_COLUMNS, meaning_text, residual_cells


class ResidualSection(NamedTuple):
    """What the page says of the residuals: a table and sentences, or why there is none."""

    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    sentences: list[str]


def residual_tests_of(explanation: Ladder) -> ResidualTests | str:
    """Tests of the final model on the logs of its fit, or in a sentence why they were not made."""
    try:
        require_short(explanation.problem.logs)
        return residuals(explanation.model, explanation.problem.logs)
    except Failure as failure:
        return f"{NO_TESTS_WORDS}: {failure}"


def residual_section(tests: ResidualTests | str | None, model: Model) -> ResidualSection | None:
    """Table and sentences of the tests; None where none were asked for."""
    if tests is None or isinstance(tests, str):
        return ResidualSection((), [], [tests]) if tests else None
    rows = [(display_text(name), *residual_cells(c)) for name, c in tests.channels.items()]
    said = [f"{display_text(name)}: {meaning_text(c)}" for name, c in tests.channels.items()]
    return ResidualSection(RESIDUAL_COLUMNS, rows, [*said, CLOSING_SENTENCE])
