"""Findings of a reproduction as sentences; every number in them is computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from wheelpend.reports.numbers import positional_number_text, range_text
from wheelpend.reproduction.choices import Choice, ChoiceEffect
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.tables import Deviation, Prediction, by_method

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

MAX_AGREEING_RATIO_DEVIATION = 1.0 / 3.0  # relative difference up to which a number of ours is called the paper's
EXCLUDED_PARAMETER = "X6"  # errors of a few hundredths of a percent in print, their last digit rounded


def finding_sentences(result: Reproduction) -> list[str]:
    """Sentences on coverage, ratios to better methods, cases of Table 3 and prediction errors."""
    return [
        *_coverage_sentences(result),
        *_ratio_sentences(result),
        *_case_sentences(result.table3),
        *_rmse_sentences(result.predictions),
    ]


def _coverage_sentences(result: Reproduction) -> Iterator[str]:
    for name, cells in (("Table 1", result.table1), ("Table 2", result.table2)):
        rows = [c for c in cells if c.paper is not None and c.method != "filtered_foh"]
        inside = [c for c in rows if c.p10 <= (c.paper or 0.0) <= c.p90]
        if rows:
            yield (f"{name}: {len(inside)} of the {len(rows)} printed errors lie within the middle 80 % of "
                   f"{result.seeds} draws of ours.")  # fmt: skip
    rest = result.started_at_rest
    inside = [c for c in rest if c.p10 <= (c.paper or 0.0) <= c.p90]
    if rest:
        yield (f"With the filters started from zero instead of the first sample it is {len(inside)} of the {len(rest)} "
               "printed errors of the filtered method.")  # fmt: skip


def _ratio_sentences(result: Reproduction) -> Iterator[str]:
    for command in ("simple", "aggressive"):
        for method, low, high in median_error_ratios(result, command):
            yield (
                f"{command.capitalize()} command: the filtered method's median errors are {range_text(low, high)} "
                f"times those of {METHOD_LABELS[method]} (X6 apart)."
            )


def median_error_ratios(result: Reproduction, command: str) -> list[tuple[str, float, float]]:
    """The filtered method's median errors (FOH) as multiples of another method's: its name, lowest, highest."""
    cells = by_method([c for c in (*result.table2, *result.table1) if c.command == command])
    found: list[tuple[str, float, float]] = []
    for method in ("iv", "shooting"):
        if method in cells:
            ratios = [
                cells["filtered_foh"][n].median / c.median for n, c in cells[method].items() if n != EXCLUDED_PARAMETER
            ]
            found.append((method, min(ratios), max(ratios)))
    return found


def _case_sentences(rows: Sequence[Deviation]) -> Iterator[str]:
    for case, own in groupby(rows, key=lambda r: r.case):
        yield case_sentence(case, list(own))


def case_sentence(case: str, rows: Sequence[Deviation]) -> str:
    """Comparison of a case of Table 3 with the printed one, by both holds."""
    parts, farthest = [], []
    for hold in ("foh", "zoh"):
        own = [r for r in rows if r.hold == hold and r.parameter != EXCLUDED_PARAMETER]
        ratios = [r.ratio for r in own]
        farthest.append(max(abs(ratio - 1.0) for ratio in ratios))
        parts.append(f"{range_text(min(ratios), max(ratios))} times the printed ones with {hold.upper()}, at most "
                     f"{positional_number_text(max(abs(r.error) for r in own))} %")  # fmt: skip
    verdict = (
        "agrees with print within a third"
        if min(farthest) <= MAX_AGREEING_RATIO_DEVIATION
        else "does not agree with print within a third"
    )
    return f"Table 3, case {case} {verdict}: our errors are {'; '.join(parts)} (X6 apart)."


def _rmse_sentences(rows: Sequence[Prediction]) -> Iterator[str]:
    if rows:
        ratios = [r.from_printed / r.paper for r in rows]
        yield ("Figure 5: the closed loop recomputed with the paper's printed estimates has "
               f"{range_text(min(ratios), max(ratios))} times the printed RMSE.")  # fmt: skip


def bound_sentence(result: Reproduction) -> str:
    """Meaning of the Cramér-Rao bound that is drawn."""
    pole = result.unstable_pole
    growth = np.exp(pole * result.duration_s)
    return (
        "The Cramér-Rao bound is that of the estimator which gives every half-second segment an initial state of its "
        "own, as multiple shooting does. With a single initial state for the whole log the bound would be far smaller "
        f"and mean nothing: on this unstable plant the sensitivities of an open-loop prediction grow as "
        f"e^({positional_number_text(pole)} t), {positional_number_text(growth, 1)}-fold over {result.duration_s:g} s, "
        "a precision that any disturbance destroys. Therefore it is not drawn. A median error is "
        "0.67 standard deviations where errors are normally distributed."
    )


def effect_sentences(choice: Choice) -> list[str]:
    """One sentence per table and alternative on the factors by which its numbers change."""
    grouped = groupby(choice.effects, key=lambda e: (e.table, e.alternative))
    return [_factor_sentence(table, alternative, list(group)) for (table, alternative), group in grouped]


def _factor_sentence(table_name: str, alternative: str, effects: Sequence[ChoiceEffect]) -> str:
    parts = [f"{e.of} × {range_text(e.smallest, e.largest)}" for e in effects]
    return f"{table_name}{', ' + alternative if alternative else ''}: {', '.join(parts)}"
