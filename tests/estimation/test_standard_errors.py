"""Standard errors are the textbook's, and the larger ones where the noise is not as it should be."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Log, Model, identify
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.least_squares import filtered_least_squares
from wheelpend.estimation.linear_fit import solve_least_squares
from wheelpend.estimation.normal_equations import covariance_of
from wheelpend.estimation.parameter_table import conservative_standard_error, parameter_table, standard_error
from wheelpend.estimation.parameters import FreeParameter, kernel_parameters
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.identification.recursive import recursive_least_squares

SHAFT = Model.parse("""plant = "shaft"

[parameters]
X1 = { nominal = 0.005 }
X2 = { nominal = 0.05 }
""")
THREE = SimpleNamespace(LINEAR=("a", "b", "c"))


@pytest.fixture(scope="module")
def fitted():
    problem = prepare(Model.default(), [simulated(duration=6.0)], lean=True, horizon=0.1)
    return problem, fit_segments(problem, problem.data.estimation, X, problem.base)


def test_least_squares_has_the_estimate_and_the_standard_errors_of_the_textbook():
    rng = np.random.default_rng(0)
    matrix, truth = rng.normal(size=(200, 3)) * [1.0, 100.0, 0.01], np.array([1.0, 0.02, 300.0])
    right = matrix @ truth + rng.normal(size=200)
    estimate, (squares,), *_ = np.linalg.lstsq(matrix, right, rcond=None)
    sigma = np.sqrt(squares / 197 * np.diag(np.linalg.inv(matrix.T @ matrix)))
    found = solve_least_squares(THREE, right[:, None], matrix[:, None, :])
    assert found.estimate == pytest.approx(estimate, rel=1e-9)
    assert found.sigma == pytest.approx(sigma, rel=1e-9)
    scaled = matrix / np.linalg.norm(matrix, axis=0)
    assert found.condition == pytest.approx(np.linalg.cond(scaled.T @ scaled), rel=1e-9)
    assert (found.rows, found.unidentifiable) == (200, ())


def test_parameters_that_only_their_sum_tells_are_said_to_be_unidentifiable():
    matrix = np.random.default_rng(1).normal(size=(50, 3))
    matrix[:, 1] = 2.0 * matrix[:, 0]
    found = solve_least_squares(THREE, (matrix @ [1.0, 1.0, 1.0])[:, None], matrix[:, None, :])
    assert found.unidentifiable == ("a", "b")
    assert found.values["c"] == pytest.approx(1.0)


def test_recursion_ends_with_the_standard_errors_of_the_whole_log(lean):
    log, tau = simulated(duration=6.0), (0.14, 0.18)
    parameters, start = kernel_parameters(lean, X, log), measured_states(lean, log)[0]
    whole = filtered_least_squares(lean, log, parameters, tau, first_order_hold=True, start=start)
    found = recursive_least_squares(lean, log, parameters, tau, first_order_hold=True).fit
    assert found.sigma == pytest.approx(whole.sigma, rel=0.02)


def test_a_covariance_is_the_inverse_of_the_information():
    root = np.random.default_rng(2).normal(size=(4, 4)) * [1.0, 1e3, 1e-3, 1.0]
    information = root.T @ root
    names = [FreeParameter(n) for n in "abcd"]
    found, _, flat = covariance_of(information, names)
    assert found == pytest.approx(np.linalg.inv(information), rel=1e-6)
    assert flat == ()
    assert covariance_of(np.diag([1.0, 0.0, 4.0]), names[:3])[2] == (names[1],)


def test_a_fits_covariance_follows_from_how_its_sum_of_squares_bends(fitted):
    problem, found = fitted
    for name, rest in (("X5", [n for n in problem.base if n != "X5"]), ("X2", [n for n in problem.base if n != "X2"])):
        away = {**found.values, name: found.values[name] + 3.0 * found.sigma(name)}
        risen = fit_segments(problem, problem.data.estimation, away, rest, rounds=30).cost - found.cost
        assert risen == pytest.approx(9.0, rel=0.05)


def test_the_larger_of_two_standard_errors_counts_unless_the_residual_is_the_noise(fitted):
    problem, found = fitted
    white = replace(found, robust=4.0 * found.covariance, coloured=False)
    plain = white.sigma("X1")
    assert plain == np.sqrt(found.covariance[0, 0]) and white.sigma("X1", robust=True) == pytest.approx(2.0 * plain)
    assert standard_error(problem, white, "X1") == pytest.approx(plain)
    for doubtful in (replace(white, coloured=True), replace(white, cost=1.2 * white.cost)):
        assert standard_error(problem, doubtful, "X1") == pytest.approx(2.0 * plain)
        assert parameter_table(problem, doubtful)["X1"].sigma == pytest.approx(2.0 * plain)
    narrow = replace(found, robust=0.25 * found.covariance, coloured=True)
    assert conservative_standard_error(narrow, "X1") == standard_error(problem, narrow, "X1") == pytest.approx(plain)


def test_a_parameter_that_is_not_identifiable_is_said_to_be(fitted):
    problem, found = fitted
    table = parameter_table(problem, replace(found, unidentifiable=(found.element("X2", None),)))
    assert [n for n, row in table.items() if not row.identifiable] == ["X2"]
    assert {n: row.value for n, row in table.items()} == {n: found.values[n] for n in X}


def test_the_error_of_a_fit_discounts_the_states_that_it_fitted(fitted):
    _, found = fitted
    assert found.states[0].size == 4 * len(found.states[0]) > 100
    assert found.error == pytest.approx(np.sqrt(found.cost / (found.count - found.states[0].size)))


def short_motor(seed: int, rows: int = 26, interval: float = 0.02) -> Log:
    """Half a second of a motor, X1 0.005 and X2 0.05, that a small force pushes at random, noise 10 mrad."""
    rng, steps = np.random.default_rng(seed), 100
    angle, speed, force, rows_out = 0.0, 0.0, 0.0, []
    volts = np.repeat(rng.uniform(-3.0, 3.0, rows // 4 + 1), 4)[:rows]
    h = interval / steps
    for u in volts:
        rows_out.append(angle)
        for _ in range(steps):
            force += -force * h / 0.1 + 0.12 * np.sqrt(2.0 * h / 0.1) * rng.standard_normal()
            speed += h * (u - 0.05 * speed + force) / 0.005
            angle += h * speed
    angles = np.array(rows_out) + 0.01 * rng.standard_normal(rows)
    return Log.from_arrays(interval * np.arange(rows), table=SHAFT.table, v_in=volts, theta_m=angles)


@pytest.mark.slow
def test_the_errors_of_a_single_segment_are_not_those_of_white_noise():
    deviations = []
    for seed in range(24):
        found = identify(SHAFT, short_motor(seed), method="shooting").parameters
        deviations += [
            abs(found["X1"].value - 0.005) / found["X1"].sigma,
            abs(found["X2"].value - 0.05) / found["X2"].sigma,
        ]
    assert 0.3 < np.median(deviations) < 4.0, "by the information alone it is about 13"
