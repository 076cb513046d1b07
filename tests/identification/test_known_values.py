"""The pieces of the regression methods against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import f as f_distribution

from tests.support import X, simulated
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.regressor import acting_input, free_decay
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.identification.bias_test import hotelling_p_value
from wheelpend.identification.energy import energy_regressor, filtered_integral, first_order_recurrence
from wheelpend.identification.inverse_dynamics import force_error
from wheelpend.identification.recursive import recursive_least_squares
from wheelpend.identification.time_constants import _evaluated_pair, capped_rms_percent, time_constant_pairs


def test_hotellings_test_of_a_difference_is_the_f_test_with_the_draws_degrees_of_freedom():
    covariance = np.diag([4.0, 0.25])
    squares = 1.0 + 4.0
    expected = f_distribution.sf(squares * (30 - 2) / ((30 - 1) * 2), 2, 30 - 2)
    assert hotelling_p_value(np.array([2.0, 1.0]), covariance, 30) == pytest.approx(expected)
    assert hotelling_p_value(np.array([0.0, 0.0]), covariance, 30) == pytest.approx(1.0)
    flat = np.diag([4.0, 0.25, 0.0])  # a parameter that does not vary says nothing
    assert hotelling_p_value(np.array([2.0, 1.0, 9.0]), flat, 30) == pytest.approx(expected)


def test_an_integral_is_exact_on_what_is_linear_between_samples():
    t = np.array([0.0, 0.1, 0.25, 0.3, 1.0])
    value = np.array([1.0, 3.0, -1.0, 2.0, 0.0])[:, None]
    assert filtered_integral(t, value[:-1], value[1:], np.inf)[:, 0] == pytest.approx(
        np.concatenate([[0.0], np.cumsum(np.diff(t) * (value[1:, 0] + value[:-1, 0]) / 2)]))  # fmt: skip
    for tau in (0.05, 2.0):
        exact = quad(lambda s, tau=tau: np.exp(-(1.0 - s) / tau) * np.interp(s, t, value[:, 0]), 0, 1, points=t[1:-1])
        assert filtered_integral(t, value[:-1], value[1:], tau)[-1, 0] == pytest.approx(exact[0], rel=1e-9)


def test_a_recurrence_is_that_of_a_loop():
    rng = np.random.default_rng(0)
    gain, value = rng.uniform(0.5, 1.0, size=(13, 1)), rng.normal(size=(13, 2))
    expected = [value[0]]
    for k in range(1, 13):
        expected.append(gain[k] * expected[-1] + value[k])
    assert first_order_recurrence(gain, value) == pytest.approx(np.array(expected))


@pytest.mark.parametrize("tau", [0.5, np.inf])
def test_the_energy_that_is_supplied_is_that_which_is_stored_and_lost(lean, tau):
    log = simulated(duration=4.0, noise=False)
    supplied, regressor = energy_regressor(lean, log, kernel_parameters(lean, X, log), tau)
    assert regressor @ np.array(list(X.values())) == pytest.approx(supplied, abs=5e-3 * np.abs(supplied).max())


@pytest.mark.parametrize("tau", [(0.1, 0.3), (0.2, 0.2)])
def test_a_filters_free_decay_solves_its_differential_equation(tau):
    t = np.linspace(0.0, 1.0, 2001)
    found = free_decay(t, tau, 2)
    assert found.shape == (2001, 2, 4)
    slow, coupled = found[:, 0, 0], found[:, 0, 1]
    first = np.exp(-t / tau[0])  # what the first filter still holds, and the second is driven by
    assert np.gradient(slow, t)[1:-1] == pytest.approx(-slow[1:-1] / tau[1], abs=1e-3)
    slope = (first * tau[0] / tau[1] if tau[0] == tau[1] else first) - coupled
    scale = 1.0 / tau[1]
    assert np.gradient(coupled, t)[1:-1] == pytest.approx(scale * slope[1:-1], abs=1e-3)
    assert coupled[0] == 0.0 and not found[:, 0, 2:].any() and not found[:, 1, :2].any()


def test_a_lagging_motor_is_driven_by_the_mean_between_two_samples():
    seen = np.array([0.0, 2.0, 6.0, 7.0])
    module = SimpleNamespace(LAG=3, acting_voltage=lambda t, voltage, parameters: seen)
    log = simulated(duration=0.5).part(0, 4)
    assert acting_input(module, log, np.zeros(4)) == pytest.approx([1.0, 4.0, 6.5, 7.0])


def test_a_force_error_is_what_the_equations_leave_of_the_input_in_percent(lean):
    log = simulated("simple", duration=6.0, noise=False)
    assert force_error(lean, log, X) < 3.0
    assert force_error(lean, log, {n: 1.2 * v for n, v in X.items()}) == pytest.approx(20.0, abs=2.0)


def test_the_error_of_time_constants_is_bias_and_spread_of_every_parameter_none_above_100_percent():
    assert capped_rms_percent(np.array([3.0, -4.0])) == pytest.approx(np.sqrt(12.5))
    assert capped_rms_percent(np.array([1e6, 0.0])) == pytest.approx(np.sqrt(5000.0))
    row = _evaluated_pair((0.1, 0.2), ("a", "b"), np.array([3.0, 0.0]), np.array([4.0, 0.0]))
    assert (row.bias, row.spread) == pytest.approx((np.sqrt(4.5), np.sqrt(8.0)))
    assert row.score == pytest.approx(np.sqrt(12.5))


def test_pairs_of_time_constants_go_from_four_samples_to_a_third_of_the_log():
    log = simulated(duration=3.0)
    pairs = time_constant_pairs(log)
    assert len(pairs) == 36 and all(a <= b for a, b in pairs)
    assert (min(pairs)[0], max(pairs)[1]) == pytest.approx((0.004, 1.0), rel=0.01)


def test_a_recursion_that_forgets_weights_each_sample_by_its_age(lean):
    log, tau, keep = simulated(duration=4.0), (0.14, 0.18), 0.999
    parameters, states = kernel_parameters(lean, X, log), measured_states(lean, log)
    found = recursive_least_squares(lean, log, parameters, tau, forgetting=keep).fit.estimate
    left, right = lean.filter_regressor(log.t, states, log.voltage, parameters, *tau, False, states[0])
    root = np.sqrt(keep ** np.arange(len(log))[::-1])[:, None]
    expected = np.linalg.lstsq((root[:, :, None] * right).reshape(-1, 7), (root * left).ravel(), rcond=None)[0]
    assert found == pytest.approx(expected, rel=1e-4)
