"""Results of `diagnose` as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import number_text, p_value_text, prediction_error_text
from wheelpend.reports.text.effect_sizes import detectable_rows, effect_size_text, log_size_lines
from wheelpend.reports.text.force_ranges import missing_force_text
from wheelpend.reports.text.remainder import NOT_ADDED, leaves_a_force, remainder_sentences
from wheelpend.reports.text.structures import structures_text
from wheelpend.reports.text.table import Table, TextBlocks
from wheelpend.reports.text.unexplained import LawRequest, unexplained_text
from wheelpend.reports.text.verdict import verdict_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.evidence import CandidateFit
    from wheelpend.diagnosis.verdict import Diagnosis
    from wheelpend.model.record import Model

CANDIDATE_COLUMNS = ("effect", "size", "p", "blocks agree", "error after", "equivalent to", "physically")


def diagnosis_text(result: Diagnosis, model: Model, asked: LawRequest | None = None) -> TextBlocks:
    """The verdict, the candidates, where the model fails, and what the logs would have shown."""
    yield verdict_text(result, model)
    yield from _candidates_text(result, model)
    if not result.determines_nothing:  # else they are what was assumed
        yield from structures_text(result.structures, beside_force=leaves_a_force(result.remainder))
    if result.experiment:
        yield result.experiment
    yield from remainder_sentences(result.remainder, model, NOT_ADDED if result.named else "")
    yield from missing_force_text(result, plant_units_of(model))
    yield from unexplained_text(result, asked or LawRequest())
    if result.detectable:
        yield Table("It would have shown", ("effect", "from a size of"), detectable_rows(result))
    for name, why in result.not_judged.items():
        yield f"{name} was not judged: it {why}."


def _candidates_text(result: Diagnosis, model: Model) -> Iterator[str | Table]:
    if not result.candidates:
        return
    rows = [_candidate_cells(candidate, model) for candidate in result.candidates]
    filled = [k for k in range(len(CANDIDATE_COLUMNS)) if any(row[k] for row in rows)]  # a column of blanks is left out
    yield Table(
        f"Candidates (held-out error now {prediction_error_text(result.error)})",
        [CANDIDATE_COLUMNS[k] for k in filled],
        [[row[k] for k in filled] for row in rows],
    )
    for candidate in result.candidates:
        yield from log_size_lines(candidate)


def _candidate_cells(candidate: CandidateFit, model: Model) -> tuple[str, ...]:
    return (
        candidate.effect,
        effect_size_text(candidate, model).replace("; ", "\n"),
        p_value_text(candidate.p_value),
        candidate.blocks_agree,
        number_text(candidate.error_after),
        "\n".join(candidate.equivalent_to),
        "" if candidate.physical else "impossible",
    )
