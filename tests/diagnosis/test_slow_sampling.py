"""A fast motor that is logged slowly: viscous friction stops it within a sample, and its inertia hardly shows."""

import numpy as np
import pytest

from wheelpend import Model, explain
from wheelpend.diagnosis.equation_scores import equation_scores
from wheelpend.estimation.data import prepare
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.starts import best_start

DT, DAMPING, MASS = 0.1, 4.3, 0.12  # s, V s/m, V s²/m: a time constant of 28 ms


def winch_log(seed: int, late: bool = True, samples: int = 300) -> dict[str, np.ndarray]:
    """Columns of a motor that winds and rests in turn, with a force of its own in each sample; exact between steps.

    A command acts half a sample ``late``, or else early.
    """
    random, lag = np.random.default_rng(seed), MASS / DAMPING
    moves = np.repeat(random.integers(-1, 2, samples), random.integers(4, 25, samples))[:samples]
    command = np.where(moves > 0, 8.4, np.where(moves < 0, -3.6, 0.0))
    final = (command + np.where(moves != 0, 0.9, 0.0) * random.normal(size=samples)) / DAMPING
    place, speed = np.zeros(samples), 0.0
    for k in range(samples - 1):
        place[k + 1] = place[k]
        for now in (final[max(k - 1, 0)], final[k]) if late else final[k : k + 2]:
            decay = np.exp(-0.5 * DT / lag)
            place[k + 1] += 0.5 * now * DT + lag * (speed - now) * (1.0 - decay)
            speed = now + (speed - now) * decay
    return {"t": DT * np.arange(samples), "v_in": command, "x": np.round(place, 4)}


def model_of_a_slide() -> Model:
    return Model.parse('plant = "slide"\n[sensors.step]\nx = 0.0001\n')


def test_a_regression_that_finds_no_inertia_gives_one_that_can_be_simulated():
    problem, start = best_start(prepare(model_of_a_slide(), [winch_log(0, late=False)]))
    found = equation_scores(problem, start)["viscous_drive"].values
    assert found["viscous_drive.coefficient"] == pytest.approx(DAMPING, rel=0.05)
    lag = found["X1"] / found["viscous_drive.coefficient"]
    assert 0.3 * problem.max_step < lag < problem.max_step  # the least that steps of the integrator follow
    module, log = problem.module, problem.logs[0]
    for effect in ("viscous_drive", "quadratic_drive", "coulomb_drive"):
        values = equation_scores(problem, start)[effect].values
        played = module.simulate(log.t, log.voltage, np.zeros(2), kernel_parameters(module, values, log), 0.01)
        assert np.isfinite(played).all()


@pytest.mark.parametrize(
    ("seed", "late"), [(0, False), *(pytest.param(k, True, marks=pytest.mark.slow) for k in (0, 1))]
)
def test_viscous_friction_is_named_that_stops_a_motor_within_a_sample(seed, late):
    found = explain(model_of_a_slide(), [winch_log(seed, late)])
    assert found.steps[0].effect == "viscous_drive"
    assert found.parameters["viscous_drive.coefficient"].value == pytest.approx(DAMPING, rel=0.05)
