"""Evidence for an effect after its refit: significance, agreement of blocks, and fall of the held-out error."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from derive.effects import Effect
from wheelpend.diagnosis.score_test import Candidate, size_names
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.parameter_table import conservative_standard_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.profiled_starts import null_values
from wheelpend.estimation.validation import validation_residuals
from wheelpend.numerics import null_space

FAMILYWISE_SIGNIFICANCE_LEVEL = 0.01  # family-wise, over the whole library
MIN_RELATIVE_ERROR_DECREASE = 0.005  # relative fall of the held-out error below which an effect is not worth naming
AGREEMENT_BLOCK_COUNT = 5  # of each held-out part, that are asked whether the error falls in them
CONFIRMATION_BLOCK_COUNT = 10  # of each held-out part, whose scatter tells the error of a confirmation


class LogEstimate(NamedTuple):
    """What one of several logs says of an effect's own parameters in it."""

    log: str
    coefficients: dict[str, float]
    sigma: dict[str, float]


@dataclass(frozen=True)
class CandidateFit:
    """An effect after its refit; coefficients that each log has for itself are the first log's."""

    effect: str
    family: str
    coefficients: dict[str, float]
    sigma: dict[str, float]
    unit: dict[str, str]
    p_value: float  # corrected for the size of the library, the larger of p_discovery and p_confirmation
    blocks_agree: str
    error_after: float  # held out
    equivalent_to: tuple[str, ...]
    physical: bool
    fit: Fit = field(repr=False)
    beyond: dict[str, float] = field(default_factory=dict)  # p-value of what it adds to each effect it contains
    per_log: tuple[LogEstimate, ...] = ()  # of several logs, where the effect has a size in each
    p_discovery: float | None = None  # from the training data that chose the effect, corrected for the library
    p_confirmation: float | None = None  # from held-out data, corrected for how many effects were judged on them

    def is_supported(self, before: float) -> bool:
        """Significant, physically possible, and lowering the held-out error by enough."""
        return (
            self.physical
            and self.p_value < FAMILYWISE_SIGNIFICANCE_LEVEL
            and self.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * before
        )

    def improves_on(self, smaller: CandidateFit) -> bool:
        """Whether what it adds to an effect that it contains is significant and lowers the held-out error by enough."""
        better = self.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * smaller.error_after
        return better and self.beyond.get(smaller.effect, 0.0) < FAMILYWISE_SIGNIFICANCE_LEVEL


def evaluate_candidate(
    problem: EstimationProblem,
    candidate: Candidate,
    fitted: Fit,
    evidence: Fit,
    before: float,
    residuals_before: list[np.ndarray],
    *,
    tests: int,
    judged: int,
) -> CandidateFit:
    """Evidence for one effect: significance, agreement of blocks, fall of the held-out error.

    It is one of so many tests on the training data, and one of so many effects judged on the held-out data. The larger
    of the two corrected probabilities counts.
    """
    effect = candidate.effect
    after, residuals = validation_residuals(problem, fitted)
    names = [n for n in fitted.free if n.split("@")[0] in effect.full_names]
    coefficients = {p.name: coefficient(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sigma = {p.name: conservative_standard_error(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sized = [n for n in names if n.split("@")[0] in size_names(effect)]
    away = deviation_from_absence(evidence, sized, null_values(problem, effect))
    added = incremental_p_values(problem, effect, evidence, tests)
    found = max(
        [min(1.0, wald_p_value(evidence, sized, away) * tests), *(added[s] for s in problem.replaced(effect.name))]
    )
    again = (
        min(1.0, confirmation_p_value(problem, residuals_before, residuals) * judged) if problem.validation else None
    )
    per_log = estimates_per_log(problem, fitted, effect)
    all_sizes = [(coefficients, sigma), *((o.coefficients, o.sigma) for o in per_log)]
    physical = all(is_physical(effect, coefficients | c, sigma | s) for c, s in all_sizes)
    return CandidateFit(
        effect.name,
        effect.family,
        coefficients,
        sigma,
        {p.name: p.unit for p in effect.parameters},
        max(found, again or 0.0),
        block_agreement(residuals_before, residuals),
        after,
        (),
        physical,
        fitted,
        added,
        per_log,
        found,
        again,
    )


def estimates_per_log(problem: EstimationProblem, fitted: Fit, effect: Effect) -> tuple[LogEstimate, ...]:
    """An effect's own size in each of several logs, where it has one."""
    names = per_log_names([n for n in effect.full_names if f"{n}@0" in fitted.free])
    if len(problem.logs) < 2 or not names:
        return ()
    return tuple(
        LogEstimate(
            log.name,
            {n.partition(".")[2]: fitted.of_log(k)[n] for n in names},
            {n.partition(".")[2]: conservative_standard_error(fitted, n, k) for n in names},
        )
        for k, log in enumerate(problem.logs)
    )


def confirmation_p_value(
    problem: EstimationProblem, residuals_before: Sequence[np.ndarray], residuals_after: Sequence[np.ndarray]
) -> float:
    """Probability, by chance, that held-out data follow what an effect changes in the prediction, as far as they do.

    The old residuals are regressed on the change, which the training data alone have fixed: a factor of 1 says that
    the effect is there, 0 that it is not (the encompassing test of Harvey, Leybourne & Newbold 1998). Its standard
    error is the larger of those for white noise and from the scatter of blocks, and counts what the training data
    leave unsure.
    """
    from scipy.special import stdtr  # imported late, as in the whole tool: it takes longer to load than most commands

    blocks = []
    for before, after in zip(residuals_before, residuals_after, strict=True):
        used = np.flatnonzero(np.isfinite(before).any(axis=1))
        for block in np.array_split(used, min(CONFIRMATION_BLOCK_COUNT, len(used))):
            change = before[block] - after[block]
            blocks.append((np.nansum(before[block] * change), np.nansum(change**2)))
    along, power = np.array(blocks).T
    if not np.isfinite(along).all() or not power.sum() > 0.0:
        return 1.0
    factor = along.sum() / power.sum()
    scatter = np.sqrt(np.sum((along - factor * power) ** 2) * len(blocks) / max(len(blocks) - 1, 1))
    unsure = 1.0 + sum(h.part.values for h in problem.validation) / sum(p.values for p in problem.training)
    sigma = max(scatter, np.sqrt(power.sum())) / power.sum() * np.sqrt(unsure)
    return float(stdtr(max(len(blocks) - 1, 1), -factor / sigma))


def incremental_p_values(problem: EstimationProblem, effect: Effect, evidence: Fit, tests: int) -> dict[str, float]:
    """Probability, by chance, of what an effect adds to each effect that it contains."""
    names = [f"{effect.name}.{p.name}" for p in effect.linear]
    found = {}
    for smaller, weights in problem.module.CONTAINS.get(effect.name, {}).items():
        if all(n in evidence.free for n in names):
            added = null_space(np.array(weights).T).T  # combinations that vanish where it is but the smaller one
            found[smaller] = min(
                1.0, wald_p_value(evidence, names, deviation_from_absence(evidence, names, {}), added) * tests
            )
    return found


def coefficient(fitted: Fit, name: str) -> float:
    """Fitted value of a parameter; of a per-log one the first log's."""
    return fitted.of_log(0)[name]


def deviation_from_absence(fitted: Fit, names: Sequence[str], absent: Mapping[str, float]) -> np.ndarray:
    """How far coefficients are from those at which they do nothing, zero where none is given."""
    parts = [(n.split("@")[0], int(n.partition("@")[2] or 0)) for n in names]
    away = [fitted.of_log(log)[name] - absent.get(name, 0.0) for name, log in parts]
    return np.where(np.isinf(away), 0.0, away)  # what stayed infinite was not fitted


def wald_p_value(fitted: Fit, names: Sequence[str], deviation: np.ndarray, combined: np.ndarray | None = None) -> float:
    """Probability of coefficients this far away by chance, with the more cautious of two covariances.

    ``combined`` (n, names) tests combinations of them instead.
    """
    from scipy.special import fdtrc  # imported late

    places = [fitted.free.index(n) for n in names]
    mixed = np.eye(len(names)) if combined is None else combined
    values, count = mixed @ deviation, len(mixed)
    segments = sum(len(s) for s in fitted.states)
    kinds = (
        (fitted.covariance * max(fitted.error, 1.0) ** 2, max(segments - len(fitted.free), 2), 1.0),
        (fitted.robust, max(fitted.blocks - count, 2), max(fitted.blocks - count, 1) / max(fitted.blocks - 1, 1)),
    )  # covariance, degrees of freedom, and Hotelling's correction for a covariance from so few blocks
    worst = 0.0
    for matrix, freedom, correction in kinds:
        block = mixed @ matrix[np.ix_(places, places)] @ mixed.T
        statistic = float(values @ np.linalg.pinv(block, rcond=1e-12, hermitian=True) @ values) / count * correction
        worst = max(worst, float(fdtrc(count, freedom, max(statistic, 0.0))))
    return worst


def is_physical(effect: Effect, coefficients: dict[str, float], sigma: dict[str, float]) -> bool:
    """Whether every coefficient lies in its physical range and order, within two standard errors."""
    pairs = itertools.pairwise(effect.ordered)
    return all(
        p.minimum - 2.0 * sigma[p.name] <= coefficients[p.name] <= p.maximum + 2.0 * sigma[p.name]
        for p in effect.parameters
    ) and all(coefficients[a] <= coefficients[b] + 2.0 * (sigma[a] + sigma[b]) for a, b in pairs)


def block_agreement(residuals_before: list[np.ndarray], residuals_after: list[np.ndarray]) -> str:
    """In how many of five blocks of the held-out data the error falls."""
    falls = []
    for before, after in zip(residuals_before, residuals_after, strict=True):
        used = np.flatnonzero(np.isfinite(before).any(axis=1))
        for block in np.array_split(used, AGREEMENT_BLOCK_COUNT):
            falls.append(np.nansum(after[block] ** 2) < np.nansum(before[block] ** 2))
    return f"{sum(falls)}/{len(falls)}"
