"""Where an event is placed, and how large it is said to be, on a short log with a push."""

from dataclasses import replace

import numpy as np
import pytest

import derive
from tests.support import X
from wheelpend import Model, simulate
from wheelpend.diagnosis.events import (
    EventCandidate,
    EventInformation,
    find_events,
    fit_at_event_times,
    locate_event,
    refine_event_times,
)
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout

PUSH = {"external_push.start": 2.5, "external_push.end": 3.3, "external_push.torque": 0.2}


@pytest.fixture(scope="module")
def pushed():
    """The problem of a log with a push, and the fit of the true machine, which knows of none."""
    log = simulate(Model.default(), duration=6.0, sample=0.002, hide=PUSH, seed=2)
    problem = replace(prepare(Model.default(), [log], use_all=True), max_step=0.002)
    return problem, fit_segments(problem, problem.data.estimation, X, (), rounds=5)


def test_a_push_is_located_and_sized_from_one_linearisation(pushed):
    problem, fitted = pushed
    found = locate_event(problem, fitted, {}, derive.effects.find("external_push"), 0)
    assert found.start["external_push.start"] == pytest.approx(2.5, abs=0.1)
    assert found.start["external_push.end"] == pytest.approx(3.3, abs=0.1)
    assert found.start["external_push.torque"] == pytest.approx(0.2, rel=0.2)
    assert found.trials == 59 * 60 // 2  # of segments of a tenth of a second, after the first 0.15 s


def test_an_expected_gain_is_what_the_sum_of_squares_falls_by_in_variances_of_the_residual(pushed):
    problem, fitted = pushed
    found = locate_event(problem, fitted, {}, derive.effects.find("external_push"), 0)
    short = replace(problem, horizon=0.2 * problem.horizon)
    segments = prepare(Model.default(), problem.logs, use_all=True, horizon=short.horizon).data.estimation
    without, with_it = (fit_segments(problem, segments, {**X, **more}, (), rounds=5) for more in ({}, PUSH))
    variance = max(without.cost / without.count, 1.0)
    assert found.gain * variance == pytest.approx(without.cost - with_it.cost, rel=0.2)
    assert variance > 1.0 and find_events(problem, fitted, fitted.error)[0].effect.name == "external_push"


def test_own_parameters_are_refitted_beside_an_event():
    rng = np.random.default_rng(0)
    rows, event = rng.normal(size=(8, 50, 2)), rng.normal(size=(8, 50))
    right = 3.0 * event * (np.arange(8) >= 4)[:, None] + rng.normal(size=(8, 50)) + rows @ [1.0, -1.0]
    columns, layout = np.dstack([rows, event]), ParameterLayout.of(map(FreeParameter, "abc"), 1)
    information, score = np.einsum("srk,srl->skl", columns, columns), np.einsum("srk,sr->sk", columns, right)
    segments = NormalEquations(layout, information, score, (right**2).sum(axis=1))
    pull, weight = EventInformation(segments, 1.0).between(np.array([4]), np.array([8]))
    matrix = np.column_stack([(event * (np.arange(8) >= 4)[:, None]).ravel(), rows.reshape(-1, 2)])
    size, *_ = np.linalg.lstsq(matrix, right.ravel(), rcond=None)[0]
    assert pull[0] / weight[0] == pytest.approx(size)
    assert 1.0 / weight[0] == pytest.approx(np.linalg.inv(matrix.T @ matrix)[0, 0])


def test_a_moment_is_placed_between_two_samples_and_within_one_of_where_it_was(pushed):
    problem, fitted = pushed
    near = {"external_push.start": 2.45, "external_push.end": 3.34, "external_push.torque": 0.2}
    candidate = EventCandidate(derive.effects.find("external_push"), 0, near, 1.0, 1, {})
    begun = fit_at_event_times(problem, fitted, candidate, ())
    found = refine_event_times(problem, problem.data.estimation, begun, candidate).of_log(0)
    for name in ("external_push.start", "external_push.end"):
        samples = found[name] / 0.002
        assert abs(samples - np.floor(samples) - 0.5) < 1e-6
        assert found[name] == pytest.approx(PUSH[name], abs=0.02)
    assert found["external_push.torque"] == pytest.approx(0.2, rel=0.05)
