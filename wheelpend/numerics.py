"""Numerical functions that several rooms call; SciPy has some, but its import takes longer than a warm command."""

from __future__ import annotations

import numpy as np


def null_space(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the null space of a matrix (rows, n)."""
    _, sizes, rows = np.linalg.svd(matrix)
    rank = int((sizes > max(matrix.shape) * np.finfo(float).eps * sizes.max(initial=0.0)).sum())
    return rows[rank:].T


DECIMATED_PIECE, DECIMATED_MARGIN = 50_000, 200  # rows that are kept of a piece; around it kept ones, then forgotten


def decimated(rows: np.ndarray, thin: int) -> np.ndarray:
    """Every thin-th row of signals (N, k), behind a zero-phase low-pass against aliasing; long ones piece by piece.

    A Chebyshev filter of 8th order and 0.05 dB ripple, forward and backward, as in scipy.signal.decimate.
    """
    kept = (len(rows) - 1) // thin + 1
    if kept <= DECIMATED_PIECE + DECIMATED_MARGIN:
        return _decimated_piece(rows, thin)
    found = []
    for first in range(0, kept, DECIMATED_PIECE):
        begin = max(first - DECIMATED_MARGIN, 0)
        last = min(first + DECIMATED_PIECE, kept)
        piece = _decimated_piece(rows[begin * thin : (last + DECIMATED_MARGIN) * thin], thin)
        found.append(piece[first - begin : last - begin])
    return np.concatenate(found)


def _decimated_piece(rows: np.ndarray, thin: int) -> np.ndarray:
    ends = (2.0 * rows[0] - rows[:0:-1], rows, 2.0 * rows[-1] - rows[-2::-1])
    whole = np.concatenate(ends)
    slope = np.tan(np.pi * np.fft.rfftfreq(len(whole))) / np.tan(0.4 * np.pi / thin)
    ripple = 10**0.005 - 1.0
    gain = 1.0 / (1.0 + ripple * np.polynomial.chebyshev.chebval(slope, [0.0] * 8 + [1.0]) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(whole, axis=0) * gain[:, None], len(whole), axis=0)
    return smooth[len(rows) - 1 : 2 * len(rows) - 1 : thin]


def gaussian_smoothed(signal: np.ndarray, width: float) -> np.ndarray:
    """A signal (N,) behind a Gaussian kernel of standard deviation width [samples]; beyond its ends it is constant."""
    reach = int(4.0 * width + 0.5)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    return np.convolve(np.pad(signal, reach, mode="edge"), weights / weights.sum(), mode="valid")


def last_true(flags: np.ndarray) -> np.ndarray:
    """Places (N,) of the last of flags (N,) that is true up to each; −1 before the first."""
    return np.maximum.accumulate(np.where(flags, np.arange(len(flags)), -1))


def first_order_lag(signal: np.ndarray, decay: float) -> np.ndarray:
    """A signal (N,) behind a first-order lag with its decay over a sample, at rest in its first value."""
    from scipy.signal import lfilter  # imported late: scipy.signal takes longer to load than most commands

    return lfilter([1.0 - decay], [1.0, -decay], signal, zi=[decay * signal[0]])[0]
