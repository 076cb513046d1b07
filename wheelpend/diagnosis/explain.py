"""Diagnose and add in turn until nothing is missing; and the single steps, add and remove."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wheelpend.diagnosis.evidence import OfLog, Tried
from wheelpend.diagnosis.missing_force.repeatability import Repeats
from wheelpend.diagnosis.stepwise import MOST_EFFECTS, climb
from wheelpend.diagnosis.verdict import Diagnosis, located, settled, with_law
from wheelpend.estimation.criteria import EXPLAINED
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameter_table import parameter_table
from wheelpend.estimation.problem import Study
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import held_residuals
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


@dataclass(frozen=True)
class Step:
    """One effect added, and what it did to the held-out error."""

    effect: str
    coefficients: dict[str, float]
    sigma: dict[str, float]
    unit: dict[str, str]
    p_value: float | None
    equivalent_to: tuple[str, ...]
    error_before: float
    error_after: float
    parameters: dict[str, float] = field(default_factory=dict)  # base parameters after the step
    per_log: tuple[OfLog, ...] = ()  # of several logs, where the effect has a size in each
    blocks_agree: str | None = None


@dataclass(frozen=True)
class Explanation:
    """The error ladder of a model on its logs."""

    verdict: str
    nominal_error: float | None
    base_error: float
    steps: tuple[Step, ...]
    effects: tuple[str, ...]
    error: float
    noise_floor: float
    horizon_s: float
    parameters: dict[str, dict]
    experiment: str | None
    warnings: tuple[str, ...]
    model: Model = field(repr=False)  # with the effects and the fitted values
    first: Diagnosis = field(repr=False)
    last: Diagnosis = field(repr=False)
    fit: Fit = field(repr=False)
    study: Study = field(repr=False)
    repeats: tuple[Repeats, ...] = ()  # of what is still unexplained: on what it depends, and how much repeats
    law: FreeLaw | None = None  # for it, on request


def explain(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    max_effects: int = MOST_EFFECTS,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Explanation:
    """Add effects, the best first, until nothing is missing or max_effects were added. Writes no files.

    Effects named in ``without`` are not tried. With ``law`` a free-form law is fitted to what no effect explains.
    """
    study = prepare(model, logs, holdout, without=without)
    nominal = nominal_error(study)
    progress("finding a start")
    study, start = best_start(study)
    rounds = climb(study, start, lambda found: len(found) > max_effects, progress)
    steps = [step_of(r.study, r.named[0], r.error) for r in rounds[:-1]]
    first, last = rounds[0], rounds[-1]
    study = last.study
    first, diagnosis = settled(first, last), located(settled(last, last), progress=progress)
    if law:
        diagnosis = with_law(diagnosis, progress=progress)
    return Explanation(
        verdict=overall(steps, diagnosis),
        nominal_error=nominal,
        base_error=first.error,
        steps=tuple(steps),
        effects=study.model.effects,
        error=diagnosis.error,
        noise_floor=study.floor,
        horizon_s=study.horizon,
        parameters=parameter_table(study, diagnosis.fit),
        experiment=first.experiment or diagnosis.experiment,
        warnings=study.warnings,
        repeats=diagnosis.repeats,
        law=diagnosis.law,
        model=fitted_model(study, diagnosis.fit),
        first=first,
        last=diagnosis,
        fit=diagnosis.fit,
        study=study,
    )


def overall(steps: Sequence[Step], last: Diagnosis) -> str:
    """Verdict of a ladder: unexplained if the last diagnosis says so, else ambiguous if any step was.

    A ladder that had to end before the rest was added leaves that rest unexplained.
    """
    if last.verdict == "unexplained" or last.error > EXPLAINED * last.noise_floor:
        return "unexplained"
    return "ambiguous" if any(s.equivalent_to for s in steps) else "nothing_missing"


def nominal_error(study: Study) -> float | None:
    """Held-out error with the model's nominal values, before any fit; null without them, or where it diverges."""
    values = {n: v.nominal for n, v in study.model.parameters.items() if v.nominal is not None}
    if any(n not in values for n in study.base):
        return None
    known = {**known_values(study.model), **values}
    fixed = Fit(
        known, tuple({} for _ in study.training), (), np.zeros((0, 0)), np.zeros((0, 0)), (), 0.0, 0, 1.0, (), True
    )
    error, _ = held_residuals(study, fixed)
    return error if np.isfinite(error) else None


def step_of(study: Study, tried: Tried, before: float) -> Step:
    """A ladder's step from a refitted candidate."""
    return Step(
        tried.effect, tried.coefficients, tried.sigma, tried.unit, tried.p_value, tried.equivalent_to,
        before, tried.error_after, {n: tried.fit.values[n] for n in study.base}, tried.per_log, tried.blocks_agree,
    )  # fmt: skip


def fitted_model(study: Study, fitted: Fit) -> Model:
    """The model with fitted values."""
    table = parameter_table(study, fitted)
    return study.model.with_fit({n: (row["value"], row["sigma"]) for n, row in table.items()})
