"""How much likelier all data are with an effect, and whether more than noise is left, in blocks of validation data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.prediction import RUNAWAY_RESIDUAL_SIGMAS
from wheelpend.estimation.segments import Segments

BLOCK_COUNT = 10  # of each log's validation segments, whose scatter gives a standard error
CHANCE_VARIANCE = 0.5  # of the difference over the sum of squares of two independent Gaussian errors
MAX_RELATIVE_FALL = 1.0 - 1e-12  # so far squares fall or rise that are none, or infinite, afterwards
MIN_CLEAR_STATISTIC = 2.0  # standard errors between blocks by which one prediction is clearly better than another
SIGMA_UNCERTAINTY = 0.01  # relative, of the sensors' σ: an error that is higher by so much is no sign of anything


def evidence_in_blocks(
    before: Fit, after: Fit, residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]
) -> np.ndarray:
    """Rise of the log-likelihood of all data after a change of the model (blocks,) [nats], where noise is all else.

    That of validation residuals of each log (N, channels) [σ] in blocks, and spread evenly over these that of the
    estimation data, less what the change's freedom is worth by chance (Schwarz).
    """
    gains = falls_in_blocks(residuals_before, residuals_after)
    if before.count != after.count:  # other data: the validation residuals alone tell
        return gains
    worth = (len(after.free) - len(before.free)) * np.log(max(after.count, 2))
    return gains + 0.5 * (before.cost - after.cost - worth) / len(gains)


def gain_statistic(gains: np.ndarray) -> float:
    """The mean of some gains over its standard error from their scatter; infinite where they are all alike."""
    if len(gains) < 2 or not np.isfinite(gains).all():
        return 0.0
    error, mean = float(np.std(gains, ddof=1)) / np.sqrt(len(gains)), float(np.mean(gains))
    return mean / error if error > 0.0 else math.copysign(math.inf, mean) if mean else 0.0


def relative_lead_statistic(falls: np.ndarray, others: np.ndarray) -> float:
    """Mean relative fall of squares from one prediction to another in blocks, over its standard error; 0 without any.

    Both (blocks,) are relative falls from a third prediction. Few blocks do not tell their scatter: one more is counted
    whose squares differ by chance as those of two independent errors do (arcsine law, variance 1/2). So single blocks
    settle nothing, and two only where both errors are far smaller. Of errors that are alike one leads clearly so in a
    tenth at most.
    """
    if not len(falls):
        return 0.0
    falls, others = (np.clip(r, -MAX_RELATIVE_FALL, MAX_RELATIVE_FALL) for r in (falls, others))
    leads = (falls - others) / (1.0 - falls * others)
    mean = float(np.mean(leads))
    return mean * len(leads) / math.sqrt(CHANCE_VARIANCE + float(np.sum((leads - mean) ** 2)))


def is_clear_lead(lead: np.ndarray, *, scatters: bool) -> bool:
    """True of a lead in log-likelihood (blocks,) [nats], the price of freedom counted, that settles a choice.

    Where it ``scatters`` between blocks by more than noise does it must be clear of that scatter too.
    """
    return bool(lead.sum() > 0.0) and (not scatters or gain_statistic(lead) >= MIN_CLEAR_STATISTIC)


def p_value_of_rest(residuals: Sequence[np.ndarray], floor: float) -> float:
    """P-value of validation residuals of each log (N, channels) [σ] being no more than noise of the error ``floor``.

    By the scatter of the mean squares of their blocks, and by how well the sensors' σ are known.
    """
    from scipy.special import stdtr  # imported late: scipy.special takes longer to load than most commands

    squares = np.array([np.nanmean(r[b] ** 2) for r in residuals for b in sample_blocks(r) if len(b)])
    if not np.isfinite(squares).all():
        return 0.0
    count = len(squares)
    if not count:
        return 1.0
    scatter = np.std(squares, ddof=1) / np.sqrt(count) if count > 1 else 0.0
    error = np.hypot(scatter, 2.0 * SIGMA_UNCERTAINTY * floor**2)
    return float(stdtr(max(count - 1, 1), -(squares.mean() - floor**2) / error))


def falls_in_blocks(residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]) -> np.ndarray:
    """Fall of half the sum of squares of each log's residuals (N, channels) over their blocks (blocks,).

    Of values that both have: a change may leave a few unpredicted, as the first readings of late sensors are. One that
    leaves less than half of them has lost the log. One block in which nothing falls where no log has any: of a log of
    one segment none is held out.
    """
    falls = [_falls(b, a) for b, a in zip(residuals_before, residuals_after, strict=True)]
    return 0.5 * np.concatenate(falls) if falls else np.zeros(1)


def falls_over_segments(
    parts: Sequence[Segments], residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]
) -> np.ndarray:
    """Fall of half the sum of squares of residuals (N, channels) over whole segments of each part, in blocks.

    The error of a segment grows from its start, so that pieces of one are not independent. Returns (2, blocks): the
    falls, then these over the sums before and after, between -1 and 1, so that no single block decides.
    """
    found = [np.zeros((2, 0))]
    for part, before, after in zip(parts, residuals_before, residuals_after, strict=True):
        known = [(before[a:b], after[a:b]) for a, b in part.bounds if np.isfinite(before[a:b]).any()]
        halves = np.array([[0.5 * float(np.nansum(r**2)) for r in pair] for pair in known]).reshape(-1, 2)
        blocks = np.array_split(halves, min(BLOCK_COUNT, len(halves)) or 1)
        sums = np.array([block.sum(axis=0) for block in blocks if len(block)]).reshape(-1, 2)
        falls = sums[:, 0] - sums[:, 1]
        bounded = np.minimum(sums, 1e300)  # what ran away is infinite
        relative = (bounded[:, 0] - bounded[:, 1]) / np.maximum(bounded.sum(axis=1), 1e-300)
        found.append(np.array([falls, relative]))
    return np.concatenate(found, axis=1)


def sample_blocks(residuals: np.ndarray, count: int = BLOCK_COUNT) -> list[np.ndarray]:
    """The samples that have residuals (N, channels), in so many blocks, or as many as there are samples."""
    used = np.flatnonzero(np.isfinite(residuals).any(axis=1))
    return np.array_split(used, min(count, max(len(used), 1)))


def _falls(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Falls of the sum of squares of a log's residuals (N, channels) over blocks (blocks,) of what both have."""
    both = np.isfinite(before) & np.isfinite(after)
    if 2 * np.count_nonzero(both) < np.count_nonzero(np.isfinite(before)):
        return np.full(1, -(RUNAWAY_RESIDUAL_SIGMAS**2))
    pair = [np.where(both, residuals, np.nan) for residuals in (before, after)]
    blocks = sample_blocks(pair[0])
    sums = np.array([[np.nansum(residuals[block] ** 2) for block in blocks] for residuals in pair])
    return sums[0] - sums[1]
