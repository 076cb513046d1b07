"""What moves by itself inside a machine is judged beside a random force, from starts of its own."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, diagnose
from wheelpend.diagnosis.likelihood import relief
from wheelpend.diagnosis.likelihood.filtered_model import filtered_model
from wheelpend.diagnosis.likelihood.refits import with_effect
from wheelpend.diagnosis.likelihood.whitened_scores import internal_effects, leading_effects, linear_effects
from wheelpend.estimation.data import prepare
from wheelpend.estimation.starts import best_start

STIFFNESS, DAMPING = 60.0, 0.3  # V/rad, V s/rad
INSIDE = {"accelerometer_tilt", "drive_compliance", "slosh", "wheel_slip"}


@pytest.fixture(scope="module")
def filtered():
    """A model without the elastic shaft that its machine has, and with a random force in its place."""
    hidden = {"drive_compliance__stiffness": STIFFNESS, "drive_compliance__damping": DAMPING}
    problem, start = best_start(prepare(Model.default(), [simulated(duration=4.0, seed=3, **hidden)]))
    return filtered_model(problem, [start], lambda text: None)


def test_each_motion_inside_is_tried_from_every_start_and_play_is_not(filtered):
    found = {one.effect.name: one for one in internal_effects(filtered)}
    assert found.keys() == INSIDE
    shaft = [start.values for start in found["drive_compliance"].starts]
    assert [s["drive_compliance.stiffness"] for s in shaft] == [20.0, 60.0, 200.0, 600.0]
    assert {s["drive_compliance.damping"] for s in shaft} == {0.1}
    assert [s.values["slosh.mass_ratio"] for s in found["slosh"].starts] == [0.05] * 5


def test_no_score_tells_of_a_motion_inside(filtered):
    assert not INSIDE & {one.effect.name for one in leading_effects(filtered)}
    assert not INSIDE & {effect.name for effect in linear_effects(filtered)}


def test_an_elastic_shaft_takes_the_place_of_a_large_random_force(filtered):
    (shaft,) = (one for one in internal_effects(filtered) if one.effect.name == "drive_compliance")
    found = with_effect(filtered, "drive_compliance", shaft.starts).ended()
    assert found.problem.max_step < filtered.problem.max_step  # the shaft is stiffer than the machine
    assert found.deviance < filtered.deviance - 1000.0
    assert found.log_values[0]["drive_compliance.stiffness"] == pytest.approx(STIFFNESS, rel=0.1)
    assert found.log_values[0]["X1"] == pytest.approx(0.0436, rel=0.2)
    assert found.force_squared < 0.01 * filtered.force_squared


def refit(effect: str, deviance: float) -> SimpleNamespace:
    """A refit with an effect, by how likely it makes the data."""
    model = SimpleNamespace(effects=("viscous_drive", effect))
    return SimpleNamespace(problem=SimpleNamespace(model=model), point=SimpleNamespace(deviance=deviance))


def test_a_motion_inside_is_judged_beside_the_leaders_where_data_are_likelier_with_it(monkeypatch):
    monkeypatch.setattr(relief, "on_ranking_part", lambda model: refit("", 100.0))
    leaders = [refit(name, 90.0) for name in ("coulomb_drive", "cogging", "air_drag", "imu_bias", "gyro_bias")]
    others = [refit("slosh", 99.0), refit("slope", 95.0), refit("wheel_slip", 101.0)]
    assert relief._leading(None, [*leaders, *others]) == [*leaders, others[0]]
    assert relief._leading(None, [others[2], *leaders]) == [others[2], *leaders[:4]]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.extras
def test_an_elastic_shaft_of_a_robot_that_is_pushed_is_named_first_and_alone():
    pytest.importorskip("mujoco")
    from wheelpend.benchmarks.random_force.machine import rough_log

    hidden = {"drive_compliance.stiffness": 100.0, "drive_compliance.damping": DAMPING}
    found = diagnose(Model.default(), [rough_log("first_order", "drive", 5, hidden, 10.0).log])
    assert found.verdict == "effect_missing" and found.steps == ("drive_compliance",)
    first = found.named[0]
    assert first.coefficients["stiffness"] == pytest.approx(100.0, abs=4.0 * first.sigma["stiffness"])
    assert "backlash" in found.not_judged and "drive_compliance" not in found.not_judged
    assert np.isfinite(first.sigma["stiffness"]) and first.sigma["stiffness"] < 100.0
