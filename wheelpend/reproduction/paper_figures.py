"""Figures 2 to 6 in the paper's arrangement and colours."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.paper import numbers
from wheelpend.reports.drawing import MEASURED_COLOUR, add_legend, figure_png
from wheelpend.reproduction.estimators import filtered
from wheelpend.reproduction.experiment import COMMAND_NAMES, Robot, Run, Setup, play
from wheelpend.reproduction.trials import PREDICTION_SETUP, STATE_NAMES, predict, rms_difference

SHOWN_SEED = 0  # of the draw in Figures 2 to 6
EXACT_COLOUR, SIMPLE_COLOUR, AGGRESSIVE_COLOUR = "#d62728", "#1f5fd0", "#1f9d3a"
COMMAND_COLOURS = {"simple": SIMPLE_COLOUR, "aggressive": AGGRESSIVE_COLOUR}
INPUT_COLOURS = {"simple": AGGRESSIVE_COLOUR, "aggressive": SIMPLE_COLOUR}  # Figure 6 has them the other way round
COMMAND_DASHES = {"simple": (0, (4, 8)), "aggressive": (6, (4, 8))}  # in turn, so that exact shows between them
OUTPUT_PANELS = (("(a) Wheel angle", "rad"), ("(b) Pitch angle", "rad"), ("(c) Wheel angular speed", "rad/s"),
          ("(d) Pitch angular speed", "rad/s"))  # fmt: skip


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
        add_legend(axes[0, 0])
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
        add_legend(axes[0, 0])
        _time_axis(axes)

    return figure_png((10.5, 7.0), 2, 2, fill, sharex=True)


def _time_axis(axes: np.ndarray) -> None:
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
