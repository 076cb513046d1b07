"""What generic code asks of a plant is in its signature, not in names: kinds of variables, directions, units."""

import math
import re

import numpy as np
import pytest

import derive
from derive.plant_signature import PlantSignature
from tests.plants.machines import LEVER, MACHINES, log_of, model_of, model_text
from wheelpend import Failure, Model
from wheelpend.diagnosis.missing_force.law_terms import CoveredRange, term_library
from wheelpend.diagnosis.missing_force.smooth_basis import SplineBasis
from wheelpend.estimation.data import prepare
from wheelpend.estimation.step_size import linearised_motion
from wheelpend.experiments.recommendation import sensor_options, usual_limits
from wheelpend.kernels.load import model_module
from wheelpend.logs.coloured_noise import angle_rate_inconsistency
from wheelpend.model.units import plant_units_of
from wheelpend.model.user_effects import effects_from_text


@pytest.mark.parametrize("machine", MACHINES)
def test_a_signature_is_read_as_it_was_written(machine):
    plant = model_of(machine).plant_signature
    assert PlantSignature.from_json(plant.to_json()) == plant


def test_speeds_and_inputs_are_known_by_the_signature_whatever_they_are_called():
    plant = model_of(LEVER).plant_signature
    assert (plant.positions, plant.speeds, plant.inputs) == ({"phi": "rad"}, {"dphi": "rad/s"}, ("tau",))
    assert [(c.name, c.rate_of) for c in plant.channels] == [("phi", ""), ("spin", "phi")]
    motion = np.linspace(-1.0, 1.0, 50)
    assert SplineBasis.of(motion, has_direction=True).has_jump
    assert not SplineBasis.of(motion, has_direction=False).has_jump


@pytest.mark.slow
def test_an_angle_is_held_against_its_rate_whatever_their_names():
    log = log_of(LEVER)
    assert 0.0 < angle_rate_inconsistency(log, "phi") < 0.01


def test_forces_between_parts_follow_the_ports_and_rows_of_different_units_are_never_added():
    directions = {m: {n: p.weights for n, p in model_of(m).plant_signature.couplings.items()} for m in MACHINES}
    assert directions["wheel_pendulum"] == {"drive": (1.0, -1.0)}
    assert directions["two links"] == {"joint": (-1.0, 1.0)}
    assert directions["cart_pole"] == directions["slide"] == directions[LEVER] == {}
    cart_pole = plant_units_of(model_of("cart_pole"))
    assert (cart_pole.force_on("cart"), cart_pole.force_on("pole")) == ("V", "V m")
    assert cart_pole.in_physical(2.0, "V m") == (2.0, "N m")


def test_the_unknown_force_on_a_row_has_the_unit_of_that_row():
    model = derive.library_model("cart_pole", {})
    assert {p.name: p.unit for p in model.fitted if p.name.startswith("missing.")} == {
        "missing.cart": "V", "missing.pole": "V m"}  # fmt: skip


def test_terms_of_a_free_law_have_the_units_of_the_part_they_act_on():
    def units(machine):
        plant = model_of(machine).plant_signature
        names = [*plant.positions, *plant.speeds]
        covered = CoveredRange(dict.fromkeys(names, -9.0), dict.fromkeys(names, 9.0), dict.fromkeys(names, (0.5,)))
        return {(t.port, t.text): t.sizes[0][1] for t in term_library(plant, covered)}

    assert units("slide")["drive", "size*dx"] == "V s/m"
    assert units("cart_pole")["joint", "size*dtheta_p"] == "V s m/rad"
    assert units("cart_pole")["joint", "size*dx"] == "V s"
    assert units(LEVER)["drive", "size*dphi"] == "A s/rad"
    assert units("pendulum")["drive", "size*dtheta_1"] == "s/rad"
    assert not any("sin(" in text for _, text in units("slide"))


def test_sensors_and_limits_that_advice_speaks_of_are_the_plants_own():
    options = sensor_options(model_of(LEVER).plant_signature)
    assert [o.channel for o in options] == ["spin", "phi", "spin", "phi"]
    assert options[0].description == "a sensor of spin with a tenth of the noise"

    class Asked:
        problem = prepare(model_of(LEVER), [log_of(LEVER)], use_all=True)

    limits = usual_limits(Asked())
    assert limits.pitch == 0.4 and limits.voltage == np.abs(log_of(LEVER).voltage).max()


def test_the_fastest_motion_needs_no_names():
    module = model_module("cart_pole", {}, ())
    matrix = linearised_motion(module, np.array([1.1, 0.05, 0.0333, 0.49, 4.0]))
    assert np.array_equal(matrix[:2, 2:], np.eye(2)) and matrix[3, 1] > 0  # the pole falls


def test_a_law_of_ones_own_calls_the_input_by_its_name():
    text = """[soft_start]
family = "actuator"
sentence = "The driver gives less at first."
on = "input"
law = "tau*(1 - share*exp(-t))"
[soft_start.parameters]
share = { unit = "1", typical = 0.3 }
"""
    (row,) = effects_from_text(text, model_of(LEVER).plant_signature)
    assert row.name == "soft_start"
    with pytest.raises(Failure, match="tau"):
        effects_from_text(text.replace("tau*", "v_in*"), model_of(LEVER).plant_signature)


def test_keys_of_sensors_are_those_that_a_plant_brings():
    model = Model.parse(f"{model_text(LEVER)}\n[sensors]\nresolver_counts = 512\nresolver_noise = 0.002\n")
    angle, spin = model.plant_signature.channels
    assert (model.sensors.noise_of(angle), model.sensors.noise_of(spin)) == (0.002, None)
    assert model.sensors.step_of(angle) == pytest.approx(2 * math.pi / 512)
    for wrong, says in (("encoder_counts = 60000", "No key named 'encoder_counts' in [sensors]. Known keys: resolver"),
                        ('resolver_noise = "loud"', "sensors.resolver_noise: must be a number or 'auto'"),
                        ("resolver_counts = -1", "sensors.resolver_counts: must be at least 0")):  # fmt: skip
        with pytest.raises(Failure, match=re.escape(says)):
            Model.parse(f"{model_text(LEVER)}\n[sensors]\n{wrong}\n")
