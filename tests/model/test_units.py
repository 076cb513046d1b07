"""Units of a plant's quantities, and what a volt is worth."""

import pytest

from wheelpend import Model
from wheelpend.model.units import PlantUnits, plant_units_of


def test_every_quantity_has_its_unit():
    units = plant_units_of(Model.default())
    found = {n: units.unit(n) for n in ("theta_w", "dtheta_p", "ddtheta_w", "v_in", "t", "dtheta_w - dtheta_p", "?")}
    assert found == {"theta_w": "rad", "dtheta_p": "rad/s", "ddtheta_w": "rad/s²", "v_in": "V", "t": "s",
                     "dtheta_w - dtheta_p": "rad/s", "?": ""}  # fmt: skip
    slide = plant_units_of(Model.default("slide"))
    assert (slide.unit("x"), slide.unit("dx")) == ("m", "m/s")


def test_a_force_in_volts_is_so_many_newton_metres():
    units = PlantUnits({}, "V", 0.5, "N·m")
    assert units.in_physical(3.0, "V s/rad") == (1.5, "N·m s/rad")
    assert units.in_physical(3.0, "rad") is None and units.in_physical(3.0, "Volts") is None
    assert PlantUnits({}, "V").in_physical(3.0, "V") is None


def test_a_volt_of_the_papers_robot_is_worth_what_its_constant_says():
    units = plant_units_of(Model.default())
    assert units.physical == "N·m"
    assert units.force_per_unit == pytest.approx(Model.default().constants[
        Model.default().plant_signature.scale_constant.name])  # fmt: skip
