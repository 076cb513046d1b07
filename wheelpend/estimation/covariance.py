"""Covariance by the block jackknife: valid where the residual is coloured, or comes from a wrong model.

Leaving a block of consecutive segments out moves the fit by δ; the sum of δδᵀ over the blocks is the jackknife's
covariance. It assumes only that blocks are independent of each other, and corrects for the leverage of a block that
determines a parameter almost alone (Bell & McCaffrey 2002; CV3 of MacKinnon, Nielsen & Webb 2023).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

import numpy as np

from wheelpend.estimation.normal_equations import NormalEquations

TARGET_BLOCK_COUNT = 20  # longer blocks allow slower noise, more blocks estimate their covariance better
MIN_SEGMENTS_PER_BLOCK = 2  # where there are enough: noise may be correlated from one segment to the next
MIN_BLOCKS_PER_LOG = 4  # blocks of a log below which they are single segments
COLOUR_THRESHOLD_SIGMAS = 4.0  # standard deviations beyond which a ratio of variances is not chance
MAX_BLOCK_LEVERAGE = 0.9  # share of a direction's information in one block at which its leverage is clipped


def block_numbers(segments: Sequence[int]) -> np.ndarray:
    """Block number (all segments,) of each segment of logs with so many segments; no block spans two logs."""
    size = max(MIN_SEGMENTS_PER_BLOCK, round(sum(segments) / TARGET_BLOCK_COUNT))
    found, first = [], 0
    for count in segments:
        own = max(min(MIN_BLOCKS_PER_LOG, count), round(count / size))
        found.append(first + np.arange(count) * own // max(count, 1))
        first += own if count else 0
    return np.concatenate(found) if found else np.zeros(0, dtype=np.int64)


def jackknife_covariance(covariance: np.ndarray, segments: NormalEquations, block: np.ndarray) -> np.ndarray:
    """Covariance (n, n) of a fit from the normal equations of its segments.

    covariance is the inverse of the information of all; block (segments,) says which segments are left out together.
    """
    eigenvalues, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    moves = []
    for number in np.unique(block):
        inside = block == number
        leverage, along = np.linalg.eigh(root.T @ segments.information[inside].sum(axis=0) @ root)
        score = along.T @ (root.T @ segments.score[inside].sum(axis=0))
        moves.append(root @ (along @ (score / (1.0 - np.clip(leverage, 0.0, MAX_BLOCK_LEVERAGE)))))
    moved = np.array(moves)
    return moved.T @ moved * (len(moved) - 1) / max(len(moved), 1)


def is_autocorrelated(residual: np.ndarray, bounds: np.ndarray) -> bool:
    """True where the residual (N, channels) of segments (n, 2) is correlated from sample to sample.

    The variance of the means of 2, 4, 8, ... samples is compared with that of white noise.
    """
    for channel in residual.T:
        runs = [r[np.isfinite(r)] for r in (channel[a:b] for a, b in bounds)]
        known = np.concatenate(runs) if runs else np.zeros(0)
        variance = float(np.mean(known**2)) if known.size else 0.0
        length = 2
        while variance > 0.0 and length <= max(map(len, runs)) // 4:
            sums = np.concatenate([r[: len(r) // length * length].reshape(-1, length).sum(axis=1) for r in runs])
            ratio = float(np.mean(sums**2)) / (length * variance)
            if ratio > 1.0 + COLOUR_THRESHOLD_SIGMAS * np.sqrt(2.0 / len(sums)):
                return True
            length *= 2
    return False


def correlated_samples(residual: np.ndarray, bounds: np.ndarray) -> float:
    """Samples that a residual (N, channels) of segments (n, 2) is correlated over: 1 where it is white.

    The sum of its autocorrelation until that is no longer positive, of the channel where it is largest: of so many
    samples one is as good as independent.
    """
    found = [1.0]
    for channel in residual.T:
        for begin, end in bounds:
            known = channel[begin:end][np.isfinite(channel[begin:end])]
            power = float(known @ known)
            lags = (float(known[k:] @ known[:-k]) / power for k in range(1, known.size) if power > 0.0)
            found.append(1.0 + 2.0 * sum(takewhile(lambda share: share > 0.0, lags)))
    return max(found)
