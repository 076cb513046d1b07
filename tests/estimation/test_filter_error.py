"""The likelihood of the filter-error method, beside dense covariances of all readings; its derivatives; its sources."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve, expm

from derive.plants import reference_of
from tests.plants.machines import LINKS
from tests.support import X, simulated
from wheelpend import Log, Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.filter_error import total_deviance
from wheelpend.estimation.random_source import correlation_bounds, possible_errors, possible_forces
from wheelpend.estimation.scoring import noise_equations, parameter_equations
from wheelpend.identification.filter_error_method import filter_estimator

MASS = reference_of("slide")["X1"]  # V s²/m
SLIDE = Model.parse('plant = "slide"\n[assumptions]\nrate_sensor = true\n')
ARM_VALUES = {**LINKS, "X4": 0.9, "X5": 0.3, "X6": 0.1, "X7": 0.05}
ARM = Model.parse('plant = "pendulum"\n[assumptions]\nlinks = 2\ndriven = "both"\nsecond_encoder = "absolute"\n')
NOISE = {"slide": (1e-3, 2e-2), "pendulum": (1e-6, 1e-6)}  # σ of each channel
FORCE, ARM_FORCE, FORCE_TIME = 0.3, 1e-5, 0.05  # V, V, s
ERROR, ERROR_TIME = 3e-3, 0.2  # m, s


def slide_equations():
    """A, B and the force's direction of the carriage; readings are its states."""
    return np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0 / MASS]])


def arm_equations():
    """The same of two links that hang down and hardly move."""
    v = ARM_VALUES
    inertia = np.array([[v["X1"], v["X2"]], [v["X2"], v["X3"]]])
    damping = np.array([[v["X6"], -v["X7"]], [-v["X7"], v["X7"]]])
    a, b = np.zeros((4, 4)), np.zeros((4, 2))
    a[:2, 2:] = np.eye(2)
    a[2:] = np.linalg.solve(inertia, np.hstack([-np.diag([v["X4"], v["X5"]]), -damping]))
    b[2:] = np.linalg.inv(inertia)
    return a, b


def steps_of(a, b, t):
    """Transition of the states over each interval, and what a held unit force adds to them."""
    n, m = b.shape
    whole = np.vstack([np.hstack([a, b]), np.zeros((m, n + m))])
    return [(e[:n, :n], e[:n, n:]) for e in (expm(whole * h) for h in np.diff(t))]


def recorded(name, t, volts, rows=1, seed=0):
    """A log of a machine that starts in rest, with a random force on its first row and noise."""
    a, b = slide_equations() if name == "slide" else arm_equations()
    size = FORCE if name == "slide" else ARM_FORCE
    random, states, force = np.random.default_rng(seed), [np.zeros(len(a))], size
    for (phi, gamma), h, u in zip(steps_of(a, b, t), np.diff(t), volts, strict=False):
        push = np.atleast_1d(u).astype(float) @ (np.eye(1) if name == "slide" else np.array([[1.0, 0.0], [-1.0, 1.0]]))
        push[0] += force
        states.append(phi @ states[-1] + gamma @ push)
        decay = np.exp(-h / FORCE_TIME)
        force = decay * force + size * np.sqrt(1 - decay**2) * random.normal()
    channels = ("x", "dx") if name == "slide" else ("theta_1", "theta_2")
    clean = np.array(states)[:, : len(channels)]
    measured = clean + random.normal(size=clean.shape) * NOISE[name]
    return Log(f"{name}.csv", t, volts, measured, channels, range_channel="", rates={"dx": "x"})


def problem_of(model, log, values):
    """The filter problem of a log, with one step from sample to sample."""
    problem = prepare(model, [log], use_all=True, lean=True)
    estimator, _ = filter_estimator(problem, values)
    return replace(estimator.problem, max_step=10.0)


def stretches_of(problem):
    """Half-open ranges of samples through which one filter runs."""
    bounds = problem.segments[0].bounds
    ends = np.flatnonzero(np.r_[bounds[1:, 0] != bounds[:-1, 1], True])
    return [(int(bounds[f, 0]), int(bounds[e, 1]), f) for f, e in zip([0, *(ends[:-1] + 1)], ends, strict=True)]


def dense_deviance(problem, equations, drive, sources):
    """−2 log-likelihood from the covariance of all readings, a Gaussian vector; no recursion over them.

    What is not known of the start comes in by the matrix determinant lemma, so that nothing is lost by rounding.
    """
    log, sigma, total = problem.segments[0].log, problem.segments[0].sigma, 0.0
    spread = problem.spreads[0]
    for first, last, number in stretches_of(problem):
        t, start = log.t[first:last], problem.starts[0][number]
        steps, count, n = steps_of(*equations, t), last - first, len(spread)
        mean, by_start, by_force = start, np.eye(n), np.zeros((n, equations[1].shape[1], count))
        rows = []
        for k in range(count):
            rows.append((mean, by_start, by_force.copy()))
            if k < count - 1:
                phi, gamma = steps[k]
                mean, by_start = phi @ mean + gamma @ drive[first + k], phi @ by_start
                by_force = np.einsum("ij,jrk->irk", phi, by_force)
                by_force[:, :, k] += gamma
        outputs = len(sigma)
        means, starts, forces = (
            np.stack([r[j][:outputs] for r in rows]).reshape(count * outputs, -1) for j in range(3)
        )
        lag = np.abs(t[:, None] - t)
        covariance = np.kron(np.eye(count), np.diag(sigma**2))
        for s in sources:
            kernel = s.rms**2 * np.exp(-lag / s.correlation_time)
            if s.is_force:
                along = np.einsum("mrk,r->mk", forces.reshape(count * outputs, -1, count), s.rows)
                covariance += along @ kernel @ along.T
            else:
                covariance += np.kron(kernel, np.outer(s.readings, s.readings))
        read = log.measured[first:last].ravel()
        good = np.isfinite(read)
        total += gaussian_deviance(
            (read - means.ravel())[good],
            covariance[np.ix_(good, good)],
            starts[good] * spread,
            np.tile(sigma, count)[good],
        )
    return total


def gaussian_deviance(residual, covariance, directions, sigma):
    """−2 log-density of a residual with a covariance and unit variance along some directions, less that of σ."""
    factor = cho_factor(covariance, lower=True)
    solved = cho_solve(factor, np.column_stack([residual, directions]))
    inner = np.eye(directions.shape[1]) + directions.T @ solved[:, 1:]
    crossed = directions.T @ solved[:, 0]
    square = residual @ solved[:, 0] - crossed @ np.linalg.solve(inner, crossed)
    return square + 2 * np.log(np.diag(factor[0])).sum() + np.linalg.slogdet(inner)[1] - 2 * np.log(sigma).sum()


def slide_sources(problem, *, force=True, error=False):
    module, plant = problem.module, SLIDE.plant_signature
    chosen = (possible_forces(plant, module.NY)[0].with_noise(FORCE, FORCE_TIME),) if force else ()
    return chosen + ((possible_errors(module.OUTPUTS, module.NQ)[0].with_noise(ERROR, ERROR_TIME),) if error else ())


def volts_at(t):
    return 4.0 * np.sign(np.sin(3.0 * t)) + 1.5 * np.sin(11.0 * t)


def even(count=500):
    return 0.01 * np.arange(count)


@pytest.fixture(scope="module")
def slide_log():
    return recorded("slide", even(), volts_at(even()))


def agreement(log, *, force=True, error=False):
    """Deviance of the filter and of the dense covariance."""
    problem = problem_of(SLIDE, log, {"X1": MASS})
    sources = slide_sources(problem, force=force, error=error)
    found = problem.deviances(np.array([MASS]), [sources])[0]
    return found, dense_deviance(problem, slide_equations(), log.known_voltage[:, None], sources)


@pytest.mark.parametrize(("force", "error"), [(False, False), (True, False), (False, True), (True, True)])
def test_the_likelihood_is_that_of_the_dense_covariance(slide_log, force, error):
    found, dense = agreement(slide_log, force=force, error=error)
    assert found == pytest.approx(dense, rel=1e-6)


def test_and_where_samples_are_missing_and_one_sensor_is_slower(slide_log):
    measured = slide_log.measured.copy()
    measured[np.arange(len(measured)) % 10 != 3, 1] = np.nan  # the speed comes at a tenth of the rate
    measured[np.random.default_rng(1).random(len(measured)) < 0.2, 0] = np.nan
    found, dense = agreement(replace(slide_log, measured=measured), error=True)
    assert found == pytest.approx(dense, rel=1e-6)


def test_and_where_the_clock_jitters():
    t = even() + np.random.default_rng(2).uniform(-0.003, 0.003, 500) * (np.arange(500) > 0)
    found, dense = agreement(recorded("slide", t, volts_at(t)))
    assert found == pytest.approx(dense, rel=1e-6)


def test_and_where_a_gap_begins_it_anew(slide_log):
    kept = np.r_[:230, 300:500]
    cut = replace(slide_log, t=slide_log.t[kept], voltage=slide_log.voltage[kept], measured=slide_log.measured[kept])
    problem = problem_of(SLIDE, cut, {"X1": MASS})
    assert len(stretches_of(problem)) == 2
    found, dense = agreement(cut, error=True)
    assert found == pytest.approx(dense, rel=1e-6)


@pytest.mark.slow
def test_and_of_a_machine_with_two_inputs():
    t = 0.005 * np.arange(400)
    volts = 1e-4 * np.column_stack([np.sign(np.sin(5 * t)), np.cos(7 * t)])
    log = recorded("pendulum", t, volts)
    problem = problem_of(ARM, log, ARM_VALUES)
    force = possible_forces(ARM.plant_signature, 2)
    sources = (force[0].with_noise(ARM_FORCE, 0.05), force[-1].with_noise(0.2 * ARM_FORCE, 0.2))
    theta = np.array([ARM_VALUES[p.name] for p in problem.space.layout.elements])
    drive = volts @ np.array([[1.0, 0.0], [-1.0, 1.0]])
    found, dense = problem.deviances(theta, [sources])[0], dense_deviance(problem, arm_equations(), drive, sources)
    assert found == pytest.approx(dense, rel=1e-6)


def test_the_score_at_held_gains_is_the_derivative_where_no_force_makes_gains_depend_on_it(slide_log):
    problem = problem_of(SLIDE, slide_log, {"X1": MASS})
    theta, step = np.array([1.1 * MASS]), 1e-5
    run = problem.run(theta, [()])[0]
    more, less = (problem.deviances(theta + d, [()])[0] for d in (step, -step))
    assert run.deviance.sum() == pytest.approx(problem.deviances(theta, [()])[0], rel=1e-12)
    assert -2.0 * run.gram[:, 0, 1].sum() == pytest.approx((more - less) / (2 * step), rel=1e-6)
    moved, here = (problem.innovations(t, [()])[0][..., 0] for t in (theta + step, theta))
    assert np.array_equal(run.innovation, problem.inside_innovations(theta, [()])[0], equal_nan=True)
    assert run.gram[:, 0, 0].sum() == pytest.approx(np.nansum(((moved - here) / step) ** 2), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("torque", [0.4, 0.0, -0.1])
@pytest.mark.parametrize("parts", [1, 5])
def test_a_filter_is_the_same_whichever_parameters_are_free(slide_log, torque, parts):
    problem = problem_of(SLIDE.with_effects(["coulomb_drive"]), slide_log, {"X1": MASS, "coulomb_drive.torque": torque})
    problem = replace(problem, max_step=1e-2, parts=parts)
    theta, sources = problem.space.start(), [slide_sources(problem, force=True, error=False)]
    run = problem.run(theta, sources)[0]
    assert run.deviance.sum() == pytest.approx(problem.deviances(theta, sources)[0], rel=1e-12)
    alone = problem.inside_innovations(theta, sources)[0]
    assert run.innovation == pytest.approx(alone, rel=1e-9, abs=1e-9, nan_ok=True)


@pytest.fixture(scope="module")
def arm_problem():
    """Two links with a force on the first and an error of the second's encoder, at values that are a little wrong."""
    t = 0.005 * np.arange(400)
    volts = 1e-3 * np.column_stack([np.sign(np.sin(5 * t)), np.cos(7 * t)])
    problem = problem_of(ARM, recorded("pendulum", t, volts), ARM_VALUES)
    sources = (
        possible_forces(ARM.plant_signature, 2)[0].with_noise(2 * ARM_FORCE, 0.08),
        possible_errors(problem.module.OUTPUTS, 2)[1].with_noise(2e-6, 0.1),
    )
    theta = np.array([1.03 * ARM_VALUES[p.name] for p in problem.space.layout.elements])
    return problem, theta, sources


def slopes(deviance, point, steps):
    """Central differences of −2 log-likelihood (n,)."""
    around = np.diag(steps)
    return np.array([(deviance(point + d) - deviance(point - d)) / (2 * d.max()) for d in around])


def test_the_score_with_what_the_gains_change_is_the_derivative_of_the_likelihood(arm_problem):
    problem, theta, sources = arm_problem
    held = problem.equations(problem.run(theta, [sources])).sum()
    now = problem.inside_innovations(theta, [sources])
    found = parameter_equations(problem, theta, [sources], now, held.information)
    sigma = 1.0 / np.sqrt(np.diag(held.information))
    expected = slopes(lambda x: problem.deviances(x, [sources])[0], theta, 0.01 * sigma) * sigma
    assert -2.0 * found.score * sigma == pytest.approx(expected, rel=0.02, abs=0.05)
    assert np.abs(-2.0 * held.score * sigma - expected).max() > 0.2  # what gains held as they are leave out


def test_the_score_of_sizes_and_times_is_the_derivative_of_the_likelihood(arm_problem):
    problem, theta, sources = arm_problem

    def deviance(logs):
        sizes, times = np.exp(logs.reshape(2, 2))
        return problem.deviances(theta, [tuple(s.with_noise(*n) for s, *n in zip(sources, sizes, times, strict=True))])[
            0
        ]

    at = np.log([s.rms for s in sources] + [s.correlation_time for s in sources])
    now = problem.inside_innovations(theta, [sources])
    information, score = noise_equations(problem, theta, [sources], now, [False] * len(sources))
    assert -2.0 * score == pytest.approx(slopes(deviance, at, np.full(4, 0.01)), rel=0.05, abs=1.0)
    assert np.linalg.eigvalsh(information).min() > 0.0


def test_a_filter_that_runs_away_has_no_likelihood_and_no_traceback(slide_log):
    problem = problem_of(SLIDE, slide_log, {"X1": MASS})
    for mass in (0.0, 1e-200):
        assert problem.deviances(np.array([mass]), [()])[0] > 1e6
        assert total_deviance(problem.run(np.array([mass]), [()])) > 1e6


def test_a_correlation_time_is_at_most_a_second_and_a_twentieth_of_the_shortest_log():
    assert correlation_bounds([100.0, 60.0], 0.001) == (0.0005, 1.0)
    assert correlation_bounds([100.0, 6.0], 0.001) == (0.0005, pytest.approx(0.3))
    shortest, longest = correlation_bounds([2.0], 0.5)  # hardly any samples
    assert 0.0 < shortest < longest == pytest.approx(0.1)


@pytest.mark.parametrize(
    "text", ["", 'plant = "slide"', 'plant = "cart_pole"', 'plant = "pendulum"\n[assumptions]\nlinks = 2']
)
def test_no_two_possible_forces_act_on_the_same_rows(text):
    plant = (Model.parse(text + "\n") if text else Model.default()).plant_signature
    forces = possible_forces(plant, 3)
    weights = [s.rows for s in forces]
    assert len(set(weights)) == len(weights) == len({s.place for s in forces})
    for row in np.eye(len(plant.coordinates)):
        assert tuple(row) in weights  # each row may feel one of its own
    assert all(not any(s.readings) and s.is_force for s in forces)


def test_a_part_of_long_logs_keeps_segments_that_follow_on_each_other():
    problem = problem_of(Model.default(), simulated(), X)
    part, whole = problem.on_part(6000).segments[0].bounds, problem.segments[0].bounds
    assert 6000 <= np.diff(part, axis=1).sum() < 7100
    jumps = np.flatnonzero(part[1:, 0] != part[:-1, 1])
    assert len(jumps) == 1 and part[0, 0] == whole[0, 0]  # the beginning, and another piece from the middle on
    assert abs(part[jumps[0] + 1, 0] - len(problem.segments[0].log) / 2) < 1000
    assert problem.on_part(10**6).segments[0].bounds.tolist() == whole.tolist()
