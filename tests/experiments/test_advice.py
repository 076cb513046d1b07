"""What an ambiguous diagnosis recommends: a command, a part turned round, a second sensor, more time."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

import derive
from derive.plants import wheel_pendulum
from tests.support import simulated
from wheelpend import Model
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.experiments import reversals
from wheelpend.experiments.advice import CLEAR_SEPARATION_SIGMA, advice, recommend, recommendation_text
from wheelpend.experiments.design import design
from wheelpend.experiments.excitation import builtin_excitations
from wheelpend.experiments.question import question_of_fit
from wheelpend.simulation.hidden import machine_values

PAIR = ("gyro_scale", "pitch_scale")


@lru_cache
def candidate(effect, rivals, command="aggressive", **hidden):
    """A log of 6 s, and the first candidate with its equivalents as a diagnosis would have them."""
    problem = prepare(Model.default(), [simulated(command, seed=3, duration=6.0, **hidden)], use_all=True)
    name = derive.effects.find(effect).full_names[0]
    start = {**machine_values(Model.default(), {}), name: 0.0}
    fitted = fit_segments(problem, problem.data.estimation, start, [*problem.base, name], rounds=40)
    sizes = {name.partition(".")[2]: Estimate(fitted.of_log(0)[name], fitted.sigma(name), "")}
    return problem, CandidateFit(effect, sizes, "", 0.0, "5/5", fitted.error, rivals, True, fitted)


def misaligned():
    return candidate("com_offset", ("imu_bias",), com_offset__angle=0.02)


def test_what_a_turned_part_does_to_every_effect_follows_from_its_law():
    turns = {
        t.part: {e for e in derive.effects.EFFECT_LIBRARY if reversals.changes_sign(t, e)}
        for t in wheel_pendulum.REVERSALS
    }
    assert turns["robot"] == {"slope"}
    assert {"imu_bias", "gyro_bias"} == turns["sensor"]
    assert {"voltage_offset", "voltage_asymmetry"} == turns["leads"]


def test_an_effect_that_moves_by_itself_is_not_rehearsed_and_the_others_are():
    problem, first = misaligned()
    said = advice(problem, replace(first, equivalent_to=("slosh", *first.equivalent_to)))
    assert said == f"{advice(problem, first)} Not rehearsed, since a motion of its own goes with it: slosh."
    for lacking in (replace(first, equivalent_to=("slosh",)), replace(first, effect="slosh")):
        assert advice(problem, lacking).startswith(f"To tell {lacking.effect}, {lacking.equivalent_to[0]} apart, rec")


def test_a_phase_is_another_one_after_a_turn():
    assert {reversals.sign_after_reversal(t, "wheel_runout.sine") for t in wheel_pendulum.REVERSALS} == {0}


def test_twins_are_separated_by_turning_the_part_that_one_of_them_belongs_to():
    said = advice(*misaligned())
    assert "Turn the pitch sensor round" in said
    assert "the size of imu_bias would change its sign, that of com_offset would not" in said
    driver = candidate("voltage_offset", ("coulomb_asymmetry",), voltage_offset__offset=0.2)
    assert "Swap the two leads" in advice(*driver)


def test_turning_the_sensor_separates_by_twice_the_size_over_the_error_of_both_logs():
    """A bias changes its sign: the two logs' estimates are 2 b apart, each with its own error."""
    question = question_of_fit(*misaligned())
    best = recommend(question)[0]
    own = question.errors(None)["com_offset.angle"]
    later = replace(question, pieces=()).errors(question.information_of(question.loop.play(best.played.excitation)))
    expected = 2 * 0.02 / np.hypot(own, later["com_offset.angle"])
    assert best.reversal.part == "sensor" and best.separation == pytest.approx(expected, rel=0.2)


def test_an_absolute_pitch_separates_what_no_command_does_and_a_finer_gyro_does_not():
    question = question_of_fit(*misaligned())
    played = question.loop.play(builtin_excitations()[0])
    sigma = float(question.problem.noise[0].sigma[1])
    assert question.separation(question.information_of(played)) < 1.0
    assert question.separation(question.information_of(played, sigma_factors={"dtheta_p": 0.1})) < 1.0
    assert (
        question.separation(question.information_of(played, fault_free_sigma={"theta_p": sigma}))
        > 10.0 * CLEAR_SEPARATION_SIGMA
    )


def test_without_a_controller_the_experiment_is_rehearsed_with_one_made_for_the_model():
    problem, first = misaligned()
    text = problem.model.text
    start, end = text.index("[controller]"), text.index("[columns]")
    said = advice(replace(problem, model=Model.parse(text[:start] + text[end:])), first)
    assert "Turn the pitch sensor round" in said and "rehearsed with a PID" in said
    assert 1 <= said.count(". ") + 1 <= 3


def test_where_a_command_separates_it_is_recommended_with_its_figure():
    said = advice(*candidate(PAIR[0], PAIR[1:], "simple", gyro_scale__scale=0.05))
    assert "the command 'aggressive'" in said and "standard errors" in said and "would still list both" in said


def test_what_is_too_small_for_every_record_is_given_the_time_that_it_would_take():
    question = question_of_fit(*candidate("coulomb_drive", ("rolling_resistance",), coulomb_drive__torque=0.2))
    best = recommend(question)[0]
    best = best._replace(separation=0.4 * CLEAR_SEPARATION_SIGMA)
    said = recommendation_text(replace(question, pieces=()), [best])
    assert "No record of 20 s separates coulomb_drive from rolling_resistance by 5" in said and "About 2 min of" in said


def test_a_second_sensor_is_asked_for_where_no_command_is_enough():
    said = advice(*candidate(PAIR[0], PAIR[1:], gyro_scale__scale=0.004))
    assert "with a second gyro whose zero and scale are known" in said


def test_a_record_with_fewer_samples_tells_less():
    question = question_of_fit(*misaligned())
    played = question.loop.play(builtin_excitations()[0])
    coarse = replace(question, density=0.1)
    assert coarse.information_of(played) == pytest.approx(0.1 * question.information_of(played))


def test_no_experiment_is_asked_for_where_the_logs_tell_already():
    problem, first = candidate("gyro_scale", ("pitch_scale",), gyro_scale__scale=0.1)
    _, other = candidate("pitch_scale", ("gyro_scale",), gyro_scale__scale=0.1)
    assert "No further record is needed" in advice(problem, first, [other])
    assert "No further record is needed" not in advice(problem, other, [first])


def test_without_between_what_a_diagnosis_leaves_ambiguous_is_the_aim_unless_no_command_can_decide_it():
    log = simulated(seed=3, duration=5.0, com_offset__angle=0.02)
    found = design(Model.default(), [log], duration=2.0, sample=0.01, generations=0)
    assert not found.between and found.separation is None
    assert "No command separates" in found.sentences[-1] and "Turn the pitch sensor round" in found.sentences[-1]
    assert all(v.designed < v.logs for n, v in found.parameters.items() if n.startswith("X"))


@pytest.mark.parametrize(
    ("rivals", "words"),
    [
        (("coulomb_asymmetry",), "look at the machine"),
        (("coulomb_asymmetry", "viscous_asymmetry"), "To tell voltage_offset, viscous_asymmetry apart, record one log"),
        (("viscous_asymmetry",), "To tell voltage_offset, viscous_asymmetry apart, record one log"),
    ],
)
def test_no_record_is_advised_that_cannot_tell_twins_apart(rivals, words):
    module = SimpleNamespace(
        TWINS={"voltage_offset": ("coulomb_asymmetry",)}, RANGE_OUTPUT=-1, INPUTS=("v_in",), INPUT="v_in", PARAMETERS=()
    )
    first = SimpleNamespace(effect="voltage_offset", equivalent_to=rivals)
    said = advice(SimpleNamespace(module=module, knows=lambda effect: False), first)
    assert words in said
    assert ("No log of this plant tells voltage_offset from coulomb_asymmetry" in said) is ("coulomb" in rivals[0])
