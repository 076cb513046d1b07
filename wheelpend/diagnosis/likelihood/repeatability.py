"""Whether what a model leaves to chance repeats: a smooth function of known signals, as a force or in a reading.

Such a function of at most two of states, input and time, as a drift of the filter or as an offset of a reading, is
fitted on some blocks of the logs and must raise the likelihood of others. The signals are the filter's own estimates
before the reading that they help to predict: behind a force at random the innovations are then orthogonal to every
function of them, whatever the controller does, which does not hold for a force and a speed of the same moment, and not
behind a filter that takes the force for smaller than it is. What repeats may be hidden in the fitted force, so that
smaller ones are tried too; but there the smaller force and the function together must be likelier than the fitted force
alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.evidence import encompassing_p_value
from wheelpend.diagnosis.likelihood.filter_response import DriftResponse, drift_responses
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel, moved_to
from wheelpend.diagnosis.likelihood.held_out import one_sided_p_value
from wheelpend.diagnosis.missing_force.smooth_basis import SmoothBasis
from wheelpend.estimation.random_source import Sources, scaled_sources, with_one_changed
from wheelpend.estimation.scaled_inverse import solve_damped

FOLD_COUNT = 20  # blocks of which each is predicted by a drift that was fitted to the others
RIDGE_PER_VARIANCE = 1.0  # prior information of a coefficient, in units of its place's variance
MAX_VARIABLES = 2  # of a function
MIN_ADDED_GAIN = 3.0  # nats that a constant must add, and each variable
FORCE_SHARES = (0.6, 0.3)  # of the found random forces, behind which is looked: they may hide what repeats
SOURCE_SHARE = 0.1  # of one source among several: it may be there only to mirror what repeats
FLAT_DAMPING = 1e-9  # of the unit diagonal, with which a direction that data do not tell does not move
SIGNIFICANCE_LEVEL = 1e-3  # of all functions together: responses of the own parameters are near ones

FORCE_KIND, READING_KIND = "force", "reading"  # kinds of what repeats


@dataclass(frozen=True)
class RepeatingFunction:
    """What repeats, as a force on one row or between two parts or as an offset of a reading, and its variables."""

    kind: str  # FORCE_KIND or READING_KIND
    row: str  # of the model, or the port of a force between two parts; of a reading, its column of the log
    depends_on: tuple[str, ...]  # variables, that which predicts most first; none of a constant, or of nothing
    share: float  # of the random force's mean square, or of the variance of a reading's innovations
    gain: float  # of log-likelihood on blocks that did not make the function [nats]
    p_value: float  # of that gain by its scatter between blocks, for all functions that were tried
    functions: int  # that were tried

    @property
    def repeats(self) -> bool:
        """True where it is more than chance finds."""
        return self.p_value < SIGNIFICANCE_LEVEL and self.gain > 0.0

    @property
    def is_in_reading(self) -> bool:
        """True of an offset of a reading."""
        return self.kind == READING_KIND

    def to_json(self) -> dict[str, Any]:
        """The finding under the keys of JSON."""
        return {
            "kind": self.kind,
            "row": self.row,
            "depends_on": self.depends_on,
            "share": self.share,
            "gain": self.gain,
            "p_value": self.p_value,
            "functions": self.functions,
        }


class Place(NamedTuple):
    """Where a function may act, and how large its coefficients are expected to be."""

    kind: str  # FORCE_KIND or READING_KIND
    name: str
    direction: np.ndarray  # (rows,) of the force, or (NY,) of the readings
    squared: float  # mean square of the random force, or typical variance of the reading's innovations

    def whitened(self, response: DriftResponse, columns: np.ndarray) -> np.ndarray:
        """Whitened innovations (N, NY, m) that functions (N, m) would take away."""
        acting = columns[:, :, None] * self.direction
        return response.of(acting) if self.kind == FORCE_KIND else response.of_readings(acting)


class DriftGain(NamedTuple):
    """What drifts do to blocks of innovations that did not make them."""

    gains: np.ndarray  # (blocks,) of log-likelihood over the filter with the fitted force [nats]
    along: np.ndarray  # (blocks,) products of the innovations without them and the change that they make
    power: np.ndarray  # (blocks,) squares of that change
    size: np.ndarray  # (drifts,) fitted to all blocks
    whitens: bool  # True where the filter has the fitted force: behind it chance follows nothing

    @property
    def p_value(self) -> float:
        """P-value of the likelihood rising, or of the innovations following the change where that tells."""
        if not self.whitens:
            return one_sided_p_value(self.gains)
        follows = encompassing_p_value(self.along, self.power, 1.0 + 1.0 / max(len(self.gains) - 1, 1))
        return min(1.0, 2.0 * min(follows, one_sided_p_value(self.gains)))


@dataclass(frozen=True)
class FoldedDrifts:
    """Normal equations of drifts and of the model's own parameters, in blocks of the innovations."""

    names: list[str]  # of the drifts, the model's own parameters first
    own: int  # number of these
    information: np.ndarray  # (blocks, n, n)
    score: np.ndarray  # (blocks, n)
    unit: float  # of a fall of half the sum of squares that is a nat: the innovations' mean square, at least 1
    lead: np.ndarray | None  # (blocks,) of log-likelihood over the filter with the fitted force [nats]; None of that

    def predicted(self, columns: Sequence[str], ridge: float) -> DriftGain:
        """What some drifts, fitted to the other blocks beside the model's own parameters, do to each block."""
        chosen = [*range(self.own), *(self.names.index(c) for c in columns)]
        prior = np.r_[np.zeros(self.own), np.full(len(columns), ridge)]
        information, score = self.information[:, chosen][:, :, chosen], self.score[:, chosen]
        total, pull = information.sum(axis=0) + np.diag(prior), score.sum(axis=0)
        rest = total - information + FLAT_DAMPING * np.diag(np.diag(total))  # what one block alone tells stays as it is
        change = solve_damped(rest, (pull - score)[..., None])[..., 0]
        change[:, : self.own] -= self.without
        right = score - np.einsum("bij,bj->bi", information[:, :, : self.own], self.without)
        along = np.einsum("bi,bi->b", change, right)
        power = np.einsum("bi,bij,bj->b", change, information, change)
        gains = along - 0.5 * power
        if self.lead is not None:  # another filter: what the model's own parameters gain behind it counts too
            gains += self.own_gains
        size = solve_damped(total, pull[:, None], FLAT_DAMPING)[self.own :, 0]
        lead = 0.0 if self.lead is None else self.lead
        return DriftGain(gains / self.unit + lead, along / self.unit, power / self.unit, size, self.lead is None)

    @cached_property
    def without(self) -> np.ndarray:
        """Own parameters (blocks, own), fitted to the other blocks without any drift."""
        information, score = self.information[:, : self.own, : self.own], self.score[:, : self.own]
        total = information.sum(axis=0)
        rest = total - information + FLAT_DAMPING * np.diag(np.diag(total))
        return solve_damped(rest, (score.sum(axis=0) - score)[..., None])[..., 0]

    @cached_property
    def own_gains(self) -> np.ndarray:
        """Rise of the log-likelihood of each block (blocks,) by these own parameters alone."""
        moved = np.einsum("bij,bj->bi", self.information[:, : self.own, : self.own], self.without)
        return np.einsum("bi,bi->b", self.without, self.score[:, : self.own] - 0.5 * moved)


def what_repeats(model: FilteredModel) -> tuple[RepeatingFunction, ...]:
    """What repeats behind a model's filter, on each row, between two parts and in each reading, the likeliest first.

    Empty where the filter's innovations cannot be followed.
    """
    fitted = _responses(model)
    if not fitted:
        return ()
    places = _places(model, fitted)
    smaller = with_smaller_sources(model)
    tests = len(places) * (1 + len(smaller))  # of as many functions each
    found = _repeating_behind(fitted, None, model.problem.plant, places, tests)
    for sources in smaller:
        responses = _responses(moved_to(model, model.point._replace(sources=sources)))
        if [len(r.whitened) for r in responses] == [len(r.whitened) for r in fitted]:
            found += _repeating_behind(responses, fitted, model.problem.plant, places, tests)
    return likeliest_by_place(found)


def with_smaller_sources(model: FilteredModel) -> list[tuple[Sources, ...]]:
    """The sources of each log with all forces smaller, and of several sources with each alone far smaller."""
    sources = model.point.sources
    found = [scaled_sources(sources, share) for share in FORCE_SHARES] if model.force_squared else []
    alone = range(len(model.point.kinds)) if len(model.point.kinds) > 1 else ()
    return [*found, *(with_one_changed(sources, k, share=SOURCE_SHARE) for k in alone)]


def _places(model: FilteredModel, responses: Sequence[DriftResponse]) -> list[Place]:
    """Every row and every force between two parts where a random force is left, and every sensor that was read."""
    module, found = model.problem.module, []
    if model.force_squared:
        rows = {name: np.eye(module.NQ)[k] for k, name in enumerate(module.ROWS)}
        couplings = {n: np.array(p.weights) for n, p in model.problem.plant.couplings.items()}
        rows |= {n: weights for n, weights in couplings.items() if np.count_nonzero(weights) > 1}
        found = [Place(FORCE_KIND, name, direction, model.force_squared) for name, direction in rows.items()]
    variances = np.concatenate([r.variance for r in responses])
    for k, name in enumerate(module.OUTPUTS):
        read = variances[:, k][np.isfinite(variances[:, k])]
        if read.size:  # the median: while a filter finds its state they are far larger
            found.append(Place(READING_KIND, name, np.eye(module.NY)[k], float(np.median(read))))
    return found


def _responses(model: FilteredModel) -> list[DriftResponse]:
    """The filter along each log that it can follow."""
    return [r for k in range(len(model.problem.logs)) if (r := drift_responses(model, k)) is not None]


def likeliest_by_place(found: Sequence[RepeatingFunction]) -> tuple[RepeatingFunction, ...]:
    """The likeliest finding of each place, the likeliest of all first."""
    by_place: dict[tuple[str, str], RepeatingFunction] = {}
    for one in sorted(found, key=lambda f: (f.p_value, -f.gain)):
        by_place.setdefault((one.kind, one.row), one)
    return tuple(by_place.values())


def _repeating_behind(
    responses: Sequence[DriftResponse],
    fitted: Sequence[DriftResponse] | None,
    plant: PlantSignature,
    places: Sequence[Place],
    tests: int,
) -> list[RepeatingFunction]:
    """What repeats behind some filters, with those that have the ``fitted`` force where these have not."""
    basis = basis_of(responses, plant)
    columns = [name for group in basis.groups.values() for name in group]
    functions = [basis.matrix(r.motion, columns) for r in responses]
    own = [r.of_own() for r in responses]
    found = []
    for place in places:
        acting = [place.whitened(r, f) for r, f in zip(responses, functions, strict=True)]
        whitened = [np.concatenate(both, axis=2) for both in zip(own, acting, strict=True)]
        folded = folded_drifts(responses, whitened, columns, fitted)
        found.append(_strongest(place, folded, basis, responses, tests))
    return found


def basis_of(responses: Sequence[DriftResponse], plant: PlantSignature) -> SmoothBasis:
    """Functions of all variables along the logs; of time only within one log."""
    names = [n for n in responses[0].motion if n != "t" or len(responses) == 1]
    return SmoothBasis.of_values({n: np.concatenate([r.motion[n] for r in responses]) for n in names}, plant)


def folded_drifts(
    responses: Sequence[DriftResponse],
    by: Sequence[np.ndarray],
    columns: Sequence[str],
    fitted: Sequence[DriftResponse] | None,
) -> FoldedDrifts:
    """Normal equations of the model's own parameters and of columns in blocks of about equal length.

    ``by`` are each log's whitened innovations (N, NY, own + columns) that a unit of each would take away.
    """
    total = sum(len(r.whitened) for r in responses)
    information, score, likelihood, squares, count = [], [], [], 0.0, 0
    for response, whitened, other in zip(responses, by, fitted or responses, strict=True):
        residual, lead = response.whitened, response.log_likelihood - other.log_likelihood
        blocks = max(2, round(FOLD_COUNT * len(residual) / max(total, 1)))
        for part in np.array_split(np.arange(len(residual)), blocks):
            rows = whitened[part].reshape(-1, whitened.shape[2])
            information.append(rows.T @ rows)
            score.append(rows.T @ residual[part].ravel())
            likelihood.append(lead[part].sum())
        squares, count = squares + float((residual**2).sum()), count + int((residual != 0.0).sum())
    own = responses[0].own.shape[1]
    names = [*(f"own {k}" for k in range(own)), *columns]
    unit = max(squares / max(count, 1), 1.0) if fitted is None else 1.0
    lead = None if fitted is None else np.array(likelihood)
    return FoldedDrifts(names, own, np.array(information), np.array(score), unit, lead)


def _strongest(
    place: Place, folded: FoldedDrifts, basis: SmoothBasis, responses: Sequence[DriftResponse], tests: int
) -> RepeatingFunction:
    """The function of at most two variables that predicts most of what the others leave: a constant, if that is all.

    Every pair is tried where no variable says anything alone.
    """
    ridge = RIDGE_PER_VARIANCE / max(place.squared, 1e-300)
    nothing, constant = folded.predicted((), ridge), folded.predicted(basis.names(()), ridge)
    single: dict[tuple[str, ...], DriftGain] = {
        (v,): folded.predicted(basis.names([v]), ridge) for v in basis.variables
    }
    first: tuple[str, ...] = max(single, key=lambda v: single[v].gains.sum(), default=())
    least = max(nothing.gains.sum(), constant.gains.sum()) + MIN_ADDED_GAIN  # where a constant does harm, over nothing
    found = bool(first) and single[first].gains.sum() >= least
    chosen, best = (first, single[first]) if found else ((), constant)
    beside = [v for v in basis.variables if v not in chosen]
    pairs: list[tuple[str, ...]] = [(*chosen, v) for v in beside] if found else [*combinations(beside, MAX_VARIABLES)]
    both = {v: folded.predicted(basis.names(v), ridge) for v in pairs}
    last = max(both, key=lambda v: both[v].gains.sum(), default=())
    if last and both[last].gains.sum() - best.gains.sum() >= (MAX_VARIABLES - len(chosen)) * MIN_ADDED_GAIN:
        chosen, best = last, both[last]
    tried = (1 + len(single) + len(both)) * tests
    if best.gains.sum() - nothing.gains.sum() < MIN_ADDED_GAIN:
        return RepeatingFunction(place.kind, place.name, (), 0.0, 0.0, 1.0, tried)
    p_value = min(1.0, best.p_value * tried)
    function = np.concatenate([basis.matrix(r.motion, basis.names(chosen)) @ best.size for r in responses])
    share = float(np.clip(np.mean(function**2) / max(place.squared, 1e-300), 0.0, 1.0))
    leading = tuple(sorted(chosen, key=lambda v: -single[v,].gains.sum()))
    return RepeatingFunction(place.kind, place.name, leading, share, float(best.gains.sum()), p_value, tried)


def repeatable_share(found: Sequence[RepeatingFunction]) -> float:
    """The share of the random force that repeats, of findings with the likeliest first.

    0 where nothing does, or where a reading's error is likelier: a force then mirrors that.
    """
    repeating = [f for f in found if f.repeats]
    if not repeating or repeating[0].is_in_reading:
        return 0.0
    return max(f.share for f in repeating if not f.is_in_reading)
