"""What tests of several rooms share: places, the paper's robot, its logs, and the command line."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from time import process_time

import numpy as np
import pytest
from typer.testing import CliRunner

from wheelpend import Log, Model, simulate
from wheelpend.cli.commands import app
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S

ROOT = Path(__file__).parent.parent  # of the repository
DATA = Path(os.environ.get("WHEELPEND_DATA", ROOT.parent / "shared" / "data"))  # measured logs, not in the repository
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured logs are not in {DATA}")

CHANNELS = ("theta_w", "theta_p", "dtheta_p")
X = dict(zip([f"X{k}" for k in range(1, 8)], (0.0436, 0.0178, 0.1149, 0.8719, 4.6701, 0.7268, 0.7256), strict=True))
CONSTANTS = {"R": 0.2413, "g": 9.81, "alpha": 165.42, "J_w": 0.1339}
SPARSE_S = 0.004  # s, between samples, where an answer is needed and no dense log: a search takes a third of the time


@lru_cache
def simulated(
    command: str = "aggressive",
    seed: int = 0,
    duration: float = 20.0,
    noise: bool = True,
    sample: float = SAMPLE_INTERVAL_S,
    **hide,
) -> Log:
    """A log of the paper's robot; effects are hidden as effect__parameter=value."""
    hidden = {name.replace("__", "."): value for name, value in hide.items()}
    return simulate(
        Model.default(), command=command, duration=duration, hide=hidden, seed=seed, noise=noise, sample=sample
    )


def energy(state: np.ndarray, values: dict[str, float]) -> np.ndarray:
    """Kinetic and potential energy in volt-equivalents, typed from the paper's eq. 1."""
    pitch, dw, dp = state[:, 1], state[:, 2], state[:, 3]
    kinetic = values["X1"] * dw**2 + values["X2"] * (dw - dp) ** 2 + values["X4"] * dp**2
    return kinetic / 2 + values["X3"] * np.cos(pitch) * dw * dp + values["X5"] * np.cos(pitch)


def run(*arguments, code: int | None = 0):
    """The result of a command line, in this process; its exit code must be ``code``, where that is given."""
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert code is None or result.exit_code == code, result.output + str(result.exception)
    return result


def quickest(work) -> float:
    """Least processor time of a few runs [s]."""
    times = []
    for _ in range(5):
        begin = process_time()
        work()
        times.append(process_time() - begin)
    return min(times)
