"""Experiments computed in advance say what a fit then finds, and a designed command beats the built-in ones."""

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from typer.testing import CliRunner

import derive
from tests.conftest import simulated
from wheelpend import Failure, Model, save_log, simulate
from wheelpend.cli.main import app
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.experiments import reversals
from wheelpend.experiments.advice import CLEAR_SEPARATION_SIGMA, advice, recommend, recommendation_text
from wheelpend.experiments.closed_loop import Limits, balancing_gains
from wheelpend.experiments.design import design
from wheelpend.experiments.excitation import builtin_excitations
from wheelpend.experiments.pose import pose_problem
from wheelpend.experiments.question import question_of_fit
from wheelpend.experiments.search import best_trajectory
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import reference, save_trajectory

PAIR = ("gyro_scale", "pitch_scale")
SECONDS = 8.0


@lru_cache
def designed():
    return design(Model.default(), between=PAIR, duration=SECONDS, sample=0.002, generations=3)


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    path = tmp_path_factory.mktemp("command") / "command.csv"
    save_trajectory(path, designed().t, designed().theta_ref, designed().dtheta_ref)
    return str(path)


def fits(command, seed, effects=PAIR, scale=0.05):
    """Fits of each effect alone, beside the plant's own parameters, to a log of a machine that has the first."""
    model = Model.default()
    hidden = {f"{effects[0]}.scale": scale} if scale else {}
    log = simulate(model, command=command, duration=SECONDS, sample=0.002, hide=hidden, seed=seed)
    problem, start = prepare(model, [log], use_all=True), machine_values(model, {})
    names = [[*problem.base, *([f"{e}.scale"] if e else [])] for e in effects]
    return [
        fit_segments(problem, problem.training, {**start, **dict.fromkeys(n, 0.0), **start}, n, rounds=40)
        for n in names
    ]


def apart(command, seed):
    right, wrong = fits(command, seed)
    assert right.converged and wrong.converged
    return wrong.cost - right.cost


@lru_cache
def candidate(effect, rivals, command="aggressive", **hidden):
    """A log of 6 s, and the first candidate with its equivalents as a diagnosis would have them."""
    problem = prepare(Model.default(), [simulated(command, seed=3, duration=6.0, **hidden)], use_all=True)
    name = derive.effects.find(effect).full_names[0]
    start = {**machine_values(Model.default(), {}), name: 0.0}
    fitted = fit_segments(problem, problem.training, start, [*problem.base, name], rounds=40)
    sizes = {name.partition(".")[2]: fitted.of_log(0)[name]}
    return problem, CandidateFit(effect, "", sizes, {}, {}, 0.0, "5/5", fitted.error, rivals, True, fitted)


def misaligned():
    return candidate("com_offset", ("imu_bias",), com_offset__angle=0.02)


def test_the_separation_that_is_promised_is_the_one_that_refits_find(command):
    found = designed()
    for name, promised in ((found.builtin, found.separation["builtin"]), (command, found.separation["designed"])):
        measured = np.sqrt(np.mean([apart(name, seed) for seed in range(3)]))
        assert measured == pytest.approx(promised, rel=0.35)
    assert found.separation["designed"] > 2.0 * found.separation["builtin"]


def test_the_standard_errors_that_are_promised_are_those_of_a_fit(command):
    fitted, _ = fits(command, seed=7)
    for name, value in designed().parameters.items():
        assert fitted.sigma(name) == pytest.approx(value.designed, rel=0.3)


def test_estimates_from_a_designed_command_scatter_as_promised_and_less_than_from_the_best_built_in_one(tmp_path):
    found = design(Model.default(), duration=SECONDS, sample=0.002, generations=3)
    save_trajectory(tmp_path / "x.csv", found.t, found.theta_ref, found.dtheta_ref)
    truth, scatter = machine_values(Model.default(), {}), {}
    for kind, name in (("builtin", found.builtin), ("designed", str(tmp_path / "x.csv"))):
        estimates = [fits(name, seed, effects=("",), scale=0.0)[0].values for seed in range(8)]
        scatter[kind] = {n: np.sqrt(np.mean([(e[n] - truth[n]) ** 2 for e in estimates])) for n in ("X1", "X2")}
        for n, spread in scatter[kind].items():
            assert 0.4 < spread / getattr(found.parameters[n], kind) < 1.8
    assert all(scatter["designed"][n] < 0.8 * scatter["builtin"][n] for n in ("X1", "X2"))


def test_a_designed_command_keeps_its_limits_also_on_a_machine_that_differs_from_the_model(command):
    found = designed()
    log = simulate(Model.default(), command=command, seed=5)
    assert found.peaks["designed"].pitch <= found.limits.pitch
    assert found.peaks["designed"].voltage <= found.limits.voltage
    assert np.abs(log.voltage).max() < 1.15 * found.limits.voltage
    assert np.abs(log.measured[:, 1]).max() < 1.15 * found.limits.pitch


def test_a_command_that_is_too_large_is_made_smaller_until_it_keeps_the_limits():
    question = pose_problem(Model.default(), (), PAIR, 4.0, 0.002, lambda text: None).question
    simple = next(b for b in builtin_excitations() if b.builtin == "simple")
    played = question.loop.play_within(simple, Limits(0.1, 24.0))
    assert 0.05 < played.peak_pitch <= 0.1 and played.factor < 0.5
    assert best_trajectory([simple], question.loop, Limits(1e-4, 24.0), lambda played: 1.0) is None  # noise tilts it so


def test_the_model_can_be_balanced_by_gains_of_its_own(library):
    values = machine_values(Model.default(), {})
    gains = balancing_gains(library, values, 0.001)
    question = pose_problem(Model.default(), (), PAIR, 10.0, 0.002, lambda text: None).question
    loop = replace(question.loop, gains=gains)
    assert all(loop.play(b).peak_pitch < 0.5 for b in builtin_excitations())
    assert np.all(gains < 0.0)  # a positive voltage tilts the body back


# ---- parts that are turned round


def test_what_a_turned_part_does_to_every_effect_follows_from_its_law():
    turns = {
        t.part: {e for e in derive.effects.LIBRARY if reversals.changes_sign(t, e)} for t in reversals.PART_REVERSALS
    }
    assert turns["robot"] == {"slope"}
    assert {"imu_bias", "gyro_bias"} == turns["sensor"]
    assert {"voltage_offset", "voltage_asymmetry"} == turns["leads"]


def test_a_phase_is_another_one_after_a_turn():
    assert {reversals.sign_after_reversal(t, "wheel_runout.sine") for t in reversals.PART_REVERSALS} == {0}


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
    assert best.turn.part == "sensor" and best.separation == pytest.approx(expected, rel=0.2)


def test_an_absolute_pitch_separates_what_no_command_does_and_a_finer_gyro_does_not():
    question = question_of_fit(*misaligned())
    played = question.loop.play(builtin_excitations()[0])
    sigma = float(question.problem.noise[0].sigma[1])
    assert question.separation(question.information_of(played)) < 1.0
    assert question.separation(question.information_of(played, finer={"dtheta_p": 0.1})) < 1.0
    assert (
        question.separation(question.information_of(played, truth={"theta_p": sigma})) > 10.0 * CLEAR_SEPARATION_SIGMA
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
    said = recommendation_text(question, [best._replace(separation=0.4 * CLEAR_SEPARATION_SIGMA)])
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


# ---- the command line


def run(*arguments, code=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == code, result.output + str(result.exception)
    return result


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Model.default().save(tmp_path / "model.toml")
    return tmp_path


def test_what_design_writes_simulate_plays(workspace, monkeypatch):
    monkeypatch.setattr("wheelpend.experiments.design.GENERATIONS", 1)
    found = json.loads(run("design", "--between", "slope,com_offset", "--duration", 4, "--sample", 0.004, "-o", "d.csv",
                           "--json", "-").stdout)  # fmt: skip
    assert (found["schema"], found["between"], found["file"]) == (1, ["slope", "com_offset"], "d.csv")
    assert found["separation"]["designed"] >= found["separation"]["builtin"]
    assert (workspace / "d.csv").read_text().splitlines()[0] == "t,theta_ref,dtheta_ref"
    run("simulate", "-o", "log.csv", "--command", "d.csv")
    assert len((workspace / "log.csv").read_text().splitlines()) == 4002


def test_without_a_log_the_logs_of_the_last_change_are_used(workspace, monkeypatch):
    save_log(workspace / "log.csv", simulated("simple", seed=1, duration=5.0))
    (workspace / "history.json").write_text(
        '[{"change": "add slope", "logs": ["log.csv"]}, {"change": "remove slope"}]'
    )
    found = run("design", "--between", "slope,com_offset", "--duration", 2, "--sample", 0.01).stdout
    assert "Beside log.csv" in found and "does not show in the logs" in found


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--between", "slope,com_ofset"), "Did you mean 'com_offset'?"),
        (("--between", "slope"), "two different effects"),
        (("--between", "viscous_drive,slope"), "is part of X6, X7"),
        (("--between", "com_offset,imu_bias"), "Turn the pitch sensor round"),
        (("--between", "coulomb_drive,stribeck_drive"), "--between stribeck_drive,coulomb_drive"),
        (("--voltage-limit", 2), "standing still alone takes"),
        (("--pitch-limit", 20), "between 0 and π/2"),
        (("--duration", 0.5), "2 to 600 s"),
        (("-o", "x.parquet"), "must end in .csv"),
    ],
)
def test_what_cannot_be_designed_is_refused_with_a_cure(workspace, arguments, said):
    assert said in run("design", *arguments, "--json", "-", code=1).output


def test_a_model_without_values_needs_a_log(workspace):
    text = Model.default().text
    start, end = text.index("[parameters]"), text.index("[sensors]")
    (workspace / "model.toml").write_text(text[:start] + text[end : text.index("[simulation]")])
    assert "give a LOG to fit" in run("design", code=1).output


def test_a_file_is_a_command_and_is_linear_between_its_rows(tmp_path):
    t = np.arange(0.0, 3.0, 0.1)
    save_trajectory(tmp_path / "c.csv", t, 0.1 * t, np.full_like(t, 0.1))
    angle, rate = reference(str(tmp_path / "c.csv"), np.array([0.05, 1.234]))
    assert angle == pytest.approx([0.005, 0.1234]) and rate == pytest.approx([0.1, 0.1])
    with pytest.raises(Failure, match=r"ends at 2\.9 s"):
        reference(str(tmp_path / "c.csv"), np.array([0.0, 5.0]))


def test_a_command_file_in_degrees_or_without_its_column_is_refused(tmp_path):
    t = np.arange(0.0, 3.0, 0.1)
    save_trajectory(tmp_path / "c.csv", t, 20.0 * t, t)
    with pytest.raises(Failure, match="Is it in degrees"):
        reference(str(tmp_path / "c.csv"), t)
    (tmp_path / "d.csv").write_text("t,pitch\n" + "".join(f"{x},0\n" for x in t))
    with pytest.raises(Failure, match="theta_ref is missing"):
        reference(str(tmp_path / "d.csv"), t)
    with pytest.raises(Failure, match="Known commands: aggressive"):
        reference("agressive", t)
