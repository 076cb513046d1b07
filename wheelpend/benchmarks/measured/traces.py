"""Figures of the case studies that show a motion or a torque over time, and what a model makes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend.benchmarks.measured.drawing import (
    AFTER_COLOUR,
    BEFORE_COLOUR,
    INK_COLOUR,
    MUTED_COLOUR,
    new_figure,
    save_svg,
)
from wheelpend.benchmarks.measured.torque import JointEquations
from wheelpend.logs.log import Log

MAX_POINTS = 4000  # of a curve, beyond which it is thinned
TORQUE_WINDOW_S = 8.0  # s of an arm's torques that are shown
JOINT_NAMES = ("shoulder", "elbow")
LEGEND_ABOVE: dict[str, Any] = {
    "frameon": False, "fontsize": 8, "ncols": 3, "loc": "lower right", "bbox_to_anchor": (1.0, 1.0)
}  # fmt: skip
LINE_COLOURS = (BEFORE_COLOUR, AFTER_COLOUR, INK_COLOUR)


def draw_free_runs(path: Path, log: Log, runs: Mapping[str, np.ndarray]) -> None:
    """Measured angle, and below it how far free runs [rad] with some models are from it, over the whole log."""
    figure, (above, below) = new_figure(7, 4.4, 2)
    thin = slice(None, None, -(-len(log) // MAX_POINTS))
    above.plot(log.t[thin], log.measured[thin, 0], color=MUTED_COLOUR, lw=0.6)
    above.set_ylabel("angle [rad]")
    for colour, (label, readings) in zip(LINE_COLOURS, runs.items(), strict=False):
        off = 1e3 * (log.measured[thin, 0] - readings[thin])
        below.plot(log.t[thin], off, color=colour, lw=0.6, label=label)
    below.set_ylabel("measured less free run [mrad]")
    below.set_xlabel("time [s]")
    below.legend(**LEGEND_ABOVE)
    save_svg(figure, path)


def draw_roll_outs(path: Path, logs: Sequence[Log], runs: Sequence[Mapping[str, np.ndarray]]) -> None:
    """Measured angle of some logs, each with its roll-outs [rad] by model."""
    figure, axes = new_figure(7, 1.8 * len(logs) + 0.4, len(logs))
    for ax, log, predicted in zip(axes, logs, runs, strict=True):
        ax.plot(log.t, log.measured[:, 0], color=MUTED_COLOUR, lw=2.0, label="measured")
        for colour, (label, readings) in zip(LINE_COLOURS, predicted.items(), strict=False):
            ax.plot(log.t, readings, color=colour, lw=0.9, label=label)
        ax.set_title(log.name, fontsize=9, loc="left", color=INK_COLOUR)
        ax.set_ylabel("angle [rad]")
    axes[0].legend(**LEGEND_ABOVE)
    axes[-1].set_xlabel("time [s]")
    save_svg(figure, path)


def draw_torques(path: Path, equations: JointEquations, needed: Mapping[str, np.ndarray]) -> None:
    """Measured torque of both joints with what some models need (N, 2), over some seconds of a stretch."""
    figure, axes = new_figure(7, 4.4, len(JOINT_NAMES))
    t = equations.t
    begin = t[0] + 0.5 * max(float(t[-1] - t[0]) - TORQUE_WINDOW_S, 0.0)
    shown = (t >= begin) & (t < begin + TORQUE_WINDOW_S)
    for joint, (ax, name) in enumerate(zip(axes, JOINT_NAMES, strict=True)):
        ax.plot(t[shown], equations.measured[shown, joint], color=MUTED_COLOUR, lw=2.0, label="measured")
        for colour, (label, torques) in zip(LINE_COLOURS, needed.items(), strict=False):
            ax.plot(t[shown], torques[shown, joint], color=colour, lw=0.9, label=label)
        ax.set_ylabel(f"{name} [N m]")
    axes[0].legend(**LEGEND_ABOVE)
    axes[-1].set_xlabel("time [s]")
    save_svg(figure, path)
