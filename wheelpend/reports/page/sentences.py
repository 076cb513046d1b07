"""Sentences and numbers of the page."""

from __future__ import annotations

import numpy as np

import derive
from wheelpend.diagnosis.explain import Explanation, Step
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.model.units import PlantUnits
from wheelpend.reports.page import style as figures

SUPERSCRIPT_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def verdict_text(explanation: Explanation) -> str:
    """The verdict as people say it."""
    more = "more " if explanation.steps else ""
    known = {"nothing_missing": f"nothing {more}is missing", "unexplained": "something is unexplained"}
    return known.get(explanation.verdict, explanation.verdict)


def headline_sentences(explanation: Explanation, q: PlantUnits) -> list[str]:
    """What is missing, how large it is, and what adding it did to the held-out error."""
    lines = [effect_size_text(step, explanation, q) for step in explanation.steps]
    before, after, floor = map(error_text, (explanation.base_error, explanation.error, explanation.noise_floor))
    kind = "held-out" if explanation.problem.validation else "training"
    if not explanation.steps:
        return [f"With its own parameters refitted, the model has a {kind} error of {before} "
                f"(noise floor {floor}); no effect of the library is worth adding."]  # fmt: skip
    return [*lines, f"The {kind} error falls from {before} to {after}; "
                    f"the noise floor is {floor}."]  # fmt: skip


def effect_size_text(step: Step, explanation: Explanation, q: PlantUnits) -> str:
    """An effect with its sentence and the sizes of its coefficients in the final model."""
    sizes = []
    for name, unit in step.unit.items():
        own = {"value": step.coefficients[name], "sigma": step.sigma[name]}
        value, sigma = (explanation.parameters.get(f"{step.effect}.{name}", own)[k] for k in ("value", "sigma"))
        text = f"{name} {estimate_text(value, sigma)} {unit_text(unit)}".rstrip()
        own = explanation.parameters.get(f"{step.effect}.{name}", {}).get("per_log", [])
        text = f"{name} {per_log_text(own, unit)}" if own else text
        extra = [torque_text(value, unit, q)] if torque_text(value, unit, q) else []
        if unit == q.force and explanation.problem.module.INPUT:
            extra.append(f"{100 * abs(value) / rms_voltage(explanation.problem):.3g} % of the rms drive voltage")
        sizes.append(text + (f" ({', '.join(extra)})" if extra else ""))
    return f"{derive.effects.find(step.effect).sentence.rstrip('.')} ({step.effect}): {', '.join(sizes)}."


def per_log_text(rows: list[dict], unit: str) -> str:
    """A parameter that several logs have each for themselves."""
    return ", ".join(f"{estimate_text(r['value'], r['sigma'])} {unit_text(unit)} in {r['log']}" for r in rows)


def torque_text(value: float, unit: str, q: PlantUnits) -> str:
    """A force in V as a torque, or nothing where it is not a force or the volt's worth is unknown."""
    found = q.in_physical(value, unit)
    return f"{number_text(found[0], 3)} {unit_text(found[1])}" if found else ""


def rms_voltage(problem: EstimationProblem) -> float:
    """Root mean square of the commanded voltage over the training logs."""
    voltage = np.concatenate([log.voltage[np.isfinite(log.voltage)] for log in problem.logs])
    return float(np.sqrt(np.mean(voltage**2))) if voltage.size and np.any(voltage) else float("nan")


def ambiguity_sentences(explanation: Explanation) -> list[str]:
    """What these data cannot tell apart."""
    return [
        f"These data cannot tell {s.effect} from {', '.join(s.equivalent_to)}."
        for s in explanation.steps
        if s.equivalent_to
    ]


def concentration_sentences(diagnosis: Diagnosis, q: PlantUnits) -> list[str]:
    """Where the missing force is concentrated, as sentences."""
    return [
        f"{100 * p.share:.0f} % of what the {p.row} row misses lies where {figures.axis_name_text(p.state)} is between "
        f"{number_text(p.low, 3)} and {number_text(p.high, 3)} {q.unit(p.state)}."
        for p in diagnosis.where
    ]


def small_estimate_text(value: float, sigma: float) -> str:
    """Value ± standard error; small ones in powers of ten."""
    return estimate_text(value, sigma) if abs(value) >= 1e-3 else f"{number_text(value, 5)} ± {number_text(sigma, 2)}"


def number_text(value: float | None, digits: int = 4) -> str:
    """A number in few digits, or a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    if abs(value) >= 10**digits and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", "−")
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return (mantissa + (f"×10{str(int(power)).translate(SUPERSCRIPT_DIGITS)}" if power else "")).replace("-", "−")


def error_text(value: float | None, digits: int = 4) -> str:
    """An error with all its digits, so that 1.00 is not 1."""
    if value is None or not np.isfinite(value) or abs(value) >= 10**digits:
        return number_text(value, digits)
    return f"{value:#.{digits}g}".rstrip(".")


def estimate_text(value: float | None, sigma: float | None) -> str:
    """Value ± standard error, to two digits of the latter."""
    if value is None or sigma is None or not np.isfinite(sigma) or sigma <= 0 or not np.isfinite(value):
        return number_text(value)
    decimals = int(np.clip(1 - np.floor(np.log10(sigma)), 0, 9))
    if decimals == 9 or abs(value) >= 1e5:
        return f"{number_text(value)} ± {number_text(sigma, 2)}"
    return f"{value:.{decimals}f} ± {sigma:.{decimals}f}".replace("-", "−")


def p_value_text(p: float | None) -> str:
    """A p-value; very small ones only as a bound."""
    if p is None:
        return "–"
    return "< 10⁻¹²" if p < 1e-12 else number_text(p, 1)


def unit_text(unit: str) -> str:
    """A unit as people read it; nothing for a plain number."""
    return "" if unit == "1" else unit.replace(" s", "·s")
