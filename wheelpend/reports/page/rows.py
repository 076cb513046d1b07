"""Rows of the page's tables: candidates, parameters, logs."""

from __future__ import annotations

from typing import NamedTuple

import derive
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.explain import Explanation
from wheelpend.diagnosis.missing_force.law_search import FreeLaw
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.page.equations import _term_text
from wheelpend.reports.page.sentences import estimate_text, number_text, small_estimate_text, torque_text, unit_text
from wheelpend.reports.text.unexplained import law_summary_text


class LawTable(NamedTuple):
    """A free-form law as the page shows it."""

    sentence: str
    laws: list[tuple[str, str, str]]  # effect, where it acts, law
    numbers: list[tuple[str, str, str]]  # effect.parameter, value with standard error, unit


def law_table(law: FreeLaw) -> LawTable:
    """Texts of a free-form law."""
    laws = [(effect, law.on[effect], _term_text(text.replace("^", "**"))) for effect, text in law.laws.items()]
    numbers = [(n, small_estimate_text(v, law.sigma[n]), unit_text(law.unit[n])) for n, v in law.coefficients.items()]
    return LawTable(law_summary_text(law), laws, numbers)


class CandidateRow(NamedTuple):
    """A candidate as the table shows it."""

    tried: CandidateFit
    sentence: str
    means: str
    law: str
    sizes: list[str]


def candidate_row(tried: CandidateFit, q: PlantUnits) -> CandidateRow:
    """Texts of a candidate."""
    effect = derive.effects.find(tried.effect)
    sizes = []
    for name, value in tried.coefficients.items():
        unit = tried.unit[name]
        torque = torque_text(value, unit, q)
        text = f"{name} = {estimate_text(value, tried.sigma[name])} {unit_text(unit)}"
        sizes.append(text.rstrip() + (f" ({torque})" if torque else ""))
        further = [o for o in tried.per_log[1:] if name in o.coefficients]
        sizes += [f"… in {o.log}: {estimate_text(o.coefficients[name], o.sigma[name])}" for o in further]
    return CandidateRow(tried, effect.sentence, effect.means, effect.equation, sizes)


def detectable_size_rows(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """The smallest size of each effect that the logs would have shown."""
    rows = []
    for effect, sizes in diagnosis.detectable.items():
        units = {p.name: unit_text(p.unit) for p in diagnosis.problem.effect(effect).parameters}
        rows.append(
            (effect, ", ".join(f"{n} {number_text(v, 2)} {units.get(n, '')}".rstrip() for n, v in sizes.items()))
        )
    return rows


class ParameterRow(NamedTuple):
    """A base parameter through the ladder."""

    name: str
    nominal: float | None
    first: float
    steps: list[tuple[float, float | None]]  # value, change from the first in %
    final: str


def parameter_rows(explanation: Explanation) -> list[ParameterRow]:
    """How each base parameter moved."""
    rows = []
    for name in explanation.problem.base:
        given, first = explanation.model.parameters.get(name), explanation.first.fit.values[name]
        values = [s.parameters[name] for s in explanation.steps if name in s.parameters]
        steps = [(v, 100.0 * (v / first - 1.0) if first else None) for v in values]
        final = explanation.parameters.get(name, {"value": first, "sigma": None})
        row = estimate_text(final["value"], final["sigma"])
        rows.append(ParameterRow(name, given.nominal if given else None, first, steps, row))
    return rows


class LogRow(NamedTuple):
    """A log as the provenance shows it."""

    name: str
    role: str
    samples: int
    duration: float  # s
    reference: bool
    sigma: list[tuple[str, str]]  # channel, standard deviation with unit
    floor: float


def log_rows(problem: EstimationProblem) -> list[LogRow]:
    """Training logs, then hold-out logs."""
    own = {h.training for h in problem.validation}
    logs = [(log, "fit; last third held out" if k in own else "fit") for k, log in enumerate(problem.logs)]
    logs += [(h.part.log, "held out") for h in problem.validation if h.training is None]
    rows, units = [], plant_units_of(problem.model)
    for (log, role), noise in zip(logs, problem.noise, strict=False):
        sigma = [(c, f"{number_text(s, 3)} {units.unit(c)}") for c, s in zip(log.channels, noise.sigma, strict=True)]
        seconds = float(log.t[-1] - log.t[0])
        rows.append(LogRow(log.name, role, len(log.t), seconds, log.reference is not None, sigma, noise.floor))
    return rows
