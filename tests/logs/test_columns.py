"""Columns of plants with no input, or with two."""

import numpy as np

from wheelpend import Model, simulate
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log


def test_a_log_of_a_plant_without_input_needs_no_column_for_one(tmp_path):
    model = Model.default("pendulum")
    log = simulate(model, command="upright", duration=2.0, seed=1)
    save_log(tmp_path / "swing.csv", log, table=model.table)
    assert (tmp_path / "swing.csv").read_text().splitlines()[0] == "t,theta_1"
    assert load_log(tmp_path / "swing.csv", table=model.table).voltage.tolist() == [0.0] * len(log)


TURNING = 'plant = "wheel_pendulum"\n[assumptions]\nplanar = false\n'


def test_a_log_with_two_voltages_comes_back_as_it_was_saved(tmp_path):
    table, rng = Model.parse(TURNING).table, np.random.default_rng(0)
    assert table.required == ("t", "v_left", "v_right", "theta_w", "theta_p", "dtheta_p", "dpsi")
    log = Log("turning", np.arange(500) * 1e-3, rng.normal(size=(500, 2)), 0.1 * rng.normal(size=(500, 4)),
              ("theta_w", "theta_p", "dtheta_p", "dpsi"))  # fmt: skip
    save_log(tmp_path / "log.csv", log, table=table)
    read = load_log(tmp_path / "log.csv", table=table)
    np.testing.assert_allclose(read.voltage, log.voltage)
    np.testing.assert_allclose(read.measured, log.measured)
