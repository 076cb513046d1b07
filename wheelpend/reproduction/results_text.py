"""Findings as sentences, numbers as people read them, and the tables on the terminal. Every number is computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wheelpend.reports.console import print_line, print_table
from wheelpend.reproduction.choices import Choice, ChoiceEffect
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.tables import Cell, Deviation, Prediction

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

MAX_AGREEING_RATIO_DEVIATION = 1.0 / 3.0  # relative difference up to which a number of ours is called the paper's
EXCLUDED_PARAMETER = "X6"  # errors of a few hundredths of a percent in print, their last digit rounded
OUTPUT_LABELS = {"theta_w": "θw", "theta_p": "θp", "dtheta_w": "θ̇w", "dtheta_p": "θ̇p"}
OUTPUT_UNITS = {"theta_w": "rad", "theta_p": "rad", "dtheta_w": "rad/s", "dtheta_p": "rad/s"}


def number_text(value: float | None, digits: int = 2) -> str:
    """A few significant digits without an exponent, as far as that is readable."""
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0.0 or 1e-4 <= abs(value) < 1e5:
        return np.format_float_positional(value, digits, fractional=False, trim="-").replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa.replace('-', '−')}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def range_text(low: float, high: float, digits: int = 2) -> str:
    """A range; one number where both ends read the same."""
    first, last = number_text(low, digits), number_text(high, digits)
    return first if first == last else f"{first} to {last}"


def spread_text(cell: Cell) -> str:
    """Median and 10 to 90 % range."""
    return f"{number_text(cell.median)} ({number_text(cell.p10)}–{number_text(cell.p90)})"


# ---- sentences


def finding_sentences(result: Reproduction) -> list[str]:
    """What came out, in a few sentences."""
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
    """How a case of Table 3 compares with the printed one, by both holds."""
    parts, farthest = [], []
    for hold in ("foh", "zoh"):
        own = [r for r in rows if r.hold == hold and r.parameter != EXCLUDED_PARAMETER]
        ratios = [r.ratio for r in own]
        farthest.append(max(abs(ratio - 1.0) for ratio in ratios))
        parts.append(f"{range_text(min(ratios), max(ratios))} times the printed ones with {hold.upper()}, at most "
                     f"{number_text(max(abs(r.error) for r in own))} %")  # fmt: skip
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
    """What the Cramér-Rao bound stands for."""
    pole = result.unstable_pole
    growth = np.exp(pole * result.duration_s)
    return (
        "The Cramér-Rao bound is that of the estimator which gives every half-second segment an initial state of its "
        "own, as multiple shooting does. With a single initial state for the whole log the bound would be far smaller "
        f"and mean nothing: on this unstable plant the sensitivities of an open-loop prediction grow as "
        f"e^({number_text(pole)} t), {number_text(growth, 1)}-fold over {result.duration_s:g} s, a precision that any "
        "disturbance destroys. Therefore it is not drawn. A median error is "
        "0.67 standard deviations where errors are normally distributed."
    )


# ---- views that terminal and page share


def by_method(cells: Sequence[Cell]) -> dict[str, dict[str, Cell]]:
    """Cells by method and parameter."""
    return {
        m: {c.parameter: c for c in cells if c.method == m} for m in dict.fromkeys(c.method for c in cells)
    }  # fmt: skip


def error_table(cells: Sequence[Cell]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of Table 1 or 2 for one command."""
    found = by_method(cells)
    head = ["parameter"]
    for method in found:
        printed = next(iter(found[method].values())).paper is not None
        if printed and method != "filtered_foh":
            head.append("paper")
        head += [METHOD_LABELS[method], *(["rank"] if printed else [])]
    return head, [_error_row(n, found) for n in next(iter(found.values()))]


def _error_row(name: str, found: dict[str, dict[str, Cell]]) -> list[str]:
    row = [name]
    for method, cells in found.items():
        cell = cells[name]
        if cell.paper is not None and method != "filtered_foh":
            row.append(number_text(cell.paper, 3))
        row.append(number_text(cell.median) if method == "cramer_rao" else spread_text(cell))
        if cell.percentile is not None:
            row.append(f"{cell.percentile:.0f} %")
    return row


def deviation_table(rows: Sequence[Deviation]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of one case of Table 3."""
    head = ["parameter", "paper", "ZOH", "ratio", "FOH", "ratio", "FOH range"]
    holds = {h: [r for r in rows if r.hold == h] for h in ("zoh", "foh")}
    body = [
        [
            z.parameter,
            number_text(z.paper_error, 3),
            number_text(z.error, 3),
            number_text(z.ratio),
            number_text(f.error, 3),
            number_text(f.ratio),
            f"{number_text(f.lowest)}–{number_text(f.highest)}",
        ]
        for z, f in zip(holds["zoh"], holds["foh"], strict=True)
    ]
    return head, body


def prediction_table(rows: Sequence[Prediction]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the prediction errors."""
    head = ["output", "paper", "its estimates", "ours", "falls"]
    body = [
        [
            f"{OUTPUT_LABELS[r.channel]} [{OUTPUT_UNITS[r.channel]}]",
            number_text(r.paper, 3),
            number_text(r.from_printed, 3),
            f"{number_text(r.median)} ({number_text(r.p10)}–{number_text(r.p90)})",
            str(r.fallen),
        ]
        for r in rows
    ]
    return head, body


def prediction_tables(rows: Sequence[Prediction]) -> list[tuple[str, tuple[list[str], list[list[str]]]]]:
    """Caption and table of the prediction errors, by the command that gave the estimates."""
    return [(f"Estimates from the {command} command", prediction_table(list(own)))
            for command, own in groupby(rows, key=lambda r: r.command)]  # fmt: skip


def condition_table(result: Reproduction) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the condition numbers."""
    head = ["command", "regressor", "of ΦᵀΦ", "columns scaled"]
    return head, [
        [c.command, METHOD_LABELS[c.method].split(",")[0], number_text(c.plain), number_text(c.scaled)]
        for c in result.conditions
    ]


def effect_sentences(choice: Choice) -> list[str]:
    """What other choices would do, one sentence per table and alternative."""
    grouped = groupby(choice.effects, key=lambda e: (e.table, e.alternative))
    return [_factor_sentence(table, alternative, list(group)) for (table, alternative), group in grouped]


def _factor_sentence(table_name: str, alternative: str, effects: Sequence[ChoiceEffect]) -> str:
    parts = [f"{e.of} × {range_text(e.smallest, e.largest)}" for e in effects]
    return f"{table_name}{', ' + alternative if alternative else ''}: {', '.join(parts)}"


def case_title(row: Deviation) -> str:
    """A case of Table 3 in words."""
    off = f"initial pitch off by {row.deviation_deg:g}°" if row.deviation_deg else "correct initial pitch"
    return f"Case {row.case}: τ1 = τ2 = {row.tau:g} s, {off}"


METHOD_GROUPS = (
    ("differentiation",),
    ("filtered_zoh", "filtered_foh"),
    ("iv", "shooting", "cramer_rao"),
)  # fit in a line


def tables_of(result: Reproduction) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Title, head and rows of every table that there is, narrow enough for a terminal."""
    for name, cells in (("Table 1", result.table1), ("Table 2", result.table2)):
        for command in dict.fromkeys(c.command for c in cells):
            for group in METHOD_GROUPS:
                own = [c for c in cells if c.command == command and c.method in group]
                if own:
                    yield f"{name}, {command} command: error [%], median (10–90 %)", *error_table(own)
    if result.conditions:
        yield "Condition numbers", *condition_table(result)
    for _, own_rows in groupby(result.table3, key=lambda r: r.case):
        rows = list(own_rows)
        yield f"Table 3, {case_title(rows[0])}: error [%]", *deviation_table(rows)
    for caption, grid in prediction_tables(result.predictions):
        yield f"Figure 5, RMSE of the predictions. {caption}", *grid


def print_reproduction(result: Reproduction) -> None:
    """Print the tables, the choices and the findings."""
    for title, head, rows in tables_of(result):
        print_table(title, head, rows)
    if result.table1 or result.table2:
        print_line("Rank: the share of our draws whose error is smaller than that of the paper's single draw.")
        print_line(bound_sentence(result))
    print_line("What the paper leaves open, and the factors by which the tables change with another choice:")
    for choice in result.choices:
        print_line(f"- {choice.name}: {choice.made}")
        for sentence in effect_sentences(choice):
            print_line(f"    {sentence}")
    for sentence in finding_sentences(result):
        print_line(sentence)
    paths = [Path(p) for p in result.written]
    print_line(f"Wrote {', '.join(p.name for p in paths)} to {paths[0].parent}/." if paths else "Nothing was written.")
