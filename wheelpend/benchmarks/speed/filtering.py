"""Rows: one pass of the filter of the filter-error method, and the whole fit beside the shooting fit."""

from __future__ import annotations

from functools import partial
from time import perf_counter
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.speed.record import Times
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.benchmarks.speed.simulation import c_closed_loop
from wheelpend.benchmarks.speed.timing import best_in_turn, timed
from wheelpend.errors import Failure
from wheelpend.estimation.data import prepare
from wheelpend.estimation.filter_error import FilterProblem
from wheelpend.estimation.random_source import Sources, possible_forces
from wheelpend.identification.filter_error_method import filter_estimator
from wheelpend.identification.identify import identify
from wheelpend.simulation.hidden import machine_values

FORCE_RMS_V, FORCE_TIME_S = 0.01, 0.1  # of the random force in the drive
FIT_LOG_DURATION_S = 60.0  # s
MAX_DEVIATION_SIGMAS = 5.0  # standard errors between a fit and the machine's values


class FilterWork(NamedTuple):
    """Filters along a log of 20 s, at the machine's values."""

    problem: FilterProblem
    theta: np.ndarray  # (free,)
    sources: list[Sources]


def filter_work(s: Setting) -> FilterWork:
    """A filter with one random force, in the drive, whose innovations are as large as it says."""
    problem, values = prepare(s.model, [s.log()], use_all=True, lean=True), machine_values(s.model, {})
    filters = filter_estimator(problem, values)[0].problem
    forces = {f.place: f for f in possible_forces(problem.plant, filters.module.NY)}
    work = FilterWork(filters, filters.space.start(), [(forces["drive"].with_noise(FORCE_RMS_V, FORCE_TIME_S),)])
    squares = sum(run.gram[:, -1, -1].sum() for run in filters.run(work.theta, work.sources))
    if not 0.8 < squares / filters.count < 1.1:
        raise Failure(f"Whitened innovations must have a mean square of 1, but it is {squares / filters.count:g}.")
    return work


def filter_against_simulation(s: Setting) -> Times:
    """One pass of the filter along 20 s, without sensitivities, against one C simulation of 20 s."""
    work = filter_work(s)
    return against_simulation(s, partial(work.problem.deviances, work.theta, work.sources))


def gradient_against_simulation(s: Setting) -> Times:
    """One pass of the filter along 20 s, linearised in the seven parameters, against one C simulation of 20 s."""
    work = filter_work(s)
    return against_simulation(s, partial(work.problem.run, work.theta, work.sources))


def against_simulation(s: Setting, run: partial) -> Times:
    """Time of a pass along 20 s, and of one C simulation of 20 s."""
    return Times(*best_in_turn(timed(run), timed(c_closed_loop(s.loop())[0])))


def filter_fit_against_shooting(s: Setting) -> Times:
    """The whole identification from a log of 60 s by the filter-error method, against that by shooting."""
    log, truth = s.log(FIT_LOG_DURATION_S), machine_values(s.model, {})
    ours, other = (partial(identify, s.model, [log], method=name) for name in ("filter_error", "shooting"))
    for found in (ours(), other()):
        worst = max(abs(row.value - truth[n]) / row.sigma for n, row in found.parameters.items())
        if not worst < MAX_DEVIATION_SIGMAS:
            raise Failure(f"A fit must find the machine, but {found.method} is {worst:.3g} standard errors off.")
    return Times(*best_in_turn(timed(ours, perf_counter), timed(other, perf_counter)))
