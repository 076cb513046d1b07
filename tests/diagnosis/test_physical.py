"""Which sizes of an effect are physically possible."""

from types import SimpleNamespace

import derive
from derive.effects import Effect
from wheelpend.diagnosis.physical import is_determined, is_within_its_friction
from wheelpend.estimation.fit import Fit
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model


def is_possible(size: float, friction: float | None, plant: str = "slide") -> bool:
    """Whether a difference between directions is possible beside so much viscous friction, nothing being fitted."""
    values = {"viscous_asymmetry.coefficient": size}
    values |= {} if friction is None else {"viscous_drive.coefficient": friction}
    return is_within_its_friction(*tried(Model.parse(f'plant = "{plant}"\n'), "viscous_asymmetry", values))


def tried(model: Model, effect: str, values: dict[str, float]) -> tuple[SimpleNamespace, Effect, Fit]:
    """A problem, an effect and values that were not fitted."""
    problem = SimpleNamespace(
        module=library_module_of(model, []), plant=model.plant_signature, model=model, logs=[None]
    )
    return problem, derive.effects.find(effect), Fit.at(values, [{}])


def test_friction_is_larger_one_way_than_the_other_by_no_more_than_it_is():
    assert is_possible(0.9, 1.0) and is_possible(-0.9, 1.0)
    assert not is_possible(1.1, 1.0) and not is_possible(-1.1, 1.0)
    assert not is_possible(1e-3, None)  # without any friction it would drive the machine one way


def test_in_a_joint_it_is_the_joints_friction_that_counts():
    assert derive.effects.find("viscous_asymmetry_joint").varies == "viscous_joint"


def test_it_is_not_judged_where_the_plants_own_parameters_contain_the_friction():
    assert is_possible(5.0, None, "wheel_pendulum")


FREE = 'plant = "pendulum"\n[assumptions]\ndriven = false\n'
DRIVEN = 'plant = "pendulum"\n[assumptions]\ndriven = true\n'
SECOND = 'plant = "pendulum"\n[assumptions]\nlinks = 2\ndriven = "second"\n'


def test_what_is_a_motors_is_no_candidate_where_none_acts():
    of_motors = {"cogging", "coulomb_asymmetry", "viscous_asymmetry"}

    def known(text):
        return {e.name for e in derive.effects.applicable_to(Model.parse(text).plant_signature)}

    assert of_motors <= known(DRIVEN) and not of_motors & known(FREE)
    assert not of_motors & known(SECOND) and {f"{e}_joint" for e in of_motors} <= known(SECOND)


def test_a_constant_torque_is_possible_where_a_viscous_difference_of_its_kind_is_not():
    slide = Model.parse('plant = "slide"\n')
    assert is_within_its_friction(*tried(slide, "coulomb_asymmetry", {"coulomb_asymmetry.torque": 0.2}))
    assert not is_within_its_friction(*tried(slide, "viscous_asymmetry", {"viscous_asymmetry.coefficient": 0.2}))


def test_laws_of_other_kinds_have_no_friction_to_stay_within():
    values = Fit.at({"coulomb_drive.torque": 5.0}, [{}])
    assert is_within_its_friction(SimpleNamespace(), derive.effects.find("coulomb_drive"), values)


def test_a_law_whose_shape_the_logs_leave_open_is_to_them_a_simpler_one():
    def found(speed, sigma):
        return SimpleNamespace(coefficients={"static": 0.4, "sliding": 0.3, "speed": speed}, sigma={"speed": sigma})

    stribeck = derive.effects.find("stribeck_drive")
    assert is_determined(stribeck, found(0.5, 0.2))
    assert not is_determined(stribeck, found(1e-3, 1e7))
    assert is_determined(derive.effects.find("coulomb_drive"), SimpleNamespace(coefficients={"torque": 0.1}, sigma={}))
