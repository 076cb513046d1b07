"""The filters' time constants: bias and standard deviation of the estimate with each pair, on replicas of a log."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend.durations import StepTimer
from wheelpend.errors import Failure
from wheelpend.files import write_bytes
from wheelpend.identification.bootstrap import ParametricBootstrap
from wheelpend.isolation import import_configured
from wheelpend.logs.log import Log

Tau = tuple[float, float]
TIME_CONSTANT_COUNT = 8  # spaced evenly in their logarithm
TIME_CONSTANT_REPLICAS = 8  # for the spread to within a quarter
MIN_TIME_CONSTANT_SAMPLES, MAX_TIME_CONSTANT_LOG_SHARE = 4.0, 1 / 3  # samples; share of the log


@dataclass(frozen=True)
class TimeConstantPair:
    """Bias and standard deviation of the estimate with a pair of time constants, in percent of each parameter."""

    tau1: float  # s
    tau2: float  # s
    bias_percent: dict[str, float]
    spread_percent: dict[str, float]
    score: float  # capped root mean square [%] over the parameters of bias and spread together

    def to_json(self) -> dict[str, Any]:
        """The pair under the keys of JSON."""
        return {
            "tau1": self.tau1,
            "tau2": self.tau2,
            "bias_percent": self.bias_percent,
            "spread_percent": self.spread_percent,
            "score": self.score,
        }

    @property
    def bias(self) -> float:
        """Capped root mean square [%] of the bias over the parameters."""
        return capped_rms_percent(np.array(list(self.bias_percent.values())))

    @property
    def spread(self) -> float:
        """Capped root mean square [%] of the standard deviation over the parameters."""
        return capped_rms_percent(np.array(list(self.spread_percent.values())))


@dataclass(frozen=True)
class TimeConstantChoice:
    """Bias and spread over the time constants, and the pair with the least error."""

    rows: tuple[TimeConstantPair, ...]
    chosen: Tau
    reason: str
    against: str  # the method of the consistent estimate: iv or shooting
    replicas: int

    def to_json(self) -> dict[str, Any]:
        """The choice under the keys of JSON."""
        return {
            "rows": self.rows,
            "chosen": self.chosen,
            "reason": self.reason,
            "against": self.against,
            "replicas": self.replicas,
        }

    def pair(self, tau: Tau) -> TimeConstantPair:
        """The row of a pair."""
        return next(r for r in self.rows if (r.tau1, r.tau2) == tau)

    @property
    def diagonal(self) -> tuple[TimeConstantPair, ...]:
        """The rows with both time constants alike, from small to large."""
        return tuple(r for r in self.rows if r.tau1 == r.tau2)


def capped_rms_percent(percent: np.ndarray) -> float:
    """Root mean square over parameters, none counted above 100 %.

    A model predicts no better than its worst parameter allows, hence squares; a parameter that is lost with every pair
    must not decide between them, hence the limit.
    """
    return float(np.sqrt(np.nanmean(np.minimum(np.abs(percent), 100.0) ** 2)))


def time_constant_pairs(log: Log) -> list[Tau]:
    """Pairs τ1 <= τ2 from a few samples to a third of the log."""
    first, last = MIN_TIME_CONSTANT_SAMPLES * log.dt, MAX_TIME_CONSTANT_LOG_SHARE * log.duration
    if last < 2.0 * first:
        raise Failure(
            f"{log.name} must last at least {round(2 * MIN_TIME_CONSTANT_SAMPLES / MAX_TIME_CONSTANT_LOG_SHARE) + 1} "
            f"samples to choose time constants; it has {len(log)}. Give --tau T1,T2."
        )
    times = [float(f"{t:.3g}") for t in np.geomspace(first, last, TIME_CONSTANT_COUNT)]
    return [(a, b) for i, a in enumerate(times) for b in times[i:]]


def choose_time_constants(
    bootstrap: ParametricBootstrap,
    estimator: Callable[[Tau], Callable[[Log], np.ndarray]],
    names: tuple[str, ...],
    progress: Callable[[str], None] = lambda text: None,
) -> TimeConstantChoice:
    """The pair of least error on replicas of the log; ``estimator`` gives for a pair the estimator (n,) of a log."""
    pairs = time_constant_pairs(bootstrap.log)
    methods, found = [estimator(tau) for tau in pairs], []
    timer = StepTimer(TIME_CONSTANT_REPLICAS)
    for number, log in enumerate(bootstrap.replicas(TIME_CONSTANT_REPLICAS)):
        progress(f"time constants: replica {number + 1} of {TIME_CONSTANT_REPLICAS}{timer.left_text(number)}")
        found.append([method(log) for method in methods])
    known = np.where(bootstrap.estimate == 0.0, np.nan, bootstrap.estimate)
    relative = 100.0 * (np.array(found) / known - 1.0)  # (replicas, pairs, n)
    bias, spread = relative.mean(axis=0), relative.std(axis=0, ddof=1)
    rows = tuple(_evaluated_pair(tau, names, b, s) for tau, b, s in zip(pairs, bias, spread, strict=True))
    best = min(rows, key=lambda r: r.score)
    return TimeConstantChoice(rows, (best.tau1, best.tau2), choice_text(rows, best), bootstrap.against, len(found))


def _evaluated_pair(tau: Tau, names: tuple[str, ...], bias: np.ndarray, spread: np.ndarray) -> TimeConstantPair:
    named = [dict(zip(names, map(float, values), strict=True)) for values in (bias, spread)]
    return TimeConstantPair(*tau, named[0], named[1], capped_rms_percent(np.hypot(bias, spread)))


def choice_text(rows: tuple[TimeConstantPair, ...], best: TimeConstantPair) -> str:
    """Errors of the chosen pair, and for comparison of the smallest and largest time constants, in two sentences."""
    alike = [r for r in rows if r.tau1 == r.tau2]
    small, large = alike[0], alike[-1]
    return (f"With τ = {best.tau1:g}, {best.tau2:g} s the parameters are off by {best.bias:.2g} % through bias and "
            f"{best.spread:.2g} % through spread (root mean square over the parameters, none above 100 %). "
            f"At {small.tau1:g} s it is {small.bias:.2g} % and {small.spread:.2g} %, "
            f"at {large.tau1:g} s {large.bias:.2g} % and {large.spread:.2g} %.")  # fmt: skip


def save_error_maps(guide: TimeConstantChoice, path: Path) -> None:
    """Write a picture of total error, bias and spread over both time constants; raises Failure where it cannot be."""
    import_configured("matplotlib")  # imported late: it takes long to load
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4.4), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    for axis, (title, name) in zip(axes, (("error", "score"), ("bias", "bias"), ("spread", "spread")), strict=True):
        times, values = _error_grid(guide, name)
        levels = np.log10(np.clip(values, 0.01, 100.0))
        mesh = axis.pcolormesh(np.arange(len(times)), np.arange(len(times)), levels, cmap="viridis", vmin=-2, vmax=2)
        _label(axis, times, values, title, guide.chosen)
    axes[0].set_ylabel("τ2 [s]")
    bar = figure.colorbar(mesh, ax=axes, ticks=[-2, -1, 0, 1, 2], label="% of the parameters, root mean square")
    bar.ax.set_yticklabels(["0.01", "0.1", "1", "10", "100"])
    picture = io.BytesIO()
    try:
        figure.savefig(picture, format=path.suffix[1:], dpi=130)
    except ValueError as error:
        raise Failure(f"{path} must be a picture that can be written, such as taus.png: {error}.") from None
    write_bytes(path, picture.getvalue())


def _error_grid(guide: TimeConstantChoice, name: str) -> tuple[list[float], np.ndarray]:
    """Time constants, and a value of the pairs as (τ2, τ1), NaN below the diagonal."""
    times = sorted({r.tau1 for r in guide.rows})
    values = np.full((len(times), len(times)), np.nan)
    for row in guide.rows:
        values[times.index(row.tau2), times.index(row.tau1)] = getattr(row, name)
    return times, values


def _label(axis, times: list[float], values: np.ndarray, title: str, chosen: Tau) -> None:
    for (j, i), value in np.ndenumerate(values):
        if np.isfinite(value):
            axis.text(i, j, f"{value:.2g}", ha="center", va="center", fontsize=7, color="w" if value < 8 else "k")
    axis.plot(times.index(chosen[0]), times.index(chosen[1]), "s", ms=26, mfc="none", mec="r", mew=2)
    ticks = [f"{t:g}" for t in times]
    axis.set_xticks(range(len(times)), ticks, rotation=45)
    axis.set_yticks(range(len(times)), ticks)
    axis.set(title=title, xlabel="τ1 [s]")
