"""How likely data are that no fit has seen: innovations of a model's filter along validation segments, in blocks.

The noise model is never exact, so that a difference in likelihood is judged by its scatter between blocks.
Source: Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57 (1989) 307; Harvey,
Leybourne and Newbold, Tests for forecast encompassing, J. Business & Economic Statistics 16 (1998) 254.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.block_evidence import gain_statistic
from wheelpend.diagnosis.evidence import encompassing_p_value
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.estimation.filter_error import FilterProblem, parted
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import Sources, scaled_sources
from wheelpend.estimation.segments import Segments, contiguous_ranges
from wheelpend.estimation.source_search import MIXTURE_PARTS
from wheelpend.estimation.validation import validation_values
from wheelpend.logs.log import Log

SETTLING_S, MAX_SETTLING_SHARE = 0.2, 0.4  # s, and of a stretch: not scored, while a filter finds its state
BLOCK_COUNT = 20  # of all validation data together
LARGER_FACTORS, SMALLER_FACTORS = (1.5, 2.2, 3.3), (0.3, 0.45, 0.67)  # of found forces, that held-out data may have
ERROR_FACTORS = (0.01, 0.1, 0.3, 3.0)  # likewise of the sensors' random errors
MIN_BLOCKS_PER_LOG = 2
MAX_COMBINED_P_VALUE = 0.9  # that a test counts: one that sees nothing at all must not drown the others
MEAN_SQUARE_RANGE = (1e-6, 1e6)  # of innovations over what is expected: what runs away is no further off


class Prediction(NamedTuple):
    """Whitened innovations of all validation data, and the logarithms of their variances, in blocks."""

    whitened: list[np.ndarray]  # of each block (samples, NY), NaN where nothing was read
    log_variance: list[np.ndarray]  # likewise [σ²]
    sources: list[Sources]  # of each part of the data

    @property
    def log_likelihood(self) -> np.ndarray:
        """Log-likelihood of each block (blocks,) [nats], without the constant that the sensors' σ alone decide."""
        pairs = zip(self.whitened, self.log_variance, strict=True)
        return np.array([-0.5 * np.nansum(w**2 + v) for w, v in pairs])

    @property
    def surprise(self) -> float:
        """Mean square of the innovations over what the filter expects, 1 of a right model: in the middle one of blocks.

        0 where nothing was read.
        """
        return float(np.median(self.mean_squares)) if len(self.mean_squares) else 0.0

    @property
    def p_value_of_surprise(self) -> float:
        """P-value of the innovations being no larger than the filter expects, by the scatter between blocks.

        Of the logarithms, so that no block that is far worse than the others hides what these say.
        """
        return one_sided_p_value(np.log(np.clip(self.mean_squares, *MEAN_SQUARE_RANGE)))

    @property
    def mean_squares(self) -> np.ndarray:
        """Of the innovations over what the filter expects, in blocks (blocks,) in which something was read."""
        return np.array([np.nanmean(w**2) for w in self.whitened if np.isfinite(w).any()])


def prediction(model: FilteredModel, fitted: Fit) -> Prediction:
    """How a model predicts its problem's validation data from sample to sample.

    A validation log's own parameters are estimated on its first third. How large a force or a sensor's error is at
    random differs from log to log: another log than those of the estimation has the likeliest of several sizes, about
    the root mean square over these. What is held out of an estimation log has the errors that were found there, and the
    force or a likelier larger one: a law that leaves less to chance should not lose by it. Where nothing is held out
    the estimation segments are predicted.
    """
    filters, sources = _filters(model, fitted), _sources_of_parts(model)
    others = np.array([v.estimation_log is None for v in model.problem.data.validation] or [False] * len(sources))
    found = _followed(filters, sources)
    found = _likeliest_sizes(filters, found, [(1.0, e) for e in ERROR_FACTORS], others)
    found = _likeliest_sizes(filters, found, [(f, 1.0) for f in SMALLER_FACTORS], others)
    found = _likeliest_sizes(filters, found, [(f, 1.0) for f in LARGER_FACTORS], np.ones_like(others))
    return _predicted(filters, found)


def prediction_at(model: FilteredModel, fitted: Fit, sources: Sequence[Sources]) -> Prediction:
    """The same with given sources in each part of the data, as another model's prediction has them."""
    filters = _filters(model, fitted)
    return _predicted(filters, _followed(filters, sources))


class _Followed(NamedTuple):
    """A filter along one part of the data."""

    sources: Sources
    innovations: np.ndarray  # (N, NY, 2) whitened, and the logarithms of their variances [σ²]
    log_likelihood: float  # of the scored samples [nats]; minus infinity where it is not finite


def _followed(filters: FilterProblem, sources: Sequence[Sources]) -> list[_Followed]:
    """The filters along all parts, with these sources in each."""
    parts = zip(sources, filters.innovations(np.zeros(0), sources), filters.segments, strict=True)
    return [_Followed(own, found, _log_likelihood(found[_scored(part)])) for own, found, part in parts]


def _likeliest_sizes(
    filters: FilterProblem, found: Sequence[_Followed], factors: Sequence[tuple[float, float]], parts: np.ndarray
) -> list[_Followed]:
    """Each part; those of the chosen ``parts`` (parts,) with forces and errors so many times as large, if likelier."""
    sources = [f.sources for f in found]
    trials = [_followed(filters, scaled_sources(sources, *f)) for f in factors] if parts.any() else []
    return [
        max((now, *(t[k] for t in trials if parts[k])), key=lambda f: f.log_likelihood) for k, now in enumerate(found)
    ]


def _predicted(filters: FilterProblem, found: Sequence[_Followed]) -> Prediction:
    total = sum(len(_scored(s)) for s in filters.segments)
    pairs = zip(found, filters.segments, strict=True)
    blocks = [one.innovations[block] for one, part in pairs for block in _blocks(part, total)]
    return Prediction([b[..., 0] for b in blocks], [b[..., 1] for b in blocks], [f.sources for f in found])


def _log_likelihood(innovations: np.ndarray) -> float:
    """Log-likelihood of whitened innovations and the logarithms of their variances (samples, NY, 2) [nats]."""
    found = -0.5 * float(np.nansum(innovations[..., 0] ** 2 + innovations[..., 1]))
    return found if np.isfinite(found) else -np.inf


def _filters(model: FilteredModel, fitted: Fit) -> FilterProblem:
    """Filters along the validation data, or along the estimation segments where nothing is held out."""
    problem = model.problem
    parts: list[tuple[Segments, Mapping[str, float]]] = [
        (v.part, validation_values(problem, fitted, v)) for v in problem.data.validation
    ]
    parts = parts or [(s, fitted.of_log(k)) for k, s in enumerate(problem.data.estimation)]
    return _filters_at(problem, [parted(segments) for segments, _ in parts], [values for _, values in parts])


def _sources_of_parts(model: FilteredModel) -> list[Sources]:
    """The sources that were found, for each part of the validation data."""
    found, validation = model.point.sources, model.problem.data.validation
    return [_sources_of(found, v.estimation_log) for v in validation] or list(found)


def _filters_at(
    problem: EstimationProblem, segments: Sequence[Segments], values: Sequence[Mapping[str, float]]
) -> FilterProblem:
    space = ParameterSpace.of(ParameterLayout.of((), len(segments)), {}, values)
    parts = MIXTURE_PARTS if problem.module.SURFACES else 1  # one part alone is deaf to what moves where it sticks
    return FilterProblem(problem.module, segments, space, problem.max_step, parts=parts)


def _sources_of(sources: Sequence[Sources], log: int | None) -> Sources:
    if log is not None:
        return sources[log]
    sizes = np.sqrt(np.mean([[s.rms**2 for s in own] for own in sources], axis=0))
    return tuple(replace(s, rms=float(size)) for s, size in zip(sources[0], sizes, strict=True))


def _scored(segments: Segments) -> np.ndarray:
    """Samples that are scored: all but the first of every stretch that a filter starts in."""
    return np.concatenate([_settled(segments.log, *ends) for ends in contiguous_ranges(segments.bounds)])


def _settled(log: Log, begin: int, end: int) -> np.ndarray:
    samples = np.arange(begin, end)
    t = log.t[samples]
    return samples[t >= t[0] + min(SETTLING_S, MAX_SETTLING_SHARE * (t[-1] - t[0]))]


def _blocks(segments: Segments, total: int) -> list[np.ndarray]:
    """The scored samples of a log in as many blocks as its share of all."""
    samples = _scored(segments)
    return np.array_split(samples, max(MIN_BLOCKS_PER_LOG, round(BLOCK_COUNT * len(samples) / max(total, 1))))


def gain_in_blocks(before: Prediction, after: Prediction) -> np.ndarray:
    """By how much each block is likelier after a change than before (blocks,) [nats]."""
    return np.nan_to_num(after.log_likelihood - before.log_likelihood, nan=-np.inf)


def one_sided_p_value(gains: np.ndarray) -> float:
    """P-value of some gains being no more than chance, by their scatter; few blocks are believed less."""
    from scipy.special import stdtr  # imported late: scipy.special takes longer to load than most commands

    return float(stdtr(max(len(gains) - 1, 1), -gain_statistic(gains)))


def bounded_p_value(p_value: float, blocks: int) -> float:
    """A p-value from the scatter of so many blocks, but none below that of all of them having one sign by chance.

    Of few blocks the scatter is hardly known, so that far smaller ones say nothing.
    """
    return max(p_value, 0.5**blocks)


def combined_p_value(p_values: Sequence[float]) -> float:
    """P-value of several tests of one hypothesis together; of small ones however they depend on each other.

    Where one alone is small it is about as many times that as there are tests; where all agree it is theirs. Source:
    Liu and Xie, Cauchy combination test, J. American Statistical Association 115 (2020) 393.
    """
    if not len(p_values):
        return 1.0
    bounded = np.clip(p_values, 1e-300, MAX_COMBINED_P_VALUE)
    statistic = float(np.mean(1.0 / np.tan(np.pi * bounded)))
    return float(np.arctan2(1.0, statistic) / np.pi)


def joint_p_value(one: float, other: float) -> float:
    """P-value of two tests of one hypothesis on independent data, by their product: one may outweigh the other.

    Source: Fisher, Statistical Methods for Research Workers, 4th edition (1932), section 21.1.
    """
    product = max(one * other, 1e-300)
    return min(product * (1.0 - math.log(product)), 1.0)


class Following(NamedTuple):
    """How validation data follow the change that an effect makes in what the same filter predicts."""

    p_value: float
    gains: np.ndarray  # (blocks,) of log-likelihood by the change [nats]


def following(before: Prediction, after: Prediction, inflation: float) -> Following:
    """Whether validation data follow the change that an effect makes in what the same filter predicts.

    The old innovations are regressed on the change, which the estimation data alone have fixed: a factor of 1 says that
    the effect is there, 0 that it is not. Its standard error is the larger of those for white innovations and from the
    scatter of the blocks, times the root of inflation for what is uncertain in the change.
    """
    pairs = list(zip(before.whitened, after.whitened, strict=True))
    along = np.array([np.nansum(b * (b - a)) for b, a in pairs])
    power = np.array([np.nansum((b - a) ** 2) for b, a in pairs])
    return Following(encompassing_p_value(along, power, inflation), along - 0.5 * power)
