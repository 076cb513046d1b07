"""A free-form law for what no effect explains: a sparse sum of dimensioned terms, fitted through the shooting problem.

Terms are chosen on the linearised problem; then kernels with the law are compiled and everything is refitted, and a
term stays only if it lowers the validation error. The search goes on from there, because beside a law that is nearly
right the next term shows more clearly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from derive.parameter_name import full_name
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.criteria import (
    MAX_EVALUATED_COST_RATIO,
    MIDDLE_HORIZON_SHARE,
    MIN_RELATIVE_ERROR_DECREASE,
    SHORT_HORIZON_SHARE,
)
from wheelpend.diagnosis.evidence import block_agreement
from wheelpend.diagnosis.missing_force.law_effects import LawEffect, effects_from_terms, full_parameter_names, register
from wheelpend.diagnosis.missing_force.law_terms import Term, term_library
from wheelpend.diagnosis.missing_force.piecewise_force import LinearisedLogs, linearise_at, linearise_logs
from wheelpend.diagnosis.missing_force.term_selection import LawStart, column_name, range_in_logs, search_laws
from wheelpend.diagnosis.refit import Progress
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.parameter_table import conservative_standard_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.validation import validation_residuals
from wheelpend.kernels.load import free_force_module

DEFAULT_LAW_NAME = "free_law"  # until the user gives it another
SEARCH_LAW_NAME = "law_in_search"  # name of its effects while terms come and go
MAX_LAW_TERMS = 4  # terms of a law
MAX_SEARCH_ROUNDS = 4  # of choosing and refitting
MAX_REFITTED_LAWS = 3  # laws that are fitted on full segments and judged
MIN_FIRST_TERM_GAIN_SHARE = 0.2  # share of the excess over the noise that a term must explain, at a wrong model
MIN_FURTHER_TERM_GAIN_SHARE = 0.05  # the same beside a law
MAX_SOLVED_LAW_ERROR_RATIO = 1.01  # error over noise floor from which on nothing more is looked for


@dataclass(frozen=True)
class FreeLaw:
    """A law for what is missing, as effects of one's own."""

    laws: dict[str, str]  # law of each effect [V], a resistance at the place where it acts
    on: dict[str, str]  # that place
    coefficients: dict[str, float]  # by effect.parameter; those of one log alone for the first log
    sigma: dict[str, float]
    unit: dict[str, str]
    error_before: float  # on validation data [σ]
    error_after: float
    noise_floor: float
    blocks_agree: str
    explains: float  # share of the validation sum of squares above the noise that it takes away
    tried: int  # terms that were tried
    effects: tuple[LawEffect, ...] = field(repr=False)
    fit: Fit = field(repr=False)
    problem: EstimationProblem = field(repr=False)

    def to_json(self) -> dict[str, Any]:
        """The law under the keys of JSON."""
        return {
            "laws": self.laws,
            "on": self.on,
            "coefficients": self.coefficients,
            "sigma": self.sigma,
            "unit": self.unit,
            "error_before": self.error_before,
            "error_after": self.error_after,
            "noise_floor": self.noise_floor,
            "blocks_agree": self.blocks_agree,
            "explains": self.explains,
            "tried": self.tried,
        }

    def with_name(self, name: str) -> FreeLaw:
        """The law under another name."""
        old = DEFAULT_LAW_NAME

        def new(full: str) -> str:
            return name + full[len(old) :]

        return replace(
            self,
            laws={new(e): law for e, law in self.laws.items()},
            on={new(e): port for e, port in self.on.items()},
            coefficients={new(n): v for n, v in self.coefficients.items()},
            sigma={new(n): v for n, v in self.sigma.items()},
            unit={new(n): u for n, u in self.unit.items()},
            effects=tuple(e._replace(name=new(e.name)) for e in self.effects),
        )

    def tables(self) -> dict[str, dict]:
        """The law as tables of effects.toml."""
        return {e.name: e.table(self.coefficients) for e in self.effects}


class FittedLaw(NamedTuple):
    """Terms, by their number among all that were tried, with a fit of the model that has them."""

    terms: dict[int, Term]
    problem: EstimationProblem  # with the kernels of the law
    fit: Fit
    names: dict[tuple[int, str], str]  # full name in the fit of each number in each term
    error: float  # on validation data [σ]

    @property
    def free(self) -> list[str]:
        """Names of the fitted parameters."""
        return self.fit.names

    @property
    def is_search_done(self) -> bool:
        """Nothing is left to look for."""
        return self.error < MAX_SOLVED_LAW_ERROR_RATIO * self.problem.floor or len(self.terms) >= MAX_LAW_TERMS


def find_law(problem: EstimationProblem, base: Fit, *, progress: Progress = lambda text: None) -> FreeLaw | None:
    """The law that explains most of what a fitted model misses; None where no term is worth having."""
    plant = problem.plant
    law = FittedLaw({}, problem, base, {}, validation_residuals(problem, base)[0])
    progress("looking for the terms of a law")
    linearisations, min_gain_share = linearise_logs(problem, base), MIN_FIRST_TERM_GAIN_SHARE
    candidates = dict(enumerate(term_library(plant, range_in_logs(linearisations[0], plant)), 1))
    for _ in range(MAX_SEARCH_ROUNDS):
        fresh = [t for n, t in candidates.items() if n not in law.terms]
        starts = search_laws(linearisations, fresh, MAX_LAW_TERMS, plant, min_gain_share)
        if not starts:
            break
        progress(f"compiling and fitting {len(starts)} laws")
        trial = best_extension(law, candidates, starts, plant)
        if not trial.error < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * law.error:
            break
        law = trial
        progress(f"held-out error {law.error:.4g} with {len(law.terms)} terms")
        if law.is_search_done:
            break
        linearisations, min_gain_share = [linearise_at_law(law)], MIN_FURTHER_TERM_GAIN_SHARE
    return free_law_of(problem, base, law, len(candidates)) if law.terms else None


def linearise_at_law(law: FittedLaw) -> LinearisedLogs:
    """The training logs linearised at a fit with a law, on short segments."""
    short = fit_model(
        law.problem, law.fit.values, law.free, horizons=(SHORT_HORIZON_SHARE,), start_per_log=law.fit.per_log
    )
    return linearise_at(law.problem, short, shortened_segments(law.problem, SHORT_HORIZON_SHARE * law.problem.horizon))


def best_extension(
    law: FittedLaw, candidates: dict[int, Term], starts: Sequence[LawStart], plant: PlantSignature
) -> FittedLaw:
    """The best of the laws that a law becomes with the terms of each start, without terms that do not pay.

    All are fitted with the same kernels, on short segments first.
    """
    chosen_terms = {t for s in starts for t in s.terms}
    numbers = {n: t for n, t in candidates.items() if n in law.terms or t in chosen_terms}
    effects = effects_from_terms(numbers, SEARCH_LAW_NAME)
    names = full_parameter_names(effects)
    added = register(effects, {}, plant)
    model = law.problem.model
    problem = replace(law.problem, module=free_force_module(model.plant, model.assumptions, (*model.effects, *added)))
    partial_fits = [fit_extension(problem, law, numbers, names, start) for start in starts]
    partial_fits.sort(key=lambda pair: pair[1].cost)
    bound = MAX_EVALUATED_COST_RATIO * partial_fits[0][1].cost
    promising = [(chosen, f) for chosen, f in partial_fits if f.cost < bound][:MAX_REFITTED_LAWS]
    laws = [prune_terms(fit_full_segments(problem, chosen, names, f)) for chosen, f in promising]
    lowest = min(x.error for x in laws)
    return min((x for x in laws if x.error * (1.0 - MIN_RELATIVE_ERROR_DECREASE) <= lowest), key=lambda x: len(x.names))


def fit_extension(
    problem: EstimationProblem, law: FittedLaw, numbers: dict[int, Term], names: dict, start: LawStart
) -> tuple[dict, Fit]:
    """Terms of a law and a start, and a fit of them on short segments from where the linearised problem puts it."""
    chosen = {n: t for n, t in numbers.items() if n in law.terms or t in start.terms}
    values = [start_values(law, chosen, names, start, log) for log in range(len(start.values))]
    present = [n for n in law.free if n not in law.names.values()]
    free = [*present, *(full for (n, _), full in names.items() if n in chosen)]
    own = per_log_names(free)
    per_log = [{n: v[n] for n in own} for v in values]
    log_segments = shortened_segments(problem, SHORT_HORIZON_SHARE * problem.horizon)
    starts = (values[0], {**values[0], **{n: v for n, v in law.fit.values.items() if n in present}})
    fits = [fit_segments(problem, log_segments, {**law.fit.values, **p}, free, start_per_log=per_log) for p in starts]
    return chosen, min(fits, key=lambda f: f.cost)


def fit_full_segments(
    problem: EstimationProblem, chosen: dict[int, Term], names: dict[tuple[int, str], str], start: Fit
) -> FittedLaw:
    """A law fitted on full segments and validated."""
    free = start.names
    fitted = fit_model(problem, start.values, free, horizons=(MIDDLE_HORIZON_SHARE, 1.0), start_per_log=start.per_log)
    own = {place: full for place, full in names.items() if place[0] in chosen}
    return FittedLaw(chosen, problem, fitted, own, validation_residuals(problem, fitted)[0])


def start_values(
    law: FittedLaw, numbers: dict[int, Term], names: dict[tuple[int, str], str], start: LawStart, log: int
) -> dict[str, float]:
    """Start of a refit for one log: the linearised solution, and for shapes the values that were tried."""
    values = {n: v for n, v in start.values[log].items() if n not in law.names.values()}
    for number, term in numbers.items():
        shapes = {s.name: s.value for s in term.shapes}
        for local in (*(s for s, _ in term.sizes), *shapes):
            if number in law.terms:
                found = start.values[log][law.names[number, local]]
            else:
                found = shapes[local] if local in shapes else start.sizes[log][column_name(term, local)]
            values[names[number, local]] = found
    return values


def prune_terms(law: FittedLaw) -> FittedLaw:
    """A law without the terms that do not lower the validation error by enough, the least useful gone first."""
    while len(law.terms) > 1:
        smaller = without_weakest_term(law)
        if law.error < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * smaller.error and len(law.terms) <= MAX_LAW_TERMS:
            break
        law = smaller
    return law


def without_weakest_term(law: FittedLaw) -> FittedLaw:
    """A law refitted without the term that it needs least."""
    return min((without_term(law, number) for number in law.terms), key=lambda x: x.error)


def without_term(law: FittedLaw, number: int) -> FittedLaw:
    """A law refitted with one term less."""
    removed = {full for (n, _), full in law.names.items() if n == number}
    sizes = {law.names[number, size] for size, _ in law.terms[number].sizes}
    free = [n for n in law.free if n not in removed]
    values = {**law.fit.values, **dict.fromkeys(sizes, 0.0)}
    per_log = [{n: v for n, v in values_of_log.items() if n not in removed} for values_of_log in law.fit.per_log]
    fitted = fit_model(law.problem, values, free, start_per_log=per_log)
    terms_left = {n: t for n, t in law.terms.items() if n != number}
    names = {place: full for place, full in law.names.items() if place[0] != number}
    return FittedLaw(terms_left, law.problem, fitted, names, validation_residuals(law.problem, fitted)[0])


def free_law_of(problem: EstimationProblem, base: Fit, law: FittedLaw, term_count: int) -> FreeLaw:
    """The law with terms numbered from 1, and the validation error before and after."""
    error_before, residuals_before = validation_residuals(problem, base)
    error_after, residuals_after = validation_residuals(law.problem, law.fit)
    effects = effects_from_terms(dict(enumerate(law.terms.values(), 1)), DEFAULT_LAW_NAME)
    order = {number: k for k, number in enumerate(law.terms, 1)}
    renamed = {full: full_parameter_names(effects)[order[n], local] for (n, local), full in law.names.items()}
    units = {full_name(e.name, p): given["unit"] for e in effects for p, given in e.parameters.items()}
    excess = max(error_before**2 - problem.floor**2, 1e-12)
    return FreeLaw(
        laws={e.name: e.law for e in effects},
        on={e.name: e.on for e in effects},
        coefficients={new_name: law.fit.of_log(0)[full] for full, new_name in renamed.items()},
        sigma={new_name: conservative_standard_error(law.fit, full) for full, new_name in renamed.items()},
        unit={n: units[n] for n in renamed.values()},
        error_before=error_before,
        error_after=error_after,
        noise_floor=problem.floor,
        blocks_agree=block_agreement(residuals_before, residuals_after),
        explains=float(np.clip(1.0 - (error_after**2 - problem.floor**2) / excess, 0.0, 1.0)),
        tried=term_count,
        effects=effects,
        fit=law.fit,
        problem=law.problem,
    )
