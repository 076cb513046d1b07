"""Inputs in V, A, N m or N: the equations stay, words, units and constants follow."""

import numpy as np
import pytest

import derive
from derive.effects.applicability import in_plant_words
from derive.input_units import UNIT_WORDS
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.inspection.inspect import inspect_file
from wheelpend.logs.read import load_log
from wheelpend.model.equations import difference_text, equations_text
from wheelpend.model.units import plant_units_of

PLANTS = {
    "pendulum": "[assumptions]\ndriven = true\n",
    "slide": "",
    "cart_pole": "",
    "wheel_pendulum": "",
}


def model(plant, unit, further=""):
    """A model of a plant whose input is in a unit."""
    return Model.parse(f'plant = "{plant}"\n{PLANTS[plant]}{further}\n[input]\nunit = "{unit}"\n')


@pytest.mark.parametrize("unit", UNIT_WORDS)
@pytest.mark.parametrize("plant", PLANTS)
def test_no_unit_of_the_input_changes_the_equations_of_motion(plant, unit):
    plain, other = model(plant, "V"), model(plant, unit)
    rows = [
        derive.compose(m.plant, m.assumptions, ("coulomb_drive", "voltage_offset")).residual for m in (plain, other)
    ]
    assert rows[0] == rows[1]


@pytest.mark.parametrize(("plant", "unit", "constant"), [
    ("pendulum", "A", "N m/A"), ("pendulum", "N", "N m/N"), ("slide", "A", "N/A"), ("slide", "N m", "N/(N m)"),
    ("wheel_pendulum", "A", "N m/A"),
])  # fmt: skip
def test_the_constant_of_the_actuator_is_per_unit_of_the_input(plant, unit, constant):
    scale = model(plant, unit).plant_signature.scale_constant
    assert scale.unit == constant
    assert "volt" not in scale.sentence
    assert UNIT_WORDS[unit] in scale.sentence


DIRECT = [("pendulum", "N m"), ("wheel_pendulum", "N m"), ("slide", "N"), ("cart_pole", "N")]


@pytest.mark.parametrize(("plant", "unit"), DIRECT)
def test_the_force_itself_as_the_input_needs_no_constant(plant, unit):
    signature = model(plant, unit).plant_signature
    assert signature.scale_constant is None
    assert not {"alpha", "gain"} & {c.name for c in signature.constants}
    quantities = plant_units_of(model(plant, unit))
    assert quantities.in_physical(1.0, unit) is None  # it is shown once
    for text in ("alpha", "gain", "K_b"):
        assert text not in equations_text(model(plant, unit))


def test_a_back_emf_is_friction_of_the_drive_where_no_voltage_is_commanded():
    assert "X3 = K_b" in equations_text(model("pendulum", "V"))
    assert "X3 = f_d/alpha" in equations_text(model("pendulum", "A"))
    assert "X3 = f_d\n" in equations_text(model("pendulum", "N m"))


def test_both_motors_of_a_pendulum_have_friction_where_no_voltage_is_commanded():
    def equations(unit):
        both = '[assumptions]\ndriven = "both"\nlinks = 2\n'
        return equations_text(Model.parse(f'plant = "pendulum"\n{both}[input]\nunit = "{unit}"\n'))

    assert "K_b" in equations("V")
    assert "K_2" in equations("V")
    for unit in ("A", "N m"):
        assert not any(letter in equations(unit) for letter in ("K_b", "K_2"))
        assert "f_d" in equations(unit)
        assert "f_2" in equations(unit)


def test_effects_parameters_and_columns_have_the_unit_of_the_input():
    signature = model("wheel_pendulum", "A").plant_signature
    row = {e.name: in_plant_words(derive.effects.in_plant_units(e, signature), signature)
           for e in derive.effects.EFFECT_LIBRARY.values()}  # fmt: skip
    assert row["coulomb_drive"].parameters[0].unit == "A"
    assert row["viscous_drive"].parameters[0].unit == "A s/rad"
    assert row["voltage_offset"].sentence == "A constant current is added to every command."
    assert model("wheel_pendulum", "A").table.units["v_in"] == "A"
    assert not any("volt" in r.instruction for r in signature.reversals)
    assert signature.usual_limits == (0.4, 0.0)  # of the paper's commands, in V


@pytest.mark.parametrize("kind", ["viscous", "coulomb", "stribeck", "presliding", "quadratic"])
def test_a_machine_that_nothing_drives_has_a_bearing_and_no_gearbox(kind):
    free = Model.parse('plant = "pendulum"\neffects = []\n').plant_signature
    row = in_plant_words(derive.effects.find(f"{kind}_drive"), free)
    for text in (row.sentence, row.means):
        assert not any(word in text for word in ("motor", "gear", "drive", "Teeth", "fan", "command", "plant's"))
    driven = model("pendulum", "N m").plant_signature
    assert in_plant_words(derive.effects.find(f"{kind}_drive"), driven).sentence != row.sentence
    assert not any(derive.effects.find(f"{kind}_joint").undriven)


def test_the_generated_text_and_the_equations_speak_of_the_input():
    text = derive.render(derive.compose("pendulum", model("pendulum", "N m").assumptions, ()))
    assert "torques in N m" in text
    assert "'N m s²/rad'" in text
    assert "0 [N m] =" in equations_text(model("pendulum", "N m"))


def test_models_that_differ_in_the_unit_alone_have_the_same_equations_of_motion():
    text = difference_text(model("pendulum", "V"), model("pendulum", "A"))
    assert "input_unit = A" in text
    assert "The equations of motion stay as they are" in text


@pytest.mark.parametrize(("text", "message"), [
    ('plant = "pendulum"\n[input]\nunit = "A"', "nothing drives this pendulum"),
    ('plant = "slide"\n[input]\nunit = "Nm"', "input.unit: must be 'V' or 'A' or 'N m' or 'N', not 'Nm'"),
    ('plant = "slide"\n[input]\nunits = "A"', "Did you mean 'unit'"),
    ('plant = "slide"\n[constants]\ngain = 3.0\n[input]\nunit = "N"', "must not hold gain: with an input in N it is 1"),
    ('plant = "slide"\n[assumptions]\ninput_unit = "N"', "No assumption named 'input_unit'"),
])  # fmt: skip
def test_an_input_that_cannot_be_is_refused(text, message):
    with pytest.raises(Failure) as caught:
        Model.parse(text)
    assert message in str(caught.value)


def test_the_plants_own_unit_is_the_same_model_as_none():
    assert model("slide", "V").assumptions == Model.parse('plant = "slide"').assumptions


def test_a_torque_is_read_in_its_units_and_edits_keep_the_entry(tmp_path):
    rows = "\n".join(f"{0.01 * k},{100 * (-1) ** k},{0.1 * k}" for k in range(30))
    (tmp_path / "log.csv").write_text(f"t,tau_mnm,theta_1\n{rows}\n")
    entry = '[columns]\nv_in = { column = "tau_mnm", unit = "mN m", offset = 0.01 }\n'
    asked = model("pendulum", "N m", entry).with_fit({"X1": (0.1, 0.01)})
    log = load_log(tmp_path / "log.csv", asked.columns, asked.table)
    np.testing.assert_allclose(log.voltage[:2], [0.11, -0.09])
    assert asked.assumptions["input_unit"] == "N m"


def test_inspect_proposes_the_unit_that_the_name_of_the_input_tells(tmp_path):
    def proposal(column):
        rows = "\n".join(f"{0.01 * k},{np.sin(k)},{0.1 * np.sin(0.1 * k)}" for k in range(600))
        (tmp_path / "log.csv").write_text(f"time,{column},angle\n{rows}\n")
        return inspect_file(model("pendulum", "V"), tmp_path / "log.csv")[1].proposal

    assert '[input]\nunit = "N m"' in proposal("tau1")
    assert 'v_in = { column = "current_mA", unit = "mA" }' in proposal("current_mA")
    assert '[input]\nunit = "A"' in proposal("current_mA")
    assert 'v_in = { column = "cmd_torque [mNm]", unit = "mN m" }' in proposal("cmd_torque [mNm]")
    assert "[input]" not in proposal("motor_mV")
