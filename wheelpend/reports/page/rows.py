"""Rows of the page's tables: candidates, laws, parameters, logs."""

from __future__ import annotations

import re
from typing import NamedTuple

import sympy as sp

import derive
from derive.base_equations import base_parameters
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.explain import Ladder
from wheelpend.diagnosis.missing_force.law_search import FreeLaw
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.numbers import small_estimate_text, typeset_estimate_text, typeset_number_text, unit_text
from wheelpend.reports.page.equations import term_text
from wheelpend.reports.text.effect_sizes import candidate_size_lines
from wheelpend.reports.text.unexplained import law_parts, law_summary_text

DAMPING_UNIT = re.compile(r"(^| )s(/|$| )")  # seconds in the unit of a parameter


class LawTable(NamedTuple):
    """A free-form law as the page shows it."""

    sentence: str
    laws: list[tuple[str, str, str]]  # effect, port, law
    numbers: list[tuple[str, str, str]]  # effect.parameter, value with standard error, unit
    force: str  # unit of the input, in which the laws are


def law_table(law: FreeLaw) -> LawTable:
    """Texts of a free-form law."""
    laws = [(part.effect, part.port, term_text(part.text.replace("^", "**"))) for part in law_parts(law)]
    numbers = [(n, small_estimate_text(v, law.sigma[n]), unit_text(law.unit[n])) for n, v in law.coefficients.items()]
    return LawTable(law_summary_text(law), laws, numbers, unit_text(law.problem.plant.input_unit))


class CandidateRow(NamedTuple):
    """A candidate as the table shows it."""

    candidate: CandidateFit
    sentence: str
    means: str
    law: str
    sizes: list[str]


def candidate_row(candidate: CandidateFit, quantities: PlantUnits, plant: PlantSignature) -> CandidateRow:
    """Texts of a candidate."""
    effect = derive.effects.in_plant_units(derive.effects.find(candidate.effect), plant)
    sizes = candidate_size_lines(candidate, quantities)
    return CandidateRow(candidate, effect.sentence, effect.means, effect.equation, sizes)


class ParameterRow(NamedTuple):
    """A base parameter through the ladder."""

    name: str
    nominal: float | None
    first: float
    steps: list[tuple[float, float | None]]  # value, change from the first in %
    final: str
    unit: str
    meaning: str


def parameter_rows(explanation: Ladder) -> list[ParameterRow]:
    """Values of each base parameter: nominal, of the first fit, after every step, final."""
    rows, meanings = [], parameter_meanings(explanation.model)
    for name in explanation.problem.base:
        given, first = explanation.model.parameters.get(name), explanation.first.fit.values[name]
        values = [s.parameters[name] for s in explanation.steps if name in s.parameters]
        steps = [(v, 100.0 * (v / first - 1.0) if first else None) for v in values]
        final = explanation.parameters.get(name)
        row = typeset_estimate_text(final.value, final.sigma) if final else typeset_estimate_text(first, None)
        rows.append(
            ParameterRow(name, given.nominal if given else None, first, steps, row, *meanings.get(name, ("", "")))
        )
    return rows


def parameter_meanings(given: Model) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each of a model's base parameters: what kind it is, and what it is made of."""
    model = derive.compose(given.plant, given.assumptions, given.effects)
    found = base_parameters(model.plant, model.grouping)
    definitions = [term_text(str(sp.together(d))) for d in model.grouping.definitions]
    signature = model.plant.plant_signature
    damping = "damping and back-EMF" if signature.driven and signature.input_unit == "V" else "damping"
    kinds = [_kind(p.unit, damping) for p in found]
    return {
        p.name: (unit_text(p.unit), f"{kind}: {text}") for p, kind, text in zip(found, kinds, definitions, strict=True)
    }


def _kind(unit: str, damping: str) -> str:
    """The kind of a base parameter, told by the seconds in its unit beside that of a force."""
    if "s²" in unit:
        return "inertia"
    return damping if DAMPING_UNIT.search(unit) else "weight"


class LogRow(NamedTuple):
    """A log as the provenance shows it."""

    name: str
    role: str
    samples: int
    duration: float  # s
    reference: bool
    sigma: list[tuple[str, str]]  # channel, standard deviation with unit
    floor: float  # σ, noise floor


def log_rows(problem: EstimationProblem) -> list[LogRow]:
    """Training logs, then hold-out logs."""
    split = {v.estimation_log: v for v in problem.data.validation if v.estimation_log is not None}
    logs = [(log, _split_text(log, split[k].part) if k in split else "fit") for k, log in enumerate(problem.logs)]
    logs += [(v.part.log, "held out") for v in problem.data.validation if v.estimation_log is None]
    rows, units = [], plant_units_of(problem.model)
    for (log, role), noise in zip(logs, problem.noise, strict=False):
        sigma = [
            (c, f"{typeset_number_text(s, 3)} {units.unit(c)}")
            for c, s in zip(log.channels, noise.sigma, strict=True)
        ]  # fmt: skip
        rows.append(LogRow(log.name, role, log.samples, log.duration, log.reference is not None, sigma, noise.floor))
    return rows


def _split_text(log: Log, held: Segments) -> str:
    """What of a log is held out of the fit."""
    begin = float(held.log.t[int(held.bounds[0, 0])] - log.t[log.lead])
    return f"fit; held out from {begin:.3g} s on"
