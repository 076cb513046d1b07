"""Evidence for an effect, the random force free with it and without it, in sample and held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import derive
from wheelpend.diagnosis.block_evidence import (
    MIN_CLEAR_STATISTIC,
    falls_over_segments,
    gain_statistic,
    relative_lead_statistic,
)
from wheelpend.diagnosis.criteria import MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.evidence import (
    FAMILYWISE_SIGNIFICANCE_LEVEL,
    CandidateFit,
    ValidatedFit,
    added_p_value,
    deviation_from_absence,
    estimate_of,
    estimates_per_log,
    wald_p_value,
)
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.held_out import (
    Following,
    Prediction,
    bounded_p_value,
    combined_p_value,
    following,
    gain_in_blocks,
    joint_p_value,
    one_sided_p_value,
    prediction,
    prediction_at,
)
from wheelpend.diagnosis.likelihood.meaning import has_meaning, rest_has_meaning
from wheelpend.diagnosis.likelihood.refits import at_sources
from wheelpend.diagnosis.physical import is_determined
from wheelpend.diagnosis.score_test import size_names
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.estimation.problem import narrower_effects
from wheelpend.estimation.profiled_starts import null_values
from wheelpend.estimation.validation import validation_residuals
from wheelpend.identification.remainder import difference_of_forces

CONFIRMATION_LEVEL = 0.05  # of a single test on held-out data, or of either part where both say much together
ONE_STANDARD_ERROR = 0.317  # p-value of one size that is a standard error off nothing, with many blocks
MIN_FORCE_SHARE = 1e-3  # of the drive on its row: below that a force is negligible
SPARED_SHARE = 0.9  # of the random force, which an effect takes the place of
MIN_TOLD_GAIN = 1.0  # nats: below that data tell nothing apart, however much alike the blocks are
MAX_SHARE = 10.0  # of the drive on its row, from which a force says that next to nothing drives it


class Judged(NamedTuple):
    """An effect with the evidence for it, and the model that has it."""

    candidate: CandidateFit
    model: FilteredModel
    predicted: Prediction  # of held-out data
    gains: np.ndarray  # (blocks,) of held-out log-likelihood, over the model without it [nats]
    in_sample: float  # fall of −2 log-likelihood of the estimation logs, less what the freedom is worth by chance
    less_force: float  # relative fall of the random force's rms, of all rows together
    less_on_row: float  # the largest on a row: the force of another row may hide how much that is
    rises: np.ndarray  # (blocks,) of log-likelihood of the estimation data, over the model without it [nats]
    falls: np.ndarray  # (blocks,) of half the sum of squares of validation residuals over the horizon
    relative_falls: np.ndarray  # (blocks,) over the sum of both, between -1 and 1
    follows: np.ndarray  # (blocks,) of held-out log-likelihood, over the model without it behind the same filter [nats]

    @property
    def evidence(self) -> float:
        """Rise of log-likelihood in sample, with what its freedom is worth by chance taken off, and held out [nats].

        Of the held-out blocks the best and the worst tenth are left out: where a force is at random it is now and then
        far larger than a Gaussian one, and such a moment would decide.
        """
        trimmed = len(self.gains) // 10
        kept = np.sort(self.gains)[trimmed : len(self.gains) - trimmed]
        return 0.5 * self.in_sample + float(kept.mean()) * len(self.gains)

    @property
    def is_certain(self) -> bool:
        """Possible, determined, significant, and better in most blocks of held-out data.

        The estimation data must discover it at 1 % and those held out confirm it at 5 %; or both say so at 5 %, and
        together at the product of these levels: where the ones say much the others may say less.
        """
        return self.candidate.is_possible and self.is_followed

    @property
    def is_followed(self) -> bool:
        """Certain, whatever size the effect came out with: significant, and better in most blocks of held-out data."""
        discovery, confirmation = self.candidate.p_discovery, self.candidate.p_confirmation
        if discovery is None or confirmation is None:
            return False
        discovered = discovery < FAMILYWISE_SIGNIFICANCE_LEVEL
        together = self.candidate.p_value < FAMILYWISE_SIGNIFICANCE_LEVEL * CONFIRMATION_LEVEL
        significant = max(discovery, confirmation) < CONFIRMATION_LEVEL and (discovered or together)
        in_most_blocks = any(2 * np.count_nonzero(b > 0.0) > len(b) for b in (self.gains, self.falls, self.follows))
        return significant and self.is_likelier and in_most_blocks

    @property
    def is_likelier(self) -> bool:
        """True where the data of the fit, and all data, are likelier with the effect than its freedom is worth."""
        return self.in_sample > 0.0 and self.evidence > 0.0

    def is_supported(self, error_before: float) -> bool:
        """Certain, and lowering the error or the force."""
        return self.is_certain and self.improves(error_before)

    def is_negligible(self, error_before: float) -> bool:
        """Certain, and lowering neither the error nor the force by what makes a step, nor clearly raising the error."""
        return self.is_certain and not self.lowers(error_before) and not self.raises_error(error_before)

    @property
    def has_weight(self) -> bool:
        """True where its force is a thousandth of the drive on a row, or held-out data are clearly likelier with it.

        Beside a random force an effect may lower neither that nor the error by what makes a step, and yet be one that a
        model of this machine lacks.
        """
        clearly_likelier = gain_statistic(self.gains) >= MIN_CLEAR_STATISTIC
        return clearly_likelier or share_of_drive(self.model, self.candidate.effect) > MIN_FORCE_SHARE

    def improves(self, error_before: float) -> bool:
        """Lowering the error, or the force without raising the error."""
        return self.lowers(error_before) and not self.raises_error(error_before)

    def lowers(self, error_before: float) -> bool:
        """Lowering the error or the force by what makes a step; the force of one row may fall that another's hides."""
        lowers_force = self.less_on_row > MIN_RELATIVE_ERROR_DECREASE and self.less_force > -MIN_RELATIVE_ERROR_DECREASE
        return lowers_force or self._error_ratio(error_before) < 1.0 - MIN_RELATIVE_ERROR_DECREASE

    def raises_error(self, error_before: float) -> bool:
        """Raising the error by a larger factor than the force falls, and in most segments: clearly by its scatter.

        A force at random makes an error over the horizon that the true law may well raise by chance; and a machine of
        so large an inertia that the force alone moves it predicts well that it goes on as it goes.
        """
        if np.isfinite(error_before) and not np.isfinite(self.candidate.error_after):
            return True  # it runs away, and of nothing there is no scatter
        factor = max(1.0 / max(1.0 - self.less_force, MIN_FORCE_SHARE), 1.0 + MIN_RELATIVE_ERROR_DECREASE)
        clearly = gain_statistic(self.relative_falls) < -MIN_CLEAR_STATISTIC or len(self.relative_falls) < 2
        return clearly and self._error_ratio(error_before) >= factor

    def _error_ratio(self, error_before: float) -> float:
        return self.candidate.error_after / error_before if np.isfinite(error_before) else 0.0

    def spares_force(self, error_before: float) -> bool:
        """Possible and likelier, with hardly any random force left: what chance may have done, it does too."""
        likely = self.candidate.is_possible and self.is_likelier and not self.raises_error(error_before)
        return likely and self.less_force > SPARED_SHARE

    def without_evidence(self) -> Judged:
        """The same in no structure that may be missing: what would not be worth naming is none."""
        return self._replace(candidate=replace(self.candidate, evidence=None))

    @property
    def evidence_per_parameter(self) -> float:
        """The evidence for each of the effect's parameters [nats]."""
        return self.evidence / self.size

    @property
    def size(self) -> int:
        """Number of the effect's parameters."""
        return len(derive.effects.find(self.candidate.effect).parameters)

    def lead_over(self, other: Judged) -> tuple[float, float]:
        """By how many standard errors between blocks held-out data are likelier, and nearer over the horizon.

        None where the difference is negligible: of two laws that are hardly apart on these data one may be ahead in
        every block, by next to nothing.
        """
        gains = gain_in_blocks(other.predicted, self.predicted)
        return told_statistic(gains), told_statistic(self.falls - other.falls)

    def is_like(self, other: Judged) -> bool:
        """True where data are as likely as with another effect, those of the fit and those held out, and these as near
        over the horizon.
        """
        return max(map(abs, self._statistics_over(other))) < MIN_CLEAR_STATISTIC

    def rivals(self, first: Judged) -> bool:
        """True where data do not tell it from an effect that comes before it.

        Or where there is more evidence for it, with no more parameters: that effect leads over the horizon, say, and
        data of the fit speak for this one.
        """
        return self.is_like(first) or self.is_likelier_than(first)

    def is_likelier_than(self, other: Judged) -> bool:
        """True where there is a nat more evidence for it than for another effect, with no more parameters."""
        return self.evidence > other.evidence + MIN_TOLD_GAIN and self.size <= other.size

    def clearly_leads(self, other: Judged) -> bool:
        """True where data are clearly likelier than with another effect, those of the fit or those held out, or these
        nearer over the horizon, and in no way clearly less so.
        """
        statistics = self._statistics_over(other)
        return max(statistics) >= MIN_CLEAR_STATISTIC and min(statistics) > -MIN_CLEAR_STATISTIC

    def overrules(self, other: Judged) -> bool:
        """True where held-out data are clearly likelier than with another effect and clearly nearer over the horizon,
        though data of the fit are clearly less likely.

        There the other one may have explained a rest, say, that a random force follows at no price.
        """
        of_fit, held_out, _ = self._statistics_over(other)
        nearer = relative_lead_statistic(self.relative_falls, other.relative_falls)
        return of_fit <= -MIN_CLEAR_STATISTIC and min(held_out, nearer) >= MIN_CLEAR_STATISTIC

    def _statistics_over(self, other: Judged) -> tuple[float, float, float]:
        """Standard errors between blocks by which data of the fit are likelier, and the lead on held-out data."""
        return told_statistic(self.rises - other.rises), *self.lead_over(other)


class JudgedModel(NamedTuple):
    """A model that effects are judged against: its fit and how it predicts what is held out."""

    model: FilteredModel
    validated: ValidatedFit
    predicted: Prediction

    @classmethod
    def of(cls, model: FilteredModel) -> JudgedModel:
        """Fit, error over the horizon and prediction from sample to sample of a model."""
        fitted = model.fitted()
        return cls(model, ValidatedFit.of(model.problem, fitted), prediction(model, fitted))


def judge(base: JudgedModel, larger: FilteredModel, effect: str, tests: int) -> Judged:
    """Evidence for an effect from the model refitted with it, against the model without it, as one of so many tests."""
    fitted = larger.fitted()
    row = larger.problem.effect(effect)
    error_after, residuals = validation_residuals(larger.problem, fitted)
    own, per_log = estimate_of(fitted, row), estimates_per_log(larger.problem, fitted, row)
    in_logs = [own.coefficients, *(own.coefficients | e.coefficients for e in per_log)]
    predicted = prediction(larger, fitted)
    gains = gain_in_blocks(base.predicted, predicted)
    falls, relative_falls = falls_over_segments(larger.problem.data.held_out, base.validated.residuals, residuals)
    rises, price = larger.point.rises_over(base.model.point), price_of_freedom(base.model, larger)
    worth = rises - price / len(rises)
    by_size = _p_value_of_size(larger, fitted, effect)
    discovery = min(1.0, _discovery(base.model, larger, fitted, effect, by_size, worth) * tests)
    followed = _following(base, larger, predicted)
    follows, confirmation = followed.gains if followed else np.zeros(0), _confirmation(gains, relative_falls, followed)
    candidate = CandidateFit(
        effect=effect,
        estimates=own.estimates,
        family=row.family,
        p_value=_p_value_of_both(base, discovery, confirmation),
        blocks_agree=agreement(gains, falls, follows),
        error_after=error_after,
        equivalent_to=(),
        physical=all(has_meaning(larger.problem, row, c) for c in in_logs) and rest_has_meaning(larger, fitted, effect),
        fit=fitted,
        per_log=per_log,
        p_discovery=discovery,
        p_confirmation=confirmation,
        held_out_gain=float(gains.sum()),
        in_sample_gain=0.5 * (base.model.point.deviance - larger.point.deviance),
        evidence=np.concatenate([worth, gains]),
        determined=is_determined(row, own)
        and (by_size < ONE_STANDARD_ERROR or _p_value_of_ratio(larger, fitted, effect) < ONE_STANDARD_ERROR),
    )
    in_sample = base.model.deviance - larger.deviance
    forces = falls_of_force(base.model, larger)
    return Judged(candidate, larger, predicted, gains, in_sample, *forces, rises, falls, relative_falls, follows)


def told_statistic(gains: np.ndarray) -> float:
    """The mean of gains in blocks (blocks,) [nats, half squares] over its standard error; 0 where they tell nothing."""
    return gain_statistic(gains) if abs(float(gains.sum())) > MIN_TOLD_GAIN else 0.0


def agreement(*kinds: np.ndarray) -> str:
    """In how many blocks held-out data are better, and of all, as "14/20": likelier, also behind one filter, or nearer.

    Of the kind in which more of the blocks agree.
    """
    better, count = max(((np.count_nonzero(b > 0.0), len(b)) for b in kinds if len(b)), key=lambda k: k[0] / k[1])
    return f"{better}/{count}"


def with_weight(certain: Sequence[Judged]) -> list[Judged]:
    """Those of some effects that have weight, and those that data do not tell from them: a sensor makes no force."""
    weighty = [j for j in certain if j.has_weight]
    return [j for j in certain if any(j is o or j.is_like(o) for o in weighty)]


def share_of_drive(model: FilteredModel, effect: str) -> float:
    """Rms of an effect's force along the measured motion, as a share of all that acts: the largest on a row.

    0 of an effect that makes no force of the measured motion: in a sensor, in the input, or with a state of its own.
    """
    problem, values = model.problem, model.log_values[0]
    without = {**values, **null_values(problem, problem.effect(effect))}
    forces = difference_of_forces(problem.module, problem.logs, values, without)
    return float(np.nan_to_num(forces / model.row_drives).max(initial=0.0))


def falls_of_force(smaller: FilteredModel, larger: FilteredModel) -> tuple[float, float]:
    """Relative fall of the random force's rms from one model to another: of all rows, and the largest on a row.

    Each row's force is measured by the drive on that row, as rows may have different units. A row whose force is
    negligible against its drive, or far larger, tells nothing.
    """
    drives = smaller.row_drives
    before, after = (np.minimum(np.sqrt(m.row_forces_squared) / drives, MAX_SHARE) for m in (smaller, larger))
    if not before.any():
        return 0.0, 0.0
    total = 1.0 - np.linalg.norm(after) / np.linalg.norm(before)
    acting = before > MIN_FORCE_SHARE
    on_rows = 1.0 - after[acting] / before[acting]
    return float(total), float(max([total, *on_rows]))


def _p_value_of_size(larger: FilteredModel, fitted: Fit, effect: str) -> float:
    """P-value, not corrected, of an effect's sizes against those at which it does nothing.

    With errors from the scatter of blocks: the likelihood of data whose noise is not quite what the model says may rise
    by much for an effect that each part of the log wants otherwise, or not at all.
    """
    sizes, deviation = _deviation(larger, fitted, effect)
    return wald_p_value(fitted, sizes, deviation, parts=larger.estimator.problem.count)


def _p_value_of_ratio(larger: FilteredModel, fitted: Fit, effect: str) -> float:
    """P-value, not corrected, of an effect's sizes as shares of the parameter of the plant that they go with most.

    Where nothing tells the scale of all inertias and forces, no size is told from none, but its ratio to one of them
    may be. To first order, so that a size that is no scale's, but none, is told by no ratio either.
    """
    sizes, deviation = _deviation(larger, fitted, effect)
    module = larger.problem.module
    own = set(module.PARAMETERS[: module.OWN_PARAMETERS])
    shared = [p for p in fitted.free if p.log is None and p.name in own and fitted.values[p.name] != 0.0]
    if not (shared and sizes):
        return 1.0
    nearest = max(shared, key=lambda p: max(abs(correlation(fitted, s, p)) for s in sizes))
    return wald_p_value_of_ratio(fitted, sizes, deviation, nearest, larger.estimator.problem.count)


def correlation(fitted: Fit, one: FreeParameter, other: FreeParameter) -> float:
    """Correlation of the errors of two parameters, by the information matrix."""
    a, b = (fitted.places[p.name, p.log] for p in (one, other))
    scale = np.sqrt(fitted.covariance[a, a] * fitted.covariance[b, b])
    return float(fitted.covariance[a, b] / scale) if np.isfinite(scale) and scale > 0.0 else 0.0


def wald_p_value_of_ratio(
    fitted: Fit, sizes: Sequence[FreeParameter], deviation: np.ndarray, to: FreeParameter, parts: int
) -> float:
    """P-value of the ratios of sizes, that deviate (sizes,) from absence, to another parameter that was fitted."""
    gradient = np.c_[np.eye(len(sizes)), -deviation / fitted.values[to.name]]  # of the ratios, times that parameter
    return wald_p_value(fitted, [*sizes, to], np.r_[deviation, 0.0], gradient, parts=parts)


def _deviation(larger: FilteredModel, fitted: Fit, effect: str) -> tuple[list[FreeParameter], np.ndarray]:
    """An effect's sizes, as they were fitted, and by how much they deviate from doing nothing."""
    row = larger.problem.effect(effect)
    sizes = [p for p in fitted.free if p.name in size_names(row)]
    return sizes, deviation_from_absence(fitted, sizes, null_values(larger.problem, row))


def _discovery(
    smaller: FilteredModel, larger: FilteredModel, fitted: Fit, effect: str, by_size: float, in_sample: np.ndarray
) -> float:
    """P-value, not corrected, of an effect on the estimation data: the smaller of two tests, for both of them.

    Its sizes against those at which it does nothing, and what it adds to effects that it replaces; and the rise of the
    log-likelihood of blocks ``in_sample`` (blocks,) [nats], by its scatter.
    """
    row, parts = larger.problem.effect(effect), larger.estimator.problem.count
    added = [added_p_value(larger.problem, row, fitted, s, parts) for s in smaller.problem.replaced(effect)]
    return min(1.0, 2.0 * min(max([by_size, *added]), one_sided_p_value(in_sample)))


def price_of_freedom(smaller: FilteredModel, larger: FilteredModel) -> float:
    """Log-likelihood that a larger model's freedom is worth by chance (Schwarz's criterion) [nats]."""
    return 0.5 * (larger.freedom - smaller.freedom) * float(np.log(max(larger.estimator.problem.count, 2)))


def _following(base: JudgedModel, larger: FilteredModel, predicted: Prediction) -> Following | None:
    """Whether held-out data follow the change that the effect makes behind the larger model's filter.

    The model without the effect gets that filter's random sources, and its parameters are refitted to them. None where
    it cannot be simulated there.
    """
    without = at_sources(base.model, larger.point.sources)
    if not np.isfinite(without.point.deviance):
        return None
    before, data = prediction_at(without, _values_of(without), predicted.sources), base.model.problem.data
    return following(before, predicted, 1.0 + (data.validation_values or data.values) / data.values)


def _confirmation(gains: np.ndarray, relative_falls: np.ndarray, followed: Following | None) -> float:
    """P-value of the effect on held-out data, of three tests together, those apart that cannot be made.

    Whether they follow the change that it makes behind one filter; whether they are likelier; and whether they are
    predicted better over the horizon, where no filter follows what a law has missed. Both of these by the scatter
    between blocks, the last of the relative change: where something happens at random over the horizon no single
    segment decides. None counts more than the number of blocks allows.
    """
    tests = [(one_sided_p_value(blocks), len(blocks)) for blocks in (gains, relative_falls) if len(blocks) > 1]
    tests += [(followed.p_value, len(followed.gains))] if followed else []
    return combined_p_value([bounded_p_value(*test) for test in tests])


def _p_value_of_both(base: JudgedModel, discovery: float, confirmation: float) -> float:
    """P-value of what the estimation data discover and held-out data confirm; the larger where none are held out."""
    independent = bool(base.model.problem.data.validation)
    return joint_p_value(discovery, confirmation) if independent else max(discovery, confirmation)


def _values_of(model: FilteredModel) -> Fit:
    """A model's values as a fit without errors."""
    space = model.estimator.problem.space
    per_log = [space.per_log_values(model.point.theta, k) for k in range(len(model.problem.logs))]
    found = Fit.at({**space.shared, **space.shared_values(model.point.theta)}, per_log)
    return replace(found, free=space.layout.elements)


def most_telling_first(supported: Sequence[Judged]) -> list[Judged]:
    """Supported effects, of those that no other clearly leads that with most evidence for each of its parameters first.

    Or a simpler one that it has in it: what more an effect of several parameters explains is judged beside the simple
    one, in the next round. Nor does a difference between directions come before the friction that differs, where these
    data do not tell them apart: of a motor that runs one way only. Each has the names of those that data do not tell
    from it, or for which there is more evidence though it leads.
    """
    able = [j for j in supported if improves_on_nested(j, supported)]
    found = sorted(able, key=lambda j: (sum(o.clearly_leads(j) for o in able), -j.evidence_per_parameter))
    plainer = _plainer_than(found[0], found) if found else ()
    found.sort(key=lambda j: j.candidate.effect not in plainer)
    return [
        _with_equivalents(j, [*(o for o in found[:k] if o.is_like(j)), *(o for o in found[k + 1 :] if o.rivals(j))])
        for k, j in enumerate(found)
    ]


def _plainer_than(one: Judged, others: Sequence[Judged]) -> tuple[str, ...]:
    """Effects that come before one: what it contains or approaches, and of a difference between directions whatever
    does as well and is none: the friction that it varies, or on a machine that goes one way an offset.
    """
    if not derive.effects.find(one.candidate.effect).varies:
        return simpler_than(one)
    plain = (o for o in others if not derive.effects.find(o.candidate.effect).varies and o.size <= one.size)
    return (*simpler_than(one), *(o.candidate.effect for o in plain if o.is_like(one)))


def not_led(supported: Sequence[Judged], judged: Sequence[Judged]) -> list[Judged]:
    """Supported effects that none clearly leads, with more evidence, which may be but is not supported itself.

    What is missing then is rather like that one, and the lesser effect stands in for it. So it is with one that what
    no fit has seen contradicts, where another supported one holds there.
    """
    others = _likely_besides(supported, judged)
    ahead = [j for j in supported if not any(_stands_in_for(j, o) for o in others)]
    return [j for j in ahead if not any(o.overrules(j) for o in ahead)]


def certain_within(judged: Sequence[Judged], supported: Sequence[Judged], error_before: float) -> list[Judged]:
    """Effects that are not supported by their own tests, but that clearly lead a supported one that contains them.

    That one's test says that some effect of its wider family is there; of the family the simpler one explains it best.
    It lowers the error or the force, and held-out data confirm it.
    """
    return [
        j
        for j in _likely_besides(supported, judged)
        if (p := j.candidate.p_confirmation) is not None
        and p < CONFIRMATION_LEVEL
        and j.improves(error_before)
        and any(j.candidate.effect in simpler_than(o) and j.clearly_leads(o) for o in supported)
    ]


def with_likelier_besides(named: Sequence[Judged], judged: Sequence[Judged], error_before: float) -> list[Judged]:
    """Named effects, to those that data do not tell from each are added which are likelier but miss certainty.

    They have no more parameters, lower the error or the force, and all data see them at 5 %: what is certain then is
    that the named one or one of these is missing. Not so where held-out data overrule one.
    """
    uncertain = [
        j
        for j in _likely_besides(named, judged)
        if j.candidate.p_value < CONFIRMATION_LEVEL and not j.is_certain and j.improves(error_before)
    ]
    return [_with_equivalents(j, [o for o in uncertain if o.is_likelier_than(j) and not j.overrules(o)]) for j in named]


def _likely_besides(supported: Sequence[Judged], judged: Sequence[Judged]) -> list[Judged]:
    """Possible effects that data are likelier with, but for those that are supported."""
    names = {j.candidate.effect for j in supported}
    return [j for j in judged if j.candidate.effect not in names and j.candidate.is_possible and j.is_likelier]


def _stands_in_for(one: Judged, other: Judged) -> bool:
    """True of an effect that another clearly leads, which does not have it in it."""
    leads = other.evidence > one.evidence and other.clearly_leads(one)
    return leads and one.candidate.effect not in simpler_than(other)


def improves_on_nested(one: Judged, others: Sequence[Judged]) -> bool:
    """True of an effect that predicts clearly better than each simpler one that it contains or approaches."""
    within = simpler_than(one)
    return all(max(one.lead_over(o)) >= MIN_CLEAR_STATISTIC for o in others if o.candidate.effect in within)


def simpler_than(one: Judged) -> tuple[str, ...]:
    """Simpler effects of the same force as one."""
    return narrower_effects(one.model.problem.module, one.candidate.effect)


def _with_equivalents(one: Judged, others: Sequence[Judged]) -> Judged:
    """An effect with the names of others beside those that data are known not to tell from it."""
    names = tuple(sorted({*one.candidate.equivalent_to, *(o.candidate.effect for o in others)}))
    return one._replace(candidate=replace(one.candidate, equivalent_to=names))
