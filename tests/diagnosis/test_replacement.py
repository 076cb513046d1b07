"""An effect takes the place of a simpler one in the model, and must add to it to be worth naming."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import derive
from tests.support import simulated
from wheelpend import Log, Model, add, diagnose
from wheelpend.diagnosis.evidence import added_p_value
from wheelpend.diagnosis.likelihood import one_round, refits
from wheelpend.diagnosis.refit import replace_contained
from wheelpend.diagnosis.score_test import EffectSize
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.validation import validation_residuals

ZERO_RAD, NOISE_RAD = 0.02, 0.002
TURNED = Model.parse('plant = "pendulum"\neffects = ["encoder_zero"]\n')
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


@pytest.fixture(scope="module")
def turned_log():
    """A free pendulum of which the encoder's zero is off by 0.02 rad."""
    random = np.random.default_rng(3)
    t = np.arange(0.0, 12.0, 0.02)
    swing = solve_ivp(lambda _, s: (s[1], -40.0 * np.sin(s[0])), (0.0, 12.0), (0.8, 0.0), t_eval=t, rtol=1e-9).y[0]
    seen = swing + ZERO_RAD + NOISE_RAD * random.standard_normal(t.size)
    return Log("turned", t, np.zeros(t.size), seen[:, None], ("theta_1",), rates={})


def test_what_each_log_has_of_a_replaced_effect_goes_with_it(turned_log):
    problem = prepare(TURNED, [turned_log, turned_log])
    logs = [{"X1": 0.025, "encoder_zero.bias": bias} for bias in (ZERO_RAD, 0.5 * ZERO_RAD)]
    size = EffectSize(dict.fromkeys(derive.effects.find("link_nonlinearity").full_names, 0.0), {})
    for started, own in zip(refits._started(problem, logs, "link_nonlinearity", size), logs, strict=True):
        assert started["encoder_zero.bias"] == 0.0
        assert started["link_nonlinearity.zero"] == pytest.approx(own["encoder_zero.bias"])


def test_a_model_predicts_by_itself_what_it_predicted_when_an_effect_was_replaced(turned_log):
    before = add(Model.parse('plant = "pendulum"\neffects = []\n'), "encoder_zero", [turned_log])
    assert before.step.coefficients["bias"] == pytest.approx(ZERO_RAD, abs=0.003)
    changed = add(before.model, "link_nonlinearity", [turned_log])
    assert changed.model.effects == ("link_nonlinearity",)
    assert changed.after.of_log(0).get("encoder_zero.bias", 0.0) == 0.0
    alone = Fit.at({n: changed.model.value(n) for n in changed.model.all_parameters}, [{}])
    judging = changed.problem.with_effects(changed.model.effects)
    assert validation_residuals(judging, alone)[0] == pytest.approx(changed.step.error_after, rel=1e-6)


def judged(effect: str, deviance: float, *, certain: bool = False, followed: bool = True) -> SimpleNamespace:
    candidate, model = SimpleNamespace(effect=effect), SimpleNamespace(deviance=deviance)
    return SimpleNamespace(candidate=candidate, model=model, is_certain=certain, is_followed=followed)


@pytest.mark.parametrize(
    ("drag", "lost", "likelier", "displaced"),
    [
        (judged("quadratic_drive", 90.0), ["viscous_drive"], True, "viscous_drive"),
        (judged("quadratic_drive", 90.0), ["viscous_drive"], False, ""),  # the model is less likely without it
        (judged("quadratic_drive", 90.0), ["slope"], True, ""),  # which was in the model from the first
        (judged("quadratic_drive", 90.0), ["quadratic_drive", "viscous_drive"], True, ""),  # itself impossible
        (judged("quadratic_drive", 90.0, followed=False), ["viscous_drive"], True, ""),  # no data follow it
        (judged("quadratic_drive", 90.0, certain=True), ["viscous_drive"], True, ""),  # it is named already
    ],
)
def test_an_effect_is_displaced_by_one_with_which_it_drives_if_the_model_is_likelier_so(
    drag, lost, likelier, displaced, monkeypatch
):
    monkeypatch.setattr(one_round, "without_meaning", lambda model: lost if model is drag.model else [])
    without = SimpleNamespace(deviance=95.0 if likelier else 105.0)
    monkeypatch.setattr(one_round, "without_effect", lambda model, effect, amid: without)
    base, other = SimpleNamespace(deviance=100.0, point=SimpleNamespace(sources=())), judged("cogging", 99.0)
    assert one_round._displaced(base, [other, drag], ["viscous_drive"], print) == displaced
