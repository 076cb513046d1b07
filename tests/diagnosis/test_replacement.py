"""An effect takes the place of a simpler one in the model, and must add to it to be worth naming."""

from dataclasses import replace

import numpy as np
import pytest

import derive
from tests.support import simulated
from wheelpend import Model, add, diagnose
from wheelpend.diagnosis.evidence import added_p_value
from wheelpend.diagnosis.refit import replace_contained
from wheelpend.diagnosis.score_test import EffectSize
from wheelpend.estimation.data import prepare

RIGID = Model.default().with_effects(["coulomb_drive"])


@pytest.fixture(scope="module")
def elastic_log():
    """A log of a drive whose friction gives way before it slides."""
    return simulated(presliding_drive__torque=0.3, presliding_drive__stiffness=10.0)


def test_the_place_of_dry_friction_is_taken_with_its_size():
    problem = prepare(RIGID, [simulated(duration=4.0)])
    size = EffectSize({"presliding_drive.torque": 0.1, "presliding_drive.stiffness": 12.0}, {})
    rest, larger = replace_contained(
        problem, derive.effects.find("presliding_drive"), {"coulomb_drive.torque": 0.25}, size
    )
    assert rest["coulomb_drive.torque"] == 0.0
    assert larger.values == {"presliding_drive.torque": 0.25, "presliding_drive.stiffness": 12.0}


@pytest.mark.slow
def test_friction_that_gives_way_replaces_dry_friction_and_is_found_as_it_is(elastic_log):
    found = diagnose(RIGID, [elastic_log]).candidates[0]
    assert found.effect == "presliding_drive" and found.p_value < 0.01
    changed = add(RIGID, "presliding_drive", [elastic_log])
    assert changed.model.effects == ("presliding_drive",)
    size = changed.step.coefficients
    assert 0.27 < size["torque"] < 0.33 and 8.0 < size["stiffness"] < 12.0


def test_an_inner_parameter_that_is_not_known_adds_nothing(elastic_log):
    changed = add(RIGID, "presliding_drive", [elastic_log])
    problem, fitted = changed.problem, changed.after
    effect = problem.effect("presliding_drive")
    assert added_p_value(problem, effect, fitted, "coulomb_drive") < 1e-6
    place = fitted.places["presliding_drive.stiffness", None]
    scale = np.ones(len(fitted.free))
    scale[place] = 1e4
    blurred = replace(fitted, covariance=fitted.covariance * np.outer(scale, scale))
    assert 0.05 < added_p_value(problem, effect, blurred, "coulomb_drive") <= 1.0
