"""A pitch that an accelerometer draws along is told before its slope is taken for the gyro's, which stays a sensor."""

import numpy as np

from tests import faulty_logs as faulty
from wheelpend.inspection.column_roles import possible_rates
from wheelpend.inspection.inspect import inspect_log


def test_a_pitch_that_an_accelerometer_draws_far_along_tells_no_unit_of_the_gyro():
    log = faulty.simulated("aggressive", 0, accelerometer_tilt__gain=0.05, accelerometer_tilt__time_constant=0.3)
    pitch, rate = faulty.column(log, "theta_p"), faulty.column(log, "dtheta_p")
    ratio = np.std(rate) / np.std(np.gradient(np.convolve(pitch, np.ones(40) / 40, "same"), log.t))
    assert not 1 / 1.15 < ratio < 1.15, "the case is one: its slope is not what the gyro reads"
    kinds = [f.kind for f in inspect_log(log).findings]
    assert "fused_pitch" in kinds and "wrong_unit" not in kinds and "flipped_sign" not in kinds


def test_a_gyro_is_the_rate_of_the_body_that_leans_and_of_an_encoder_where_there_is_none():
    assert ("encoder", "gyro") not in possible_rates(["encoder", "pitch", "gyro"])
    assert ("pitch", "gyro") in possible_rates(["encoder", "pitch", "gyro"])
    assert ("encoder", "gyro") in possible_rates(["encoder", "gyro"])
