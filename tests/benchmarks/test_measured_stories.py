"""The stories of the free pendulum, the servo and the arm: their judges on the measured logs, and the servo's pairs."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support import DATA
from wheelpend import Model, explain, simulate
from wheelpend.benchmarks.measured import pairs
from wheelpend.benchmarks.measured.__main__ import CASE_STUDIES, app
from wheelpend.benchmarks.measured.arm import ARM_LOG, ARM_MODEL, DRY_FRICTION, VISCOUS_PARAMETERS
from wheelpend.benchmarks.measured.pairs import PairAnswer, pair_texts, study_pairs
from wheelpend.benchmarks.measured.pendulum import DECAY_LOG, PENDULUM_MODEL, fitted_to_free_run
from wheelpend.benchmarks.measured.rungs import FittedModel, course_text, fitted_models, goal_text
from wheelpend.benchmarks.measured.servo_logs import ESTIMATION_LOGS, LOG_NAMES, VALIDATION_LOGS, log_pairs
from wheelpend.benchmarks.measured.torque import least_squares_values, log_halves, torque_error
from wheelpend.estimation.data import read_logs


def measured_log(name, model):
    if not (DATA / name).exists():
        pytest.skip("the measured logs are not here")
    return read_logs([DATA / name], model)[0]


# ---- the judges on the measured logs, whose figures were found without this project


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "error"),
    [
        (("viscous_drive",), 0.028),
        (("coulomb_drive", "quadratic_drive"), 0.0077),
        (("viscous_drive", "coulomb_drive", "quadratic_drive"), 0.0029),
    ],
)
def test_free_runs_of_the_pendulum_come_as_near_as_they_can(effects, error):
    model = Model.parse(PENDULUM_MODEL)
    judged = fitted_to_free_run(FittedModel("", model, {"X1": 0.0156}), effects, measured_log(DECAY_LOG, model))
    assert judged.error == pytest.approx(error, rel=0.02)
    assert (judged.fitted.values.get("viscous_drive.coefficient", 0.0) < 0.0) == (len(effects) == 3)


@pytest.mark.parametrize(
    ("effects", "without", "error"), [((), VISCOUS_PARAMETERS, 15.1), ((), (), 9.8), (DRY_FRICTION, (), 6.7)]
)
def test_torques_of_the_arm_behind_five_hertz_are_known_from_least_squares(effects, without, error):
    model = Model.parse(ARM_MODEL)
    module = FittedModel("", model.with_effects(effects), {}).module
    first, second = log_halves(measured_log(ARM_LOG, model))
    values = least_squares_values(module, first, without)
    assert torque_error(module, values, second) == pytest.approx(error, rel=0.05)
    assert values["X1"] + values["X3"] == pytest.approx(0.12, rel=0.1)


# ---- the servo's logs


def test_every_two_logs_of_different_trajectories_are_a_pair():
    found = log_pairs()
    assert len(set(map(frozenset, found))) == len(found) == 48
    assert all(one.rpartition("_")[0] != other.rpartition("_")[0] for one, other in found)
    assert {*ESTIMATION_LOGS, *VALIDATION_LOGS} == set(LOG_NAMES) and len(VALIDATION_LOGS) == 9


@pytest.fixture
def tried(monkeypatch):
    """Pairs that were explained, each as if the load's friction were found in it."""
    found = []

    def explained(data, pair):
        found.append(pair)
        return PairAnswer(pair, ("load_friction",), "unexplained", 100.0, 50.0, 1.0)

    monkeypatch.setattr(pairs, "explained_pair", explained)
    monkeypatch.setattr(pairs, "code_fingerprint", lambda: "now")
    return found


def test_a_study_of_pairs_goes_on_where_it_was_interrupted(tried, tmp_path):
    assert len(study_pairs(Path(), tmp_path, limit=3, progress=lambda line: None)) == 3
    assert len(study_pairs(Path(), tmp_path, limit=2, progress=lambda line: None)) == 5
    assert tried == log_pairs()[:5] and len(list(tmp_path.glob("*.json"))) == 5
    assert len(study_pairs(Path(), tmp_path, minutes=0.0)) == 5 == len(tried)


def test_answers_of_another_state_of_the_code_are_made_anew(tried, tmp_path, monkeypatch):
    study_pairs(Path(), tmp_path, limit=1, progress=lambda line: None)
    monkeypatch.setattr(pairs, "code_fingerprint", lambda: "later")
    study_pairs(Path(), tmp_path, limit=1, progress=lambda line: None)
    assert tried == log_pairs()[:1] * 2


def test_pairs_are_counted_by_what_was_added_at_all_and_first(tmp_path):
    steps = [("load_friction",), ("coulomb_drive", "load_friction"), ("coulomb_drive",), ()]
    for number, found in enumerate(steps):
        answer = PairAnswer(("a", "b"), found, "unexplained", 9.0, 8.0, 1.0)
        (tmp_path / f"{number}.json").write_text(json.dumps({"code": "any", **answer.to_json()}), encoding="utf-8")
    text = pair_texts(tmp_path)["pairs"]
    assert "Of 48 pairs 4 were tried: `load_friction` is among the steps in 2, and the first of them in 1." in text
    assert "`unexplained` was said of `a` and `b`; `a` and `b`." in text
    assert "| `coulomb_drive` | 2 | 2 |" in text and "| nothing | 1 | – |" in text
    assert "None of the 48 pairs" in pair_texts(tmp_path / "elsewhere")["pairs"]


# ---- the command


def test_a_story_that_is_none_and_logs_that_are_not_there_are_said(tmp_path):
    wrong = CliRunner().invoke(app, ["--only", "servos", "--out", str(tmp_path)])
    assert (
        wrong.exit_code
        and "servo" in wrong.output
        and set(CASE_STUDIES) == {"emps", "robot", "pendulum", "servo", "arm"}
    )
    absent = CliRunner().invoke(app, ["--only", "arm", "--data", str(tmp_path), "--out", str(tmp_path)])
    assert absent.exit_code and "arm.md" in absent.output and not list(tmp_path.iterdir())


def test_a_goal_is_reached_or_not():
    assert goal_text(1.0, 1.0) == "it is reached" and goal_text(1.01, 1.0) == "it is not reached"


# ---- the rungs of a ladder


@pytest.mark.slow
def test_every_rung_of_a_ladder_has_its_effects_and_the_last_one_the_values_of_the_ladder():
    model = Model.default("slide")
    log = simulate(model, duration=10.0, hide={"viscous_drive": 0.6, "coulomb_drive": 0.5}, seed=1)
    found = explain(model, [log])
    rungs = fitted_models(found)
    assert [set(r.model.effects) - {s.effect for s in found.steps[:k]} for k, r in enumerate(rungs)] == [set()] * 3
    assert rungs[-1].values == {n: found.fit.values[n] for n in rungs[-1].values}
    assert rungs[-1].values["viscous_drive.coefficient"] == pytest.approx(0.6, rel=0.05)
    assert rungs[1].values != rungs[2].values and "`" in course_text(found)
