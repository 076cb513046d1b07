"""Angles that wrap into one turn and encoders that start again at zero, made continuous."""

from __future__ import annotations

import math

import numpy as np

TURN = 2 * math.pi
SLACK = 0.25  # of a turn, by which a jump may differ from a whole one
BEYOND = 1.05  # turns that a wrapped angle covers at most
SUDDEN = 20.0  # times the usual step from which a jump to zero is a new start
STAYS = 10  # samples that an encoder which started again stays there


def continued(
    name: str, values: np.ndarray, t: np.ndarray, unit: str, starts_again: bool = True
) -> tuple[np.ndarray, list[str]]:
    """A channel (N,) without the jumps of wrapping and of a new start, and a sentence on each kind that was found.

    ``t`` (N,) are the times of the samples, for the sentences.
    """
    known = np.flatnonzero(np.isfinite(values))
    remarks = []
    if unit == "rad" and (jumps := wraps(values[known])):
        values = values.copy()
        values[known] = np.unwrap(values[known])
        remarks.append(f"{name} jumps by a turn in {jumps} places: it was wrapped, and is made continuous.")
    found = new_starts(values[known]) if starts_again else np.zeros(0, dtype=int)
    if len(found):
        steps = np.diff(values[known], prepend=values[known][0])
        steps[found] = 0.0
        values = values.copy()
        values[known] = values[known][0] + np.cumsum(steps)
        first = t[known[found[0]]] - t[0]
        times = "once" if len(found) == 1 else f"{len(found)} times"
        remarks.append(f"{name} jumps to zero {times}, first {first:.6g} after the log's beginning: the encoder "
                       "started again, and its jumps are taken out.")  # fmt: skip
    return values, remarks


def wraps(values: np.ndarray) -> int:
    """How often an angle [rad] jumps because it is kept within one turn; 0 where it is not."""
    if values.size < 2:
        return 0
    steps = np.abs(np.diff(values))
    jumps = np.abs(steps - TURN) < SLACK * TURN
    usual = float(np.max(steps[~jumps], initial=0.0))
    wrapped = jumps.any() and usual <= SLACK * TURN and np.ptp(values) <= BEYOND * TURN
    return int(jumps.sum()) if wrapped else 0


def new_starts(values: np.ndarray) -> np.ndarray:
    """Places at which a counter jumps to zero and goes on from there."""
    if values.size < 4 * STAYS:
        return np.zeros(0, dtype=int)
    steps = np.abs(np.diff(values))
    usual = float(np.quantile(steps, 0.999 if steps.size > 5000 else 0.98))
    if usual == 0.0:
        return np.zeros(0, dtype=int)
    sudden = np.flatnonzero((steps > SUDDEN * usual) & (np.abs(values[1:]) <= usual)) + 1
    return np.array([k for k in sudden if np.all(steps[k : k + STAYS] <= SUDDEN * usual)], dtype=int)
