"""Figures of the case studies, and the rows of their error ladders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.compare import Comparison
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import read_logs
from wheelpend.identification.inverse_dynamics import equations_with_values
from wheelpend.isolation import import_configured
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.reports.ladder import ladder_rungs

INK_COLOUR, MUTED_COLOUR, BEFORE_COLOUR, AFTER_COLOUR = "#243447", "#8a97a6", "#d1592a", "#1f6f8b"
FORCE_PER_VOLT_N = 35.1507


class Rung(NamedTuple):
    """A model of the ladder, identified by inverse dynamics."""

    effects: tuple[str, ...]
    estimation_error: float  # force error on the estimation log [%]
    pulses_error: float  # force error on the log with pulses [%]
    values: dict[str, float]  # of its parameters, forces in V

    @property
    def label(self) -> str:
        """The effect that it has more than the one before."""
        return f"+ {self.effects[-1]}" if len(self.effects) > 1 else "mass and offset"


def new_figure(width: float, height: float, rows: int = 1):
    """Figure [inches] and its axes one above the other, in the project's colours."""
    import_configured("matplotlib")  # late: what only computes does not need it
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, 1, squeeze=False, sharex=rows > 1)[:, 0]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(colors=INK_COLOUR)
    return figure, axes


def save_svg(figure, path: Path) -> None:
    """Write an SVG that is the same for the same numbers."""
    matplotlib = import_configured("matplotlib")
    with matplotlib.rc_context({"svg.hashsalt": path.name}):
        figure.savefig(path, metadata={"Date": None})


def bar_heights(rungs: Sequence) -> np.ndarray:
    """Heights (rungs,) of horizontal bars, the first on top."""
    return np.arange(len(rungs))[::-1]


def draw_force_ladder(path: Path, rungs: Sequence[Rung]) -> None:
    """Force error of every rung on both logs."""
    figure, (ax,) = new_figure(7, 1.0 + 0.4 * len(rungs))
    y = bar_heights(rungs)
    ax.barh(y + 0.18, [r.estimation_error for r in rungs], 0.34, color=AFTER_COLOUR, label="estimation log")
    ax.barh(y - 0.18, [r.pulses_error for r in rungs], 0.34, color=BEFORE_COLOUR, label="log with pulses")
    ax.set_yticks(y, [r.label for r in rungs])
    ax.set_xscale("log")
    ax.set_xticks([3, 5, 10, 20, 50], ["3", "5", "10", "20", "50"])
    ax.xaxis.minorticks_off()
    ax.set_xlabel("force error [%]")
    ax.legend(frameon=False)
    save_svg(figure, path)


def draw_force(path: Path, model: Model, rungs: Sequence[Rung], log_path: Path) -> None:
    """Measured force and its residual, rung by rung, over five seconds."""
    figure, axes = new_figure(7, 1.3 * len(rungs), len(rungs))
    for ax, rung in zip(axes, rungs, strict=True):
        t, force, rest = unexplained_force(model.with_effects(rung.effects), rung.values, log_path)
        shown = (t > 1.0) & (t < 6.0)
        ax.plot(t[shown], force[shown], color=MUTED_COLOUR, lw=0.8, label="measured force")
        ax.plot(t[shown], rest[shown], color=BEFORE_COLOUR, lw=0.9, label="left unexplained")
        ax.set_title(rung.label, fontsize=9, loc="left", color=INK_COLOUR)
        ax.set_ylabel("N")
    axes[0].legend(frameon=False, ncols=2, fontsize=8, loc="upper right")
    axes[-1].set_xlabel("time [s]")
    save_svg(figure, path)


def draw_bursts(path: Path, model: Model, log_path: Path, comparison: Comparison) -> None:
    """Residual of the force in the log with pulses, with the bursts marked."""
    figure, (ax,) = new_figure(7, 2.6)
    values = {n: v for n in (*model.parameters, *model.effect_values) if (v := model.value(n)) is not None}
    t, _, rest = unexplained_force(model, values, log_path)
    shown = (t > 1.0) & (t < 6.0)
    ax.plot(t[shown], rest[shown], color=INK_COLOUR, lw=0.6)
    for burst in comparison.bursts:
        if 1.0 < burst["from"] < 6.0:
            colour = MUTED_COLOUR if burst["at_reversal"] else BEFORE_COLOUR
            ax.axvspan(burst["from"], burst["to"], color=colour, alpha=0.5)
    ax.set_ylabel("left unexplained [N]")
    ax.set_xlabel("time [s]; orange: bursts, grey: bursts at a reversal")
    save_svg(figure, path)


def unexplained_force(
    model: Model, values: dict[str, float], log_path: Path
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], measured force and its residual [N], at the bandwidth of the differentiated motion."""
    module = model_module(model.plant, model.assumptions, model.effects)
    log = read_logs([log_path], model)[0]
    (raw,) = equations_with_values(module, log, values)  # the log is one long stretch
    rest = raw.left - raw.regressor @ np.array([values[n] for n in module.LINEAR])
    return raw.t, FORCE_PER_VOLT_N * raw.left[:, 0], FORCE_PER_VOLT_N * rest[:, 0]


def draw_robot(path: Path, log: Log, standstills: Sequence[tuple[float, float]]) -> None:
    """Drive angle, pitch and voltage, with the stretches marked in which the drive stands still."""
    figure, axes = new_figure(7, 4.6, 3)
    rows = (
        ("drive angle [rad]", log.measured[:, 0]),
        ("pitch [rad]", log.measured[:, 1]),
        ("voltage [V]", log.voltage),
    )
    for ax, (name, signal) in zip(axes, rows, strict=True):
        ax.plot(log.t, signal, color=INK_COLOUR, lw=0.9)
        ax.set_ylabel(name)
        for a, b in standstills:
            ax.axvspan(a, b, color=BEFORE_COLOUR, alpha=0.25, lw=0)
    axes[-1].set_xlabel("time [s]; marked: the drive stands still")
    save_svg(figure, path)


def draw_error_ladder(path: Path, found: Ladder) -> None:
    """Validation error of the refitted model and after every step, with the noise floor."""
    figure, (ax,) = new_figure(7, 1.4 + 0.4 * len(found.steps))
    rungs = [rung for rung in ladder_rungs(found) if rung.kind != "nominal"]
    y = bar_heights(rungs)
    ax.set_xlim(0.0, 1.25 * max(r.error for r in rungs))
    ax.barh(y, [r.error for r in rungs], color=[AFTER_COLOUR if r.kind == "step" else BEFORE_COLOUR for r in rungs])
    ax.axvline(found.noise_floor, color=MUTED_COLOUR, lw=1, ls="--")
    ax.set_yticks(y, [rung.label for rung in rungs])
    for place, rung in zip(y, rungs, strict=True):
        ax.text(rung.error, place, f" {rung.text}", va="center", fontsize=8, color=INK_COLOUR)
    ax.set_xlabel("held-out error [σ]; dashed: noise floor\nforce: random force that is left, share of the drive")
    save_svg(figure, path)
