"""Effects scored by regression: the filtered equations of motion with one effect more, the plant's parameters free.

Score tests and refits go on from a fit of the model as it is. Where that lacks a large effect, the fit may have gone so
far astray (a mass without end, for a motor that viscous friction holds at a constant speed) that no effect shows there
and no refit finds back. The filtered equations (paper eqs. 39, 40) are linear in the parameters of the plant and of
most effects, and a regression finds both from anywhere. Noise biases it, so it tells where refits begin, and no more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from derive.effects import DryForce, Effect
from wheelpend.estimation.linear_fit import triangular_factor
from wheelpend.estimation.nonnegative import MIN_PARAMETER_RATIO, SMALLEST_NORM, nonnegative_solution
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.regressor import acting_input, free_decay
from wheelpend.estimation.starts import MAX_START_SAMPLES, start_time_constants
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.load import released_coordinates
from wheelpend.logs.commands import longest_known_part
from wheelpend.logs.log import Log

MAX_DOUBLINGS = 12  # of what came out at zero, until it can be simulated
MAX_TRIED_SAMPLES = 2_000  # of a log, over which that is tried
LEADER_COUNT = 3  # effects that leave least of the equations, which are refitted whatever other scores say


class EquationScore(NamedTuple):
    """An effect, and what a regression with it comes to."""

    effect: Effect
    share: float  # of what the equations without it leave (rms), that they leave with it
    values: dict[str, float]  # of the linear parameters of the model and of the effect
    unknown: tuple[str, ...]  # parameters of the plant that came out at zero, where that cannot be simulated

    def size(self) -> dict[str, float]:
        """Values of the effect's own parameters."""
        return {n: self.values[n] for n in self.effect.full_names}

    def rest(self) -> dict[str, float]:
        """Values of the model's other parameters."""
        return {n: v for n, v in self.values.items() if n not in self.effect.full_names}


def equation_scores(problem: EstimationProblem, values: Mapping[str, float]) -> dict[str, EquationScore]:
    """Effects whose forces are linear in their parameters, by name, that which leaves least of the equations first.

    ``values`` are the model's parameters, whose linear ones are estimated anew. Of several time constants of the
    filters that counts behind which an effect does best. None where the model holds a coordinate that no sensor sees,
    or its logs are too short for a filter.
    """
    if released_coordinates(problem.model.effects):
        return {}
    effects = [e for e in problem.candidates() if _is_linear(problem, e)]
    names = _model_names(problem)
    found: dict[str, tuple[EquationScore, np.ndarray]] = {}  # with the norms of its columns
    for tau in start_time_constants(problem.logs[0]):
        root = _stacked_root(problem, values, tau)
        if root is None:
            continue
        left, _, _ = _regressed(problem, root, names)
        for effect in effects:
            rest, solution, norms = _regressed(problem, root, names, effect)
            share = rest / left if left > 0.0 else 1.0
            if effect.name not in found or share < found[effect.name][0].share:
                found[effect.name] = EquationScore(effect, share, solution, ()), norms
    scores = {name: _with_inertia(problem, one, norms) for name, (one, norms) in found.items()}
    return dict(sorted(scores.items(), key=lambda item: item[1].share))


def leading_by_equations(scores: Mapping[str, EquationScore]) -> dict[str, EquationScore]:
    """The effects that leave least of the equations, by name, as far as they leave less."""
    less = [(name, one) for name, one in scores.items() if one.share < 1.0]
    return dict(less[:LEADER_COUNT])


def _is_linear(problem: EstimationProblem, effect: Effect) -> bool:
    """True of a lasting effect all of whose parameters are linear, and the same in all logs.

    Not of friction that grows with the load: its regression balances the input, and leaves the plant nothing to do.
    """
    linear = set(problem.module.LINEAR)
    shared = all(p.scope == "shared" for p in effect.parameters)
    loaded = isinstance(effect.enters, DryForce) and effect.enters.loaded
    return shared and not effect.event and not effect.releases and not loaded and linear.issuperset(effect.full_names)


def _model_names(problem: EstimationProblem) -> list[str]:
    """Linear parameters of the model, but those that are fixed."""
    present = {*problem.base, *(n for e in problem.model.effects for n in problem.effect(e).full_names)}
    return [n for n in problem.module.LINEAR if n in present and n not in problem.restrictions.fixed]


def _stacked_root(
    problem: EstimationProblem, values: Mapping[str, float], tau: tuple[float, float]
) -> np.ndarray | None:
    """Triangular factor of the equations of all logs: a column per linear parameter, then what they add up to.

    What is fixed, and the free responses of the filters, are taken off. None where a number is not finite.
    """
    roots = []
    for segments in problem.data.estimation:
        log, _ = longest_known_part(segments.log.part(0, int(segments.bounds[-1, 1])))
        matrix = _equations(problem, log.part(0, min(len(log), MAX_START_SAMPLES)), values, tau)
        if not np.isfinite(matrix).all():
            return None
        roots.append(triangular_factor(matrix))
    return triangular_factor(np.concatenate(roots))


def _equations(
    problem: EstimationProblem, log: Log, values: Mapping[str, float], tau: tuple[float, float]
) -> np.ndarray:
    """Filtered equations (rows, linear parameters + 1) of a log, what is fixed on the right side."""
    module, fixed = problem.module, problem.restrictions.fixed
    parameters = kernel_parameters(module, values, log)
    states, inputs = measured_states(module, log), acting_input(module, log, parameters)
    sides, regressors = module.filter_regressor(log.t, states, inputs, parameters, *tau, True, states[0])
    known = [k for k, n in enumerate(module.LINEAR) if n in fixed]
    sides = sides - regressors[:, :, known] @ np.array([fixed[module.LINEAR[k]] for k in known])
    matrix = np.concatenate([regressors, sides[:, :, None]], axis=2).reshape(sides.size, -1)
    decay, _ = np.linalg.qr(free_decay(log.t, tau, module.NQ).reshape(sides.size, -1))
    return matrix - decay @ (decay.T @ matrix)


def _regressed(
    problem: EstimationProblem, root: np.ndarray, names: Sequence[str], effect: Effect | None = None
) -> tuple[float, dict[str, float], np.ndarray]:
    """What a regression leaves of the equations (rms), with one effect more where it is given; its solution; and the
    norms (n,) of its columns.
    """
    linear, added = problem.module.LINEAR, effect.full_names if effect else ()
    signed = [n in problem.module.SIGNED for n in names]
    signed += [p.minimum < 0.0 for p in effect.parameters] if effect else []
    columns = [*names, *added]
    chosen = root[:, [linear.index(n) for n in columns]]
    estimate, rest = nonnegative_solution(chosen, root[:, -1], np.array(signed, dtype=bool))
    return rest, dict(zip(columns, map(float, estimate), strict=True)), np.linalg.norm(chosen, axis=0)


def _can_be_simulated(problem: EstimationProblem, values: Mapping[str, float]) -> bool:
    """True of values with which the integrator follows a log without leaving the finite numbers."""
    module, log = problem.module, problem.logs[0].part(0, min(len(problem.logs[0]), MAX_TRIED_SAMPLES))
    parameters, start = kernel_parameters(module, values, log), measured_states(module, log)[0]
    try:
        states = module.simulate(log.t, log.known_voltage, start, parameters, problem.max_step)
    except ZeroDivisionError:  # a machine without inertia
        return False
    return bool(np.isfinite(states).all())


def _with_inertia(problem: EstimationProblem, one: EquationScore, lengths: np.ndarray) -> EquationScore:
    """A score in which parameters of the plant that came out at zero have a small share of what acts.

    Where it cannot be simulated without: so there is so much of them that the integrator follows the log with its
    steps. In a log of few samples friction stops a fast machine within each, and its inertia hardly shows.
    """
    found, signed = one.values, problem.module.SIGNED
    lost = tuple(n for n, v in found.items() if n in problem.base and n not in signed and v == 0.0)
    if not lost or _can_be_simulated(problem, found):
        return one
    norms = dict(zip(found, np.maximum(lengths, SMALLEST_NORM), strict=True))
    least = MIN_PARAMETER_RATIO * max(norms[n] * abs(v) for n, v in found.items())
    trials = [{**found, **{n: float(2.0**k * least / norms[n]) for n in lost}} for k in range(MAX_DOUBLINGS)]
    able = next((values for values in trials if _can_be_simulated(problem, values)), trials[0])
    return one._replace(values=able, unknown=lost)
