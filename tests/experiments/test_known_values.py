"""Information, separation, limits and trajectories against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

import derive
from tests.plants.machines import model_text
from tests.support import simulated
from wheelpend import Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.experiments.advice import duration_text, records_needed
from wheelpend.experiments.design_start import start_without_logs
from wheelpend.experiments.excitation import multisine, sweep
from wheelpend.experiments.information import add_information, separation, standard_errors
from wheelpend.experiments.question import Question
from wheelpend.experiments.simulated_experiment import Limits, SimulatedExperiment

BASE, FIRST, OTHER = "X1", "slope.angle", "gyro_scale.scale"
SHARED = [FreeParameter(n) for n in (BASE, FIRST, OTHER)]
OWN_SLOPE = [FreeParameter(BASE), FreeParameter(FIRST, scope="per log"), FreeParameter(OTHER)]


def information(seed=0):
    """Rows of three sensitivities, and their information."""
    rows = np.random.default_rng(seed).normal(size=(60, 3)) @ [[1, 0.5, 0.2], [0, 1, 0.7], [0, 0, 1.0]]
    return rows, rows.T @ rows


def test_a_separation_is_the_root_of_what_the_best_refit_leaves():
    rows, found = information()
    joint = add_information([found], SHARED)
    data = 0.3 * rows[:, 1]
    answer = np.linalg.lstsq(rows[:, [0, 2]], data, rcond=None)[0]
    left = np.sum((data - rows[:, [0, 2]] @ answer) ** 2)
    assert separation(joint, [{FIRST: 0.3}], [FIRST], [OTHER], [BASE]) == pytest.approx(np.sqrt(left))
    twice = add_information([found, found], SHARED)
    assert separation(twice, [{FIRST: 0.3}], [FIRST], [OTHER], [BASE]) == pytest.approx(np.sqrt(2 * left))


def test_standard_errors_are_those_beside_all_other_parameters():
    _, found = information()
    joint = add_information([found], SHARED)
    expected = np.sqrt(np.diag(np.linalg.inv(found)))
    errors = standard_errors(joint, [BASE, FIRST, OTHER])
    assert list(errors.values()) == pytest.approx(expected) and list(errors) == [BASE, FIRST, OTHER]
    alone = standard_errors(joint, [BASE, OTHER])
    assert alone[BASE] == pytest.approx(np.sqrt(np.linalg.inv(found[np.ix_([0, 2], [0, 2])])[0, 0]))


def test_a_value_of_each_log_has_its_own_place_and_one_that_turns_its_sign():
    (_, one), (_, two) = information(1), information(2)
    own = add_information([one, two], OWN_SLOPE)
    assert [(p.name, p.log) for p in own.layout.elements] == [(BASE, None), (OTHER, None), (FIRST, 0), (FIRST, 1)]
    assert own.information[2, 2] == pytest.approx(one[1, 1]) and own.information[3, 3] == pytest.approx(two[1, 1])
    assert own.information[2, 3] == 0.0 and own.information[0, 0] == pytest.approx(one[0, 0] + two[0, 0])
    tied = add_information([one, two], OWN_SLOPE, {BASE: 1, FIRST: -1, OTHER: 0})
    assert [(p.name, p.log) for p in tied.layout.elements] == [(BASE, None), (OTHER, None), (FIRST, 0), (OTHER, 1)]
    assert tied.information[0, 2] == pytest.approx(one[0, 1] - two[0, 1])
    assert tied.information[2, 2] == pytest.approx(one[1, 1] + two[1, 1])
    assert tied.information[0, 1] == pytest.approx(one[0, 2]) and tied.information[0, 3] == pytest.approx(two[0, 2])


def question(pieces, **changes):
    problem = prepare(Model.default(), [simulated(duration=2.0)], use_all=True)
    fields = {"problem": problem, "loop": None, "base": (BASE,), "first": "slope", "others": ("gyro_scale",),
              "sizes": ({FIRST: 0.3, BASE: 1.0, OTHER: 0.0},), "pieces": pieces, **changes}  # fmt: skip
    return Question(**fields)


def test_a_record_adds_to_what_the_logs_tell_already():
    (_, one), (_, two) = information(1), information(2)
    asked = question((one,))
    assert asked.names == (BASE, FIRST, OTHER)
    both = asked.information_with(two)
    assert both.information[0, 0] == pytest.approx(one[0, 0] + two[0, 0])
    assert asked.information_with(None).information[0, 0] == pytest.approx(one[0, 0])
    assert asked.separation(two) > asked.separation(None) > 0.0
    assert asked.errors(two)[BASE] < asked.errors(None)[BASE]


def test_the_errors_of_rivals_differ_by_what_their_sums_of_squares_do():
    played = SimpleNamespace(log=SimpleNamespace(measured=np.zeros((1000, 2))))
    asked = question((), density=1.5)
    values = asked.problem.data.estimation[0].values + 3000
    assert asked.gap(30.0, played) == pytest.approx(np.sqrt(1.0 + 900.0 / values) - 1.0)


def test_both_limits_must_be_kept():
    states = np.zeros((3, 4))
    states[:, 0], states[:, 1] = [-1.0, 0.0, 4.0], [0.1, -0.3, 0.0]
    log = SimpleNamespace(voltage=np.array([1.0, -12.0, 3.0]))
    played = SimulatedExperiment(None, log, states, np.zeros(0), 1.0, np.zeros(3), tilt=states[:, 1])
    assert (played.peak_pitch, played.peak_voltage, played.travel) == pytest.approx((0.3, 12.0, 5.0))
    assert played.is_within(Limits(0.3, 12.0))
    assert not played.is_within(Limits(0.29, 12.0)) and not played.is_within(Limits(0.3, 11.9))


def test_a_multisine_is_a_sum_of_sines_in_hertz():
    t = np.arange(0, 40.0, 0.01)
    angle = multisine([0.5, 1.5], np.array([0.1, 0.05]), np.array([0.0, 1.0])).trajectory(t, 1.0)[0]
    inside = (t > 15) & (t < 25)
    exact = 0.1 * np.sin(2 * np.pi * 0.5 * t) + 0.05 * np.sin(2 * np.pi * 1.5 * t + 1.0)
    assert angle[inside] == pytest.approx(exact[inside], abs=1e-9)
    assert angle[0] == angle[-1] == 0.0


def test_a_sweep_goes_from_its_lowest_frequency_to_its_highest():
    t = np.arange(0, 40.0, 0.001)
    angle = sweep(0.1, 0.2, 2.0).trajectory(t, 0.5)[0]
    zeros = t[1:][np.diff(np.sign(angle)) != 0]
    rates = 0.5 / np.diff(zeros)
    assert rates[1] == pytest.approx(0.2 * 10.0 ** ((zeros[1] + zeros[2]) / 80.0), rel=0.05)
    assert rates[-2] == pytest.approx(2.0, rel=0.05) and np.abs(angle).max() == pytest.approx(0.05, rel=0.01)
    middle = np.argmin(np.abs(zeros - 20.0))
    assert rates[middle] == pytest.approx(np.sqrt(0.4), rel=0.05)


def test_the_length_of_a_record_counts_what_the_logs_tell_already():
    assert records_needed(5.0, 0.0) == pytest.approx(1.0)  # a separation of 5 is clear
    assert records_needed(2.5, 0.0) == pytest.approx(4.0)  # squares add up
    assert records_needed(np.sqrt(10.0), 3.0) == pytest.approx(16.0)
    assert records_needed(3.0, 3.0) == np.inf and duration_text(23.6) == "24 s" and duration_text(700.0) == "12 min"


def test_typical_sizes_are_those_of_the_plant():
    start = start_without_logs(Model.parse(model_text("cart_pole")), "tether_spring")
    row = derive.effects.in_plant_units(derive.effects.find("tether_spring"), start.problem.plant)
    assert start.values[0]["tether_spring.stiffness"] == row.parameters[0].typical
    assert row.parameters[0].typical != derive.effects.find("tether_spring").parameters[0].typical
