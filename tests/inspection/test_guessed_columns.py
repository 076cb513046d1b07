"""Columns under other names are guessed."""

import numpy as np

from wheelpend import Model
from wheelpend.inspection.inspect import inspect_file
from wheelpend.logs.read import save_log


def test_columns_are_guessed_by_name_unit_and_by_what_grows(tmp_path):
    from tests.support import simulated

    log = simulated(duration=4.0)
    save_log(tmp_path / "plain.csv", log)
    header = "clock,motor_cmd,enc_wheel,pitch_deg,gyro_y [deg/s]"
    rows = np.column_stack([1e3 * log.t, log.voltage, log.measured[:, 0], np.degrees(log.measured[:, 1:])])
    np.savetxt(tmp_path / "odd.csv", rows, delimiter=",", header=header, comments="")
    plain, _ = inspect_file(Model.default(), tmp_path / "plain.csv")
    read, found = inspect_file(Model.default(), tmp_path / "odd.csv")
    np.testing.assert_allclose(read.measured, plain.measured, atol=1e-9)
    np.testing.assert_allclose(read.t, plain.t, atol=1e-9)
    assert 't = { column = "clock", unit = "ms" }' in found.proposal
    assert 'dtheta_p = { column = "gyro_y [deg/s]", unit = "deg/s" }' in found.proposal
    again = Model.parse(Model.default().text.partition("[columns]")[0] + found.proposal)
    assert again.columns["theta_p"].unit == "deg"
