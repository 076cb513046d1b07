"""Which parameters are free, whose they are, and between what bounds."""

import numpy as np
import pytest

import derive
from tests.support import simulated
from wheelpend import Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names, known_values, limits_of, per_log_names, tied_pairs
from wheelpend.estimation.problem import extended_effects
from wheelpend.estimation.profiled_starts import null_values, quantile_starts

EFFECTS = ["coulomb_drive", "slope", "cogging", "imu_lag", "external_push"]
NAMES = [n for e in EFFECTS for n in derive.effects.find(e).full_names]


def test_a_slope_a_phase_and_an_event_are_each_logs_own():
    own = per_log_names(["X1", *NAMES])
    assert own == ["slope.angle", "cogging.sine", "cogging.cosine", "external_push.start", "external_push.end",
                   "external_push.torque"]  # fmt: skip
    assert tied_pairs(["X1", *NAMES]) == [("cogging.sine", "cogging.cosine")]
    assert tied_pairs(["cogging.sine"]) == []


def test_own_parameters_are_positive_and_effects_have_the_bounds_that_a_simulation_needs():
    limits = limits_of(["X1", "X2", *NAMES], signed=("X2",))
    assert (limits["X1"], limits["X2"]) == ((0.0, np.inf), (-np.inf, np.inf))
    assert (limits["imu_lag.delay"], limits["coulomb_drive.torque"]) == ((0.0, 0.3), (-np.inf, np.inf))


def test_identified_values_go_before_nominal_ones_and_constants_are_known():
    model = Model.default().with_effects(["slope"]).with_fit({"X1": (0.05, 1e-3), "slope.angle": (0.01, None)})
    found = known_values(model)
    assert (found["X1"], found["slope.angle"], found["R"]) == (0.05, 0.01, model.constants["R"])
    assert found["X2"] == model.parameters["X2"].nominal


def test_an_effect_takes_the_place_of_those_that_it_contains_or_approaches():
    model = Model.default().with_effects(["coulomb_drive", "slope"])
    assert extended_effects(model, "stribeck_drive") == ["slope", "stribeck_drive"]
    assert extended_effects(model, "presliding_drive") == ["slope", "presliding_drive"]
    assert extended_effects(model, "imu_bias") == ["coulomb_drive", "slope", "imu_bias"]


def test_a_problem_frees_what_its_model_has_and_offers_what_it_lacks():
    problem = prepare(Model.default().with_effects(["stribeck_drive"]), [simulated(duration=4.0)], without=["slope"])
    assert free_names(problem, ["slope"]) == ["X1", "X2", "X3", "X4", "X5", "X6", "X7", "slope.angle"]
    offered = {e.name for e in problem.candidates()}
    assert not offered & {"stribeck_drive", "coulomb_drive", "slope", "viscous_drive"}
    assert {"voltage_offset", "imu_bias", "air_drag"} <= offered
    elastic = prepare(Model.default().with_effects(["presliding_drive"]), [simulated(duration=4.0)])
    assert "coulomb_drive" not in {e.name for e in elastic.candidates()}


def test_a_limit_does_nothing_from_the_largest_value_on_that_the_log_reaches():
    problem = prepare(Model.default(), [simulated(duration=4.0)])
    segments = problem.data.estimation[0]
    voltage = np.abs(segments.log.voltage[segments.bounds[0, 0] : segments.bounds[-1, 1]])
    saturation = derive.effects.find("voltage_saturation")
    assert null_values(problem, saturation) == {"voltage_saturation.limit": pytest.approx(voltage.max())}
    assert null_values(problem, derive.effects.find("slope")) == {"slope.angle": 0.0}
    starts = quantile_starts(problem, saturation.parameters[0], saturation.parameters[0].starts)
    assert starts == pytest.approx(np.quantile(voltage, (0.5, 0.8, 0.95, 0.995)))
