"""A smoother says of every step what least squares over the whole log says."""

import numpy as np
import pytest

from wheelpend.estimation.filter_error import FilterProblem, FilterTrack
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.random_source import RandomSource
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.smoother import smoothed, smoothed_force, stretch_beginnings
from wheelpend.kernels.load import free_force_module
from wheelpend.logs.log import Log

X1 = 2.7058  # V s²/m
SIGMA, STEP_S, SUBSTEPS = 1e-5, 2e-3, 3  # m, s
RMS, TIME_S = 0.8, 0.02  # V, s


def carriage_log(samples=40):
    """Samples of a carriage's encoder, under a voltage and with noise; what it does in truth does not matter."""
    random = np.random.default_rng(1)
    t = STEP_S * np.arange(samples)
    x = np.cumsum(np.cumsum(random.normal(size=samples))) * 1e-6 + SIGMA * random.normal(size=samples)
    return Log("carriage", t, np.sin(30.0 * t), x[:, None], ("x",))


def carriage_problem(log, bounds):
    module = free_force_module("slide", {}, ())
    space = ParameterSpace.of(ParameterLayout.of((), 1), {"X1": X1, "gain": 35.15}, ())
    segments = Segments(log, np.array([SIGMA]), np.array(bounds))
    return FilterProblem(module, [segments], space, STEP_S / SUBSTEPS)


def least_squares(log, spread, first):
    """Position, speed and force at every substep: the likeliest, and their covariance, by one dense system."""
    h = STEP_S / SUBSTEPS
    keep = np.exp(-h / TIME_S)
    move = np.array([[1.0, h, h**2 / 2 / X1], [0.0, 1.0, h / X1], [0.0, 0.0, keep]])
    count = SUBSTEPS * (len(log) - 1) + 1
    rows, right = [], []

    def demand(blocks, value, sigma):
        row = np.zeros(3 * count)
        for step, block in blocks:
            row[3 * step : 3 * step + 3] = block
        rows.append(row / sigma)
        right.append(value / sigma)

    for axis, (value, sigma) in enumerate(zip((*first, 0.0), (*spread, RMS), strict=True)):
        demand([(0, np.eye(3)[axis])], value, sigma)
    for step in range(count - 1):
        pushed = np.array([h**2 / 2 / X1, h / X1, 0.0]) * log.inputs[0, step // SUBSTEPS]
        sigmas = (1e-12, 1e-10, RMS * np.sqrt(1.0 - keep**2))  # motion is certain, the force is not
        for axis in range(3):
            demand([(step, -move[axis]), (step + 1, np.eye(3)[axis])], pushed[axis], sigmas[axis])
    for sample, value in enumerate(log.measured[:, 0]):
        if np.isfinite(value):
            demand([(SUBSTEPS * sample, np.array([1.0, 0.0, 0.0]))], value, SIGMA)
    q, r = np.linalg.qr(np.array(rows))
    inverse = np.linalg.inv(r)
    found = inverse @ (q.T @ np.array(right))
    chosen = slice(None, None, SUBSTEPS)
    return found.reshape(-1, 3)[chosen], np.sqrt((inverse**2).sum(axis=1)).reshape(-1, 3)[chosen]


def test_a_carriage_with_a_random_force_is_smoothed_as_by_dense_least_squares():
    log = carriage_log()
    log.measured[7:10] = np.nan
    problem = carriage_problem(log, [[0, 20], [20, 40]])  # the second segment goes on where the first ended
    source = RandomSource("drive", (1.0,), (0.0,), RMS, TIME_S)
    track = problem.track(0, np.zeros(0), (source,))
    found = smoothed_force(track, problem.segments[0].bounds, (source,), (2, 1))
    mean, sigma = least_squares(log, problem.spreads[0], problem.starts[0][0])
    assert found.samples.tolist() == list(range(40))
    assert found.mean[:, 0] == pytest.approx(mean[:, 2], abs=2e-4 * RMS)
    assert found.sigma[:, 0] == pytest.approx(sigma[:, 2], rel=1e-3)
    assert found.states == pytest.approx(mean[:, :2], abs=1e-4 * np.abs(mean[:, :2]).max())


def test_a_stretch_that_starts_anew_knows_nothing_of_the_one_before():
    log, source = carriage_log(), RandomSource("drive", (1.0,), (0.0,), RMS, TIME_S)
    bounds = np.array([[0, 20], [25, 40]])
    both, alone = carriage_problem(log, bounds), carriage_problem(log, bounds[:1])
    found, first = (
        smoothed_force(p.track(0, np.zeros(0), (source,)), p.segments[0].bounds, (source,), (2, 1))
        for p in (both, alone)
    )
    assert found.samples.tolist() == [*range(20), *range(25, 40)]
    assert found.mean[:20] == pytest.approx(first.mean, rel=1e-9)
    assert found.sigma[:20] == pytest.approx(first.sigma, rel=1e-9)


def test_segments_that_go_on_are_one_stretch():
    assert stretch_beginnings(np.array([[3, 8], [8, 12], [20, 30]])).tolist() == [3, 20]


def test_a_source_of_no_size_stays_zero_and_certain():
    log = carriage_log()
    sources = tuple(RandomSource("drive", (1.0,), (0.0,), rms, TIME_S) for rms in (RMS, 0.0))
    found = [
        smoothed_force(carriage_problem(log, [[0, 40]]).track(0, np.zeros(0), own), np.array([[0, 40]]), own, (2, 1))
        for own in (sources, sources[:1])
    ]
    assert found[0].mean == pytest.approx(found[1].mean, rel=1e-6)
    assert found[0].sigma == pytest.approx(found[1].sigma, rel=1e-6)


def test_a_step_without_time_changes_nothing():
    unit = np.eye(2)
    predicted, filtered = np.diag([4.0, 1.0]), np.diag([0.8, 0.5])
    means = np.array([[[0.0, 0.0], [1.0, 0.2]], [[1.0, 0.2], [0.9, 0.4]]])
    track = FilterTrack(means, np.array([[predicted, filtered], [filtered, 0.5 * filtered]]), np.array([unit, unit]),
                        np.array([5, 5]))  # fmt: skip
    found = smoothed(track, np.array([5]))
    assert found.means == pytest.approx(np.array([[0.9, 0.4], [0.9, 0.4]]))
    assert found.covariances[0] == pytest.approx(0.5 * filtered)


def test_a_carriage_that_stands_for_long_has_no_missing_force():
    """Where it sticks its speed forgets all but rounding, from which nothing is to be learnt backwards."""
    random, count = np.random.default_rng(2), 600
    t = STEP_S * np.arange(count)
    u = np.where(t < 0.3, 3.0, 0.1)
    x, v = np.zeros(count), np.zeros(count)
    for k in range(1, count):  # ten steps of Euler with dry friction of 0.4 V and viscous friction of 2 V s/m
        place, speed = x[k - 1], v[k - 1]
        for _ in range(10):
            push = u[k - 1] - 2.0 * speed
            pushed = speed + 0.1 * STEP_S / 0.5 * (push - 0.4 * (np.sign(speed) or np.sign(push)))
            speed = pushed if pushed * (speed or push) > 0.0 and (speed or abs(push) > 0.4) else 0.0
            place += 0.1 * STEP_S * speed
        x[k], v[k] = place, speed
    assert x[-1] == x[-150] > 0.1  # it stands
    log = Log("carriage", t, u, (x + SIGMA * random.normal(size=count))[:, None], ("x",))
    effects = ("viscous_drive", "coulomb_drive")
    names = ("viscous_drive.coefficient", "coulomb_drive.torque")
    module = free_force_module("slide", {}, effects)
    values = {"X1": 0.5, "gain": 1.0, **dict(zip(names, (2.0, 0.4), strict=True))}
    space = ParameterSpace.of(ParameterLayout.of((), 1), values, ())
    segments = Segments(log, np.array([SIGMA]), np.array([[0, count]]))
    source = RandomSource("drive", (1.0,), (0.0,), 1e-3, 1e-3)
    problem = FilterProblem(module, [segments], space, STEP_S / SUBSTEPS)
    found = smoothed_force(problem.track(0, np.zeros(0), (source,)), segments.bounds, (source,), (2, 1))
    assert np.abs(found.mean).max() < 0.1
    assert found.sigma.max() == pytest.approx(1e-3, rel=0.01)
