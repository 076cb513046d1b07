"""What is said where chance has as much weight as the model."""

import pytest

from tests.support import simulated
from wheelpend import Model, add, identify
from wheelpend.estimation.estimate import Estimate
from wheelpend.identification.remainder import Remainder, RowForce, SensorError
from wheelpend.identification.remainder_warnings import is_mostly_chance, remainder_warnings, undetermined_warnings
from wheelpend.kernels.load import free_force_module
from wheelpend.reports.text.verdict import has_repeating

ROBOT = Model.default().plant_signature


def left(share):
    return Remainder({"wheel": RowForce(0.2, "V", None, share, share, 0.1, "wheel")}, places=("wheel",))


@pytest.mark.parametrize(("share", "mostly"), [(0.05, False), (0.49, False), (0.51, True), (13.0, True)])
def test_a_force_of_half_the_weight_of_the_model_is_mostly_chance_and_is_warned_of(share, mostly):
    assert is_mostly_chance(left(share)) is mostly
    assert bool(remainder_warnings(left(share), ROBOT)) is mostly


def test_the_input_is_spoken_of_where_there_is_one():
    free = Model.parse('plant = "pendulum"\n').plant_signature
    (of_a_motor,), (of_none,) = remainder_warnings(left(0.8), ROBOT), remainder_warnings(left(0.8), free)
    assert "log the mean of the input" in of_a_motor and "input" not in of_none


@pytest.mark.parametrize(
    ("share", "unpredicted", "mostly"), [(0.9, 0.4, True), (0.9, 0.2, False), (0.1, 0.4, False), (0.9, None, False)]
)
def test_what_is_missed_and_taken_for_a_sensors_error_is_mostly_chance(share, unpredicted, mostly):
    error = SensorError(0.25, "rad", 5.0, share, 0.2)
    missed = Remainder(sensors={"theta_p": error}, unpredicted=unpredicted)
    assert is_mostly_chance(missed) is mostly
    said = remainder_warnings(missed, ROBOT)
    assert len(said) == mostly and all("taken for errors of theta_p." in s for s in said)


def test_nothing_left_is_no_chance():
    assert not is_mostly_chance(None) and not is_mostly_chance(Remainder())


def test_a_force_of_which_nothing_is_known_to_repeat_is_not_said_to():
    assert not has_repeating(left(0.8))


def undetermined(table, told=(), remainder=None):
    model = Model.default()
    module = free_force_module(model.plant, model.assumptions, ("coulomb_drive", "slope"))
    return undetermined_warnings(module, model.plant_signature, table, told, remainder)


def test_a_positive_parameter_that_is_smaller_than_two_standard_errors_is_not_determined():
    table = {"X1": Estimate(0.1, 0.06, "V s²/rad"), "X2": Estimate(0.1, 0.05, "V s²/rad"),
             "coulomb_drive.torque": Estimate(0.2, 0.2, "V")}  # fmt: skip
    assert undetermined(table) == (
        "X1 = 0.1 ± 0.06 V s²/rad: these logs do not determine it. "
        "`wheelpend design` writes the command for a log that does.",
        "coulomb_drive.torque = 0.2 ± 0.2 V: these logs do not tell it from zero. Whether the model does without "
        "coulomb_drive, `wheelpend remove coulomb_drive LOG` says.",
    )
    assert undetermined(table, ("X1", "coulomb_drive.torque")) == ()


def test_what_a_random_force_stands_for_may_hide_a_parameter_and_logs_are_not_blamed_alone():
    lost = {"X1": Estimate(0.1, 0.06, "V s²/rad")}
    (said,) = undetermined(lost, remainder=left(0.44))
    assert "judge no model" not in said and "`wheelpend diagnose LOG` looks for it" in said
    assert "a random force of 44 % of the drive" in said and "`wheelpend design`" in said
    assert "judge no model" in undetermined(lost, remainder=left(0.01))[0]


def test_logs_that_determine_no_parameter_of_the_plant_judge_no_model():
    lost, known = Estimate(6890.0, 1.6e7, "V s²/rad"), Estimate(0.1, 0.001, "V s²/rad")
    (said,) = undetermined({"X1": lost})
    assert "do not determine it. They judge no model" in said
    assert "judge no model" not in undetermined({"X1": lost, "X2": known})[0]
    assert "judge no model" not in undetermined({"X1": lost, "X2": lost}, ("X2",))[0]
    assert "judge no model" in undetermined({"X1": lost, "X2": Estimate(0.1, 0.3, "V s²/rad", identifiable=False)})[0]
    stiffness = {"presliding_drive.stiffness": Estimate(6890.0, 1.6e7, "V/rad")}
    assert not any("judge no model" in s for s in undetermined(stiffness)), "the plant's own are fixed"


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("slope.angle", Estimate(0.01, 0.1, "rad")),  # may well be none
        ("X1", Estimate(0.1, 0.3, "V s²/rad", identifiable=False)),  # is said not to be excited
        ("X6", Estimate(0.0, 1.0, "V s/rad")),  # at its bound, which is said
    ],
)
def test_a_parameter_that_may_be_nothing_or_of_which_all_is_said_is_not_warned_of(name, found):
    assert undetermined({name: found}) == ()


def test_identify_and_add_warn_of_what_a_short_log_does_not_determine():
    log = simulated(seed=1, duration=0.5, command="upright")
    assert any("X4 = " in w and "not determine" in w for w in identify(Model.default(), [log]).warnings)
    warnings = add(Model.default(), "coulomb_drive", [log]).warnings
    assert any("X5 = " in w and "not determine" in w for w in warnings)
    assert any("not tell it from zero" in w for w in warnings)
