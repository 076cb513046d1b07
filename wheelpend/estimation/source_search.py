"""Which random sources a machine has: as few as suffice, none if none is needed, by likelihood.

A fit begins with a force on every row and an error of every sensor, all large: so free that no wrong start and no
missing law can bend it far. What the likelihood does not need is then taken away, and forces on several rows become one
between them where that is likelier.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.estimation.filter_fit import THOROUGH, TRIAL, Effort, FilterEstimator, FilterPoint
from wheelpend.estimation.random_source import RandomSource, Sources

Progress = Callable[[str], None]

START_FORCE_SHARE, START_ERROR_SIGMAS, START_TIME_S = 1.0, 3.0, 0.05  # of the scale, σ, s: where sources begin
MIXTURE_PARTS = 5  # come close to a particle filter
POLISH = Effort(6, 0.5, True)  # of the fit that ends with them
MAX_SEARCH_SAMPLES = 10_000  # of all logs together, on which sources are chosen
FREEST = Effort(25, 0.1, True, holds_times=True)  # of the fit that begins the search
START = Effort(6, 10.0, True, holds_times=True)  # of fits that decide between starts
SECOND_ERROR_EFFORT = Effort(10, 0.5, True)  # of fits with a second error of a sensor
SOURCES_ALONE = Effort(12, 1.0, False, holds_parameters=True)  # of fits that find what is likeliest at a start
TRIAL_FORCE_SHARES, TRIAL_ERROR_SIGMAS = (0.2, 0.01), (2.0, 0.5)  # first sizes that are tried of a source
TRIAL_TIMES_S = (0.003, 0.03, 0.3)  # s, its first correlation times
MAX_TRIED = 2  # sources that are fitted in a round, those that promise most
MAX_EXPLAINED_SQUARE = 1.1  # mean square of whitened innovations up to which no source is behind them


def likeliest_sources(
    estimator: FilterEstimator, starts: Iterable[np.ndarray], forces: Sources, errors: Sources, progress: Progress
) -> FilterPoint:
    """The fit from the best of some starts (free,) each, with as few random sources as suffice.

    The first start is the likeliest; more are taken only where sensor noise does not explain what it leads to. A source
    counts where it raises the likelihood by more than its size and correlation time would by chance in so many values
    (Schwarz's criterion). They are chosen on a part of long logs.
    """
    possible = (*forces, *errors)
    progress("fitting without random forces")
    starts = iter(starts)
    first = next(starts)
    whole = estimator.fit(first, estimator.in_all_logs(()), TRIAL)
    part = estimator.on_part(MAX_SEARCH_SAMPLES)
    if is_explained(estimator, whole):
        found = part.point(whole.theta, whole.sources)
    else:
        found = likeliest_from(part, [first, *starts], forces, errors, progress)
    progress("looking for another random force or sensor error")
    while (trial := _with_another(part, found, possible)) and _is_worth(part, trial, found):
        found = _with_filters(part, without_needless(part, trial), errors)
    progress("fitting all samples")
    return _with_given_times(estimator, estimator.fit(found.theta, found.sources))


def _with_given_times(estimator: FilterEstimator, point: FilterPoint) -> FilterPoint:
    """The likelier of a fit, and one in which events begin and end near where they are given to.

    What a start was fitted to without random forces may have carried them off, to where a force happened to jump.
    """
    times = [k for k, p in enumerate(estimator.problem.space.layout.elements) if p.role == "event time"]
    if not times:
        return point
    theta = point.theta.copy()
    theta[times] = estimator.problem.space.start()[times]
    near = estimator.fit(theta, point.sources, THOROUGH._replace(holds_times=True))
    near = estimator.fit(near.theta, near.sources)
    return near if near.deviance < point.deviance else point


def likeliest_from(
    estimator: FilterEstimator,
    starts: Sequence[np.ndarray],
    forces: Sources,
    errors: Sources,
    progress: Progress = lambda text: None,
) -> FilterPoint:
    """The fit that begins with large sources everywhere, from the best of some starts, without those not needed."""
    progress("fitting with large random forces")
    freest = _freest(estimator, starts, (*forces, *errors))
    progress("taking random forces away that are not needed")
    return _with_filters(estimator, _with_ports(estimator, without_needless(estimator, freest), forces), errors)


def as_mixture(estimator: FilterEstimator, point: FilterPoint) -> tuple[FilterEstimator, FilterPoint]:
    """A fit gone on with from a point, with several Gaussian parts where a surface may stick."""
    if not estimator.problem.module.SURFACES:
        return estimator, point
    parted = replace(estimator, problem=replace(estimator.problem, parts=MIXTURE_PARTS))
    return parted, parted.fit(point.theta, point.sources, POLISH)


def is_explained(estimator: FilterEstimator, point: FilterPoint) -> bool:
    """True where sensor noise alone explains the innovations."""
    squares = sum(float(run.gram[:, -1, -1].sum()) for run in point.runs)
    return squares < MAX_EXPLAINED_SQUARE * estimator.problem.count


def _freest(estimator: FilterEstimator, starts: Sequence[np.ndarray], possible: Sources) -> FilterPoint:
    """A fit with a force on every row and an error of every sensor: from every start large ones, then likely ones.

    Where forces are large the parameters hardly matter, and a fit may carry them so far that it ends in another, less
    likely place. So a second one begins with the sources that are likeliest at a start, and the likelier one counts.
    """
    alone = [s for s in possible if not s.lags and (not s.is_force or np.count_nonzero(s.rows) == 1)]
    shares = [START_FORCE_SHARE if s.is_force else START_ERROR_SIGMAS for s in alone]
    sources = tuple(estimator.sized(s, share, START_TIME_S) for s, share in zip(alone, shares, strict=True))
    begun = [estimator.fit(s, estimator.in_all_logs(sources), START, fixed_noise=True) for s in starts]
    at_starts = [estimator.fit(s, estimator.in_all_logs(sources), SOURCES_ALONE) for s in starts]
    ended = []
    for points in (begun, at_starts):
        best = min(points, key=lambda p: p.deviance)
        ended.append(estimator.fit(best.theta, best.sources, FREEST))
    return min(ended, key=lambda p: p.deviance)


def with_second_errors(estimator: FilterEstimator, point: FilterPoint, errors: Sources) -> FilterPoint:
    """A fit with a second error of such sensors as have one, where that is likelier than chance would make it.

    What a sensor reads may be wrong slowly and fast: by play and by quantisation, say. Of the two the likelihood may
    have found either, with a force that stands for the other; from there no size of it promises anything, so that it
    is fitted whatever it promises.
    """
    starts = [s for e in errors for s in _starts_of_second(estimator, point, e)]
    trials = [estimator.fit(point.theta, sources, SECOND_ERROR_EFFORT) for sources in starts]
    best = min(trials, key=lambda p: p.deviance, default=point)
    if best is point or not _is_worth(estimator, best, point):
        return point
    more = without_needless(estimator, best)
    return with_second_errors(estimator, more, errors) if _seconds(more) > _seconds(point) else more


def _seconds(point: FilterPoint) -> int:
    """How many of a point's sources are second errors of their sensors."""
    return len(point.kinds) - len({s.kind for s in point.kinds})


def _starts_of_second(estimator: FilterEstimator, point: FilterPoint, error: RandomSource) -> list[tuple[Sources, ...]]:
    """Sources of all logs with a second error of a sensor that has one: the likeliest faster and slower one."""
    own = [s for s in point.kinds if s.kind == error.kind]
    if error.lags or len(own) != 1:
        return []
    sizes = list(_first_sizes(estimator, error))
    sides = (
        [s for s in sizes if s.correlation_time < own[0].correlation_time],
        [s for s in sizes if s.correlation_time > own[0].correlation_time],
    )
    found = [_likeliest_beside(estimator, point, point.sources, side) for side in sides if side]
    return [f[1] for f in found if f is not None]


def _is_worth(estimator: FilterEstimator, more: FilterPoint, less: FilterPoint) -> bool:
    """True where a fit with more sources is likelier than one with fewer by more than chance would make it."""
    return more.deviance + _penalty(estimator, more) < less.deviance + _penalty(estimator, less)


def _penalty(estimator: FilterEstimator, point: FilterPoint) -> float:
    """What the freedom of a point's sources is worth by chance: sizes in each log, and times."""
    return len(point.kinds) * (len(point.sources) + 1) * float(np.log(max(estimator.problem.count, 2)))


def without_needless(estimator: FilterEstimator, point: FilterPoint) -> FilterPoint:
    """A fit without those of its sources that the likelihood can spare, the most needless first."""
    fewer = [tuple((*own[:k], *own[k + 1 :]) for own in point.sources) for k in range(len(point.kinds))]
    losses = [float(estimator.problem.deviances(point.theta, s).sum()) for s in fewer]
    goal = point.deviance + _penalty(estimator, point) * (1.0 - (len(point.kinds) - 1) / max(len(point.kinds), 1))
    for number in np.argsort(losses):
        trial = estimator.fit(point.theta, fewer[number], TRIAL, goal=goal)
        if not _is_worth(estimator, point, trial):
            return without_needless(estimator, trial)
    return point


def _with_ports(estimator: FilterEstimator, point: FilterPoint, forces: Sources) -> FilterPoint:
    """The likeliest of a fit and those with a force along a port in place of one or more on its rows."""
    trials = [point]
    for port in (f for f in forces if np.count_nonzero(f.rows) > 1):
        replaced = [
            s.is_force and bool(np.any((np.array(s.rows) != 0) & (np.array(port.rows) != 0))) for s in point.kinds
        ]
        for kept in _kept_rows(replaced):
            rest = tuple(tuple(s for s, k in zip(own, kept, strict=True) if k) for own in point.sources)
            trials.extend(_fits_with(estimator, point, rest, port))
    best = min(trials, key=lambda p: p.deviance + _penalty(estimator, p))
    return best if best is point else without_needless(estimator, best)


def _with_filters(estimator: FilterEstimator, point: FilterPoint, errors: Sources) -> FilterPoint:
    """The likeliest of a fit and those with the error of a low-pass filter in place of another error of a sensor."""
    trials = [point]
    for lagging in (e for e in errors if e.lags):
        plain = [s.place == lagging.place and not s.lags and not s.is_force for s in point.kinds]
        if any(plain) and lagging.kind not in {s.kind for s in point.kinds}:
            rest = tuple(tuple(s for s, p in zip(own, plain, strict=True) if not p) for own in point.sources)
            trials.extend(_fits_with(estimator, point, rest, lagging))
    best = min(trials, key=lambda p: p.deviance)
    return best if best is point else _with_filters(estimator, without_needless(estimator, best), errors)


def _kept_rows(replaced: Sequence[bool]) -> Iterator[tuple[bool, ...]]:
    """Which sources are kept: all but those on a port's rows, and all but one of these."""
    if any(replaced):
        yield tuple(not r for r in replaced)
    if sum(replaced) > 1:
        for number in np.flatnonzero(replaced):
            yield tuple(not r or k == number for k, r in enumerate(replaced))


def _fits_with(
    estimator: FilterEstimator, point: FilterPoint, beside: tuple[Sources, ...], source: RandomSource
) -> list[FilterPoint]:
    """A fit with a source beside others; none where no size of it can be filtered."""
    start = _best_first_size(estimator, point, beside, source)
    return [] if start is None else [estimator.fit(point.theta, start[1], TRIAL)]


def _with_another(estimator: FilterEstimator, best: FilterPoint, possible: Sources) -> FilterPoint | None:
    """The likeliest fit with one more source of those that promise most; None where none promises anything."""
    known = {s.kind for s in best.kinds}
    found = [_best_first_size(estimator, best, best.sources, s) for s in possible if s.kind not in known]
    promising = sorted((f for f in found if f is not None and f[0] < best.deviance), key=lambda f: f[0])[:MAX_TRIED]
    fits = [estimator.fit(best.theta, sources, TRIAL) for _, sources in promising]
    return min(fits, key=lambda p: p.deviance, default=None)


def _best_first_size(
    estimator: FilterEstimator, point: FilterPoint, beside: tuple[Sources, ...], source: RandomSource
) -> tuple[float, tuple[Sources, ...]] | None:
    """Deviance, and sources of all logs, with a source of the likeliest of several sizes and times beside others.

    None where no size can be filtered.
    """
    return _likeliest_beside(estimator, point, beside, _first_sizes(estimator, source))


def _likeliest_beside(
    estimator: FilterEstimator, point: FilterPoint, beside: tuple[Sources, ...], trials: Iterable[RandomSource]
) -> tuple[float, tuple[Sources, ...]] | None:
    """Deviance, and sources of all logs, with the likeliest of several sources beside others; None as above."""
    tried = []
    for trial in trials:
        sources = tuple((*own, trial) for own in beside)
        tried.append((float(estimator.problem.deviances(point.theta, sources).sum()), sources))
    best = min(tried, key=lambda t: t[0])
    return best if np.isfinite(best[0]) else None


def _first_sizes(estimator: FilterEstimator, source: RandomSource) -> Iterable[RandomSource]:
    shares = TRIAL_FORCE_SHARES if source.is_force else TRIAL_ERROR_SIGMAS
    return dict.fromkeys(estimator.sized(source, share, time) for share in shares for time in TRIAL_TIMES_S)
