"""Series as whole numbers in a text: seven bits to a byte, so that a small number of either sign is one byte."""

from __future__ import annotations

from base64 import b64encode
from typing import NamedTuple

import numpy as np

BITS_PER_BYTE = 7  # the eighth says that more follow


class WholeSeries(NamedTuple):
    """A series as whole numbers, and what one of them is worth."""

    whole: str
    quantum: float


def whole_numbers_text(numbers: np.ndarray) -> str:
    """Whole numbers (n,) as base64; 0, −1, 1, −2, ... are 0, 1, 2, 3, ..., the lowest seven bits of each first."""
    values = np.asarray(numbers).astype(np.int64)
    rest = np.where(values < 0, -2 * values - 1, 2 * values)
    columns, present = [], np.ones(len(rest), dtype=bool)
    masks = []
    while present.any():
        more = rest >= 1 << BITS_PER_BYTE
        columns.append((rest & 127) | (more << BITS_PER_BYTE))
        masks.append(present)
        present, rest = present & more, rest >> BITS_PER_BYTE
    if not columns:
        return ""
    return b64encode(np.array(columns).T[np.array(masks).T].astype(np.uint8).tobytes()).decode()


def held_series(values: np.ndarray, quantum: float) -> WholeSeries:
    """Values (n,) that are held and integrated: each rounded so that the sum up to it is right to half a quantum."""
    return WholeSeries(whole_numbers_text(np.diff(np.rint(np.cumsum(values) / quantum), prepend=0.0)), quantum)


def smooth_series(values: np.ndarray, quantum: float) -> WholeSeries:
    """Values (n,) of something that moves: their second differences, each value right to half a quantum."""
    return WholeSeries(whole_numbers_text(np.diff(np.rint(values / quantum), 2, prepend=[0.0, 0.0])), quantum)
