"""Two measured logs, which lie beside the project: a machine axis and a balancing robot."""

import pytest

from tests.support import DATA, needs_data
from wheelpend import Model, add, compare, explain, identify
from wheelpend.benchmarks.measured.drawing import FORCE_PER_VOLT_N
from wheelpend.benchmarks.measured.emps import (
    BALANCING_LOG,
    ESTIMATION_LOG,
    PUBLISHED_EFFECTS,
    PUBLISHED_FORCE_VALUES,
    PULSES_LOG,
    SLIDE_MODEL,
)
from wheelpend.benchmarks.measured.robot import ROBOT_MODEL
from wheelpend.estimation.data import read_logs
from wheelpend.identification.inverse_dynamics import force_error
from wheelpend.inspection.inspect import inspect_file
from wheelpend.kernels import load as kernels

AXIS_EFFECTS = (*PUBLISHED_EFFECTS, "viscous_asymmetry")

pytestmark = needs_data


@pytest.fixture(scope="module")
def slide():
    return Model.parse(SLIDE_MODEL)


@pytest.fixture(scope="module")
def axis(slide):
    """What the tool finds in the estimation log from mass and offset alone."""
    return explain(slide, [DATA / ESTIMATION_LOG])


@pytest.mark.slow
def test_friction_of_the_axis_is_found_and_then_its_direction_dependence(axis):
    names = [s.effect for s in axis.steps]
    assert names[:2] == ["viscous_drive", "coulomb_drive"] and "viscous_asymmetry" in names
    assert all(s.error_after < 0.6 * s.error_before and s.force_after < s.force_before for s in axis.steps)
    assert [s.error_before for s in axis.steps[1:]] + [axis.error] == [s.error_after for s in axis.steps]
    assert axis.verdict == "unexplained"  # hundreds of times the encoder's noise are left, and said to be


@pytest.mark.parametrize(
    ("effects", "estimation", "pulses"),
    [(PUBLISHED_EFFECTS, 4.1, 6.0), (AXIS_EFFECTS, 3.15, 5.4)],
)
def test_what_inverse_dynamics_leave_is_what_was_published(slide, effects, estimation, pulses):
    model = slide.with_effects(effects)
    found = identify(model, [DATA / ESTIMATION_LOG], method="inverse")
    values = {n: row.value for n, row in found.parameters.items()}
    other = force_error(kernels.model_module("slide", {}, effects), read_logs([DATA / PULSES_LOG], model)[0], values)
    assert found.force_error <= estimation and other <= pulses
    if len(effects) == 3:
        assert {n: values[n] * FORCE_PER_VOLT_N for n in PUBLISHED_FORCE_VALUES} == pytest.approx(
            PUBLISHED_FORCE_VALUES, rel=0.01
        )


def test_without_coulomb_friction_the_others_are_corrupted(slide):
    found = identify(slide.with_effects(PUBLISHED_EFFECTS[:2]), [DATA / ESTIMATION_LOG], method="inverse").parameters
    assert (
        found["viscous_drive.coefficient"].value * FORCE_PER_VOLT_N
        > 1.9 * PUBLISHED_FORCE_VALUES["viscous_drive.coefficient"]
    )


@pytest.mark.slow
def test_force_pulses_are_located_in_time_and_not_absorbed_into_friction(slide):
    model = identify(slide.with_effects(AXIS_EFFECTS), [DATA / ESTIMATION_LOG], method="inverse").model
    calm, pushed = (compare(model, [DATA / name]) for name in (ESTIMATION_LOG, PULSES_LOG))
    assert not [b for b in calm.bursts if not b["at_reversal"]]
    times = [b["from"] for b in pushed.bursts]
    edges = [0.343 + 0.5 * k for k in range(2, 40)]  # of the pulses, as the file has them; the tool is not told
    assert sum(any(abs(t - edge) < 0.02 for t in times) for edge in edges) >= 36
    friction = [
        identify(slide.with_effects(PUBLISHED_EFFECTS), [DATA / name], method="shooting").parameters
        for name in (ESTIMATION_LOG, PULSES_LOG)
    ]
    for name in ("viscous_drive.coefficient", "coulomb_drive.torque"):
        assert friction[1][name].value == pytest.approx(friction[0][name].value, rel=0.05)


def test_the_columns_of_the_axis_are_guessed():
    _, found = inspect_file(Model.default("slide"), DATA / ESTIMATION_LOG)
    assert 'x = { column = "qm" }' in found.proposal and 'v_in = { column = "vir" }' in found.proposal
    assert "[sensors.noise]\nx = " in found.sensors


@pytest.mark.slow
def test_dry_friction_nearly_halves_the_held_out_error_of_the_balancing_robot():
    changed = add(Model.parse(ROBOT_MODEL), "coulomb_drive", [DATA / BALANCING_LOG])
    assert changed.step.error_after < 0.6 * changed.step.error_before
    assert changed.step.coefficients["torque"] == pytest.approx(0.4, abs=0.05)


@pytest.mark.slow
def test_dry_friction_is_what_the_balancing_robot_misses_first():
    found = explain(Model.parse(ROBOT_MODEL), [DATA / BALANCING_LOG])
    assert found.steps[0].effect in ("coulomb_drive", "presliding_drive")  # whether or not it gives before it slides
    assert found.error <= 0.6 * found.base_error


def test_the_balancing_robots_drive_stands_still_where_it_does():
    _, found = inspect_file(Model.parse(ROBOT_MODEL), DATA / BALANCING_LOG)
    longest = max(found.stand_still["theta_w"], key=lambda pair: pair[1] - pair[0])
    assert longest[0] == pytest.approx(3.17, abs=0.1) and longest[1] == pytest.approx(3.70, abs=0.1)
    assert found.jitter > 0.001


@pytest.mark.slow
def test_the_drive_constant_of_the_balancing_robot_comes_out_as_published():
    model = Model.parse(ROBOT_MODEL + "\n[assumptions]\nground_friction = false\n").with_effects(["coulomb_drive"])
    found = identify(model, [DATA / BALANCING_LOG])
    name = next(n for n in found.parameters if found.unit[n] == "V s/rad" and "." not in n)
    row = found.parameters[name]
    assert row.value == pytest.approx(0.546, abs=0.1) and abs(row.value - 0.546) < 2 * row.sigma
