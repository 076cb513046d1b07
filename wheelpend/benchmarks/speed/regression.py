"""Rows: filtered regression over many samples, and recursive least squares."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.speed import reference
from wheelpend.benchmarks.speed.environment import peer
from wheelpend.benchmarks.speed.record import NotMeasurableError, Times
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.benchmarks.speed.simulation import generated_closed_loop
from wheelpend.benchmarks.speed.timing import best_in_turn, timed
from wheelpend.isolation import import_configured
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S

LOG_SAMPLE_COUNT = 10_000_000
SCIPY_SAMPLE_COUNT = 1_000_000  # for SciPy, which keeps every signal
FILTER_TIME_CONSTANTS_S = (2.25, 6.5)  # s, the paper's
INITIAL_INFORMATION = 1e-3  # one over the parameters' variance before the first row


class Measurement(NamedTuple):
    """A log that begins at rest, one sample every SAMPLE_INTERVAL_S."""

    t: np.ndarray  # (N,)
    states: np.ndarray  # (N, NX)
    voltage: np.ndarray  # (N,)


# ---- filtered regression


def gram_against_c(s: Setting) -> Times:
    """The Gram matrix of the filtered regression, per sample, against the same in one C loop."""
    log = measurement(s, LOG_SAMPLE_COUNT)
    mine, run = gram_of(s, log)
    theirs, work = gram_in_c(log)
    run()
    work()
    require_agreement("filtered regression", mine, theirs)
    return Times(*best_in_turn(timed(run), timed(work))).per(LOG_SAMPLE_COUNT)


def gram_against_reading(s: Setting) -> Times:
    """The same, per sample, against a C loop that only adds up states and voltage."""
    log = measurement(s, LOG_SAMPLE_COUNT)
    _, run = gram_of(s, log)
    sums = [reference.call("total", x.size, x) for x in (log.states, log.voltage)]
    return Times(*best_in_turn(timed(run), timed(lambda: [total() for total in sums]))).per(LOG_SAMPLE_COUNT)


def gram_against_scipy(s: Setting) -> Times:
    """The same, per sample, against NumPy and scipy.signal.lfilter on fewer samples."""
    log, fewer = measurement(s, LOG_SAMPLE_COUNT), measurement(s, SCIPY_SAMPLE_COUNT)
    _, run = gram_of(s, log)
    problem = {
        "states": fewer.states,
        "voltage": fewer.voltage,
        "h": np.array(SAMPLE_INTERVAL_S),
        "tau": np.array(FILTER_TIME_CONSTANTS_S),
    }
    with peer(s.peers, "scipy", **problem) as (contender, result):
        theirs, work = gram_in_c(fewer)
        work()
        require_agreement("filtered regression by SciPy", result.reshape(theirs.shape), theirs, 1e-6)
        mine, other = best_in_turn(timed(run), contender)
    return Times(mine / LOG_SAMPLE_COUNT, other / SCIPY_SAMPLE_COUNT)


def gram_of(s: Setting, log: Measurement) -> tuple[np.ndarray, Callable[[], object]]:
    """Gram matrix (n + 1, n + 1), and the function that fills it by the kernel filtered_gram."""
    kernel = getattr(s.lean, "filtered_gram", None)
    if kernel is None:
        raise NotMeasurableError("the generated module has no filtered_gram")
    size = len(s.lean.LINEAR) + 1
    gram, memory, weights = (
        np.zeros((size, size)),
        s.lean.filter_memory(),
        s.lean.filter_weights(SAMPLE_INTERVAL_S, *FILTER_TIME_CONSTANTS_S),
    )

    def run() -> None:
        gram[:] = 0.0
        s.lean.filter_start(log.t[0], log.states[0], log.voltage[0], s.parameters, weights, memory)
        kernel(log.t, log.states, log.voltage, s.parameters, *FILTER_TIME_CONSTANTS_S, True, memory, gram)

    return gram, run


def gram_in_c(log: Measurement) -> tuple[np.ndarray, Callable[[], object]]:
    """Gram matrix (8, 8), and the C function that fills it."""
    gram = np.zeros((8, 8))
    return gram, reference.call(
        "filtered_gram", len(log.t), SAMPLE_INTERVAL_S, log.states, log.voltage, *FILTER_TIME_CONSTANTS_S, gram
    )


def require_agreement(
    what: str, ours: np.ndarray, theirs: np.ndarray, tolerance: float = reference.RELATIVE_TOLERANCE
) -> None:
    """Raise Failure unless two Gram matrices agree, their columns scaled to unit length."""
    length = np.sqrt(np.diag(theirs))
    reference.require_agreement(what, ours, theirs, np.outer(length, length), tolerance)


def measurement(s: Setting, samples: int) -> Measurement:
    """So many samples of the closed loop from rest."""
    loop = s.loop(samples * SAMPLE_INTERVAL_S)
    states, _, voltage = generated_closed_loop(s, loop)()
    return Measurement(loop.t[:samples], states[:samples], voltage[:samples])


# ---- recursive least squares


class Rows(NamedTuple):
    """Rows of a regression."""

    phi: np.ndarray  # (rows, n)
    tau: np.ndarray  # (rows,)


def recursion_against_c(s: Setting) -> Times:
    """Recursive least squares, per update, against plain loops in C."""
    rows = regression_rows(s)
    mine, run = recursion_of(s, rows)
    theirs, work = recursion_in_c(rows)
    run()
    work()
    reference.require_agreement("recursive least squares", mine, theirs, np.abs(theirs).max())
    return Times(*best_in_turn(timed(run), timed(work))).per(len(rows.tau))


def recursion_against_padasip(s: Setting) -> Times:
    """The same, per update, against padasip."""
    rows = regression_rows(s)
    mine, run = recursion_of(s, rows)
    with peer(s.peers, "padasip", **rows._asdict(), eps=np.array(INITIAL_INFORMATION)) as (contender, result):
        run()
        reference.require_agreement("recursive least squares by padasip", mine, result, np.abs(result).max(), 1e-6)
        return Times(*best_in_turn(timed(run), contender)).per(len(rows.tau))


def recursion_of(s: Setting, rows: Rows) -> tuple[np.ndarray, Callable[[], object]]:
    """Estimate (n,), and the function that fills it: the generated update, called from a compiled loop."""
    njit, update = import_configured("numba").njit, s.lean.recursive_update

    @njit
    def over_rows(phi, tau, estimate, covariance):
        for k in range(tau.size):
            update(estimate, covariance, phi[k], tau[k], 1.0)

    return _with_reset(rows, partial(over_rows, *rows))


def recursion_in_c(rows: Rows) -> tuple[np.ndarray, Callable[[], object]]:
    """Estimate (n,), and the C function that fills it."""
    return _with_reset(rows, lambda *now: reference.call("recursive", len(rows.tau), *rows, 1.0, *now)())


def _with_reset(rows: Rows, work: Callable[..., object]) -> tuple[np.ndarray, Callable[[], object]]:
    n = rows.phi.shape[1]
    estimate, covariance = np.zeros(n), np.eye(n)

    def run() -> None:
        estimate[:], covariance[:] = 0.0, np.eye(n) / INITIAL_INFORMATION
        work(estimate, covariance)

    return estimate, run


def regression_rows(s: Setting) -> Rows:
    """Filtered rows of the closed loop, one equation after the other at each sample."""
    log = measurement(s, len(s.loop().t))
    tau, phi = s.lean.filter_regressor(
        log.t, log.states, log.voltage, s.parameters, *FILTER_TIME_CONSTANTS_S, True, log.states[0]
    )
    return Rows(np.ascontiguousarray(phi.reshape(-1, phi.shape[2])), tau.ravel())
