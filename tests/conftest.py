"""Kernels for all tests, and a count of what fits simulate."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "WHEELPEND_THREADS"):
    os.environ.setdefault(name, "1")  # small problems: more threads only get into each other's way
os.environ["WHEELPEND_TRACEBACK"] = "1"  # an error that nobody foresaw fails a test
os.environ["WHEELPEND_KEPT_SEARCHES"] = "0"  # what a test searches for is to be found by what it tests


from types import ModuleType  # noqa: E402

import pytest  # noqa: E402

from wheelpend.kernels import load as kernels  # noqa: E402


@pytest.fixture(scope="session")
def library():
    return kernels.library_module("wheel_pendulum", {})


@pytest.fixture(scope="session")
def lean():
    return kernels.model_module("wheel_pendulum", {}, ())


@pytest.fixture
def samples(monkeypatch):
    """How many samples are simulated for fits, module by module, from here on."""
    counted: dict[str, int] = {}
    beside: dict[str, ModuleType] = {}  # copies: no kernel may be compiled against a counter
    load = kernels.load_module

    def counting(text, name):
        module = load(text, name)
        if name not in beside:
            beside[name] = ModuleType(name)
            vars(beside[name]).update(vars(module))

        def counted_shoot(t, voltage, measured, weight, bounds, *rest):
            counted[name] = counted.get(name, 0) + int((bounds[:, 1] - bounds[:, 0]).sum())
            return module.shoot(t, voltage, measured, weight, bounds, *rest)

        beside[name].shoot = counted_shoot
        return beside[name]

    monkeypatch.setattr(kernels, "load_module", counting)
    return counted
