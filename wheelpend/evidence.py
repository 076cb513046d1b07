"""Evidence for an effect after its refit: significance, agreement of blocks, and fall of the held-out error."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import null_space
from scipy.special import fdtrc

from derive.effects import Effect
from wheelpend.screening import Candidate, size_names
from wheelpend.shapes import nothing
from wheelpend.shooting import Fit
from wheelpend.study import Study, held_residuals

SIGNIFICANCE = 0.01  # family-wise, over the whole library
WORTHWHILE = 0.005  # relative fall of the held-out error below which an effect is not worth naming
BLOCKS = 5


@dataclass(frozen=True)
class Tried:
    """An effect after its refit."""

    effect: str
    family: str
    coefficients: dict[str, float]
    sigma: dict[str, float]
    unit: dict[str, str]
    p_value: float  # corrected for the size of the library
    blocks_agree: str
    error_after: float  # held out
    equivalent_to: tuple[str, ...]
    physical: bool
    fit: Fit = field(repr=False)
    beyond: dict[str, float] = field(default_factory=dict)  # p-value of what it adds to each effect it contains

    def worth_naming(self, before: float) -> bool:
        """Significant, physically possible, and lowering the held-out error by enough."""
        return self.physical and self.p_value < SIGNIFICANCE and self.error_after < (1.0 - WORTHWHILE) * before

    def worth_more_than(self, smaller: Tried) -> bool:
        """Whether what it adds to an effect that it contains is significant and lowers the held-out error by enough."""
        better = self.error_after < (1.0 - WORTHWHILE) * smaller.error_after
        return better and self.beyond.get(smaller.effect, 0.0) < SIGNIFICANCE


def judge(
    study: Study, candidate: Candidate, fitted: Fit, evidence: Fit, before: float, old: list[np.ndarray], tests: int
) -> Tried:
    """Evidence for one effect: significance, agreement of blocks, fall of the held-out error."""
    effect = candidate.effect
    after, residuals = held_residuals(study, fitted)
    names = [n for n in fitted.free if n.split("@")[0] in effect.full_names]
    coefficients = {p.name: coefficient(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sigma = {p.name: honest_sigma(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sized = [n for n in names if n.split("@")[0] in size_names(effect)]
    away = distance(evidence, sized, nothing(study, effect))
    p_value, added = min(1.0, wald(evidence, sized, away) * tests), beyond(study, effect, evidence, tests)
    p_value = max([p_value, *(added[s] for s in study.replaced(effect.name))])
    return Tried(
        effect.name, effect.family, coefficients, sigma, {p.name: p.unit for p in effect.parameters},
        p_value, agreement(old, residuals), after, (), possible(effect, coefficients, sigma), fitted, added,
    )  # fmt: skip


def beyond(study: Study, effect: Effect, evidence: Fit, tests: int) -> dict[str, float]:
    """Probability, by chance, of what an effect adds to each effect that it contains."""
    names = [f"{effect.name}.{p.name}" for p in effect.linear]
    found = {}
    for smaller, weights in study.module.CONTAINS.get(effect.name, {}).items():
        if all(n in evidence.free for n in names):
            added = null_space(np.array(weights).T).T  # combinations that vanish where it is but the smaller one
            found[smaller] = min(1.0, wald(evidence, names, distance(evidence, names, {}), added) * tests)
    return found


def coefficient(fitted: Fit, name: str) -> float:
    """Fitted value of a parameter; of a per-log one the first log's."""
    return fitted.of_log(0)[name]


def honest_sigma(fitted: Fit, name: str) -> float:
    """The larger of the standard errors that the information matrix and the scatter of the segments give."""
    return max(fitted.sigma(name), fitted.sigma(name, robust=True))


def distance(fitted: Fit, names: Sequence[str], absent: Mapping[str, float]) -> np.ndarray:
    """How far coefficients are from those at which they do nothing, zero where none is given."""
    parts = [(n.split("@")[0], int(n.partition("@")[2] or 0)) for n in names]
    away = [fitted.of_log(log)[name] - absent.get(name, 0.0) for name, log in parts]
    return np.where(np.isinf(away), 0.0, away)  # what stayed infinite was not fitted


def wald(fitted: Fit, names: Sequence[str], away: np.ndarray, combined: np.ndarray | None = None) -> float:
    """Probability of coefficients this far away by chance, with the more cautious of two covariances.

    ``combined`` (n, names) tests combinations of them instead.
    """
    places = [fitted.free.index(n) for n in names]
    mixed = np.eye(len(names)) if combined is None else combined
    values = mixed @ away
    segments = sum(len(s) for s in fitted.states)
    freedom = max(segments - len(fitted.free), 2)
    worst = 0.0
    for matrix in (fitted.covariance * max(fitted.error, 1.0) ** 2, fitted.robust):
        block = mixed @ matrix[np.ix_(places, places)] @ mixed.T
        statistic = float(values @ np.linalg.pinv(block, rcond=1e-12, hermitian=True) @ values) / len(values)
        worst = max(worst, float(fdtrc(len(values), freedom, max(statistic, 0.0))))
    return worst


def possible(effect: Effect, coefficients: dict[str, float], sigma: dict[str, float]) -> bool:
    """Whether every coefficient lies in its physical range and order, within two standard errors."""
    pairs = itertools.pairwise(effect.ordered)
    return all(
        p.minimum - 2.0 * sigma[p.name] <= coefficients[p.name] <= p.maximum + 2.0 * sigma[p.name]
        for p in effect.parameters
    ) and all(coefficients[a] <= coefficients[b] + 2.0 * (sigma[a] + sigma[b]) for a, b in pairs)


def agreement(old: list[np.ndarray], new: list[np.ndarray]) -> str:
    """In how many of five blocks of the held-out data the error falls."""
    falls = []
    for before, after in zip(old, new, strict=True):
        used = np.flatnonzero(np.isfinite(before).any(axis=1))
        for block in np.array_split(used, BLOCKS):
            falls.append(np.nansum(after[block] ** 2) < np.nansum(before[block] ** 2))
    return f"{sum(falls)}/{len(falls)}"
