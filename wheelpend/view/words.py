"""Results of commands as words and cells: the numbers' only formatter is that of the reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import derive
from wheelpend.model.entries import ParameterValue
from wheelpend.model.record import Model
from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import estimate_text, number_text, p_value_text, percent_text, physical_text

TABLE_CHARACTERS = "┏┡└│┃╇━"  # with which the lines of a table in the terminal begin
NORMAL_QUANTILE = 1.96  # standard errors to either side of an interval of 95 %


def sentences(lines: Sequence[str]) -> list[str]:
    """The lines of a result that are sentences, neither rows nor titles of tables."""
    followed = zip(lines, [*lines[1:], ""], strict=True)
    return [line.strip() for line, after in followed if line.strip() and not (_is_row(line) or _is_row(after))]


def _is_row(line: str) -> bool:
    return line.strip().startswith(tuple(TABLE_CHARACTERS))


def sizes(candidate: Mapping[str, Any], model: Model | None) -> str:
    """An effect's coefficients with their standard errors, in N m too where a volt's worth is known."""
    return "; ".join(_size(candidate, name, model) for name in candidate.get("coefficients") or {})


def _size(candidate: Mapping[str, Any], name: str, model: Model | None) -> str:
    value, unit = candidate["coefficients"][name], candidate["unit"][name]
    text = f"{name} {estimate_text(value, candidate['sigma'][name], unit)}"
    physical = physical_text(value, unit, plant_units_of(model), 4) if model is not None else ""
    return f"{text} = {physical}" if physical else text


def candidate_cells(candidate: Mapping[str, Any], model: Model | None) -> list[str]:
    """A candidate's row: name, probability, size, error after, p, and what it cannot be told from."""
    probability = candidate.get("probability")
    return [
        candidate["effect"],
        "" if probability is None else percent_text(probability),
        sizes(candidate, model),
        number_text(candidate.get("error_after")),
        p_value_text(candidate["p_value"]),
        ", ".join(candidate.get("equivalent_to") or []) or "none",
    ]


def meaning(effect: str) -> list[str]:
    """What an effect is, what it means for the machine, its law, and what resembles it."""
    row = derive.effects.EFFECT_LIBRARY.get(effect)
    if row is None:
        return []
    law = f"Law: {row.equation}" if row.equation else ""
    alike = f"Acts in a similar way: {row.resembles.replace('`', '')}" if row.resembles else ""
    return [words for words in (row.sentence, row.means, law, alike) if words]


def parameter_rows(model: Model) -> list[list[str]]:
    """Each parameter of the model: its name, its value, the interval of 95 %, and where the value comes from."""
    known = model.all_parameters
    return [[name, number_text(found.best), *_interval_cells(found)] for name, found in known.items()]


def _interval_cells(found: ParameterValue) -> list[str]:
    if found.identified is None or found.sigma is None:
        return ["", "identified" if found.identified is not None else "nominal"]
    low, high = (found.identified + side * NORMAL_QUANTILE * found.sigma for side in (-1.0, 1.0))
    return [f"{number_text(low)} to {number_text(high)}", "identified"]


def ladder_rows(entries: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Every change of a workspace with its errors, the logs it was judged on, and its day."""
    return [
        [
            str(entry.get("change", "")),
            number_text(entry.get("error_before")),
            number_text(entry.get("error_after")),
            ", ".join(Path(str(log)).name for log in entry.get("logs") or ()),
            str(entry.get("date", "")),
        ]
        for entry in entries
    ]
