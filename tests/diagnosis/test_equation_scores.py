"""What a regression of the filtered equations tells of effects that a fit of the model as it is has lost sight of."""

from dataclasses import replace

import pytest

from tests.diagnosis.test_steps_from_rest import DAMPING, FRICTION, MASS, step_log
from wheelpend import Model
from wheelpend.diagnosis.equation_scores import equation_scores, leading_by_equations
from wheelpend.estimation.data import prepare
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.restrictions import Restrictions

ASTRAY = {"X1": 1e6}  # of a fit that takes the motor's constant speed for the coasting of an endless mass


@pytest.fixture(scope="module")
def problem() -> EstimationProblem:
    logs = [step_log(6.0, 0, 0.2), step_log(3.0, 1, 0.2), step_log(-6.0, 2, 0.2)]
    return prepare(Model.parse('plant = "slide"\n'), logs, use_all=True)


def test_a_regression_finds_viscous_friction_and_the_mass_wherever_the_fit_ended(problem):
    scores = equation_scores(problem, ASTRAY)
    first = next(iter(scores.values()))
    assert first.effect.name == "viscous_drive" and 0.0 < first.share < 0.2
    assert first.rest()["X1"] == pytest.approx(MASS, rel=0.4)  # dry friction is missing beside it
    assert first.size()["viscous_drive.coefficient"] == pytest.approx(DAMPING + FRICTION / 2.0, rel=0.2)
    assert list(leading_by_equations(scores)) == list(scores)[:3]
    assert list(scores) == sorted(scores, key=lambda name: scores[name].share)


def test_beside_what_the_model_has_dry_friction_leaves_next_to_nothing_and_all_sizes_are_right(problem):
    scores = equation_scores(problem.with_effects(["viscous_drive"]), {**ASTRAY, "viscous_drive.coefficient": 0.0})
    found = scores["coulomb_drive"]
    assert 0.0 < found.share < 0.1
    assert found.values["X1"] == pytest.approx(MASS, rel=0.1)
    assert found.values["viscous_drive.coefficient"] == pytest.approx(DAMPING, rel=0.02)
    assert found.values["coulomb_drive.torque"] == pytest.approx(FRICTION, rel=0.02)


def test_friction_that_grows_with_the_load_is_not_scored_since_it_balances_any_input(problem):
    assert "load_friction" not in equation_scores(problem, ASTRAY)


def test_what_is_fixed_stays(problem):
    fixed = replace(problem, restrictions=Restrictions({"X1": 2 * MASS}))
    found = equation_scores(fixed, {"X1": 2 * MASS})["viscous_drive"]
    assert "X1" not in found.values and found.values["viscous_drive.coefficient"] == pytest.approx(2.5, rel=0.2)
