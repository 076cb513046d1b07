"""Rows: the shooting fit, sensitivities, the search among candidates and the whole diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import combinations
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from derive.parameter_name import MISSING_FORCE, effect_of
from wheelpend.api import diagnose, explain
from wheelpend.benchmarks.speed.environment import peer
from wheelpend.benchmarks.speed.record import Times
from wheelpend.benchmarks.speed.regression import FILTER_TIME_CONSTANTS_S
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.benchmarks.speed.simulation import MAX_STEP_S, c_closed_loop, generated_closed_loop
from wheelpend.benchmarks.speed.timing import best_in_turn, timed
from wheelpend.diagnosis.pair_search import search_pairs
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.simulation.hidden import machine_values

FIT_LOG_DURATION_S = 60.0  # s, the log of the shooting fit
SEGMENT_DURATION_S = 0.25  # s, short enough to start from nominal values at once
FOLD_COUNT = 10  # of the cross-validation
REFITTED_CANDIDATE_COUNT = 4  # candidates that are refitted from the data; all would take minutes
HIDDEN_EFFECTS = {"coulomb_drive": 0.3}  # V, what the diagnosis is to find
EXPLAINED_EFFECTS = HIDDEN_EFFECTS | {"actuator_delay": 0.004}  # V and s, what is to be explained


def fit_against_simulation(s: Setting) -> Times:
    """Fit 7 parameters and all initial states to 60 s, from nominal values, against one C simulation of 60 s."""
    problem = prepare(s.model, [s.log(FIT_LOG_DURATION_S)], use_all=True, horizon=SEGMENT_DURATION_S)
    run = partial(fit_segments, problem, problem.data.estimation, known_values(s.model), problem.base, rounds=40)
    fitted = run()
    if not (fitted.converged and fitted.error < 1.1 * problem.floor):
        raise Failure(f"The fit must reach the noise, but its error is {fitted.error:g}.")
    return Times(
        *best_in_turn(timed(run, perf_counter), timed(c_closed_loop(s.loop(FIT_LOG_DURATION_S))[0], perf_counter))
    )


def sensitivities_against_simulation(s: Setting) -> Times:
    """20 s with the derivatives in every parameter of the library, against one C simulation of 20 s."""
    loop, module = s.loop(), s.library
    voltage = generated_closed_loop(s, loop)()[2]
    parameters = kernel_parameters(module, machine_values(s.model, {}), s.log())
    columns = np.arange(module.FITTED)
    run = partial(module.sensitivities, loop.t, voltage, loop.state, parameters, columns, MAX_STEP_S)
    if not np.isfinite(run()[2]).all():
        raise Failure("Sensitivities must be finite numbers.")
    return Times(*best_in_turn(timed(run), timed(c_closed_loop(loop)[0])))


class Columns(NamedTuple):
    """A regression with the columns of every effect."""

    phi: np.ndarray  # (rows, n)
    tau: np.ndarray  # (rows,)
    own: tuple[int, ...]  # the model's columns
    further: tuple[tuple[int, ...], ...]  # candidates: one or two columns beside the model's


def search_against_refits(s: Setting) -> Times:
    """All single effects and pairs, cross-validated from stored Gram matrices, against refits from the data."""
    columns = library_columns(s)
    grams = fold_grams(columns)
    search_in_grams(grams, columns)
    run = partial(search_in_grams, grams, columns)
    chosen = [
        columns.further[k] for k in np.linspace(0, len(columns.further) - 1, REFITTED_CANDIDATE_COUNT).astype(int)
    ]
    begin = process_time()
    for places in chosen:
        refit(columns, places)
    each = (process_time() - begin) / REFITTED_CANDIDATE_COUNT
    return Times(best_in_turn(timed(run))[0], each * len(columns.further))


def search_in_grams(grams: np.ndarray, columns: Columns) -> np.ndarray:
    """Validation sum of squares of each candidate, by the search in stored Gram matrices."""
    places = [list(further) for further in columns.further if len(further) == 1]
    found = search_pairs(grams, len(columns.own), places)
    return np.concatenate([found.singles, found.pairs[np.triu_indices(len(places), 1)]])


def refit(columns: Columns, further: Sequence[int]) -> float:
    """Validation sum of squares of one candidate, fitted to the data anew for each fold."""
    phi = np.ascontiguousarray(columns.phi[:, [*columns.own, *further]])
    squares = 0.0
    for validation in folds(len(columns.tau)):
        estimate = np.linalg.lstsq(phi[~validation], columns.tau[~validation])[0]
        squares += float(((columns.tau[validation] - phi[validation] @ estimate) ** 2).sum())
    return squares


def fold_grams(columns: Columns) -> np.ndarray:
    """[phi tau]ᵀ[phi tau] of every fold, (FOLD_COUNT, n + 1, n + 1)."""
    whole = np.column_stack([columns.phi, columns.tau])
    return np.array([whole[fold].T @ whole[fold] for fold in folds(len(whole))])


def folds(rows: int) -> list[np.ndarray]:
    """Masks (rows,) of the validation rows of each fold: contiguous blocks."""
    number = np.arange(rows) * FOLD_COUNT // rows
    return [number == k for k in range(FOLD_COUNT)]


def library_columns(s: Setting) -> Columns:
    """The filtered regressor of a 20 s log with every effect that is linear in its sizes."""
    module, log = s.library, s.log(**HIDDEN_EFFECTS)
    states, parameters = measured_states(module, log), kernel_parameters(module, machine_values(s.model, {}), log)
    tau, phi = module.filter_regressor(
        log.t, states, log.voltage, parameters, *FILTER_TIME_CONSTANTS_S, True, states[0]
    )
    own = tuple(k for k, name in enumerate(module.LINEAR) if not effect_of(name))
    others = [k for k, name in enumerate(module.LINEAR) if effect_of(name) not in ("", MISSING_FORCE)]
    further = (*combinations(others, 1), *combinations(others, 2))
    return Columns(phi.reshape(-1, phi.shape[2]), tau.ravel(), own, further)


def explanation_against_diagnosis(s: Setting) -> Times:
    """Explaining a 20 s log by two effects, against the diagnosis of one with the first of them."""
    log, simpler = s.log(**EXPLAINED_EFFECTS), s.log(**HIDDEN_EFFECTS)
    run = partial(explain, s.model, [log])
    if (found := {step.effect for step in run().steps}) != set(EXPLAINED_EFFECTS):
        raise Failure(f"Both hidden effects must be added, but {', '.join(sorted(found)) or 'nothing'} was.")
    return Times(
        *best_in_turn(
            timed(run, perf_counter), timed(partial(diagnose, s.model, [simpler]), perf_counter), min_rounds=2
        )
    )


def diagnosis_against_pysindy(s: Setting) -> Times:
    """The whole diagnosis of a 20 s log, against one sparse regression as large as it."""
    log, rng = s.log(**HIDDEN_EFFECTS), np.random.default_rng(0)
    run = partial(diagnose, s.model, [log])
    if (verdict := run().verdict) != "effect_missing":
        raise Failure(f"The diagnosis must find what is hidden, but its verdict is {verdict}.")
    columns, sides = rng.normal(size=(len(log), s.library.FITTED)), rng.normal(size=(len(log), s.library.NQ))
    with peer(s.peers, "pysindy", columns=columns, sides=sides) as (contender, _):
        return Times(*best_in_turn(timed(run, perf_counter), contender, min_rounds=2))
