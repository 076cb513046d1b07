"""``python -m wheelpend.benchmarks.hidden_effects.shipped`` makes the engine's logs in data/ again, truth included."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wheelpend.benchmarks.hidden_effects.engine import engine_log
from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS
from wheelpend.files import write_text
from wheelpend.logs.log import Log
from wheelpend.logs.shipped import data_folder

LOG_DURATION_S = 10.0  # s
COLUMN_DECIMALS = {"t": 3, "v_in": 3, "theta_w": 6, "theta_p": 5, "dtheta_p": 5, "theta_ref": 6}  # below the noise
SHIPPED_LOGS: dict[str, Mapping[str, float]] = {
    "engine_friction_slope": {"coulomb_drive.torque": 0.3, "slope.angle": 0.03},
    "engine_cogging": {"cogging.sine": 0.3, "cogging.cosine": 0.15, "cogging.periods": 4.0},
    "engine_inductance": {"winding_inductance.time_constant": 0.01},
}


def main(folder: Path | None = None) -> None:
    """Write every log and its truth."""
    target = folder or data_folder()
    for seed, (name, hide) in enumerate(SHIPPED_LOGS.items(), 41):
        write_text(target / f"{name}.csv", log_csv_text(engine_log(hide, duration=LOG_DURATION_S, seed=seed)))
        truth = {"effects": dict(hide), "parameters": {n: float(f"{v:.6g}") for n, v in TRUE_PARAMETERS.items()}}
        write_text(target / f"{name}_truth.json", json.dumps(truth) + "\n")


def log_csv_text(log: Log) -> str:
    """CSV text of a log, each column rounded to its COLUMN_DECIMALS."""
    assert log.reference is not None
    columns = np.column_stack([log.t, log.voltage, log.measured, log.reference])
    rows = [",".join(f"{v:.{d}f}" for v, d in zip(row, COLUMN_DECIMALS.values(), strict=True)) for row in columns]
    return "\n".join([",".join(COLUMN_DECIMALS), *rows]) + "\n"


if __name__ == "__main__":
    main()
