"""The tables as charts: medians with their ranges as dots and whiskers, beside the paper's numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.reports.drawing import INK_COLOUR, PAPER_COLOUR, add_legend, figure_png
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.tables import HOLD_NAMES, Cell, Deviation

METHOD_COLOURS = {"differentiation": "#8a8f98", "filtered_zoh": "#e8a33d", "filtered_foh": "#d1592a", "iv": "#7a4fa3",
                  "shooting": "#1f6fb4", "cramer_rao": INK_COLOUR}  # fmt: skip
HOLD_COLOURS = {"zoh": METHOD_COLOURS["filtered_zoh"], "foh": METHOD_COLOURS["filtered_foh"]}


def errors_chart(cells: Sequence[Cell], commands: Sequence[str]) -> bytes:
    """Median and 10 to 90 % range of every method's error, the bound and the paper's draw, per parameter."""

    def fill(axes: np.ndarray) -> None:
        for ax, command in zip(axes[:, 0], commands, strict=True):
            _errors_panel(ax, [c for c in cells if c.command == command])
            ax.set_title(f"{command} command")
        add_legend(axes[0, 0])

    return figure_png((10.5, 1.0 + 3.8 * len(commands)), len(commands), 1, fill)


def _errors_panel(ax, cells: Sequence[Cell]) -> None:
    methods = list(dict.fromkeys(c.method for c in cells))
    whiskers = [m for m in methods if m != "cramer_rao"]
    for k, method in enumerate(whiskers):
        own = [c for c in cells if c.method == method]
        x = np.arange(len(own)) + _offset(k, len(whiskers))
        _whiskers(ax, x, own, METHOD_COLOURS[method], METHOD_LABELS[method])
        if own[0].paper is not None and method != "filtered_zoh":
            label = "the paper's draw" if method == "filtered_foh" else None
            ax.plot(
                x, [c.paper for c in own], "D", color=PAPER_COLOUR, ms=4.5, mfc="none", mew=1.3, label=label, zorder=4
            )
    for index, c in enumerate([c for c in cells if c.method == "cramer_rao"]):
        ax.hlines(c.median, index - 0.42, index + 0.42, colors=INK_COLOUR, ls="--", lw=1.2,
                  label=f"{METHOD_LABELS['cramer_rao']} (standard deviation)" if index == 0 else None)  # fmt: skip
    _log_axis(ax, list(dict.fromkeys(c.parameter for c in cells)), "absolute error [%]")


def _offset(k: int, count: int) -> float:
    return 0.7 * ((k + 0.5) / count - 0.5)


def _whiskers(ax, x: np.ndarray, cells: Sequence[Cell], colour: str, label: str) -> None:
    middle, low, high = (np.array([getattr(c, n) for c in cells]) for n in ("median", "p10", "p90"))
    ax.errorbar(x, middle, [middle - low, high - middle], fmt="o", color=colour, ms=4.5, lw=1.8, capsize=3, label=label)


def _log_axis(ax, names: Sequence[str], label: str) -> None:
    ax.set_yscale("log")
    ax.set_xticks(range(len(names)), names)
    ax.set_xlim(-0.55, len(names) - 0.45)
    ax.grid(axis="x", visible=False)
    ax.set_ylabel(label)


def deviations_chart(rows: Sequence[Deviation]) -> bytes:
    """Table 3: printed and ours, with the range over what the paper leaves open, per case and parameter."""
    cases = list(dict.fromkeys(r.case for r in rows))

    def fill(axes: np.ndarray) -> None:
        for ax, case in zip(axes.ravel(), cases, strict=True):
            _deviations_panel(ax, [r for r in rows if r.case == case])
        add_legend(axes[0, 0])

    return figure_png((10.5, 7.2), 2, 2, fill)


def _deviations_panel(ax, rows: Sequence[Deviation]) -> None:
    for k, hold in enumerate(HOLD_NAMES):
        own = [r for r in rows if r.hold == hold]
        x, middle = np.arange(len(own)) + _offset(k, len(HOLD_NAMES)), np.array([abs(r.error) for r in own])
        low, high = (np.array([getattr(r, n) for r in own]) for n in ("lowest", "highest"))
        ax.vlines(x, low, high, color=HOLD_COLOURS[hold], lw=5, alpha=0.35)
        ax.plot(x, middle, "o", color=HOLD_COLOURS[hold], ms=5, label=f"ours, {hold.upper()}")
    own = [r for r in rows if r.hold == HOLD_NAMES[0]]
    ax.plot(
        range(len(own)),
        [r.paper_error for r in own],
        "D",
        color=PAPER_COLOUR,
        ms=5,
        mfc="none",
        mew=1.3,
        label="the paper",
    )
    first = own[0]
    ax.set_title(f"case {first.case}: τ = {first.tau:g} s, pitch off by {first.deviation_deg:g}°")
    _log_axis(ax, [r.parameter for r in own], "absolute error [%]")
