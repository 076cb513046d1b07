"""What a model predicts of a log, sample by sample, over the segments on which it is compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wheelpend.diagnosis.compare import model_to_compare, predict_segments
from wheelpend.errors import Failure
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.prediction import RUNAWAY_RESIDUAL_SIGMAS
from wheelpend.logs.sources import LogLike, as_list
from wheelpend.model.record import Model
from wheelpend.notebook import DrawnResult, ResultTable
from wheelpend.parallel import with_one_blas_thread

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, repr=False)
class Prediction(DrawnResult):
    """A log and what a model predicts of it, from a fitted state at the beginning of each segment on."""

    error: float  # over all segments [σ]
    horizon_s: float  # length of a segment
    t: np.ndarray  # (N,) s, from the log's first sample
    segment: np.ndarray  # (N,) int, from 0; -1 where nothing is predicted: gaps, warm-ups, a machine out of its range
    channels: tuple[str, ...]  # of the columns of measured and predicted
    measured: np.ndarray  # (N, channels) as the log has it, without outliers; NaN where a sensor gave no value
    predicted: np.ndarray  # (N, channels), NaN where nothing was measured or no segment is; infinite where it runs away
    sigma: np.ndarray  # (channels,) standard deviation of each sensor's noise
    warnings: tuple[str, ...] = ()

    def headline(self) -> str:
        """The error, and over how many segments."""
        return f"Prediction of {self.segment.max() + 1} segments of {self.horizon_s:g} s, error {self.error:.3g} σ"

    def table(self) -> ResultTable:
        """A row per channel: root mean square error and standard deviation of the noise, in the channel's unit."""
        squares = (self.measured - self.predicted) ** 2
        rmse = [float(np.sqrt(np.mean(s[~np.isnan(s)]))) for s in squares.T]
        rows = list(zip(self.channels, rmse, self.sigma.tolist(), strict=True))
        return ResultTable({"channel": str, "rmse": float, "sigma": float}, rows)

    def to_frame(self) -> pl.DataFrame:
        """A row per sample: t [s], segment, and each channel and channel_predicted; null where there is none."""
        import polars as pl  # imported late: it is slow to load

        columns = {"t": self.t, "segment": self.segment}
        for name, measured, predicted in zip(self.channels, self.measured.T, self.predicted.T, strict=True):
            columns |= {name: measured, f"{name}_predicted": predicted}
        return pl.DataFrame(columns).fill_nan(None)


@with_one_blas_thread
def predict(
    model: Model,
    log: LogLike,
    *,
    horizon: float = DEFAULT_HORIZON_S,
    progress: Callable[[str], None] = lambda text: None,
) -> Prediction:
    """Predict a log with the model at its values, over segments of ``horizon`` [s] as ``compare`` does.

    In each segment the model runs freely on the logged commands; only the state at its beginning is fitted. A model
    with neither identified nor nominal values is fitted to the log first. Raises Failure for more logs than one, and
    where the log or the model cannot be used.
    """
    logs = as_list(log)
    if len(logs) != 1:
        raise Failure(f"A prediction must be of one log, but {len(logs)} were given. Predict each by itself.")
    compared = model_to_compare(model, logs, (), progress, horizon)
    progress("predicting segments")
    error, (residual,) = predict_segments(compared)
    (segments,) = compared.log_segments
    predicted = segments.log.measured - residual * segments.sigma
    predicted[np.abs(residual) >= RUNAWAY_RESIDUAL_SIGMAS] = np.inf
    number = np.full(len(segments.log), -1, dtype=np.int64)
    for k, (begin, end) in enumerate(segments.bounds):
        number[begin:end] = k
    return Prediction(
        error, horizon, segments.log.t, number, segments.log.channels, segments.log.measured, predicted,
        np.asarray(segments.sigma), compared.problem.warnings,
    )  # fmt: skip
