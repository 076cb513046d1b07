"""What no data can tell apart is found from the equations, and the simulated robot agrees."""

import numpy as np
import pytest

import derive
from tests.support import simulated
from wheelpend import Model, add
from wheelpend.benchmarks.hidden_effects.cases import benchmark_plant
from wheelpend.diagnosis.score_test import linear_names
from wheelpend.errors import Failure
from wheelpend.kernels import load as kernels
from wheelpend.simulation.hidden import machine_values


def same(one, other, tolerance=1e-9):
    return max(np.abs(one.measured - other.measured).max(), np.abs(one.voltage - other.voltage).max()) < tolerance


def test_viscous_friction_in_the_drive_is_part_of_x6_and_x7(library):
    assert library.ABSORBED == {"viscous_drive.coefficient": {"X6": 1.0, "X7": 1.0}}
    assert not any(name.startswith("viscous_drive") for name in library.PARAMETERS)


def test_ground_friction_is_part_of_x6_only_where_its_reaction_does_not_reach_the_body():
    names = ["ground_viscous", "air_drag"]
    assert derive.relations("wheel_pendulum", {}, names).absorbed == {}
    alone = derive.relations("wheel_pendulum", {"ground_friction_reaction": "none"}, names).absorbed
    assert list(alone) == ["ground_viscous.coefficient"]
    assert set(alone["ground_viscous.coefficient"]) <= {"X6", "X7"}


def test_hiding_an_absorbed_effect_is_raising_the_parameters_that_contain_it():
    plain, raised = (
        machine_values(Model.default(), {}),
        machine_values(Model.default(), {"viscous_drive.coefficient": 0.05}),
    )
    assert {n: raised[n] - plain[n] for n in plain if raised[n] != plain[n]} == pytest.approx({"X6": 0.05, "X7": 0.05})
    log = simulated(duration=2.0, noise=False, viscous_drive__coefficient=0.05)
    assert not same(log, simulated(duration=2.0, noise=False), 1e-3)


def test_an_absorbed_effect_cannot_be_added_and_is_said_to_be_part_of_what(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from wheelpend.cli.commands import app

    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["new"]).exit_code == 0
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    result = CliRunner().invoke(app, ["add", "viscous_drive"])
    assert result.exit_code == 1
    assert "viscous_drive is part of X6, X7" in " ".join(result.stderr.split())
    assert before == {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    with pytest.raises(Failure, match="is part of X6, X7"):
        add(Model.default(), "viscous_drive", [simulated(duration=3.0)])


def test_a_shifted_centre_of_mass_and_a_shifted_pitch_sensor_are_twins(library):
    assert library.TWINS["com_offset"] == ("imu_bias",)
    assert library.TWINS["imu_bias"] == ("com_offset",)


def test_friction_that_is_larger_one_way_and_a_constant_voltage_are_twins(library):
    assert library.TWINS["coulomb_asymmetry"] == ("voltage_offset",)
    one = simulated(duration=3.0, noise=False, coulomb_asymmetry__torque=0.1)
    other = simulated(duration=3.0, noise=False, voltage_offset__offset=-0.1)
    assert same(one, other)


def test_effects_that_only_resemble_each_other_are_no_twins(library):
    assert set(library.TWINS) == {"com_offset", "imu_bias", "coulomb_asymmetry", "voltage_offset"}


def test_friction_that_falls_with_speed_contains_friction_that_does_not(library):
    assert library.CONTAINS == {"stribeck_drive": {"coulomb_drive": ((1.0,), (1.0,))}}
    flat = simulated(duration=3.0, noise=False, stribeck_drive__static=0.3, stribeck_drive__sliding=0.3,
                     stribeck_drive__speed=0.5)  # fmt: skip
    assert same(flat, simulated(duration=3.0, noise=False, coulomb_drive__torque=0.3))


LIMITS = {
    e.name for e in derive.effects.EFFECT_LIBRARY.values() if e.releases == "twist" or e.releases == "creep"
}  # never quite rigid


@pytest.mark.parametrize(
    "effect", sorted({e.name for e in derive.effects.applicable_to(benchmark_plant())} - {"viscous_drive"} - LIMITS)
)
def test_an_absent_effect_changes_nothing_whatever_its_shape(library, effect):
    row = derive.effects.find(effect)
    shapes = {f"{effect}__{p.name}": p.typical for p in row.parameters if p not in row.sizes}
    absent = {f"{effect}__{p.name}": p.absent for p in row.sizes}
    assert same(simulated(duration=2.0, noise=False, **shapes, **absent), simulated(duration=2.0, noise=False))


def test_every_relation_is_the_same_whatever_the_order_of_the_effects():
    names = ["imu_bias", "com_offset", "coulomb_drive", "stribeck_drive", "viscous_drive"]
    assert derive.relations("wheel_pendulum", {}, names) == derive.relations("wheel_pendulum", {}, names[::-1])


def test_the_library_of_another_assumption_has_relations_of_its_own():
    assert set(kernels.library_module("wheel_pendulum", {"ground_friction_reaction": "none"}).ABSORBED) == {
        "viscous_drive.coefficient", "ground_viscous.coefficient"}  # fmt: skip


def test_what_contains_another_effect_has_one_size_for_all_logs():
    """What it adds to the other one is tested on sizes that all logs share."""
    links = kernels.library_module("pendulum", {}, ())
    assert set(links.CONTAINS["link_nonlinearity"]) == {"encoder_zero"}
    for module in (
        kernels.library_module("wheel_pendulum", {}, ()),
        kernels.library_module("cart_pole", {}, ()),
        links,
    ):
        for name in module.CONTAINS:
            row = derive.effects.find(name)
            assert {p.scope for p in row.parameters if row.name_of(p) in linear_names(row)} == {"shared"}, name
