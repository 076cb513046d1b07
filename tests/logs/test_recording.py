"""What is no measurement is left out of a log, quickly, and what is one stays."""

from dataclasses import replace

import numpy as np
import pytest

from tests import faulty_logs as faulty
from wheelpend import Model
from wheelpend.logs.faults import readings_at_ceiling
from wheelpend.logs.recording import cured

TABLE = Model.default().table


def forward_only(offset=0.0):
    """A rate in steps that starts and stops sharply, forwards alone, with the angle that belongs to it."""
    t = np.arange(4000) * 5e-3
    rate = np.where(t % 4 < 2, 3.0 + np.sin(5 * t), 0.0)
    return t, np.round((rate + offset) / 0.002) * 0.002, np.cumsum(rate) * 5e-3


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_a_rate_that_only_goes_forward_is_not_saturated_at_rest(offset):
    _, rate, _ = forward_only(offset)
    assert not readings_at_ceiling(rate, rate)[0].any()
    assert readings_at_ceiling(np.minimum(rate, 3.5), rate)[0].sum() == (rate >= 3.5).sum()


def test_an_angle_at_which_the_machine_stops_is_not_saturated_though_it_stops_hard():
    t = np.arange(4000) * 5e-3
    angle = np.minimum(1.037 * np.abs((t % 4) - 2) + 0.01 * np.sin(7 * t), 1.0)  # against a stop
    rate = np.where(1.037 * np.abs(t % 4 - 2) < 1, np.sign(t % 4 - 2), 0.0)
    assert readings_at_ceiling(angle)[0].any() and not readings_at_ceiling(angle, rate)[0].any()
    still_moving = np.sign(t % 4 - 2)
    assert readings_at_ceiling(angle, still_moving)[0].any()


def test_a_log_whose_gyro_rests_at_nought_keeps_its_standstills():
    log = faulty.clean()
    rate = np.round(np.where(log.t % 4 < 2, 1.0 + np.abs(faulty.column(log, "dtheta_p")), 0.0) / 0.002) * 0.002
    log = replace(faulty.with_columns(log, dtheta_p=rate), faults=())
    left = cured(log, TABLE)
    assert "saturation" not in [f.kind for f in left.faults] and np.isfinite(left.measured[:, 2]).all()
