"""The hand-written C reference, compiled by the system's compiler when it is needed."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from wheelpend.benchmarks.speed.record import NotMeasurableError
from wheelpend.errors import Failure

C_SOURCE_PATH = Path(__file__).with_name("reference.c")
COMPILER_OPTIONS = ("-O3", "-march=native", "-shared", "-fPIC")
COMPILER_NAMES = ("cc", "gcc", "clang")
RELATIVE_TOLERANCE = 1e-9  # relative, to which kernels and reference agree


def compiler() -> str:
    """The system's C compiler: $CC, else the first that is there; raises NotMeasurableError without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else COMPILER_NAMES
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        raise NotMeasurableError(f"no C compiler: {', '.join(names)} not found")
    return found


@lru_cache
def load() -> ctypes.CDLL:
    """Compile the reference for this very processor and load it; raises NotMeasurableError where that fails."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "reference.so"
        command = [compiler(), *COMPILER_OPTIONS, "-o", str(path), str(C_SOURCE_PATH), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise NotMeasurableError(f"{' '.join(command)} failed: {done.stderr.strip()}")
        library = ctypes.CDLL(str(path))
    library.total.restype = ctypes.c_double
    return library


def call(name: str, *arguments: int | float | np.ndarray) -> Callable[[], float]:
    """Call of a function of reference.c, ready to run; integers go as long, numbers as double, arrays as float64."""
    return partial(getattr(load(), name), *map(_converted, arguments))


def _converted(value: int | float | np.ndarray) -> object:
    if isinstance(value, np.ndarray):
        assert value.dtype == np.float64 and value.flags.c_contiguous
        return value.ctypes.data_as(ctypes.POINTER(ctypes.c_double))  # which keeps the array alive
    return ctypes.c_long(value) if isinstance(value, int) else ctypes.c_double(value)


def require_agreement(
    what: str, ours: np.ndarray, theirs: np.ndarray, scale: np.ndarray, tolerance: float = RELATIVE_TOLERANCE
) -> None:
    """Raise Failure unless results agree, relative to a scale: what differs must not be timed."""
    difference = float(np.max(np.abs(ours - theirs) / scale))
    if not difference <= tolerance:
        raise Failure(f"{what}: both contenders must have the same result within {tolerance:g}, but they differ by "
                      f"{difference:.2g}. Their times would not be comparable.")  # fmt: skip
