"""Gauss-Newton with Levenberg-Marquardt damping over several logs at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.fit_statistics import fit_at
from wheelpend.estimation.normal_equations import ReducedEquations
from wheelpend.estimation.shooting_problem import LinearisedPoint, ShootingProblem

MIN_COST_DECREASE = 0.01  # σ², decrease of the sum of squares that is not worth a step
MIN_RELATIVE_COST_DECREASE = 1e-6  # the same as a share of the sum of squares
MIN_EXCESS_COST_DECREASE = 5e-3  # the same as a share of what a wrong model leaves above twice the noise
ROUNDING_COST_INCREASE = 1e-9  # relative increase of the sum of squares that is rounding: the minimum is reached
START_DAMPING, MIN_DAMPING, MIN_RAISED_DAMPING, MAX_DAMPING = 1e-3, 1e-12, 1e-8, 1e6  # of the unit diagonal
MAX_REFUSED = 3  # steps in a row that raise the sum of squares, from which on it is asked whether segments are held
MAX_UNDAMPED = 0.01  # damping below which the undamped step's prediction holds


@np.errstate(over="ignore", invalid="ignore")  # a trial that diverges gives infinities, and is rejected
def fit(problem: ShootingProblem, *, states: Sequence[np.ndarray] | None = None, rounds: int = 40) -> Fit:
    """Fit θ and the initial states, from the problem's start and the given states (per log: (segments, NX)).

    Stops when a step lowers the sum of squares by less than 0.01 and a millionth of it, is predicted to, or can no
    longer lower it.
    """
    theta = problem.space.start()
    start = problem.linearise(theta, problem.start_states(theta) if states is None else list(states))
    return fit_at(problem, *levenberg_marquardt(problem, start, rounds))


def levenberg_marquardt(problem: ShootingProblem, point: LinearisedPoint, rounds: int) -> tuple[LinearisedPoint, bool]:
    """The point reached in at most so many rounds, and whether the iteration has converged there."""
    damping, refused = START_DAMPING, 0
    for _ in range(rounds):
        reduced = problem.reduce(point, damping)
        if not np.isfinite(point.cost) or not np.isfinite(reduced.total.information).all():
            return point, False  # the start cannot be simulated: there is no direction to take
        theta, states = _damped_step(problem, point, reduced, damping)
        if damping < MAX_UNDAMPED and problem.predicted_decrease(reduced) < _negligible_decrease(point.cost):
            return point._replace(theta=theta, states=states), True  # the last step is too small to be simulated
        trial = problem.linearise(theta, states)
        refused = 0 if trial.cost <= point.cost else refused + 1
        if refused >= MAX_REFUSED:
            trial = problem.with_settled_states(trial, point)
        if trial.cost <= point.cost:
            gain, point = point.cost - trial.cost, trial
            if gain >= _sufficient_decrease(point.cost, problem.count):
                damping = max(damping * 0.1, MIN_DAMPING)
            elif not refused:
                return point, True
            else:  # what was settled says nothing of how far the parameters could go
                damping = max(damping * 10.0, MIN_RAISED_DAMPING)
        else:
            if trial.cost - point.cost < ROUNDING_COST_INCREASE * point.cost:
                return point, True
            damping = max(damping * 10.0, MIN_RAISED_DAMPING)
            if damping > MAX_DAMPING:
                return point, False
    return point, False


def _damped_step(
    problem: ShootingProblem, point: LinearisedPoint, reduced: ReducedEquations, damping: float
) -> tuple[np.ndarray, list[np.ndarray]]:
    """θ and initial states after a step: the states' own one, and their response to that of θ."""
    theta = problem.space.after_step(point.theta, reduced.total, damping)
    step = theta - point.theta
    states = [
        x + eliminated.step - np.einsum("skx,k->sx", eliminated.response, step[places])
        for x, eliminated, places in zip(point.states, reduced.states, problem.space.layout.places, strict=True)
    ]
    return theta, problem.consistent_states(theta, states)


def _negligible_decrease(cost: float) -> float:
    """Decrease of the sum of squares below which a fit has converged."""
    return MIN_COST_DECREASE + MIN_RELATIVE_COST_DECREASE * cost


def _sufficient_decrease(cost: float, count: int) -> float:
    """The same after a step; a wrong model, whose residual is far above the noise, need not be exact."""
    return (
        MIN_COST_DECREASE + MIN_RELATIVE_COST_DECREASE * cost + MIN_EXCESS_COST_DECREASE * max(cost - 2.0 * count, 0.0)
    )
