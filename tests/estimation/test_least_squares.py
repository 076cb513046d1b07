"""Filtered least squares over a log in pieces gives what the whole gives."""

import pytest

from tests.support import X, simulated
from wheelpend.estimation import least_squares, long_logs
from wheelpend.estimation.parameters import kernel_parameters


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
