"""Standard deviation of the white part of measured channels: what neither smoothness nor the past accounts for.

Motion can only add to what differences leave, and to what a prediction from the past misses. So every estimate is an
upper limit, and the least one holds, up to its standard error.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log
from wheelpend.numerics import last_true

DIFFERENCE_ORDERS = range(2, 7)  # differences of these orders: the higher, the less of a smooth signal remains
VARIANCE_WINDOW_SAMPLES = 50  # samples over which a variance is taken
IRREGULAR_SHARE = 0.01  # of the median interval, by which half of all differ where times are not taken as equal
MAX_MISSING_SHARE = 0.01  # of the rows, beyond which the steps across those that are missing count as they are
BURST_SIGMAS = 5.0  # standard deviations of a window's variance above the median one from which it is a burst
MAX_PREDICTORS = 160  # past samples, of all signals together, that predict the next; the noise in n adds 1/n or so
INPUT_GAIN_LAGS = 3  # samples of the input whose effect may depend on where the machine is
POSITION_AVERAGE_LAGS = 10  # samples that say where the machine is
MIN_ROWS_PER_COEFFICIENT = 5  # predicted samples for each coefficient of a prediction
MAX_PREDICTED_SAMPLES = 4_000  # samples, which give a standard deviation to 1.1 %
LOST_ROW_RATIO = 1.5  # times the usual interval between rows, from which on one is missing
JUMP_DEVIATIONS = 12.0  # times the median one: what is further off disturbs the predictions that look back at it
RANK_TOLERANCE = 1e-10  # relative singular value below which a direction of the regressors says nothing


def white_sigma(
    signal: np.ndarray, predicted: tuple[float, float] = (np.inf, 0.0), t: np.ndarray | None = None
) -> float:
    """Standard deviation of the white part of a signal (N,): the surest estimate that the least one does not exclude.

    ``predicted`` is σ by prediction, and its relative standard error; ``t`` (N,) are the times of its values, equal
    steps where they are not known. The least of all would be low by chance.
    """
    estimates = [(v, e) for v, e in (*difference_estimates(signal, t), predicted) if np.isfinite(v)]
    if not estimates:
        return float(np.nanstd(signal)) if np.isfinite(signal).any() else np.nan
    limit = min(value * (1.0 + error) for value, error in estimates)
    return min((error, value) for value, error in estimates if value <= limit)[1]


def difference_noise(signal: np.ndarray) -> float:
    """Standard deviation of the white part of a signal (N,), from its differences alone."""
    return white_sigma(signal)


def difference_estimates(signal: np.ndarray, t: np.ndarray | None = None) -> list[tuple[float, float]]:
    """σ and its relative standard error from the differences of each order of a signal (N,), without bursts.

    At unequal times ``t`` (N,) from divided differences too, which remove what is smooth in time; and even so from
    those of equal steps, since the times may be what is wrong.
    """
    found = []
    signal, t = _readings(signal, t)
    beyond = np.zeros(0) if t is None else _is_gap(t)
    for times in (None,) if t is None or _is_regular(t) else (None, t):
        for order in DIFFERENCE_ORDERS:
            squares = _differences(signal, times, order) ** 2
            if beyond.any():  # what happened in a gap is no noise
                squares[np.convolve(beyond, np.ones(order), "valid") > 0.0] = np.nan
            squares = squares[np.isfinite(squares)]  # a missing value leaves no difference
            if squares.size <= 10:
                break
            inflation = _correlation_of_squares(order)
            found.append((mean_without_bursts(squares, inflation) ** 0.5, (inflation / (2.0 * squares.size)) ** 0.5))
    return found


def _readings(signal: np.ndarray, t: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Values (N,) and times (N,) of a signal; of one that is read in every second row or less often, of these rows."""
    read = np.flatnonzero(np.isfinite(signal))
    if read.size < 2 or np.median(np.diff(read)) < 2:
        return signal, t
    return signal[read], None if t is None else t[read]


def _is_gap(t: np.ndarray) -> np.ndarray:
    """1.0 for every step (N - 1,) between times (N,) that is far longer than most, 0.0 for others."""
    steps = np.diff(t)
    return (steps > GAP_INTERVAL_RATIO * np.median(steps)).astype(float) if steps.size else np.zeros(0)


def _is_regular(t: np.ndarray) -> bool:
    """True of times (N,) in equal steps, gaps apart, but for a few rows that are missing."""
    steps = np.diff(t)
    if not steps.size:
        return True
    middle = np.median(steps)
    off = np.abs(steps - middle)
    return bool(np.median(off) <= IRREGULAR_SHARE * middle and np.mean(off > 0.5 * middle) <= MAX_MISSING_SHARE)


def _differences(signal: np.ndarray, t: np.ndarray | None, order: int) -> np.ndarray:
    """Differences (N − order,) of a signal (N,) at times (N,), divided where they are given, of the size of its noise.

    Those of white noise have its variance.
    """
    if t is None:
        return white_differences(signal, order)
    times = np.lib.stride_tricks.sliding_window_view(t, order + 1)
    places = range(order + 1)
    weights = np.stack([1.0 / np.prod([times[:, k] - times[:, m] for m in places if m != k], axis=0) for k in places])
    weights /= np.sqrt((weights**2).sum(axis=0))
    return np.einsum("kn,nk->n", weights, np.lib.stride_tricks.sliding_window_view(signal, order + 1))


def white_differences(signal: np.ndarray, order: int) -> np.ndarray:
    """Differences (N − order,) of a signal (N,) in equal steps, of the size of its white noise."""
    return np.asarray(np.diff(signal, order)) / comb(2 * order, order) ** 0.5


def _correlation_of_squares(order: int) -> float:
    """Sum over all lags of the squared autocorrelation of white noise's differences: so much less do they average."""
    middle = comb(2 * order, order)
    return sum((comb(2 * order, order + lag) / middle) ** 2 for lag in range(-order, order + 1))


def mean_without_bursts(squares: np.ndarray, inflation: float = 1.0) -> float:
    """Mean of squares (N,) over short windows, those with bursts left out, so that the noise need not be Gaussian."""
    width = min(VARIANCE_WINDOW_SAMPLES, squares.size)
    means = squares[: squares.size // width * width].reshape(-1, width).mean(axis=1)
    limit = 1.0 + BURST_SIGMAS * (2.0 * inflation / width) ** 0.5
    return float(means[means <= limit * np.median(means)].mean())


def predicted_noise(log: Log) -> list[tuple[float, float]]:
    """For each channel σ of what its past and that of all signals do not predict, and its relative standard error.

    The input is among these signals: a controller that answers to the noise shakes the machine from sample to sample,
    and differences take that for noise. Only samples before the predicted one are used, or the controller's own law
    would predict it. Infinite where the log is too short.
    """
    signals = [_held(s) for s in (*log.measured.T, *log.inputs) if np.isfinite(s).any() and np.ptp(s[np.isfinite(s)])]
    inputs = [_held(u) for u in log.inputs if np.isfinite(u).any()]
    predictors = min(MAX_PREDICTORS, len(log) // MIN_ROWS_PER_COEFFICIENT)
    most = predictors // max(len(signals), 1)

    def rest_of(begins: np.ndarray) -> _Prediction | None:
        lags, rows = most, _predictable_samples(log, begins, most)
        while lags >= 2 * INPUT_GAIN_LAGS and rows.size < MIN_ROWS_PER_COEFFICIENT * lags * len(signals):
            lags //= 2  # where rows are missing again and again, few have a long past
            rows = _predictable_samples(log, begins, lags)
        if lags < INPUT_GAIN_LAGS or not rows.size:
            return None
        return _predicted(_regressors(signals, inputs, rows, lags), log.measured[rows], rows)

    begins = _begins(log)
    found = rest_of(begins)
    if found is not None and (jumps := found.jumps()).size:
        begins[np.minimum(jumps + 1, len(log) - 1)] = True
        found = rest_of(begins) or found
    return found.errors() if found else [(np.inf, 0.0)] * len(log.channels)


def _held(signal: np.ndarray) -> np.ndarray:
    """A signal (N,) with its last known value where one is missing, over its standard deviation."""
    last = last_true(np.isfinite(signal))
    held = signal[np.where(last < 0, int(np.argmax(last >= 0)), last)]
    return (held - held.mean()) / max(float(held.std()), 1e-300)


def _begins(log: Log) -> np.ndarray:
    """Mask (N,) of the samples before which one is missing: a row, the reading of a channel, the way of an encoder.

    One reading that is held, one row that was lost or one jump among what predicts is as large as the motion of a step
    and more, and would be taken for noise. A slow sensor is read in every so many rows, and none is missing between.
    """
    begins = np.concatenate([[True], np.diff(log.t) > LOST_ROW_RATIO * log.dt])
    begins[list(log.breaks)] = True
    for column in np.isfinite(log.measured).T:
        read = np.flatnonzero(column)
        if read.size > 1:
            steps = np.diff(read)
            begins[read[1:][steps > max(np.median(steps), 1.0)]] = True
    return begins


def _predictable_samples(log: Log, begins: np.ndarray, lags: int) -> np.ndarray:
    """Complete samples with so many before them since one of a mask (N,), at most MAX_PREDICTED_SAMPLES, spread out."""
    known = np.isfinite(log.measured).all(axis=1)
    rows = np.flatnonzero((np.arange(len(log)) - last_true(begins) >= lags) & known)
    return rows[:: max(1, -(-rows.size // MAX_PREDICTED_SAMPLES))]


def _regressors(signals: list[np.ndarray], inputs: list[np.ndarray], rows: np.ndarray, lags: int) -> np.ndarray:
    """What predicts the samples: the past of every signal, and how where the machine is changes the input's effect."""

    def past(signal: np.ndarray, count: int) -> np.ndarray:
        return np.asarray(signal[np.subtract.outer(rows, np.arange(1, count + 1))])

    columns = [np.ones((rows.size, 1))]
    for signal in signals:
        own = past(signal, lags)
        place = own[:, :POSITION_AVERAGE_LAGS].mean(axis=1, keepdims=True)
        columns += [own, place**2, place**3]
        columns += [past(u, INPUT_GAIN_LAGS) * place**power for u in inputs for power in (1, 2)]
    return np.concatenate(columns, axis=1)


class _Prediction(NamedTuple):
    """What is left of the channels at some samples by what predicts them."""

    rest: np.ndarray  # (n, channels)
    rows: np.ndarray  # (n,) samples
    freedom: int  # samples less coefficients

    def errors(self) -> list[tuple[float, float]]:
        """Standard deviation of each channel's rest, and its relative standard error."""
        ratio = len(self.rows) / self.freedom
        variances = [mean_without_bursts(r**2) * ratio for r in self.rest.T]
        return [(float(np.sqrt(v)), float(np.sqrt(0.5 / self.freedom))) for v in variances]

    def jumps(self) -> np.ndarray:
        """Samples (k,) at which a channel goes far from where it was predicted."""
        size = np.abs(self.rest)
        usual = np.median(size, axis=0)
        return self.rows[((size > JUMP_DEVIATIONS * usual) & (usual > 0.0)).any(axis=1)]


def _predicted(regressors: np.ndarray, targets: np.ndarray, rows: np.ndarray) -> _Prediction | None:
    """What regressors (n, p) leave of targets (n, channels) at samples (n,); None where these are too few.

    Made triangular first, with the targets beside them: that costs a tenth of singular values of all rows.
    """
    count, width = regressors.shape
    if count < 2 * width:
        return None
    centred = targets - targets.mean(axis=0)
    triangular = np.asarray(np.linalg.qr(np.hstack([regressors, centred]), mode="r"))[:width]
    coefficients, _, rank, _ = np.linalg.lstsq(triangular[:, :width], triangular[:, width:], RANK_TOLERANCE)
    return _Prediction(centred - regressors @ coefficients, rows, count - int(rank))
