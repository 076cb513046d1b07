"""How likely data are that no fit has seen: innovations of a model's filter along validation segments, in blocks.

The noise model is never exact, so that a difference in likelihood is judged by its scatter between blocks.
Source: Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57 (1989) 307; Harvey,
Leybourne and Newbold, Tests for forecast encompassing, J. Business & Economic Statistics 16 (1998) 254.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.evidence import encompassing_p_value
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.estimation.filter_error import FilterProblem, parted
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import Sources, with_forces
from wheelpend.estimation.segments import Segments, contiguous_ranges
from wheelpend.estimation.source_search import MIXTURE_PARTS
from wheelpend.estimation.validation import validation_values
from wheelpend.logs.log import Log

SETTLING_S, MAX_SETTLING_SHARE = 0.2, 0.4  # s, and of a stretch: not scored, while a filter finds its state
BLOCK_COUNT = 20  # of all validation data together
SIZE_FACTORS = (1.0, 1.5, 2.2, 3.3)  # of the found forces' sizes, of which each validation part has its likeliest
MIN_BLOCKS_PER_LOG = 2
MAX_COMBINED_P_VALUE = 0.9  # that a test counts: one that sees nothing at all must not drown the others


class Prediction(NamedTuple):
    """Whitened innovations of all validation data, and the logarithms of their variances, in blocks."""

    whitened: list[np.ndarray]  # of each block (samples, NY), NaN where nothing was read
    log_variance: list[np.ndarray]  # likewise [σ²]

    @property
    def log_likelihood(self) -> np.ndarray:
        """Log-likelihood of each block (blocks,) [nats], without the constant that the sensors' σ alone decide."""
        pairs = zip(self.whitened, self.log_variance, strict=True)
        return np.array([-0.5 * np.nansum(w**2 + v) for w, v in pairs])


def prediction(model: FilteredModel, fitted: Fit, sources: Sequence[Sources] | None = None) -> Prediction:
    """How a model predicts its problem's validation data from sample to sample, with its own or with other sources.

    A validation log's own parameters are estimated on its first third. How large a force is at random differs from log
    to log: sources have the correlation times that were found, and the size that was found in the log that a segment
    belongs to, else the root mean square over the estimation logs, or a likelier one of a few larger ones. Where
    nothing is held out the estimation segments are predicted.
    """
    problem, sources = model.problem, sources or model.point.sources
    parts: list[tuple[Segments, Mapping[str, float], Sources]] = [
        (v.part, validation_values(problem, fitted, v), _sources_of(sources, v.estimation_log))
        for v in problem.data.validation
    ]
    for number, segments in enumerate(problem.data.estimation if not parts else ()):
        parts.append((segments, fitted.of_log(number), sources[number]))
    own = [found for _, _, found in parts]
    filters = _filters_at(problem, [parted(segments) for segments, _, _ in parts], [values for _, values, _ in parts])
    total = sum(len(_scored(s)) for s in filters.segments)
    tried = [filters.innovations(np.zeros(0), with_forces(own, share, 1.0, 0.0)) for share in SIZE_FACTORS]
    blocks = []
    for number, part in enumerate(filters.segments):
        scored = _scored(part)
        found = max((t[number] for t in tried), key=lambda innovations: _log_likelihood(innovations[scored]))
        blocks += [(found[block, :, 0], found[block, :, 1]) for block in _blocks(part, total)]
    return Prediction([w for w, _ in blocks], [v for _, v in blocks])


def _log_likelihood(innovations: np.ndarray) -> float:
    """Log-likelihood of whitened innovations and the logarithms of their variances (samples, NY, 2) [nats]."""
    found = -0.5 * float(np.nansum(innovations[..., 0] ** 2 + innovations[..., 1]))
    return found if np.isfinite(found) else -np.inf


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


def gain_statistic(gains: np.ndarray) -> float:
    """The mean of some gains over its standard error from their scatter."""
    if len(gains) < 2 or not np.isfinite(gains).all():
        return 0.0
    error = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
    return float(np.mean(gains)) / error if error > 0.0 else 0.0


def one_sided_p_value(gains: np.ndarray) -> float:
    """P-value of some gains being no more than chance, by their scatter; few blocks are believed less."""
    from scipy.special import stdtr  # imported late: scipy.special takes longer to load than most commands

    return float(stdtr(max(len(gains) - 1, 1), -gain_statistic(gains)))


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


def following_p_value(before: Prediction, after: Prediction, inflation: float) -> float:
    """P-value of validation data following the change that an effect makes in what the same filter predicts.

    The old innovations are regressed on the change, which the estimation data alone have fixed: a factor of 1 says that
    the effect is there, 0 that it is not. Its standard error is the larger of those for white innovations and from the
    scatter of the blocks, times the root of inflation for what is uncertain in the change.
    """
    pairs = list(zip(before.whitened, after.whitened, strict=True))
    along = np.array([np.nansum(b * (b - a)) for b, a in pairs])
    power = np.array([np.nansum((b - a) ** 2) for b, a in pairs])
    return encompassing_p_value(along, power, inflation)
