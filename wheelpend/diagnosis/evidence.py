"""Evidence for an effect after its refit: Wald and encompassing tests, agreement of blocks, validation error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from derive.effects import Effect
from derive.parameter_name import short_name
from wheelpend.diagnosis.block_evidence import evidence_in_blocks, p_value_of_rest, sample_blocks
from wheelpend.diagnosis.criteria import MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.physical import is_determined, is_physical, is_within_its_friction
from wheelpend.diagnosis.score_test import linear_names, size_names
from wheelpend.estimation.estimate import EffectEstimate, Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.parameter_table import conservative_standard_error
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.profiled_starts import null_values
from wheelpend.estimation.validation import validation_residuals
from wheelpend.numerics import null_space

FAMILYWISE_SIGNIFICANCE_LEVEL = 0.01  # over the whole library
AGREEMENT_BLOCK_COUNT = 5  # blocks of each log's validation segments in which the fall of the error is counted


class ValidatedFit(NamedTuple):
    """A fit and its prediction errors on the validation segments."""

    fit: Fit
    error: float  # [σ]
    residuals: list[np.ndarray]  # of each log (N, channels) [σ]

    @staticmethod
    def of(problem: EstimationProblem, fitted: Fit) -> ValidatedFit:
        """Predict the validation segments with a fit."""
        return ValidatedFit(fitted, *validation_residuals(problem, fitted))


class Comparisons(NamedTuple):
    """Numbers of comparisons by which p-values are corrected (Bonferroni)."""

    tests: int  # on the training data
    validated: int  # effects that are judged on the validation data


class LogEstimate(NamedTuple):
    """Estimates of an effect's own parameters in one of several logs."""

    log: str
    coefficients: dict[str, float]
    sigma: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """The estimates under the keys of JSON."""
        return {"log": self.log, "coefficients": self.coefficients, "sigma": self.sigma}


@dataclass(frozen=True)
class CandidateFit(EffectEstimate):
    """An effect after its refit."""

    family: str
    p_value: float  # corrected for the library: the larger of the two below, or with a random force that of both
    blocks_agree: str  # in how many blocks of the validation data the error falls, as "4/5"
    error_after: float  # on validation data [σ]
    equivalent_to: tuple[str, ...]
    physical: bool
    fit: Fit = field(repr=False)
    beyond: dict[str, float] = field(default_factory=dict)  # p-value of what it adds to each effect it contains
    per_log: tuple[LogEstimate, ...] = ()  # of several logs, where the effect has a size in each
    p_discovery: float | None = None  # from the training data that chose the effect, corrected for the library
    p_confirmation: float | None = None  # from validation data, corrected for how many effects were judged on them
    held_out_gain: float | None = None  # of log-likelihood with a random force [nats], where that is what judges
    in_sample_gain: float | None = None  # the same of the data that the effect was fitted to
    evidence: np.ndarray | None = field(repr=False, compare=False, default=None)  # rise of log-likelihood in blocks
    p_rest: float = field(repr=False, default=1.0)  # p-value of validation residuals with it being no more than noise
    probability: float | None = None  # that it is missing, alone or with others, once every round is known
    determined: bool = True  # the logs tell its shape

    def to_json(self) -> dict[str, Any]:
        """The candidate under the keys of JSON."""
        return {
            "effect": self.effect,
            "family": self.family,
            "coefficients": self.coefficients,
            "sigma": self.sigma,
            "unit": self.unit,
            "p_value": self.p_value,
            "probability": self.probability,
            "blocks_agree": self.blocks_agree,
            "error_after": self.error_after,
            "equivalent_to": self.equivalent_to,
            "physical": self.physical,
            "beyond": self.beyond,
            "per_log": self.per_log,
            "p_discovery": self.p_discovery,
            "p_confirmation": self.p_confirmation,
            "held_out_gain": self.held_out_gain,
            "in_sample_gain": self.in_sample_gain,
        }

    @property
    def is_possible(self) -> bool:
        """Physically possible, and of a shape that the logs determine."""
        return self.physical and self.determined

    def is_supported(self, error_before: float) -> bool:
        """Significant, physically possible, and lowering the validation error by enough."""
        return (
            self.physical
            and self.p_value < FAMILYWISE_SIGNIFICANCE_LEVEL
            and self.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * error_before
        )

    def improves_on(self, smaller: CandidateFit) -> bool:
        """Adding significantly to an effect that it contains, and lowering the validation error by enough."""
        better = self.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * smaller.error_after
        return better and self.beyond.get(smaller.effect, 0.0) < FAMILYWISE_SIGNIFICANCE_LEVEL


def evaluate_candidate(
    problem: EstimationProblem,
    effect: Effect,
    fitted: Fit,
    base: ValidatedFit,
    comparisons: Comparisons,
    significance: Fit | None = None,
) -> CandidateFit:
    """Evidence for one effect from a fit with it, and from that of the model without it.

    The larger of two corrected p-values counts: from the training data that chose the effect, by the fit
    ``significance`` where it is another one, and from the validation data.
    """
    error_after, residuals = validation_residuals(problem, fitted)
    own, per_log = estimate_of(fitted, effect), estimates_per_log(problem, fitted, effect)
    in_logs = [(own.coefficients, own.sigma), *((e.coefficients, e.sigma) for e in per_log)]
    incremental = incremental_p_values(problem, effect, significance or fitted, comparisons.tests)
    sizes = [p for p in fitted.free if p.name in size_names(effect)]
    size_p_value = min(1.0, _size_p_value(problem, effect, significance or fitted, sizes) * comparisons.tests)
    added = [added_p_value(problem, effect, significance or fitted, s) for s in problem.replaced(effect.name)]
    discovery = max([size_p_value, *(min(1.0, p * comparisons.tests) for p in added)])
    confirmation = _corrected_confirmation(problem, base.residuals, residuals, comparisons.validated)
    return CandidateFit(
        effect=effect.name,
        estimates=own.estimates,
        family=effect.family,
        p_value=max(discovery, confirmation or 0.0),
        blocks_agree=block_agreement(base.residuals, residuals),
        error_after=error_after,
        equivalent_to=(),
        physical=all(is_physical(effect, own.coefficients | c, own.sigma | s) for c, s in in_logs)
        and is_within_its_friction(problem, effect, fitted),
        determined=is_determined(effect, own),
        fit=fitted,
        beyond=incremental,
        per_log=per_log,
        p_discovery=discovery,
        p_confirmation=confirmation,
        evidence=evidence_in_blocks(base.fit, fitted, base.residuals, residuals),
        p_rest=p_value_of_rest(residuals, problem.floor),
    )


def _size_p_value(problem: EstimationProblem, effect: Effect, fitted: Fit, sizes: Sequence[FreeParameter]) -> float:
    """P-value, not corrected, of the sizes of an effect against those at which it does nothing."""
    return wald_p_value(fitted, sizes, deviation_from_absence(fitted, sizes, null_values(problem, effect)))


def _corrected_confirmation(
    problem: EstimationProblem, before: Sequence[np.ndarray], after: Sequence[np.ndarray], validated: int
) -> float | None:
    """P-value of the encompassing test, corrected for so many effects; None without validation data."""
    return min(1.0, confirmation_p_value(problem, before, after) * validated) if problem.data.validation else None


def estimate_of(fitted: Fit, effect: Effect) -> EffectEstimate:
    """An effect's parameters with conservative standard errors; of those that each log has the first log's."""
    names = {p.name: effect.name_of(p) for p in effect.parameters}
    values, sigma = fitted.of_log(0), {p: conservative_standard_error(fitted, n) for p, n in names.items()}
    rows = {p.name: Estimate(values[names[p.name]], sigma[p.name], p.unit) for p in effect.parameters}
    return EffectEstimate(effect.name, rows)


def estimates_per_log(problem: EstimationProblem, fitted: Fit, effect: Effect) -> tuple[LogEstimate, ...]:
    """An effect's own size in each of several logs, where it has one."""
    names = per_log_names([n for n in effect.full_names if (n, 0) in fitted.places])
    if len(problem.logs) < 2 or not names:
        return ()
    return tuple(
        LogEstimate(
            log.name,
            {short_name(n): fitted.of_log(k)[n] for n in names},
            {short_name(n): conservative_standard_error(fitted, n, k) for n in names},
        )
        for k, log in enumerate(problem.logs)
    )


def confirmation_p_value(
    problem: EstimationProblem, residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]
) -> float:
    """P-value of the validation data following the change that an effect makes in the prediction.

    The old residuals are regressed on the change, which the training data alone have fixed: a factor of 1 says that
    the effect is there, 0 that it is not (the encompassing test of Harvey, Leybourne & Newbold 1998). Its standard
    error is the larger of those for white noise and from the scatter of blocks, and counts the uncertainty of the
    training data.
    """
    along, power = _regression_sums(residuals_before, residuals_after)
    return encompassing_p_value(along, power, 1.0 + problem.data.validation_values / problem.data.values)


def encompassing_p_value(along: np.ndarray, power: np.ndarray, inflation: float) -> float:
    """P-value of residuals following a change, from their products with it and its squares, summed over blocks.

    inflation is the variance of the factor over that which the residuals alone give it.
    """
    from scipy.special import stdtr  # imported late: scipy.special takes longer to load than most commands

    if not np.isfinite(along).all() or not power.sum() > 0.0:
        return 1.0
    count = len(along)
    factor = along.sum() / power.sum()
    scatter = np.sqrt(np.sum((along - factor * power) ** 2) * count / max(count - 1, 1))
    sigma = max(scatter, np.sqrt(power.sum())) / power.sum() * np.sqrt(inflation)
    return float(stdtr(max(count - 1, 1), -factor / sigma))


def _regression_sums(
    residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Products of the old residuals with the change, and its squares, summed over each block (blocks,)."""
    blocks = []
    for before, after in zip(residuals_before, residuals_after, strict=True):
        for block in sample_blocks(before):
            change = before[block] - after[block]
            blocks.append((np.nansum(before[block] * change), np.nansum(change**2)))
    along, power = np.array(blocks).T
    return along, power


def incremental_p_values(problem: EstimationProblem, effect: Effect, fitted: Fit, tests: int) -> dict[str, float]:
    """P-value, corrected for so many tests, of what an effect adds to each effect that it contains."""
    if not all((n, None) in fitted.places for n in linear_names(effect)):
        return {}
    contained = problem.module.CONTAINS.get(effect.name, {})
    return {s: min(1.0, added_p_value(problem, effect, fitted, s) * tests) for s in contained}


def added_p_value(
    problem: EstimationProblem, effect: Effect, fitted: Fit, smaller: str, parts: int | None = None
) -> float:
    """P-value, not corrected, of what an effect adds to one that it contains, or that it approaches.

    It becomes the one that it approaches where its inner parameter is infinite: to first order the inverse is as many
    standard errors from zero as the parameter itself.
    """
    weights = problem.module.CONTAINS.get(effect.name, {}).get(smaller)
    names = linear_names(effect) if weights else [effect.name_of(p) for p in filter(None, [effect.profiled])]
    sizes = [fitted.element(n, None) for n in names]
    added = null_space(np.array(weights).T).T if weights else None  # combinations that vanish where it is the smaller
    return wald_p_value(fitted, sizes, deviation_from_absence(fitted, sizes, {}), added, parts)


def deviation_from_absence(fitted: Fit, sizes: Sequence[FreeParameter], absent: Mapping[str, float]) -> np.ndarray:
    """Coefficients less the values at which they do nothing, zero where none is given."""
    deviation = [fitted.of_log(p.log or 0)[p.name] - absent.get(p.name, 0.0) for p in sizes]
    return np.where(np.isinf(deviation), 0.0, deviation)  # what stayed infinite was not fitted


def wald_p_value(
    fitted: Fit,
    sizes: Sequence[FreeParameter],
    deviation: np.ndarray,
    combined: np.ndarray | None = None,
    parts: int | None = None,
) -> float:
    """P-value of coefficients that deviate so far from absence, with the more cautious of two covariances.

    ``combined`` (n, sizes) tests combinations of them instead. ``parts`` is the number of independent parts of the
    data, that of the segments where it is not given.
    """
    from scipy.special import fdtrc  # imported late: scipy.special takes longer to load than most commands

    if not np.isfinite(fitted.error):
        return 1.0  # what cannot be simulated is evidence for nothing
    indices = [fitted.places[p.name, p.log] for p in sizes]
    mixed = np.eye(len(sizes)) if combined is None else combined
    values, count = mixed @ deviation, len(mixed)
    segment_count = sum(len(s) for s in fitted.states) if parts is None else parts
    kinds = (
        (fitted.covariance * max(fitted.error, 1.0) ** 2, max(segment_count - len(fitted.free), 2), 1.0),
        (fitted.robust, max(fitted.blocks - count, 2), max(fitted.blocks - count, 1) / max(fitted.blocks - 1, 1)),
    )  # covariance, degrees of freedom, and Hotelling's correction for a covariance from so few blocks
    worst = 0.0
    for matrix, freedom, correction in kinds:
        block = mixed @ matrix[np.ix_(indices, indices)] @ mixed.T
        statistic = float(values @ np.linalg.pinv(block, rcond=1e-12, hermitian=True) @ values) / count * correction
        worst = max(worst, float(fdtrc(count, freedom, max(statistic, 0.0))))
    return worst


def block_agreement(residuals_before: list[np.ndarray], residuals_after: list[np.ndarray]) -> str:
    """Number of blocks of the validation data in which the error falls, and of all, as "4/5"."""
    falls = []
    for before, after in zip(residuals_before, residuals_after, strict=True):
        for block in sample_blocks(before, AGREEMENT_BLOCK_COUNT):
            falls.append(np.nansum(after[block] ** 2) < np.nansum(before[block] ** 2))
    return f"{sum(falls)}/{len(falls)}"
