"""What a model leaves to chance: at its values, refitted, stored; and the warnings of a fit."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

from derive.plants.wheel_pendulum import REFERENCE_PARAMETERS
from tests.support import CONSTANTS, SPARSE_S, X, simulated
from wheelpend import Log, Model, identify
from wheelpend.errors import Failure
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.identification import inverse_dynamics
from wheelpend.identification import remainder_warnings as warnings
from wheelpend.identification.filter_error_method import remainder_at_point
from wheelpend.identification.remainder import Remainder, RowForce, SensorError, modelled_forces, with_remainder
from wheelpend.identification.remainder_at import likeliest_point, refitted_remainder, remainder_or_warning
from wheelpend.kernels.load import free_force_module
from wheelpend.model.entries import RandomForce, SensorNoise

FORCE = RowForce(0.2, "V", 33.0, 0.1, 0.1, 0.1, "drive")
ROBOT = Model.default().plant_signature
INERTIAS = ("X1", "X2", "X3", "X4")


@lru_cache
def problem(**hide):
    return prepare(Model.default(), [simulated(duration=6.0, sample=SPARSE_S, **hide)], use_all=True)


@lru_cache
def rough():
    """An identification of a model without the friction that the machine has."""
    return identify(Model.default(), [simulated(duration=6.0, sample=SPARSE_S, coulomb_drive__torque=0.3)])


def remainder_at(problem, values):
    return remainder_at_point(problem, *likeliest_point(problem, values, ()))


def test_a_complete_model_leaves_nothing_to_chance():
    for find in (remainder_at, refitted_remainder):
        assert find(problem(), [X | CONSTANTS]) == Remainder()


def test_missing_friction_is_a_force_between_wheel_and_body():
    left = refitted_remainder(problem(coulomb_drive__torque=0.3), [X | CONSTANTS])
    assert left.places == ("drive",)
    assert left.force["wheel"].rms == left.force["body"].rms == pytest.approx(0.15, rel=0.3)  # of 0.3 V, refitted
    assert 0.02 < left.force["wheel"].share_of_drive < 0.12
    assert left.force["wheel"].rms_torque == pytest.approx(165.42 * left.force["wheel"].rms)


def test_what_wrong_values_leave_shrinks_when_they_are_refitted():
    wrong = {n: 0.95 * v for n, v in X.items()} | CONSTANTS
    assert remainder_at(problem(), [wrong]).strongest.share_of_drive > 0.01
    assert refitted_remainder(problem(), [wrong]) == Remainder()


def test_at_constant_speed_the_input_measures_a_force_and_not_what_is_left_of_it_by_friction():
    model = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n')
    t = np.arange(300) * 0.01
    log = Log("slow", t, np.full(300, 2.0), (0.5 * t)[:, None], ("x",), rates={})
    module = free_force_module(model.plant, model.assumptions, model.effects)
    values = {"X1": 1.0, "viscous_drive.coefficient": 3.9}
    acting = modelled_forces(module, [log], values)
    assert acting.together == pytest.approx([0.05], abs=1e-3) and acting.of_input == pytest.approx([2.0])
    assert (acting.largest == acting.of_input).all()
    assert modelled_forces(module, [replace(log, voltage=np.zeros(300))], values).largest == pytest.approx(
        [1.95], abs=1e-3
    )


def test_what_cannot_be_filtered_is_null_with_a_warning():
    def fails(problem, values):
        raise Failure("no filter.")

    def divides(problem, values):
        raise ZeroDivisionError

    for find in (fails, divides):
        left, (said,) = remainder_or_warning(find, problem(), [X])
        assert left is None and "leaves to chance" in said


def test_identified_values_keep_what_they_leave_and_a_later_fit_drops_it():
    model = rough().model
    assert set(model.random_force) == {"wheel", "body"}
    assert model.random_force["wheel"].place == "drive"
    assert model.random_force["wheel"].rms == rough().remainder.force["wheel"].rms
    clean = identify(model, [simulated(duration=6.0, sample=SPARSE_S)]).model
    assert not clean.random_force and "random_force" not in clean.dump()


def test_a_place_is_stored_only_where_the_force_acts_on_several_rows():
    left = Remainder({"wheel": FORCE, "body": RowForce(0.1, "V", None, 0.1, 0.1, 0.2, "body")},
                     {"theta_p": SensorError(0.001, "rad", 2.0, 0.01, 0.3)})  # fmt: skip
    model = with_remainder(Model.default(), left)
    assert model.random_force == {"wheel": RandomForce(0.2, 0.1, "drive"), "body": RandomForce(0.1, 0.2)}
    assert model.sensor_error == {"theta_p": SensorNoise(0.001, 0.3)}
    assert with_remainder(model, None).dump() == Model.default().dump()


def test_the_widening_of_intervals_is_part_of_their_errors():
    found = rough()
    assert set(found.widening.factors) == set(X)
    assert min(found.widening.factors.values()) >= 1.0
    assert 0.0 < found.widening.shortest_s <= found.widening.longest_s < 0.31  # a twentieth of 6 s
    assert [e.sigma for e in found.parameters.values()] == pytest.approx(np.sqrt(np.diag(found.covariance.matrix)))


def test_shooting_has_a_covariance_with_the_errors_of_its_table():
    found = identify(Model.default(), [simulated(duration=6.0, sample=SPARSE_S)], method="shooting")
    assert found.covariance.names == tuple(X)
    assert np.sqrt(np.diag(found.covariance.matrix)) == pytest.approx([e.sigma for e in found.parameters.values()])
    assert found.covariance.matrix == pytest.approx(found.covariance.matrix.T)


# ---- warnings


@pytest.mark.parametrize(("share", "warned"), [(0.51, True), (0.49, False), (np.inf, True)])
def test_a_force_as_large_as_the_drive_is_warned_of(share, warned):
    left = Remainder({"wheel": RowForce(1.0, "V", None, share, share, 0.1, "wheel")})
    said = warnings.remainder_warnings(left, ROBOT)
    assert any("More than half" in w and "wheelpend diagnose" in w for w in said) == warned
    assert not warnings.remainder_warnings(None, ROBOT) and not warnings.remainder_warnings(Remainder(), ROBOT)


def test_a_fit_that_stopped_at_a_bound_says_which_and_what_it_means():
    own = FreeParameter("X2", unit="V s²/rad", bounds=(0.0, np.inf))
    effect = FreeParameter("coulomb_drive.torque", "coulomb_drive", unit="V", bounds=(0.0, np.inf))
    free = FreeParameter("slope.angle", "slope", unit="rad")
    covariance = np.diag([1.0, 1.0, 1.0])
    said = warnings.bound_warnings((own, effect, free), np.array([1e-8, 0.0, 0.0]), covariance, {})
    assert [w.partition(" ")[0] for w in said] == ["X2", "coulomb_drive.torque"]
    assert "bound of 0 V s²/rad, below which no machine has it" in said[0]
    assert "it would be no coulomb_drive" in said[1]
    assert not warnings.bound_warnings((own, effect, free), np.array([1e-3, 0.1, 0.0]), covariance, {})


def test_a_value_lost_in_its_error_is_not_excited():
    table = {"X1": Estimate(0.001, 3.4, "V s²/rad"), "X4": Estimate(0.03, 0.01, "V s²/rad")}
    assert {n: e.identifiable for n, e in warnings.with_astray_marked(table).items()} == {"X1": False, "X4": True}


def inertia_warnings(factor, left, sigma=0.001):
    table = {n: Estimate(factor * X[n], sigma * X[n], "V s²/rad") for n in INERTIAS}
    rest = {n: Estimate(v, 0.001, "V") for n, v in X.items() if n not in INERTIAS}
    return warnings.inertia_warnings(problem(coulomb_drive__torque=0.3), table | rest, left)


def test_an_inertia_far_from_inverse_dynamics_is_warned_of_where_a_force_is_left(monkeypatch):
    known = [(n, REFERENCE_PARAMETERS[n], 0.01 * X[n]) for n in INERTIAS]
    monkeypatch.setattr(warnings, "_inertias_by_inverse_dynamics", lambda problem, table: known)
    left = Remainder({"wheel": FORCE})
    assert [w.partition(" ")[0] for w in inertia_warnings(30.0, left)] == list(INERTIAS)
    assert not inertia_warnings(1.5, left)
    assert not inertia_warnings(30.0, Remainder()) and not inertia_warnings(30.0, None)
    assert not inertia_warnings(3.0, left, sigma=5.0)  # its own error says as much


def test_inverse_dynamics_speak_of_inertias_that_they_know_alone():
    table = {n: Estimate(v, 0.001, "V") for n, v in X.items()}
    found = warnings._inertias_by_inverse_dynamics(problem(coulomb_drive__torque=0.3), table)
    assert {n for n, _, _ in found} <= set(INERTIAS) and found
    assert all(sigma <= 0.5 * value for _, value, sigma in found)


def test_what_inverse_dynamics_do_not_know_themselves_is_left_out(monkeypatch):
    fitted = SimpleNamespace(
        names=("X1", "X2", "X3", "X4", "X5"), estimate=np.array([1.0, 1.0, -1.0, 1.0, 1.0]),
        sigma=np.array([0.4, 0.6, 0.1, 0.1, 0.1]), unidentifiable=("X4",), undefined=(),
    )  # fmt: skip
    monkeypatch.setattr(inverse_dynamics, "inverse_dynamics", lambda *arguments: SimpleNamespace(fit=fitted))
    table = {n: Estimate(v, 0.001, "V") for n, v in X.items()}
    assert warnings._inertias_by_inverse_dynamics(problem(), table) == [("X1", 1.0, 0.4)]
