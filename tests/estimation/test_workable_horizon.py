"""The longest horizon over which a model can be simulated."""

import pytest

from wheelpend import Model, simulate
from wheelpend.errors import NotSimulable, TooShort
from wheelpend.estimation import workable_horizon
from wheelpend.estimation.data import prepare


@pytest.fixture(scope="module")
def log():
    return simulate(Model.default(), duration=4.0, seed=3)


def asked_over(log, works, monkeypatch):
    """Horizons that were tried, and the problem that worked."""
    monkeypatch.setattr(workable_horizon, "best_start", lambda problem: (problem, {}))
    tried, said = [], []

    def attempt(problem, start):
        tried.append(problem.horizon)
        if problem.horizon > works:
            raise NotSimulable("over so long")
        return problem

    def prepared(horizon):
        return prepare(Model.default(), log, horizon=horizon, lean=True)

    try:
        return tried, said, workable_horizon.over_workable_horizon(prepared, attempt, said.append)
    except NotSimulable:
        return tried, said, None


def test_it_is_halved_until_it_works_and_that_is_said(log, monkeypatch):
    tried, said, problem = asked_over(log, 0.2, monkeypatch)
    assert tried == [0.5, 0.25, 0.125] and problem.horizon == 0.125
    assert "over 0.125 s" in problem.warnings[-1] and any("trying 0.25 s" in line for line in said)


def test_where_the_usual_one_works_nothing_is_said(log, monkeypatch):
    tried, _, problem = asked_over(log, 0.5, monkeypatch)
    assert tried == [0.5] and not any("so that errors" in w for w in problem.warnings)


def test_a_model_that_follows_no_log_over_a_tenth_of_a_second_is_a_failure(log, monkeypatch):
    tried, _, problem = asked_over(log, 0.01, monkeypatch)
    assert problem is None and tried == [0.5, 0.25, 0.125]


def test_logs_too_short_for_the_usual_horizon_are_judged_over_a_shorter_one(log, monkeypatch):
    short = log.part(0, 240)
    tried, said, problem = asked_over(short, 0.5, monkeypatch)
    assert tried == [problem.horizon] and problem.horizon < 0.5
    assert "too short to be judged over 0.5 s" in problem.warnings[-1] and any("trying 0.25 s" in line for line in said)
    with pytest.raises(TooShort, match="uninterrupted stretch"):
        asked_over(log.part(0, 60), 0.5, monkeypatch)
