"""Samples that two logs share: whether one is a copy, a part or a continuation of the record of the other.

Times do not count: a copy may begin at another one. Two records of a machine never have a row in common for long, since
the last digits of its sensors are noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.logs.log import Log
from wheelpend.logs.runs import runs_of

MIN_SHARED_ROWS = 50  # in a row; of a quantised machine that stands still fewer may be alike by chance
MIN_DISTINCT_ROWS = 25  # among them: the few that a standstill repeats tell nothing


class SharedRows(NamedTuple):
    """Rows that two logs have in common, one after the other in both."""

    first: int  # in the one, counted from 1
    other_first: int  # in the other
    length: int


def shared_rows(one: Log, other: Log) -> SharedRows | None:
    """The longest run of rows of two logs that agree in every channel and input; None where it is not long enough."""
    if one.channels != other.channels or one.voltage.shape[1:] != other.voltage.shape[1:]:
        return None
    hashes, other_hashes = row_hashes(one), row_hashes(other)
    known, rows = np.unique(hashes, return_index=True)
    others, other_rows = np.unique(other_hashes, return_index=True)
    _, k, n = np.intersect1d(known, others, assume_unique=True, return_indices=True)
    if len(k) < MIN_DISTINCT_ROWS:
        return None
    offsets, counts = np.unique(other_rows[n] - rows[k], return_counts=True)
    offset = int(offsets[np.argmax(counts)])
    begin, end = max(0, -offset), min(len(hashes), len(other_hashes) - offset)
    alike = hashes[begin:end] == other_hashes[begin + offset : end + offset]
    first, count = longest_run(alike)
    distinct = len(np.unique(hashes[begin + first : begin + first + count]))
    if count < MIN_SHARED_ROWS or distinct < MIN_DISTINCT_ROWS:
        return None
    return SharedRows(begin + first + 1, begin + first + offset + 1, count)


def row_hashes(log: Log) -> np.ndarray:
    """A number (N,) per row that is the same where all its values are."""
    values = np.column_stack([log.voltage, log.measured]) + 0.0  # -0 is 0
    values[np.isnan(values)] = np.nan  # all alike
    odd = np.random.default_rng(0).integers(1 << 63, size=values.shape[1], dtype=np.uint64) | np.uint64(1)
    bits = np.ascontiguousarray(values).view(np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * odd
    return (mixed ^ (mixed >> np.uint64(32))).sum(axis=1, dtype=np.uint64)


def longest_run(alike: np.ndarray) -> tuple[int, int]:
    """First index and length of the longest run of true values."""
    first, end = max(runs_of(alike).tolist(), key=lambda run: run[1] - run[0], default=(0, 0))
    return first, end - first
