"""Plants of the library: what acts on their parts, and in which units."""

import numpy as np
import pytest
import sympy as sp

import derive
from derive.algebra import are_proportional
from derive.effects import in_plant_units
from derive.functions import Magnitude, Ramp, Sign

EVERY = [
    ("slide", {}),
    ("pendulum", {}),
    ("pendulum", {"driven": True}),
    ("pendulum", {"links": 2}),
    ("pendulum", {"links": 2, "driven": True, "second_encoder": "absolute"}),
    ("pendulum", {"links": 2, "driven": "second", "rate_sensor": "second"}),
    ("pendulum", {"links": 2, "driven": "both", "rate_sensor": "both"}),
    ("cart_pole", {"range": "any", "rate_sensor": "both"}),
    ("cart_pole", {}),
    ("wheel_pendulum", {"encoder": "relative"}),
]


@pytest.mark.parametrize(("plant", "assumptions"), EVERY)
def test_every_plant_has_a_library_that_the_templates_can_write(plant, assumptions):
    model = derive.library_model(plant, assumptions)
    compile(derive.render(model), plant, "exec")
    assert {e.name for e in model.effects} >= {"coulomb_drive", "quadratic_drive", "stribeck_drive"}


def test_a_law_has_the_units_and_numbers_of_the_part_on_which_it_acts():
    slide, robot, free = (derive.plants.build(n, derive.plants.complete_assumptions(n, {})).plant_signature
                          for n in ("slide", "wheel_pendulum", "pendulum"))  # fmt: skip
    row = derive.effects.find("presliding_drive")
    assert [p.unit for p in in_plant_units(row, robot).parameters] == ["V", "V/rad"]
    assert [p.unit for p in in_plant_units(row, slide).parameters] == ["V", "V/m"]
    assert [p.unit for p in in_plant_units(row, free).parameters] == ["1", "1/rad"]
    assert in_plant_units(row, slide).parameters[1].maximum == 100 * row.parameters[1].maximum  # 0.01 m counts as a rad
    viscous, cubic = derive.effects.find("viscous_drive"), derive.effects.find("quadratic_drive")
    assert [in_plant_units(e, slide).parameters[0].unit for e in (viscous, cubic)] == ["V s/m", "V s²/m²"]


def test_effects_act_on_parts_and_not_on_plants():
    def fitting(name, **assumptions):
        plant = derive.plants.build(name, derive.plants.complete_assumptions(name, assumptions)).plant_signature
        return {e.name for e in derive.effects.applicable_to(plant)}

    assert "voltage_offset" not in fitting("pendulum") and "voltage_offset" in fitting("pendulum", driven=True)
    assert "load_friction" not in fitting("pendulum") and "load_friction" in fitting("slide")
    assert "coulomb_joint" in fitting("cart_pole") and "coulomb_joint" not in fitting("slide")
    assert "rolling_resistance" in fitting("wheel_pendulum") and "rolling_resistance" not in fitting("cart_pole")
    assert "imu_bias" in fitting("cart_pole") and "gyro_bias" not in fitting("cart_pole")


def test_a_motor_coasts_where_a_driver_switches_a_voltage_on_one_motor():
    def coasts(name, **assumptions):
        plant = derive.plants.build(name, derive.plants.complete_assumptions(name, assumptions)).plant_signature
        return "coasting_driver" in {e.name for e in derive.effects.applicable_to(plant)}

    assert all(map(coasts, ("shaft", "slide", "wheel_pendulum", "cart_pole"))) and coasts("pendulum", driven=True)
    assert not coasts("pendulum") and not coasts("pendulum", links=2, driven="both")
    assert not coasts("pendulum", links=2, driven="second")  # the motor is at the other joint
    assert not coasts("shaft", input_unit="A") and not coasts("slide", input_unit="N")


@pytest.mark.parametrize(("volts", "acting"), [(6.0, 5.0), (-6.0, 5.0), (0.8, 0.0)])
def test_what_grows_with_the_voltage_follows_that_which_reaches_the_motor(volts, acting):
    (row,) = derive.compose("shaft", {}, ("coasting_driver", "voltage_dead_zone")).residual
    own = {"X1": 0.1, "X2": 0.2, "ddtheta_m": 0.0, "dtheta_m": 3.0, "v_in": volts}
    sizes = {"coasting_driver.rate": 0.02, "voltage_dead_zone.threshold": 1.0}
    at = {s: (own | sizes)[s.name] for s in row.free_symbols}
    value = float(row.subs(at).replace(Magnitude, sp.Abs).replace(Sign, sp.sign).replace(Ramp, lambda x: sp.Max(x, 0)))
    assert value == pytest.approx(0.2 * 3.0 + 0.02 * acting * 3.0 - np.sign(volts) * acting)


def test_without_ground_friction_the_two_dampings_are_one():
    lean = derive.compose("wheel_pendulum", {"ground_friction": False}, [])
    assert len(lean.grouping.names) == 6
    damping = [p for p in lean.fitted if p.unit == "V s/rad"]
    assert len(damping) == 1


def test_parameters_that_are_plain_symbols_are_compared_as_numbers_are():
    K_1, K_2 = sp.symbols("K_1 K_2", positive=True)
    assert not are_proportional(K_1, K_2) and are_proportional(3 * K_1, K_1)


def test_a_joint_with_a_motor_has_the_friction_of_a_drive_and_one_without_that_of_a_bearing():
    def at_joint(**assumptions):
        plant = derive.plants.build("pendulum", {"links": 2, **assumptions}).plant_signature
        return {e.name for e in derive.effects.applicable_to(plant) if "joint" in e.name}

    bearing = {"viscous_joint", "coulomb_joint", "quadratic_joint"}
    assert at_joint() == at_joint(driven=True) == bearing
    assert at_joint(driven="second") == at_joint(driven="both") > bearing | {"stribeck_joint", "load_friction_joint"}


def test_friction_with_the_load_is_where_a_motor_turns():
    def fitting(driven):
        plant = derive.plants.build("pendulum", {"links": 2, "driven": driven}).plant_signature
        return {e.name for e in derive.effects.applicable_to(plant) if e.name.startswith("load_friction")}

    assert fitting(False) == set() and fitting(True) == {"load_friction"}
    assert fitting("second") == {"load_friction_joint"} and fitting("both") == {"load_friction", "load_friction_joint"}


@pytest.mark.parametrize(("driven", "absorbed"), [
    (True, {"viscous_drive.coefficient": {"X6": 1.0}}),
    ("second", {"viscous_joint.coefficient": {"X6": 1.0}}),
    ("both", {"viscous_drive.coefficient": {"X6": 1.0}, "viscous_joint.coefficient": {"X6": 1.0, "X7": 1.0}}),
])  # fmt: skip
def test_viscous_friction_of_a_joint_with_a_motor_is_part_of_its_damping(driven, absorbed):
    assert derive.library_model("pendulum", {"links": 2, "driven": driven}).relations.absorbed == absorbed
