"""Experiments computed in advance say what a fit then finds, and a designed command beats the built-in ones."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from wheelpend import Model, simulate
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.experiments.design import design
from wheelpend.experiments.excitation import builtin_excitations
from wheelpend.experiments.pose import pose_problem
from wheelpend.experiments.search import best_trajectory
from wheelpend.experiments.simulated_experiment import Limits, balancing_gains
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import save_trajectory

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
        fit_segments(problem, problem.data.estimation, {**start, **dict.fromkeys(n, 0.0), **start}, n, rounds=40)
        for n in names
    ]


def apart(command, seed):
    right, wrong = fits(command, seed)
    assert right.converged and wrong.converged
    return wrong.cost - right.cost


def test_the_separation_that_is_promised_is_the_one_that_refits_find(command):
    found = designed()
    for name, promised in ((found.builtin, found.separation["builtin"]), (command, found.separation["designed"])):
        measured = np.sqrt(np.mean([apart(name, seed) for seed in range(3)]))
        assert measured == pytest.approx(promised, rel=0.35)
        assert 0.8 < measured / promised < 1.2
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
            assert 0.4 < spread / getattr(found.parameters[n], kind) < 1.95
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
    loop = replace(question.loop, closed_loop=replace(question.loop.closed_loop, gains=gains))
    assert all(loop.play(b).peak_pitch < 0.5 for b in builtin_excitations())
    assert np.all(gains < 0.0)  # a positive voltage tilts the body back
