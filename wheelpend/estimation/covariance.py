"""Covariance from the scatter of blocks: honest where the residual has colour, or comes from a wrong model.

Leaving a block of consecutive segments out moves the fit by δ; the sum of δδᵀ over the blocks is the jackknife's
covariance. It takes nothing for granted but that blocks are independent of each other, and a block that decides a
parameter almost alone counts as what it is (Bell & McCaffrey 2002; CV3 of MacKinnon, Nielsen & Webb 2023).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TARGET_BLOCK_COUNT = 20  # at most about so many: longer blocks bear slower noise, more blocks tell their scatter better
MIN_SEGMENTS_PER_BLOCK = (
    2  # the fewest in a block where there are enough: noise may reach from one segment into the next
)
MIN_BLOCKS_PER_LOG = 4  # blocks of a log below which they are single segments
COLOUR_THRESHOLD_SIGMAS = 4.0  # standard deviations beyond which a ratio of variances is not chance
MAX_BLOCK_LEVERAGE = 0.9  # share of a direction's information in one block beyond which leaving it out says nothing


def block_numbers(segments: Sequence[int]) -> np.ndarray:
    """Number of the block that each segment of logs with so many segments belongs to; none spans two logs."""
    size = max(MIN_SEGMENTS_PER_BLOCK, round(sum(segments) / TARGET_BLOCK_COUNT))
    found, first = [], 0
    for count in segments:
        own = max(min(MIN_BLOCKS_PER_LOG, count), round(count / size))
        found.append(first + np.arange(count) * own // max(count, 1))
        first += own if count else 0
    return np.concatenate(found) if found else np.zeros(0, dtype=np.int64)


def jackknife_covariance(
    covariance: np.ndarray, informations: np.ndarray, scores: np.ndarray, block: np.ndarray
) -> np.ndarray:
    """Covariance (n, n) of a fit from the informations (segments, n, n) and scores (segments, n) of its segments.

    covariance is the inverse of the information of all; block (segments,) says which segments are left out together.
    """
    eigenvalues, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    moves = []
    for number in np.unique(block):
        mine = block == number
        share, along = np.linalg.eigh(root.T @ informations[mine].sum(axis=0) @ root)
        pull = along.T @ (root.T @ scores[mine].sum(axis=0))
        moves.append(root @ (along @ (pull / (1.0 - np.clip(share, 0.0, MAX_BLOCK_LEVERAGE)))))
    moved = np.array(moves)
    return moved.T @ moved * (len(moved) - 1) / max(len(moved), 1)


def is_autocorrelated(residual: np.ndarray, bounds: np.ndarray) -> bool:
    """Whether the residual (N, channels) of segments (n, 2) is correlated from sample to sample.

    The variance of the means of 2, 4, 8, ... samples is compared with that of white noise.
    """
    for channel in residual.T:
        pieces = [p[np.isfinite(p)] for p in (channel[a:b] for a, b in bounds)]
        variance = float(np.mean(np.concatenate(pieces) ** 2)) if pieces else 0.0
        length = 2
        while variance > 0.0 and length <= max(map(len, pieces)) // 4:
            sums = np.concatenate([p[: len(p) // length * length].reshape(-1, length).sum(axis=1) for p in pieces])
            ratio = float(np.mean(sums**2)) / (length * variance)
            if ratio > 1.0 + COLOUR_THRESHOLD_SIGMAS * np.sqrt(2.0 / len(sums)):
                return True
            length *= 2
    return False
