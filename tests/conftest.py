"""Shared logs and kernels: simulated and compiled once for the whole run."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "WHEELPEND_THREADS"):
    os.environ.setdefault(name, "1")  # small problems: more threads only get into each other's way

from functools import lru_cache  # noqa: E402

import pytest  # noqa: E402

from wheelpend.kernels import load as kernels  # noqa: E402
from wheelpend.logs.log import Log  # noqa: E402
from wheelpend.model.record import Model  # noqa: E402
from wheelpend.simulation.simulate import simulate  # noqa: E402


@lru_cache
def simulated(command: str = "aggressive", seed: int = 0, duration: float = 20.0, noise: bool = True, **hide) -> Log:
    """A log of the paper's robot; effects are hidden as effect__parameter=value."""
    hidden = {name.replace("__", "."): value for name, value in hide.items()}
    return simulate(Model.default(), command=command, duration=duration, hide=hidden, seed=seed, noise=noise)


@pytest.fixture(scope="session")
def library():
    return kernels.library_module("wheel_pendulum", {})


@pytest.fixture(scope="session")
def lean():
    return kernels.model_module("wheel_pendulum", {}, ())
