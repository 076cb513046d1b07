"""Case study of the measured machine axis (EMPS), from mass and offset to direction-dependent friction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import derive
from wheelpend.api import explain
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.drawing import (
    FORCE_PER_VOLT_N,
    Rung,
    draw_bursts,
    draw_force,
    draw_force_ladder,
)
from wheelpend.benchmarks.measured.rungs import steps_table
from wheelpend.diagnosis.compare import Comparison, compare
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import read_logs
from wheelpend.identification.identify import identify
from wheelpend.identification.inverse_dynamics import force_error
from wheelpend.kernels.load import model_module
from wheelpend.model.record import Model
from wheelpend.reports.text.verdict import repeating_text

PAGE_TEMPLATE_PATH = Path(__file__).with_name("emps.md")
ESTIMATION_LOG, PULSES_LOG = "emps/DATA_EMPS.mat", "emps/DATA_EMPS_PULSES.mat"
BALANCING_LOG = "mini_segway/balancing.csv"
PUBLISHED_EFFECTS = ("voltage_offset", "viscous_drive", "coulomb_drive")
PUBLISHED_FORCE_VALUES = {"X1": 95.1089, "viscous_drive.coefficient": 203.5034, "coulomb_drive.torque": 20.3935,
             "voltage_offset.offset": 3.1648}  # Janot, Gautier, Brunot 2019: kg, N s/m, N, N  # fmt: skip
SLIDE_MODEL = """\
plant = "slide"
effects = ["voltage_offset"]           # mass and offset alone: what friction there is, the tool is to find

[constants]
gain = 35.1507                         # force on the carriage per volt [N/V]

[columns]
x = { column = "qm" }
v_in = { column = "vir" }
x_ref = { column = "qg" }
"""


class AxisStudy(NamedTuple):
    """The measured axis, explained and refitted; the comparisons take the values of the last rung."""

    explanation: Ladder
    rungs: list[Rung]
    identified: Model  # the last rung with its values
    estimation: Comparison  # with the log the values come from
    pulses: Comparison  # with the log with pulses
    published: Rung  # the effects of the published model


def emps_page_text(estimation: Path, pulses: Path, out: Path, update: Callable[[str], None]) -> str:
    """The page on the EMPS, after emps.md; draws its figures into the folder ``out``."""
    model = Model.parse(SLIDE_MODEL)
    study = study_axis(model, estimation, pulses, update)
    draw_force_ladder(out / "emps_ladder.svg", study.rungs)
    draw_force(out / "emps_force.svg", model, study.rungs, estimation)
    draw_bursts(out / "emps_pulses.svg", study.identified, pulses, study.pulses)
    return PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        model=SLIDE_MODEL,
        verdict=study.explanation.verdict,
        repeats=repeatable_share_text(study.explanation),
        shooting=markdown_table(("", "M [kg]", "F_v [N s/m]", "F_c [N]"), shooting_rows(model, estimation, pulses)),
        steps=steps_table(study.explanation),
        **force_texts(study),
        **burst_texts(study),
    )


def study_axis(model: Model, estimation: Path, pulses: Path, update: Callable[[str], None]) -> AxisStudy:
    """Explain the estimation log, fit every rung by inverse dynamics and compare the last one with both logs."""
    explanation = explain(model, [estimation], progress=update)
    update("inverse dynamics with each rung")
    rungs = [fit_rung(model, effects, estimation, pulses) for effects in effects_of_rungs(explanation)]
    update("comparing with the log with pulses")
    identified = model_with_values(model.with_effects(rungs[-1].effects), rungs[-1].values)
    with_pulses = compare(identified, [pulses])
    published = fit_rung(model, PUBLISHED_EFFECTS, estimation, pulses)
    return AxisStudy(explanation, rungs, identified, compare(identified, [estimation]), with_pulses, published)


def force_texts(study: AxisStudy) -> dict[str, str]:
    """Table of the force errors, and the deviations from the published parameters."""
    rows = [force_row(rung.label, rung) for rung in study.rungs]
    asymmetry = study.rungs[-1].values.get("viscous_asymmetry.coefficient", float("nan")) * FORCE_PER_VOLT_N
    return {
        "forces": markdown_table(
            ("model", "estimation [%]", "pulses [%]", "M [kg]", "F_v [N s/m]", "F_c [N]", "offset [N]"),
            [*rows, PUBLISHED_ROW],
        ),
        "worst": f"{max_deviation_percent(study.published.values):.2f}",
        "asymmetry": f"{asymmetry:.1f}",
    }


def burst_texts(study: AxisStudy) -> dict[str, str]:
    """Number, times and peak of the bursts of missing force in either log."""
    starts = [burst["from"] for burst in study.pulses.bursts if not burst["at_reversal"]]
    peak = max(burst["peak"] for burst in study.pulses.bursts) * FORCE_PER_VOLT_N
    at_reversal = sum(burst["at_reversal"] for burst in study.estimation.bursts)
    return {
        "bursts": str(len(starts)),
        "edges": ", ".join(f"{t:.3f}" for t in starts[:8]),
        "peak": f"{peak:.0f}",
        "quiet": str(len(study.estimation.bursts) - at_reversal),
        "turning": str(at_reversal),
    }


PUBLISHED_ROW = ("published, with Coulomb friction", "4.083", "5.982", "95.11", "203.50", "20.39", "3.16")


def effects_of_rungs(found: Ladder) -> list[tuple[str, ...]]:
    """The effects of every rung, from those of the model on; of one that remembers its path the law that it approaches.

    Inverse dynamics see one moment, not the path that led to it.
    """
    laws = dict.fromkeys(derive.effects.find(step.effect).approaches or step.effect for step in found.steps)
    own = found.first.problem.model.effects
    return [(*own, *list(laws)[:k]) for k in range(len(laws) + 1)]


def fit_rung(model: Model, effects: Sequence[str], estimation: Path, pulses: Path) -> Rung:
    """Identify a model by inverse dynamics on the estimation log; its force error there and on the log with pulses."""
    larger = model.with_effects(effects)
    found = identify(larger, [estimation], method="inverse")
    values = {n: e.value for n, e in found.parameters.items()}
    other = force_error(model_module(larger.plant, larger.assumptions, effects), read_logs([pulses], larger)[0], values)
    return Rung(tuple(effects), found.force_error or float("nan"), other or float("nan"), values)


def force_row(name: str, rung: Rung) -> tuple[str, ...]:
    """Name, force errors and parameters of a rung, as text."""
    values = [rung.values.get(n) for n in PUBLISHED_FORCE_VALUES]
    return (
        name,
        f"{rung.estimation_error:.2f}",
        f"{rung.pulses_error:.2f}",
        *("–" if v is None else f"{v * FORCE_PER_VOLT_N:.2f}" for v in values),
    )


def max_deviation_percent(values: dict[str, float]) -> float:
    """Largest relative difference from a published parameter [%]."""
    return max(
        abs(100.0 * (values[n] * FORCE_PER_VOLT_N / published - 1.0)) for n, published in PUBLISHED_FORCE_VALUES.items()
    )


def shooting_rows(model: Model, *logs: Path) -> list[tuple[str, ...]]:
    """Parameters of the model with viscous and Coulomb friction by shooting on each log."""
    larger, rows = model.with_effects(PUBLISHED_EFFECTS), []
    for path in logs:
        found = identify(larger, [path], method="shooting").parameters
        cells = [
            f"{found[n].value * FORCE_PER_VOLT_N:.2f} ± {found[n].sigma * FORCE_PER_VOLT_N:.2f}"
            for n in [*PUBLISHED_FORCE_VALUES][:3]
        ]
        rows.append((path.name, *cells))
    return rows


def repeatable_share_text(found: Ladder) -> str:
    """Repeatable share of the missing force, and the variables it depends on."""
    if found.last.by_likelihood:
        return repeating_text(found.last.remainder, found.problem.plant) or "None of it repeats."
    if not found.repeats:
        return "None of it repeats."
    first = found.repeats[0]
    return f"Of it {100 * first.repeatable:.0f} % repeat, with {' and '.join(first.depends_on)}."


def model_with_values(model: Model, values: dict[str, float]) -> Model:
    """The model with these values as its identified ones, without standard errors."""
    return model.with_fit({n: (v, None) for n, v in values.items()})
