"""Runs: the stretches of samples in which something holds."""

from __future__ import annotations

import numpy as np


def runs_of(mask: np.ndarray) -> np.ndarray:
    """Half-open ranges (runs, 2) of the stretches in which a mask (N,) is true."""
    return np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0])))).reshape(-1, 2)
