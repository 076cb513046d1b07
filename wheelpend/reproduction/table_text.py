"""Head and rows of every table as text, for terminal and page."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from wheelpend.reports.numbers import positional_number_text
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.tables import Cell, Deviation, Prediction, by_method

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

OUTPUT_LABELS = {"theta_w": "θw", "theta_p": "θp", "dtheta_w": "θ̇w", "dtheta_p": "θ̇p"}
OUTPUT_UNITS = {"theta_w": "rad", "theta_p": "rad", "dtheta_w": "rad/s", "dtheta_p": "rad/s"}


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
            row.append(positional_number_text(cell.paper, 3))
        row.append(positional_number_text(cell.median) if method == "cramer_rao" else spread_text(cell))
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
            positional_number_text(z.paper_error, 3),
            positional_number_text(z.error, 3),
            positional_number_text(z.ratio),
            positional_number_text(f.error, 3),
            positional_number_text(f.ratio),
            f"{positional_number_text(f.lowest)}–{positional_number_text(f.highest)}",
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
            positional_number_text(r.paper, 3),
            positional_number_text(r.from_printed, 3),
            _median_text(r.median, r.p10, r.p90),
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
        [
            c.command,
            METHOD_LABELS[c.method].split(",")[0],
            positional_number_text(c.plain),
            positional_number_text(c.scaled),
        ]
        for c in result.conditions
    ]


def case_title(row: Deviation) -> str:
    """Caption of a case of Table 3."""
    off = f"initial pitch off by {row.deviation_deg:g}°" if row.deviation_deg else "correct initial pitch"
    return f"Case {row.case}: τ1 = τ2 = {row.tau:g} s, {off}"


def spread_text(cell: Cell) -> str:
    """Median and 10 to 90 % range."""
    return _median_text(cell.median, cell.p10, cell.p90)


def _median_text(median: float, p10: float, p90: float) -> str:
    low, high = positional_number_text(p10), positional_number_text(p90)
    return f"{positional_number_text(median)} ({low}–{high})"
