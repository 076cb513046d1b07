"""Continuation: a fit that goes from short segments to full ones, with fresh initial states at each length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.criteria import EXPLAINED, FAR, VISIBLE
from wheelpend.estimation.data import shortened
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import limits_of, per_log_names, phased_pairs
from wheelpend.estimation.gauss_newton import fit
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.kernels import load as kernels

ALIKE = 1e-3  # of the error, by which two fits of the same segments may differ that ended in the same place
ALL_LENGTHS = (0.1, 0.3, 1.0)  # of the segments that a fit goes through, in horizons


def fit_parts(
    study: Study,
    parts: Sequence[Part],
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    start_per_log: Sequence[Mapping[str, float]] = (),
    rounds: int = 15,
) -> Fit:
    """Fit free parameters to some parts with the study's kernels, scopes and bounds.

    Ripples are first fitted in every log by itself, which finds the phases; then their amplitudes are made one.
    """
    found = _fitted(study, parts, start, free, start_per_log, rounds)
    pairs = phased_pairs(free)
    if len(parts) == 1 or not pairs or not rounds:
        return found
    return _fitted(study, parts, found.values, free, found.per_log, rounds, states=found.states, phased=pairs)


def _fitted(study: Study, parts, start, free, start_per_log, rounds: int, **ties) -> Fit:
    return fit(
        kernels_for(study, free, start, start_per_log),
        parts,
        start,
        free,
        per_log=per_log_names(free),
        limits=limits_of(free, study.plant, study.module.SIGNED),
        start_per_log=start_per_log,
        max_step=study.max_step,
        rounds=rounds,
        **ties,
    )


def kernels_for(study: Study, free: Sequence[str], *values: Mapping[str, float] | Sequence[Mapping[str, float]]):
    """The study's kernels, or those of the bare plant, several times faster, where no effect is fitted or given."""
    given = [v for found in values for v in ([found] if isinstance(found, Mapping) else found)]
    named = {n for v in given for n, x in v.items() if "." in n and n in study.module.PARAMETERS
             and x != study.module.ABSENT[study.module.PARAMETERS.index(n)]}  # fmt: skip
    if study.model.effects or named or any("." in n for n in free):
        return study.module
    return kernels.lean(study.model.plant, study.model.assumptions, ())


class Begun(NamedTuple):
    """Where fits to short segments lead."""

    values: dict[str, float]
    per_log: tuple[Mapping[str, float], ...]
    errors: tuple[float, ...]  # of each length


def fit_model(
    study: Study,
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    horizons: Sequence[float] = ALL_LENGTHS,
    start_per_log: Sequence[Mapping[str, float]] = (),
) -> Fit:
    """Fit the free parameters to the training parts, from short to long segments, given as shares of the horizon.

    Where that ends far from the noise, underway or nowhere, the starts from before any fit get their chance too: a
    model that lacks an effect can be bent, on short segments, into one that cannot be simulated over long ones. Where
    it ends underway in the noise or near it, it goes on with fresh states.
    Raises Failure where no start leads to a model that can.
    """
    first = _prepared(study, start, free, horizons[:-1], start_per_log)
    best, begun = _at_length(study, first.values, free, first.per_log, horizons[-1]), [first]
    if best.error < VISIBLE * study.floor:  # in the noise no other start leads further than going on does
        on = best if best.converged else _at_length(study, best.values, free, best.per_log, horizons[-1])
        return min(best, on, key=lambda f: f.cost)
    if horizons[-1] == 1.0 and not best.converged and best.error < FAR * study.floor:
        again = _prepared(study, best.values, free, ALL_LENGTHS[:-1], best.per_log)  # with fresh states
        other = _at_length(study, again.values, free, again.per_log, 1.0)
        best = other if other.cost < best.cost else best
    for number, origin in enumerate(study.origins):
        arrived = best.converged and best.error < FAR * study.floor
        if np.isfinite(best.cost) and (number > 0 or arrived):
            break
        again = _prepared(study, {**start, **origin}, free, horizons[:-1], start_per_log)
        if any(_alike(again, earlier) for earlier in begun):
            continue  # from there it would go the same way again
        begun.append(again)
        other = _at_length(study, again.values, free, again.per_log, horizons[-1])
        best = other if not best.cost <= other.cost else best
    if not np.isfinite(best.cost):
        raise Failure(f"{study.training[0].log.name}: the model must be one that can be simulated over "
                      f"{study.horizon} s, but no start led to one. Check `wheelpend inspect`, or give nominal values "
                      "in [parameters].")  # fmt: skip
    return best


def _prepared(
    study: Study,
    start: Mapping[str, float],
    free: Sequence[str],
    shares: Sequence[float],
    start_per_log: Sequence[Mapping[str, float]],
) -> Begun:
    """Values, and those of each log, after fits to short segments that grow, until one lies in the noise.

    Each length starts from fresh initial states: states fitted to a wrong model can trap the next fit.
    """
    begun = Begun(dict(start), tuple(start_per_log), ())
    for share in shares:
        result = _at_length(study, begun.values, free, begun.per_log, share)
        begun = Begun(result.values, result.per_log, (*begun.errors, result.error))
        if result.converged and result.error < EXPLAINED * study.floor:
            break
    return begun


def _at_length(study: Study, values: Mapping[str, float], free: Sequence[str], own, share: float) -> Fit:
    """Fit to segments that are a share of the horizon long."""
    parts = study.training if share == 1.0 else shortened(study, share * study.horizon)
    return fit_parts(study, parts, values, free, start_per_log=own, rounds=25 if share == 1.0 else 15)


def _alike(one: Begun, other: Begun) -> bool:
    """Whether two ways through short segments ended at the same error, and so in the same place as it seems."""
    same = bool(one.errors) and len(one.errors) == len(other.errors)
    return same and abs(one.errors[-1] - other.errors[-1]) < ALIKE * one.errors[-1]
