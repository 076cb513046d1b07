"""Starting values that only a log can give: the period of a ripple, a speed or a limit within the range of the log.

Such a parameter cannot be scored at the effect's absence: there it means nothing, as the period of a ripple without
amplitude, or it is infinite, as the limit of a saturation. So the likelihood is profiled over a grid of its values.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from derive.effects import INPUT_SIGNAL, Effect, EffectParameter, Quantiles, Ripple, Values
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.ripple_search import strongest_ripple
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import measured_states

RIPPLE_TIME_CONSTANTS_S = (0.01, 0.03)  # s, of the filters behind which a ripple is sought: a trade of noise for signal


class ProfileGrid(NamedTuple):
    """Values over which an effect's parameter is profiled."""

    settings: tuple[dict[str, float], ...]  # by effect.parameter
    trials: int  # number of independent trials that they amount to


def profile_grids(problem: EstimationProblem, fitted: Fit, effects: Iterable[Effect]) -> dict[str, ProfileGrid]:
    """Grids by effect, of those that have a parameter to be profiled, from the logs and a fit to them."""
    found = {}
    for effect in effects:
        parameter = effect.profiled
        if parameter is None or effect.event:
            continue
        grid = _grid_values(problem, fitted, parameter)
        if grid is not None:
            name = effect.name_of(parameter)
            found[effect.name] = ProfileGrid(tuple({name: v} for v in grid[0]), grid[1])
    return found


def _grid_values(problem: EstimationProblem, fitted: Fit, parameter: EffectParameter) -> tuple[list[float], int] | None:
    """Values of a parameter and the number of independent trials; None where it has no starts."""
    starts = parameter.starts
    if isinstance(starts, Quantiles):
        values = quantile_starts(problem, parameter, starts)
        return values, len(values)
    if isinstance(starts, Values):
        return list(starts.at), len(starts.at)
    if isinstance(starts, Ripple):
        ripples = [strongest_ripple(problem, fitted, starts.of, tau) for tau in RIPPLE_TIME_CONSTANTS_S]
        length_per_radian = problem.plant.port(starts.of).length_per_radian
        return list(dict.fromkeys(p / length_per_radian for p, _ in ripples)), sum(t for _, t in ripples)
    return None


def profiled_start_values(problem: EstimationProblem) -> dict[str, float]:
    """The middle grid value of each profiled parameter of the model's effects, from the first log."""
    found: dict[str, float] = {}
    for effect in map(problem.effect, problem.model.effects):
        parameter = effect.profiled
        if parameter is None:
            continue
        values: list[float] = []
        if isinstance(parameter.starts, Quantiles):
            values = quantile_starts(problem, parameter, parameter.starts)
        elif isinstance(parameter.starts, Values):
            values = list(parameter.starts.at)
        found |= {effect.name_of(parameter): v for v in values[len(values) // 2 :][:1]}
    return found


def quantile_starts(problem: EstimationProblem, parameter: EffectParameter, starts: Quantiles) -> list[float]:
    """Quantiles of the signal that the parameter is compared with in the equations, those above its lower bound."""
    size = magnitude(problem, problem.data.estimation[0], starts.of)
    values = [float(v) for v in np.quantile(size, starts.at)]
    return list(dict.fromkeys(v for v in values if v > max(parameter.minimum, 0.0)))


def magnitude(problem: EstimationProblem, segments: Segments, of: str) -> np.ndarray:
    """Absolute values of the input or of a port's speed, from the first to the last of some segments."""
    log, window = segments.log, slice(int(segments.bounds[0, 0]), int(segments.bounds[-1, 1]))
    if of == INPUT_SIGNAL:
        signal = log.voltage[window]
    else:
        states = measured_states(problem.module, log)[window]
        signal = states[:, problem.module.NQ :] @ problem.port_weights(of)
    return np.abs(signal[np.isfinite(signal)])


def null_values(problem: EstimationProblem, effect: Effect) -> dict[str, float]:
    """Sizes at which an effect does nothing on these logs, by effect.parameter.

    A limit does nothing from the largest value on that the logs reach. A stiffness k does nothing at infinity, and
    1/k is as many standard errors away from zero as k is.
    """
    table = {}
    for p in effect.sizes:
        of = p.starts.of if math.isinf(p.absent) and isinstance(p.starts, Quantiles) else None
        reached = max(float(magnitude(problem, s, of).max(initial=0.0)) for s in problem.data.estimation) if of else 0.0
        table[effect.name_of(p)] = reached
    return table
