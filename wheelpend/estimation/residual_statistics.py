"""Statistics of whitened innovations: are they white, do past inputs predict them, how large and how normal are they?

Every test allows for residuals whose size changes along the log, as those of a machine do.
Sources: Dalla, Giraitis and Phillips, Robust tests for white noise and cross-correlation, Econometric Theory 38 (2022)
913; White, A heteroskedasticity-consistent covariance matrix estimator, Econometrica 48 (1980) 817; Ljung, System
Identification (1999), section 16.6.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc, ndtri

MAX_LAGS = 20  # lags that are looked at, spread evenly over their logarithm
INPUT_LAGS = 8  # likewise, of the input and of the residual's own past beside it
MIN_PAIRS_PER_LAG = 30  # pairs of samples below which a lag says nothing
NORMAL_PROBABILITIES = (0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999)
RANK_TOLERANCE = 1e-10  # relative eigenvalue below which a direction of the regressors says nothing


class Autocorrelation(NamedTuple):
    """Correlation of a residual with its own past."""

    lags: np.ndarray  # (lags,) samples
    values: np.ndarray  # (lags,)
    deviates: np.ndarray  # (lags,) standard normal where the residual is white

    @property
    def band(self) -> np.ndarray:
        """Half width (lags,) of the interval that holds 95 % of the values of white noise."""
        scale = np.abs(self.values) / np.maximum(np.abs(self.deviates), 1e-300)
        return np.asarray(-ndtri(0.025) * scale)

    @property
    def p_value(self) -> float:
        """Probability of values as large together in white noise."""
        return float(chdtrc(self.lags.size, float(self.deviates @ self.deviates))) if self.lags.size else 1.0


def spread_lags(longest: int, count: int = MAX_LAGS) -> np.ndarray:
    """At most so many distinct lags from 1 to a longest one [samples], evenly spread over their logarithm."""
    return np.unique(np.round(np.geomspace(1, max(longest, 1), count)).astype(int))


def autocorrelation(runs: Sequence[np.ndarray], lags: np.ndarray) -> Autocorrelation:
    """Autocorrelation of runs (N,) of one residual without gaps in time; missing values are NaN.

    Each deviate is a sum of products over the root of the sum of their squares, which has variance 1 whatever the size
    of the residual does.
    """
    square = float(np.nansum([np.nansum(r**2) for r in runs]))
    count = sum(int(np.isfinite(r).sum()) for r in runs)
    found = []
    for lag in lags:
        products = np.concatenate([r[lag:] * r[:-lag] for r in runs if len(r) > lag] or [np.zeros(0)])
        products = products[np.isfinite(products)]
        if products.size < MIN_PAIRS_PER_LAG or not square:
            continue
        power = float(np.sqrt(np.sum(products**2)))
        value = float(products.sum()) / products.size / (square / count)
        found.append((int(lag), value, float(products.sum()) / power if power else 0.0))
    rows = np.array(found).reshape(-1, 3)
    return Autocorrelation(rows[:, 0].astype(int), rows[:, 1], rows[:, 2])


def past_input_p_value(runs: Sequence[np.ndarray], inputs: Sequence[np.ndarray], longest: int) -> float:
    """Probability by chance that past inputs predict a residual as well as they do, given its own past.

    runs are a residual (N,) without gaps in time, inputs the commands (inputs, N) of the same samples. The input at a
    sample answers to that sample where a controller is at work, so only earlier ones count; and a residual with colour
    reaches the input through the controller, so its own past stands beside them. 1 where there is too little of either.
    """
    lags = spread_lags(longest, INPUT_LAGS)
    depth = int(lags[-1])
    rows, targets = [], []
    for residual, commands in zip(runs, inputs, strict=True):
        if len(residual) <= depth:
            continue
        at = np.arange(depth, len(residual))
        signals = [residual, *commands]
        rows.append(np.column_stack([s[at - k] for s in signals for k in lags]))
        targets.append(residual[at])
    if not rows:
        return 1.0
    x, y = np.concatenate(rows), np.concatenate(targets)
    good = np.isfinite(x).all(axis=1) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(y) < 10 * x.shape[1]:
        return 1.0
    x = x - x.mean(axis=0)
    scale = x.std(axis=0)
    return _wald_p_value(x[:, scale > 0] / scale[scale > 0], y - y.mean(), int((scale[: lags.size] > 0).sum()))


def _wald_p_value(x: np.ndarray, y: np.ndarray, own: int) -> float:
    """Wald test, with White's covariance, that only the first columns of x (N, n) predict y (N,)."""
    own_part, others = x[:, :own], x[:, own:]
    if not others.shape[1]:
        return 1.0
    beside = others - own_part @ np.linalg.lstsq(own_part, others, rcond=None)[0] if own else others
    rest = y - own_part @ np.linalg.lstsq(own_part, y, rcond=None)[0] if own else y
    power, axes = np.linalg.eigh(beside.T @ beside)
    kept = axes[:, power > RANK_TOLERANCE * max(float(power[-1]), 1e-300)]
    along = beside @ kept
    score, spread = along.T @ rest, (along * rest[:, None] ** 2).T @ along
    return float(chdtrc(kept.shape[1], float(score @ np.linalg.solve(spread, score))))


def normal_quantiles(residual: np.ndarray) -> list[tuple[float, float]]:
    """Of a residual (N,): quantiles of the normal distribution and its own, at NORMAL_PROBABILITIES."""
    known = residual[np.isfinite(residual)]
    if not known.size:
        return []
    own = np.quantile(known, NORMAL_PROBABILITIES)
    return [(float(ndtri(p)), float(q)) for p, q in zip(NORMAL_PROBABILITIES, own, strict=True)]


def excess_kurtosis(residual: np.ndarray) -> float:
    """Excess kurtosis of a residual (N,): 0 of a normal distribution, larger with heavier tails."""
    known = residual[np.isfinite(residual)]
    variance = float(np.mean(known**2)) if known.size else 0.0
    return float(np.mean(known**4)) / variance**2 - 3.0 if variance else 0.0
