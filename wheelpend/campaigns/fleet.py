"""What the units of a fleet have in common, and which of them stand out and by what.

Every unit's parameters θ are a draw around the fleet's, θ ~ N(μ, T), and its estimate has errors of its own with a
known covariance Σ: the estimate is a draw from N(μ, T + Σ). μ and T are the likeliest ones, of the units that do not
stand out. A difference is explained by as few parameters as suffice, since estimates of one unit are correlated.
Source: Gelman et al., Bayesian Data Analysis, 3rd ed. (2013), chapter 5; Jackson, White and Thompson, Statistics in
Medicine 29 (2010) 1282, for the multivariate scatter; Benjamini and Hochberg, J. Royal Statistical Society B 57 (1995)
289.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.special import chdtrc, chdtri, ndtri, stdtrit

FALSE_DISCOVERY_RATE = 0.05  # of the units that are said to stand out, as many do not
EXPLAINED_P_VALUE = 0.01  # of what a difference's parameters leave, above which no further one is named
SCATTER_P_VALUE = 0.01  # below which a parameter scatters, over all parameters together
MIN_UNITS = 3  # for a scatter between them
MAX_ROUNDS = 10  # in which units that stand out are left out of the fleet's mean and scatter
MAX_SCATTER_ROUNDS, SCATTER_TOLERANCE = 500, 1e-6  # of the likeliest scatter, relative to the errors
MAD_TO_SIGMA = 1.0 / float(ndtri(0.75))  # of a normal distribution
MEDIAN_VARIANCE = 0.5 * np.pi  # of a median over that of the mean
WIDTH_95 = float(ndtri(0.975))  # standard errors


class UnitEstimate(NamedTuple):
    """A unit's parameters, from one log or several."""

    unit: str
    names: tuple[str, ...]
    values: np.ndarray  # (n,)
    covariance: np.ndarray  # (n, n)


class Explained(NamedTuple):
    """A parameter by which two estimates differ, the others alike."""

    parameter: str
    difference: float
    sigma: float  # its standard error, where nothing else differs but the parameters named beside it
    p_value: float  # of its being chance, beside those that were named before it

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the difference."""
        return self.difference - WIDTH_95 * self.sigma, self.difference + WIDTH_95 * self.sigma

    def to_json(self) -> dict[str, Any]:
        """The parameter under the keys of JSON."""
        return {
            "parameter": self.parameter,
            "difference": self.difference,
            "sigma": self.sigma,
            "interval": list(self.interval),
            "p_value": self.p_value,
        }


class Difference(NamedTuple):
    """Why two estimates differ."""

    parameters: tuple[Explained, ...]  # as few as suffice, the most telling first; none where they are alike
    p_value: float  # of all of the difference being chance
    rest_p_value: float  # of what the parameters leave of it

    def to_json(self) -> dict[str, Any]:
        """The difference under the keys of JSON."""
        return {"parameters": list(self.parameters), "p_value": self.p_value, "rest_p_value": self.rest_p_value}


class FleetParameter(NamedTuple):
    """A parameter over the fleet, without the units that stand out by it."""

    mean: float
    mean_sigma: float  # its standard error
    scatter: float  # standard deviation from unit to unit, the estimates' errors taken off
    scatter_interval: tuple[float, float]  # 95 %
    p_value: float  # of there being no scatter
    scatters: bool  # more than the errors allow, at SCATTER_P_VALUE over all parameters

    def to_json(self) -> dict[str, Any]:
        """The parameter under the keys of JSON."""
        return {**self._asdict(), "scatter_interval": list(self.scatter_interval)}


class OddUnit(NamedTuple):
    """A unit that stands out."""

    unit: str
    difference: Difference  # of the unit from the fleet

    def to_json(self) -> dict[str, Any]:
        """The unit under the keys of JSON."""
        return {"unit": self.unit, **self.difference.to_json()}


@dataclass(frozen=True)
class Fleet:
    """The fleet's parameters, and the units that stand out."""

    units: tuple[UnitEstimate, ...]
    parameters: dict[str, FleetParameter]
    odd: tuple[OddUnit, ...]  # the surest first
    scatter: np.ndarray  # (n, n) covariance of the units' parameters around the fleet's

    def to_json(self) -> dict[str, Any]:
        """The fleet under the keys of JSON."""
        return {"units": [u.unit for u in self.units], "parameters": self.parameters, "odd": self.odd}


class _Population(NamedTuple):
    """The likeliest mean and scatter of some units, in units of the parameters' typical errors."""

    mean: np.ndarray  # (n,)
    scatter: np.ndarray  # (n, n)
    mean_covariance: np.ndarray  # (n, n)
    units: int  # from which they are


def fleet_of(units: Sequence[UnitEstimate]) -> Fleet | None:
    """The fleet that these units make; None where there are fewer than MIN_UNITS that share a parameter.

    Of parameters that not every unit identifies nothing is said.
    """
    if len(units) < MIN_UNITS:
        return None
    names = [n for n in units[0].names if all(n in u.names for u in units)]
    if not names:
        return None
    values, covariances = _aligned(units, names)
    scale = np.sqrt(np.median(np.diagonal(covariances, axis1=1, axis2=2), axis=0))
    values, covariances = values / scale, covariances / np.outer(scale, scale)
    kept, found = np.ones(len(units), dtype=bool), list[Difference]()
    population = _robust_population(values, covariances)
    for number in range(MAX_ROUNDS):
        found = _all_against(population, values, covariances, names, kept)
        p_values = np.array([_best_p_value(d, len(names)) for d in found])
        # by medians only the surest: their scatter is a rough one, and who is left out once hardly comes back
        odd = discoveries(p_values) if number else p_values < FALSE_DISCOVERY_RATE / len(units)
        if (number and (odd == ~kept).all()) or np.count_nonzero(~odd) < MIN_UNITS:
            break
        kept = ~odd
        population = _population(values[kept], covariances[kept])
    if _would_show(len(units), len(names)):
        kept, population, found = _readmitted(kept, population, found, values, covariances, names)
    parameters = _fleet_parameters(names, population, values[kept], covariances[kept], scale)
    surest = sorted(map(int, np.flatnonzero(~kept)), key=lambda k: found[k].p_value)
    sized = dict(zip(names, scale, strict=True))
    return Fleet(
        tuple(units), parameters, tuple(OddUnit(units[k].unit, _in_units(found[k], sized)) for k in surest),
        population.scatter * np.outer(scale, scale),
    )  # fmt: skip


def _would_show(units: int, parameters: int) -> bool:
    """True where a unit that stands out does so even where it is counted among the fleet, and does not hide itself.

    Of so many units none is farther off than as many standard deviations squared.
    """
    return units > 2.0 * float(chdtri(parameters, FALSE_DISCOVERY_RATE / units))


def _readmitted(
    kept: np.ndarray,
    population: _Population,
    found: list[Difference],
    values: np.ndarray,
    covariances: np.ndarray,
    names: Sequence[str],
) -> tuple[np.ndarray, _Population, list[Difference]]:
    """What was found, once those that stand out only because the scatter was taken without them are back.

    Leaving out the farthest of many that are alike makes the scatter smaller, and the next farthest stand out.
    """
    for k in sorted(np.flatnonzero(~kept), key=lambda k: -_best_p_value(found[k], len(names))):
        with_it = kept | (np.arange(len(kept)) == k)
        trial = _population(values[with_it], covariances[with_it])
        against = _all_against(trial, values, covariances, names, with_it)
        if discoveries([_best_p_value(d, len(names)) for d in against])[k]:
            break
        kept, population, found = with_it, trial, against
    return kept, population, found


def difference_between(one: UnitEstimate, other: UnitEstimate) -> Difference:
    """Why another unit differs from one: which parameters, by how much, as few as suffice."""
    names = [n for n in one.names if n in other.names]
    values, covariances = _aligned([one, other], names)
    total = covariances.sum(axis=0)
    scale = np.sqrt(np.diag(total))
    found = explained_difference((values[1] - values[0]) / scale, total / np.outer(scale, scale), names)
    return _in_units(found, dict(zip(names, scale, strict=True)))


def explained_difference(difference: np.ndarray, covariance: np.ndarray, names: Sequence[str]) -> Difference:
    """A difference (n,) with a covariance (n, n), explained by as few parameters as leave no more than chance.

    Each is the one that leaves least, beside those that were named before; their sizes are estimated together.
    """
    weights = np.linalg.pinv(covariance, hermitian=True)
    count = int(np.linalg.matrix_rank(covariance, hermitian=True))
    squares = float(difference @ weights @ difference)
    chosen: list[int] = []
    p_values: list[float] = []
    rest = whole = float(chdtrc(count, squares))
    while rest < EXPLAINED_P_VALUE and len(chosen) < count:
        lefts = {k: _left(difference, weights, [*chosen, k]) for k in range(len(names)) if k not in chosen}
        best = min(lefts, key=lambda k: lefts[k])
        fall = _left(difference, weights, chosen) - lefts[best]
        p_values.append(min(1.0, float(chdtrc(1, max(fall, 0.0))) * len(lefts)))
        chosen.append(best)
        rest = float(chdtrc(count - len(chosen), max(lefts[best], 0.0))) if count > len(chosen) else 1.0
    sizes, errors = _sizes(difference, weights, chosen)
    rows = zip(chosen, sizes, errors, p_values, strict=True)
    return Difference(tuple(Explained(names[k], float(d), float(s), p) for k, d, s, p in rows), whole, rest)


def _sizes(difference: np.ndarray, weights: np.ndarray, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of the chosen parameters' differences where the others are alike, and their standard errors."""
    covariance = np.linalg.pinv(weights[np.ix_(chosen, chosen)], hermitian=True) if chosen else np.zeros((0, 0))
    return covariance @ (weights @ difference)[list(chosen)], np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _left(difference: np.ndarray, weights: np.ndarray, chosen: Sequence[int]) -> float:
    """χ² of what the chosen parameters leave of a difference."""
    rest = difference.copy()
    rest[list(chosen)] -= _sizes(difference, weights, chosen)[0]
    return float(rest @ weights @ rest)


def _all_against(
    population: _Population, values: np.ndarray, covariances: np.ndarray, names: Sequence[str], kept: np.ndarray
) -> list[Difference]:
    """Every unit against the fleet, of which those that are kept are a part."""
    return [_against(population, v, c, names, is_in) for v, c, is_in in zip(values, covariances, kept, strict=True)]


def _against(
    population: _Population, values: np.ndarray, covariance: np.ndarray, names: Sequence[str], is_in: bool
) -> Difference:
    """A unit against the fleet: of one that is in it the mean is not independent, and its error counts the less."""
    around = covariance + population.scatter * _widening(population.units)
    total = around - population.mean_covariance if is_in else around + population.mean_covariance
    return explained_difference(values - population.mean, total, names)


def _best_p_value(found: Difference, count: int) -> float:
    """P-value of a unit's being like the fleet: of all parameters together, or of the most telling one of so many."""
    first = found.parameters[0].p_value if found.parameters else 1.0
    return min(1.0, 2.0 * min(found.p_value, first)) if count > 1 else found.p_value


def discoveries(p_values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Which are no chance (n,), where of those that are said to be none FALSE_DISCOVERY_RATE are."""
    order = np.argsort(p_values)
    limits = FALSE_DISCOVERY_RATE * np.arange(1, len(order) + 1) / len(order)
    below = np.flatnonzero(np.array(p_values)[order] <= limits)
    found = np.zeros(len(order), dtype=bool)
    found[order[: below[-1] + 1 if len(below) else 0]] = True
    return found


def _population(values: np.ndarray, covariances: np.ndarray) -> _Population:
    """Mean and scatter of estimates (units, n) with covariances, by restricted maximum likelihood.

    By expectation maximisation. The scatter is full where there are units enough for it, and else that of each
    parameter by itself.
    """
    units, count = values.shape
    full = units > 3 * count
    scatter = np.diag(np.maximum(values.var(axis=0, ddof=1) - covariances.mean(axis=0).diagonal(), 0.1))
    for _ in range(MAX_SCATTER_ROUNDS):
        weights = np.linalg.inv(covariances + scatter)
        mean_covariance = np.linalg.inv(weights.sum(axis=0))
        mean = mean_covariance @ np.einsum("uij,uj->i", weights, values)
        gains = scatter @ weights
        shrunk = np.einsum("uij,uj->ui", gains, values - mean)
        uncertain = scatter - gains @ scatter + gains @ mean_covariance @ gains.transpose(0, 2, 1)
        new = (shrunk.T @ shrunk + uncertain.sum(axis=0)) / units
        new = 0.5 * (new + new.T) if full else np.diag(np.diag(new))
        moved = float(np.abs(new - scatter).max())
        scatter = new
        if moved < SCATTER_TOLERANCE:
            break
    return _Population(mean, scatter, mean_covariance, units)


def _robust_population(values: np.ndarray, covariances: np.ndarray) -> _Population:
    """Mean and scatter of estimates (units, n) with covariances by medians, which a few odd units do not move."""
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    mean = np.median(values, axis=0)
    spread = (MAD_TO_SIGMA * np.median(np.abs(values - mean), axis=0)) ** 2
    scatter = np.diag(np.maximum(spread - np.median(variances, axis=0), 0.0))
    errors = np.diag(np.median(variances, axis=0)) + scatter
    return _Population(mean, scatter, MEDIAN_VARIANCE * errors / len(values), len(values))


def _widening(units: int) -> float:
    """By which a scatter that is known from so many units is widened, where another unit is judged by it.

    The quantile of Student's distribution over the normal one's, squared, where one of as many would stand out.
    """
    level = 0.5 * FALSE_DISCOVERY_RATE / units
    return float(stdtrit(units - 1, level) / ndtri(level)) ** 2


def _fleet_parameters(
    names: Sequence[str],
    population: _Population,
    values: np.ndarray,
    covariances: np.ndarray,
    scale: np.ndarray,
) -> dict[str, FleetParameter]:
    found = {}
    for k, name in enumerate(names):
        estimates, variances = values[:, k], covariances[:, k, k]
        p_value = float(chdtrc(len(values) - 1, _spread(estimates, variances, 0.0)))
        low, high = (np.sqrt(v) * scale[k] for v in scatter_interval(estimates, variances))
        found[name] = FleetParameter(
            float(population.mean[k] * scale[k]),
            float(np.sqrt(population.mean_covariance[k, k]) * scale[k]),
            float(np.sqrt(max(population.scatter[k, k], 0.0)) * scale[k]),
            (float(low), float(high)),
            p_value,
            p_value < SCATTER_P_VALUE / len(names),
        )
    return found


def scatter_interval(values: np.ndarray, variances: np.ndarray) -> tuple[float, float]:
    """95 % interval of the variance from unit to unit of estimates (units,) with variances (units,): the Q-profile.

    Source: Viechtbauer, Confidence intervals for the amount of heterogeneity in meta-analysis, Statistics in Medicine
    26 (2007) 37.
    """

    def variance_at(level: float) -> float:
        target, high = float(chdtri(len(values) - 1, level)), float(np.var(values) + variances.max())
        if _spread(values, variances, 0.0) <= target:
            return 0.0
        while _spread(values, variances, high) > target:
            high *= 2.0
        low = 0.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _spread(values, variances, middle) > target else (low, middle)
        return 0.5 * (low + high)

    return variance_at(0.025), variance_at(0.975)


def _spread(values: np.ndarray, variances: np.ndarray, scatter: float) -> float:
    """χ² of values (units,) about their weighted mean, with a variance from unit to unit added to their own."""
    weights = 1.0 / (variances + scatter)
    mean = float(np.average(values, weights=weights))
    return float(np.sum(weights * (values - mean) ** 2))


def _aligned(units: Sequence[UnitEstimate], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Values (units, n) and covariances (units, n, n) of the named parameters."""
    places = [[u.names.index(n) for n in names] for u in units]
    values = np.array([u.values[p] for u, p in zip(units, places, strict=True)])
    return values, np.array([u.covariance[np.ix_(p, p)] for u, p in zip(units, places, strict=True)])


def _in_units(found: Difference, scale: Mapping[str, float]) -> Difference:
    """A difference in the parameters' own units."""
    own = [
        e._replace(difference=float(e.difference * scale[e.parameter]), sigma=float(e.sigma * scale[e.parameter]))
        for e in found.parameters
    ]
    return found._replace(parameters=tuple(own))


def combined(unit: str, estimates: Sequence[UnitEstimate]) -> UnitEstimate:
    """One estimate of a unit from those of its logs, of the parameters that all have, weighted by their errors.

    Its errors are widened where the logs scatter more than theirs say.
    """
    names = [n for n in estimates[0].names if all(n in e.names for e in estimates)]
    values, covariances = _aligned(estimates, names)
    weights = np.linalg.inv(covariances)
    covariance = np.linalg.inv(weights.sum(axis=0))
    mean = covariance @ np.einsum("uij,uj->i", weights, values)
    degrees = values.size - len(names)
    spread = float(np.einsum("ui,uij,uj->", values - mean, weights, values - mean))
    widened = covariance * max(1.0, spread / degrees if degrees else 1.0)
    return UnitEstimate(unit, tuple(names), mean, widened)
