"""Filtered least squares over a log in pieces gives what the whole gives."""

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend.estimation import least_squares, long_logs
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import measured_states


@pytest.mark.parametrize("tau", [(0.14, 0.18), (0.5, 0.7)])
def test_a_log_in_pieces_gives_what_the_whole_gives(lean, monkeypatch, tau):
    log = simulated(duration=20.0)
    parameters = kernel_parameters(lean, X, log)
    whole = least_squares.filtered_least_squares(lean, log, parameters, tau)
    monkeypatch.setattr(long_logs, "CHUNK_SAMPLES", 2000)
    pieces = least_squares.filtered_least_squares(lean, log, parameters, tau)
    assert pieces.estimate == pytest.approx(whole.estimate, rel=1e-7)
    assert pieces.sigma == pytest.approx(whole.sigma, rel=1e-3)
    monkeypatch.setattr(long_logs, "MAX_NORMAL_EQUATIONS_CONDITION", 0.0)
    assert least_squares.filtered_least_squares(lean, log, parameters, tau).estimate == pytest.approx(
        whole.estimate, rel=1e-9
    )


def test_the_residual_of_a_log_in_pieces_is_that_of_the_whole_to_the_last_bit(lean, monkeypatch):
    log, tau = simulated(duration=3.0), (0.03, 0.04)
    parameters, states = kernel_parameters(lean, X, log), measured_states(lean, log)
    sides, regressors = lean.filter_regressor(log.t, states, log.voltage, parameters, *tau, True, states[0])
    coefficients = np.linspace(0.1, 0.7, len(lean.LINEAR))
    monkeypatch.setattr(long_logs, "CHUNK_SAMPLES", 700)
    found = long_logs.filtered_residual(lean, log.t, states, log.voltage, parameters, tau, coefficients)
    assert (found == sides - regressors @ coefficients).all() and np.abs(found).max() > 1.0
