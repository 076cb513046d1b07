"""Case study of a measured pendulum that swings freely: which friction makes it stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from derive.parameter_name import effect_of
from wheelpend.api import explain
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.drawing import draw_error_ladder
from wheelpend.benchmarks.measured.free_run import best_free_run_values, free_run, free_run_error
from wheelpend.benchmarks.measured.rungs import FittedModel, fitted_models, goal_text, ladder_texts
from wheelpend.benchmarks.measured.traces import draw_free_runs
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import read_logs
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

PAGE_TEMPLATE_PATH = Path(__file__).with_name("pendulum.md")
DECAY_LOG = "free_pendulum/decay.csv"
GOAL_RAD = 0.012  # rad, of the free run
PENDULUM_MODEL = """\
plant = "pendulum"
effects = []

[columns]
theta_1 = { column = "angle", offset = -3.141593 }   # it is recorded from upright
t = { column = "time" }
"""
FRICTION_LAWS = (
    ("viscous_drive",),
    ("coulomb_drive",),
    ("viscous_drive", "coulomb_drive"),
    ("coulomb_drive", "quadratic_drive"),
    ("viscous_drive", "coulomb_drive", "quadratic_drive"),
)
SMALL_FRICTION = 1e-4  # of any law, from which its fit begins


class JudgedModel(NamedTuple):
    """A model with values, and how well a free run with them follows the whole record."""

    fitted: FittedModel
    error: float  # rad, root mean square


class PendulumStudy(NamedTuple):
    """The pendulum explained, every rung judged by a free run, and friction laws that were fitted to that run alone."""

    log: Log
    explanation: Ladder
    rungs: list[JudgedModel]
    laws: list[JudgedModel]


def pendulum_page_text(path: Path, out: Path, update: Callable[[str], None]) -> str:
    """The page on the free pendulum, after pendulum.md; draws its figures into the folder ``out``."""
    study = study_pendulum(path, update)
    draw_error_ladder(out / "pendulum_ladder.svg", study.explanation)
    best = min(study.laws, key=lambda judged: judged.error)
    runs = {"explain": study.rungs[-1], "fitted to this run": best}
    draw_free_runs(out / "pendulum_free_run.svg", study.log, {label: run_of(j, study.log) for label, j in runs.items()})
    return PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        model=PENDULUM_MODEL, **ladder_texts(study.explanation), **free_run_texts(study)
    )


def study_pendulum(path: Path, update: Callable[[str], None]) -> PendulumStudy:
    """Explain the record, judge every rung by a free run, and fit friction laws to the free run itself."""
    model = Model.parse(PENDULUM_MODEL)
    (log,) = read_logs([path], model)
    explanation = explain(model, [path], progress=update)
    update("free runs with each rung")
    rungs = [JudgedModel(f, free_run_error(f.module, f.values, log)) for f in fitted_models(explanation)]
    laws = []
    for effects in FRICTION_LAWS:
        update(f"fitting a free run with {' and '.join(effects)}")
        laws.append(fitted_to_free_run(rungs[0].fitted, effects, log))
    return PendulumStudy(log, explanation, rungs, laws)


def fitted_to_free_run(begin: FittedModel, effects: Sequence[str], log: Log) -> JudgedModel:
    """A model with these effects that comes nearest to the log in a free run, sought from one without them."""
    model = begin.model.with_effects(effects)
    label = " and ".join(f"`{e}`" for e in effects)
    start = FittedModel(label, model, begin.values)
    frictions = {n: SMALL_FRICTION for n in start.module.PARAMETERS if effect_of(n) in effects}
    best = best_free_run_values(start.module, {**begin.values, **frictions}, log)
    return JudgedModel(start._replace(values=best), free_run_error(start.module, best, log))


def free_run_texts(study: PendulumStudy) -> dict[str, str]:
    """Tables of the free runs, and what they say of the ladder."""
    last, best = study.rungs[-1], min(study.laws, key=lambda judged: judged.error)
    wrong = [j.fitted.label for j in study.laws if any(j.fitted.values[n] < 0.0 for n in _friction_names(j))]
    return {
        "duration": f"{study.log.duration:.0f}",
        "rungs": markdown_table(("model", "free run [rad]"), [(j.fitted.label, f"{j.error:.4f}") for j in study.rungs]),
        "laws": markdown_table(("friction", "free run [rad]", "values"), map(law_row, study.laws)),
        "last": f"{last.error:.4f}",
        "goal": f"{GOAL_RAD:g}",
        "reached": goal_text(last.error, GOAL_RAD),
        "best_law": best.fitted.label,
        "best": f"{best.error:.4f}",
        "ratio": f"{last.error / best.error:.1f}",
        "wrong": " and of ".join(wrong) or "none of them",
    }


def law_row(judged: JudgedModel) -> tuple[str, str, str]:
    """Friction law, error of its free run, and its values, as text."""
    values = ", ".join(f"{judged.fitted.values[n]:.3g}" for n in _friction_names(judged))
    return judged.fitted.label, f"{judged.error:.4f}", values


def _friction_names(judged: JudgedModel) -> list[str]:
    return [n for n in judged.fitted.values if effect_of(n)]


def run_of(judged: JudgedModel, log: Log) -> np.ndarray:
    """Readings (N,) [rad] of a model's free run."""
    return free_run(judged.fitted.module, judged.fitted.values, log)
