"""Means of a force over ranges of a state, with the standard error that its visits there leave."""

from __future__ import annotations

import numpy as np

MAX_BINS = 24


def quantile_bins(x: np.ndarray) -> np.ndarray:
    """Bin number of each value; bins hold equal counts."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, min(MAX_BINS, max(2, len(x) // 8)) + 1)))
    return np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))


def bin_means(x: np.ndarray, y: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """Mean x, mean y and the mean's standard error of each bin (bins, 3); samples of one visit to a bin count once."""
    rows = []
    for b in np.unique(bins):
        inside = bins == b
        visits = np.count_nonzero(np.diff(np.r_[False, inside].astype(np.int8)) > 0)
        rows.append((x[inside].mean(), y[inside].mean(), y[inside].std() / np.sqrt(visits)))
    return np.array(rows)
