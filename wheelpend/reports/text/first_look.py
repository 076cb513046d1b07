"""The first look at a log as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.reports.numbers import number_text
from wheelpend.reports.text.inspection import findings_text, summary_text
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.inspection.first_look import FirstLook


def first_look_text(look: FirstLook) -> TextBlocks:
    """Columns, what they are, which plant has them, findings under that plant, and the model.toml that follows."""
    yield "There is no model here: this is by the columns and what they do."
    rows = [(look.survey.title(c.name), c.words, number_text(c.minimum), number_text(c.maximum),
             number_text(c.step or None)) for c in look.survey.columns]  # fmt: skip
    yield Table("Columns", ("column", "is", "minimum", "maximum", "step"), rows)
    for sentence in look.proposal.sentences:
        yield f"- {sentence}"
    if look.log is not None and look.inspection is not None:
        yield from summary_text(look.log, look.inspection)
        yield from findings_text(look.inspection)
    if look.refusal:
        yield f"It cannot be read so: {look.refusal}"
    yield f"Its model.toml would begin so, and `wheelpend new --from LOG` writes it:\n\n{look.model}"
