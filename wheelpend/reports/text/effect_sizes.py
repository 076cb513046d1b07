"""Sizes of effects: coefficients with standard errors, as torques and as shares of the drive input."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from derive.parameter_name import full_name
from wheelpend.estimation.estimate import Estimate, LogValue
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.numbers import (
    digits_text,
    estimate_text,
    physical_text,
    quantity_text,
    typeset_estimate_text,
    typeset_number_text,
    typeset_physical_text,
    unit_text,
)

if TYPE_CHECKING:
    from wheelpend.diagnosis.evidence import CandidateFit
    from wheelpend.diagnosis.explain import Ladder, Step
    from wheelpend.diagnosis.verdict import Diagnosis
    from wheelpend.estimation.problem import EstimationProblem
    from wheelpend.model.record import Model


def rms_input(problem: EstimationProblem) -> float:
    """Root mean square of the input of the training logs [its unit]; 0 where nothing drives the machine."""
    voltage = np.concatenate([log.voltage[np.isfinite(log.voltage)] for log in problem.logs])
    return float(np.sqrt(np.mean(voltage**2))) if voltage.size else 0.0


# ---- for the terminal


def effect_size_text(found: CandidateFit | Step, model: Model, drive_v: float | None = None) -> str:
    """Coefficients of an effect, in N m or N too where a volt's worth is known, and as a share of the drive input."""
    quantities = plant_units_of(model)
    return "; ".join(_coefficient_text(n, e, quantities, drive_v) for n, e in found.estimates.items())


def _coefficient_text(name: str, found: Estimate, quantities: PlantUnits, drive_v: float | None) -> str:
    value, unit = found.value, found.unit
    text = f"{name} {estimate_text(value, found.sigma, unit)}"
    if physical := physical_text(value, unit, quantities, 4):
        text += f" = {physical}"
    if drive_v and unit == quantities.force:
        text += f", {100 * abs(value) / drive_v:.1f} % of the rms drive {quantities.input_word}"
    return text


def moved_size_text(step: Step, explanation: Ladder) -> str:
    """Coefficients of an effect in the final fit, where it moved them by a standard error from what a step found."""
    moved = []
    for name, first in step.estimates.items():
        final = explanation.parameters.get(full_name(step.effect, name), first)
        if not final.per_log and abs(final.value - first.value) > first.sigma:
            moved.append(f"{name} {estimate_text(final.value, final.sigma, final.unit)}")
    return f"In the final fit: {'; '.join(moved)}." if moved else ""


def log_size_lines(found: CandidateFit | Step) -> Iterator[str]:
    """Sizes of an effect in each of several logs, where they have their own."""
    for own in found.per_log:
        sizes = ", ".join(f"{n} {estimate_text(v, own.sigma[n], found.unit[n])}" for n, v in own.coefficients.items())
        yield f"  {found.effect} in {own.log}: {sizes}"


def detectable_rows(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Smallest detectable size of each effect, with its units."""
    rows = []
    for effect, sizes in diagnosis.detectable.items():
        units = {p.name: p.unit for p in diagnosis.problem.effect(effect).parameters}
        rows.append((effect, ", ".join(f"{n} {quantity_text(v, units.get(n, ''), 2)}" for n, v in sizes.items())))
    return rows


# ---- for the page


def step_size_text(step: Step, explanation: Ladder, quantities: PlantUnits) -> str:
    """Coefficients of an added effect as the final model has them."""
    drive_v = rms_input(explanation.problem) if explanation.problem.module.INPUT else 0.0
    return ", ".join(
        _final_coefficient_text(n, explanation.parameters.get(full_name(step.effect, n), e), quantities, drive_v)
        for n, e in step.estimates.items()
    )


def _final_coefficient_text(name: str, final: Estimate, quantities: PlantUnits, drive_v: float) -> str:
    value, unit = final.value, final.unit
    if final.per_log:
        return f"{name} {per_log_text(final.per_log, unit)}"
    text = f"{name} {_with_unit(final)}".rstrip()
    share = (
        f"{digits_text(100 * abs(value) / drive_v, 3)} % of the rms drive {quantities.input_word}" if drive_v else ""
    )
    beside = [typeset_physical_text(value, unit, quantities), share if unit == quantities.force else ""]
    return text + _in_brackets(beside)


def per_log_text(rows: Iterable[LogValue], unit: str) -> str:
    """A parameter that several logs have each for themselves."""
    return ", ".join(f"{typeset_estimate_text(r.value, r.sigma)} {unit_text(unit)} in {r.log}" for r in rows)


def candidate_size_lines(candidate: CandidateFit, quantities: PlantUnits) -> list[str]:
    """Coefficients of a candidate, each followed by those of the further logs."""
    lines = []
    for name, found in candidate.estimates.items():
        text = f"{name} = {_with_unit(found)}".rstrip()
        lines.append(text + _in_brackets([typeset_physical_text(found.value, found.unit, quantities)]))
        further = [o for o in candidate.per_log[1:] if name in o.coefficients]
        lines += [f"… in {o.log}: {typeset_estimate_text(o.coefficients[name], o.sigma[name])}" for o in further]
    return lines


def typeset_detectable_rows(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Smallest detectable size of each effect, with its units."""
    rows = []
    for effect, sizes in diagnosis.detectable.items():
        units = {p.name: unit_text(p.unit) for p in diagnosis.problem.effect(effect).parameters}
        texts = (f"{n} {typeset_number_text(v, 2)} {units.get(n, '')}".rstrip() for n, v in sizes.items())
        rows.append((effect, ", ".join(texts)))
    return rows


def _with_unit(found: Estimate) -> str:
    return f"{typeset_estimate_text(found.value, found.sigma)} {unit_text(found.unit)}"


def _in_brackets(texts: Iterable[str]) -> str:
    known = [t for t in texts if t]
    return f" ({', '.join(known)})" if known else ""
