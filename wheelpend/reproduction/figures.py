"""Pictures (PNG): Figures 2 to 6 in the paper's arrangement and colours, and the tables as dots and whiskers."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wheelpend.estimation.least_squares import measured_states
from wheelpend.paper import numbers
from wheelpend.reproduction.estimators import METHOD_LABELS, filtered
from wheelpend.reproduction.experiment import COMMAND_NAMES, Robot, Run, Setup, play
from wheelpend.reproduction.tables import HOLD_NAMES, Cell, Deviation
from wheelpend.reproduction.trials import PREDICTION_SETUP, STATE_NAMES, predict, rms_difference

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

SHOWN_SEED = 0  # of the draw in Figures 2 to 6
INK_COLOUR, EXACT_COLOUR, SIMPLE_COLOUR, AGGRESSIVE_COLOUR, MEASURED_COLOUR, PAPER_COLOUR = (
    "#262b33",
    "#d62728",
    "#1f5fd0",
    "#1f9d3a",
    "#9aa0a6",
    "#000000",
)
COMMAND_COLOURS = {"simple": SIMPLE_COLOUR, "aggressive": AGGRESSIVE_COLOUR}
INPUT_COLOURS = {"simple": AGGRESSIVE_COLOUR, "aggressive": SIMPLE_COLOUR}  # Figure 6 has them the other way round
COMMAND_DASHES = {"simple": (0, (4, 8)), "aggressive": (6, (4, 8))}  # in turn, so that exact shows between them
METHOD_COLOURS = {"differentiation": "#8a8f98", "filtered_zoh": "#e8a33d", "filtered_foh": "#d1592a", "iv": "#7a4fa3",
                  "shooting": "#1f6fb4", "cramer_rao": INK_COLOUR}  # fmt: skip
HOLD_COLOURS = {"zoh": METHOD_COLOURS["filtered_zoh"], "foh": METHOD_COLOURS["filtered_foh"]}
OUTPUT_PANELS = (("(a) Wheel angle", "rad"), ("(b) Pitch angle", "rad"), ("(c) Wheel angular speed", "rad/s"),
          ("(d) Pitch angular speed", "rad/s"))  # fmt: skip
FIGURE_DPI = 130
FIGURE_STYLE: Any = {
    "font.size": 10,
    "axes.grid": True,
    "grid.color": "#e2e6eb",
    "axes.edgecolor": MEASURED_COLOUR,
    "axes.axisbelow": True,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK_COLOUR,
    "axes.labelcolor": INK_COLOUR,
}


def draw(result: Reproduction) -> dict[str, bytes]:
    """All pictures that belong to a result, as PNG by name."""
    import matplotlib

    with matplotlib.rc_context(FIGURE_STYLE):
        return dict(_pictures(result))


def _pictures(result: Reproduction) -> Iterator[tuple[str, bytes]]:
    if result.table1:
        yield "table1", errors_chart(result.table1, ("simple",))
    if result.table2:
        yield "table2", errors_chart(result.table2, COMMAND_NAMES)
    if result.table3:
        yield "table3", deviations_chart(result.table3)
    if result.predictions and result.robot:
        yield from paper_figures(result.robot)


def figure_png(
    size: tuple[float, float], rows: int, columns: int, fill: Callable[[np.ndarray], Any], **shared
) -> bytes:
    """A PNG of a grid of axes (rows, columns) that a function fills."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    fill(figure.subplots(rows, columns, squeeze=False, **shared))
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return data.getvalue()


# ---- tables as charts


def errors_chart(cells: Sequence[Cell], commands: Sequence[str]) -> bytes:
    """Median and 10 to 90 % range of every method's error, the bound and the paper's draw, per parameter."""

    def fill(axes: np.ndarray) -> None:
        for ax, command in zip(axes[:, 0], commands, strict=True):
            _errors_panel(ax, [c for c in cells if c.command == command])
            ax.set_title(f"{command} command")
        _legend(axes[0, 0])

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


def _legend(ax, columns: int = 4) -> None:
    ax.figure.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=columns, fontsize=9.5)


def deviations_chart(rows: Sequence[Deviation]) -> bytes:
    """Table 3: printed and ours, with the range over what the paper leaves open, per case and parameter."""
    cases = list(dict.fromkeys(r.case for r in rows))

    def fill(axes: np.ndarray) -> None:
        for ax, case in zip(axes.ravel(), cases, strict=True):
            _deviations_panel(ax, [r for r in rows if r.case == case])
        _legend(axes[0, 0])

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


# ---- the paper's figures


def paper_figures(robot: Robot) -> Iterator[tuple[str, bytes]]:
    """Figures 2 to 6, of one draw and its filtered estimates (FOH)."""
    runs = {c: play(robot, Setup(c), SHOWN_SEED) for c in COMMAND_NAMES}
    yield "figure2", figure2(runs)
    yield "figure3", figure3(robot, runs)
    exact = play(robot, PREDICTION_SETUP)
    predicted = {c: predict(robot, PREDICTION_SETUP, filtered(robot, runs[c].log)) for c in COMMAND_NAMES}
    yield "figure4", figure4(exact, predicted)
    yield "figure5", figure5(exact, predicted)
    yield "figure6", figure6(play(robot, PREDICTION_SETUP, SHOWN_SEED), exact, predicted)


def figure2(runs: dict[str, Run]) -> bytes:
    """Input data: the commanded voltages."""

    def fill(axes: np.ndarray) -> None:
        for ax, (command, run) in zip(axes[:, 0], runs.items(), strict=True):
            ax.plot(run.log.t, run.log.voltage, color=COMMAND_COLOURS[command], lw=0.6)
            ax.set_title(f"{command} command")
            ax.set_ylabel("control input [V]")
        _time_axis(axes)

    return figure_png((10.5, 5.0), 2, 1, fill, sharex=True)


def figure3(robot: Robot, runs: dict[str, Run]) -> bytes:
    """Output data, as measured; the wheel's speed from differences of the encoder."""

    def panel(ax, index: int) -> None:
        for command, run in runs.items():
            states = measured_states(robot.module, run.log)
            ax.plot(run.log.t, states[:, index], color=COMMAND_COLOURS[command], lw=0.6, label=f"{command} command")

    return _four_outputs_png(panel)


def figure4(exact: Run, predicted: dict[str, Run]) -> bytes:
    """Closed-loop predictions of the outputs."""

    def panel(ax, index: int) -> None:
        ax.plot(exact.log.t, exact.states[:, index], color=EXACT_COLOUR, lw=2.4, label="exact")
        for command, run in predicted.items():
            ax.plot(run.log.t, run.states[:, index], color=COMMAND_COLOURS[command], lw=1.3, ls=COMMAND_DASHES[command],
                    label=f"identified from the {command} command")  # fmt: skip

    return _four_outputs_png(panel)


def figure5(exact: Run, predicted: dict[str, Run]) -> bytes:
    """Errors of those predictions, with their root mean square beside the paper's."""
    rms = {c: rms_difference(run, exact) for c, run in predicted.items()}

    def panel(ax, index: int) -> None:
        for position, (command, run) in enumerate(predicted.items()):
            paper = numbers.PREDICTION_RMSE[STATE_NAMES[index]][position]
            ax.plot(run.log.t, run.states[:, index] - exact.states[:, index], color=COMMAND_COLOURS[command], lw=0.9,
                    label=f"identified from the {command} command")  # fmt: skip
            ax.text(0.01, 0.985 - 0.075 * position, f"RMSE {rms[command][index]:.2g}; paper {paper:.2g}",
                    color=COMMAND_COLOURS[command], transform=ax.transAxes, fontsize=9, va="top",
                    bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1})  # fmt: skip
        ax.margins(y=0.22)

    return _four_outputs_png(panel)


def figure6(measured: Run, exact: Run, predicted: dict[str, Run]) -> bytes:
    """Prediction of the control input."""

    def fill(axes: np.ndarray) -> None:
        for ax, last in zip(axes[:, 0], (exact.log.t[-1], exact.log.t[-1] / 5), strict=True):
            shown = exact.log.t <= last
            _input_panel(ax, shown, measured, exact, predicted)
        _legend(axes[0, 0])
        axes[0, 0].set_title("whole experiment")
        axes[1, 0].set_title("its first fifth")
        axes[1, 0].set_xlabel("time [s]")

    return figure_png((10.5, 6.0), 2, 1, fill)


def _input_panel(ax, shown: np.ndarray, measured: Run, exact: Run, predicted: dict[str, Run]) -> None:
    t = exact.log.t[shown]
    ax.plot(t, measured.log.voltage[shown], color=MEASURED_COLOUR, lw=0.5, label="measured")
    ax.plot(t, exact.log.voltage[shown], color=EXACT_COLOUR, lw=1.8, label="exact")
    for command, run in predicted.items():
        ax.plot(t, run.log.voltage[shown], color=INPUT_COLOURS[command], lw=1.0, ls=COMMAND_DASHES[command],
                label=f"identified from the {command} command")  # fmt: skip
    ax.set_ylabel("control input [V]")


def _four_outputs_png(panel: Callable[[Any, int], None]) -> bytes:
    """The four outputs in the paper's arrangement."""

    def fill(axes: np.ndarray) -> None:
        for index, ax in enumerate(axes.ravel()):
            panel(ax, index)
            title, unit = OUTPUT_PANELS[index]
            ax.set_title(title)
            ax.set_ylabel(f"[{unit}]")
        _legend(axes[0, 0])
        _time_axis(axes)

    return figure_png((10.5, 7.0), 2, 2, fill, sharex=True)


def _time_axis(axes: np.ndarray) -> None:
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
