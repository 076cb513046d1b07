"""Test of least squares for bias on a log, in the manner of Durbin, Wu and Hausman.

Least squares is efficient without noise in the regressor and biased with it; a consistent estimate is less precise and
unbiased either way. The test statistic is their difference. Filters colour the residual over seconds, so the classical
variances do not hold: that of the difference comes from a parametric bootstrap, which also predicts the bias itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wheelpend.durations import StepTimer
from wheelpend.estimation.linear_fit import LinearFit
from wheelpend.identification.bootstrap import ParametricBootstrap
from wheelpend.logs.log import Log

BIAS_TEST_REPLICAS = 30
P_VALUE_LEVEL = 0.01
NEGLIGIBLE_RELATIVE_BIAS = 1e-3  # of a parameter: left by interpolation between samples even without noise


@dataclass(frozen=True)
class BiasTest:
    """Least squares against a consistent estimate, in percent of the latter."""

    p_value: float  # of a difference this large when the bias is no more than about a tenth of a percent
    biased: bool  # p below 0.01
    against: str  # iv or shooting
    difference_percent: dict[str, float]
    sigma_percent: dict[str, float]  # standard deviation of that difference by chance
    predicted_bias_percent: dict[str, float]  # mean of least squares on replicas
    predicted_spread_percent: dict[str, float]  # standard deviation of least squares on replicas
    replicas: int

    def to_json(self) -> dict[str, Any]:
        """The test under the keys of JSON."""
        return {
            "p_value": self.p_value,
            "biased": self.biased,
            "against": self.against,
            "difference_percent": self.difference_percent,
            "sigma_percent": self.sigma_percent,
            "predicted_bias_percent": self.predicted_bias_percent,
            "predicted_spread_percent": self.predicted_spread_percent,
            "replicas": self.replicas,
        }

    @property
    def sentence(self) -> str:
        """The result of the test in words."""
        if not self.biased:
            return f"Least squares shows no bias on this log (p = {self.p_value:.2g}, against {self.against})."
        worst = max(
            self.predicted_bias_percent, key=lambda n: float(np.nan_to_num(abs(self.predicted_bias_percent[n])))
        )
        return (f"Least squares is biased on this log (p = {self.p_value:.1g}, against {self.against}): expect "
                f"{self.predicted_bias_percent[worst]:+.3g} % in {worst}, which its standard errors do not tell. "
                f"Use `--method {self.against}`.")  # fmt: skip


def hausman_test(
    bootstrap: ParametricBootstrap,
    fitted: LinearFit,
    estimator: Callable[[Log], LinearFit],
    replicas: int = BIAS_TEST_REPLICAS,
    progress: Callable[[str], None] = lambda text: None,
) -> BiasTest:
    """Test a least-squares fit of the log against the consistent estimate; its estimator is applied to replicas."""
    pairs, timer = [], StepTimer(replicas)
    for number, log in enumerate(bootstrap.replicas(replicas)):
        progress(f"is least squares biased: replica {number + 1} of {replicas}{timer.left_text(number)}")
        pairs.append((estimator(log).estimate, _consistent_estimate(bootstrap, log)))
    least, consistent = (np.array(column) for column in zip(*pairs, strict=True))
    spread = np.atleast_2d(np.cov((least - consistent).T))
    if bootstrap.reestimate is None:
        spread = spread + bootstrap.covariance
    difference = fitted.estimate - bootstrap.estimate
    margin = np.diag((NEGLIGIBLE_RELATIVE_BIAS * bootstrap.estimate) ** 2)
    p_value = hotelling_p_value(difference, spread + margin, replicas)
    percent = 100.0 / np.where(bootstrap.estimate == 0.0, np.nan, np.abs(bootstrap.estimate))

    def named(values: np.ndarray) -> dict[str, float]:
        return dict(zip(fitted.names, map(float, values * percent), strict=True))

    return BiasTest(
        p_value, p_value < P_VALUE_LEVEL, bootstrap.against, named(difference), named(np.sqrt(np.diag(spread))),
        named(least.mean(axis=0) - bootstrap.estimate), named(least.std(axis=0, ddof=1)), replicas,
    )  # fmt: skip


def _consistent_estimate(bootstrap: ParametricBootstrap, log: Log) -> np.ndarray:
    return bootstrap.estimate if bootstrap.reestimate is None else bootstrap.reestimate(log)


def hotelling_p_value(difference: np.ndarray, covariance: np.ndarray, draws: int) -> float:
    """Probability of a difference (n,) this large when its mean is zero; covariance (n, n) estimated from draws."""
    from scipy.special import fdtrc  # imported late: SciPy takes longer to load than a warm command

    varies = np.diag(covariance) > 0.0
    if not varies.any():  # nothing that could be tested
        return 1.0
    scale = np.sqrt(np.diag(covariance)[varies])
    scaled = difference[varies] / scale
    square = float(scaled @ np.linalg.pinv(covariance[np.ix_(varies, varies)] / np.outer(scale, scale)) @ scaled)
    size = len(scale)
    return float(fdtrc(size, draws - size, square * (draws - size) / ((draws - 1) * size)))


__all__ = ["BiasTest", "hausman_test", "hotelling_p_value"]
