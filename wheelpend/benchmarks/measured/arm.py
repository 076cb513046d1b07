"""Case study of a measured arm of two links with a motor at each joint: friction of quasi-direct drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from wheelpend.api import explain
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.drawing import draw_error_ladder
from wheelpend.benchmarks.measured.rungs import FittedModel, fitted_models, goal_text, ladder_texts
from wheelpend.benchmarks.measured.torque import (
    MOTION_CUTOFF_HZ,
    joint_equations,
    least_squares_values,
    log_halves,
    torque_error,
)
from wheelpend.benchmarks.measured.traces import draw_torques
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import read_logs
from wheelpend.identification.identify import identify
from wheelpend.identification.inverse_dynamics import linear_parameter_values
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

PAGE_TEMPLATE_PATH = Path(__file__).with_name("arm.md")
ARM_LOG = "dfki_arm/measured.csv"
GOAL_PERCENT, GOAL_INERTIA_SHARE = 7.5, 0.2  # torque error on the second half; deviation of the inertia
LEAST_SQUARES_INERTIA = 0.12  # N m s², X1 + X3 by least squares behind 5 Hz, friction in both joints
ARM_MODEL = """\
plant = "pendulum"
effects = []

[assumptions]
links = 2
driven = "both"

[input]
unit = "N m"

[columns]
v_in = { column = "tau1" }
v_in_2 = { column = "tau2" }
theta_1 = { column = "pos1" }
theta_2 = { column = "pos2" }
t = { column = "time" }

[sensors.step]
theta_1 = 0.0003815                    # of the encoders [rad]
theta_2 = 0.0003815
"""
WIDE_CUTOFF_HZ = 20.0  # of the filter, at which the encoder's steps are most of what is differentiated twice
IDENTIFY_LABEL = "the last of these, values of `identify`"
VISCOUS_PARAMETERS = ("X6", "X7")
DRY_FRICTION = ("coulomb_drive", "coulomb_joint")
REFERENCE_MODELS = (  # label, effects, parameters held at 0
    ("rigid body alone", (), VISCOUS_PARAMETERS),
    ("and viscous friction", (), ()),
    ("and Coulomb friction", DRY_FRICTION, ()),
    ("Coulomb friction, none viscous", DRY_FRICTION, VISCOUS_PARAMETERS),
)


class JudgedModel(NamedTuple):
    """A model with values from the first half of the log, and its torque errors [%]."""

    fitted: FittedModel
    first: float
    second: float

    @property
    def inertia(self) -> float:
        """Inertia X1 + X3 about the shoulder with the elbow at a right angle [N m s²]."""
        return self.fitted.values["X1"] + self.fitted.values["X3"]


class ArmStudy(NamedTuple):
    """The arm explained on the first half of its log, and every rung judged by the torques of the second."""

    halves: tuple[Log, Log]
    explanation: Ladder
    rungs: list[JudgedModel]
    references: list[JudgedModel]  # by least squares
    identified: JudgedModel  # the last rung with the values of identify
    coarse_inertia: float  # N m s², X1 + X3 by least squares with friction behind a filter that is too wide


def arm_page_text(path: Path, out: Path, update: Callable[[str], None]) -> str:
    """The page on the arm, after arm.md; draws its figures into the folder ``out``."""
    study = study_arm(path, update)
    draw_error_ladder(out / "arm_ladder.svg", study.explanation)
    draw_needed_torques(out / "arm_torque.svg", study)
    return PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        model=ARM_MODEL, **ladder_texts(study.explanation), **torque_texts(study)
    )


def study_arm(path: Path, update: Callable[[str], None]) -> ArmStudy:
    """Explain the first half of the log and judge every rung, and plain least squares, on both halves."""
    model = Model.parse(ARM_MODEL)
    halves = log_halves(read_logs([path], model)[0])
    explanation = explain(model, halves[:1], progress=update)
    update("torques with each rung")
    rungs = [judged_model(fitted, halves) for fitted in fitted_models(explanation)]
    references = []
    for label, effects, without in REFERENCE_MODELS:
        begun = FittedModel(label, model.with_effects(effects), {})
        values = least_squares_values(begun.module, halves[0], without)
        references.append(judged_model(begun._replace(values=values), halves))
    dry = FittedModel("", model.with_effects(DRY_FRICTION), {}).module
    coarse = least_squares_values(dry, halves[0], cutoff=WIDE_CUTOFF_HZ)
    last = rungs[-1].fitted
    found = identify(last.model, halves[:1], progress=update).parameters
    by_identify = last._replace(label=IDENTIFY_LABEL, values={**last.values, **{n: e.value for n, e in found.items()}})
    return ArmStudy(
        halves, explanation, rungs, references, judged_model(by_identify, halves), coarse["X1"] + coarse["X3"]
    )


def judged_model(fitted: FittedModel, halves: Sequence[Log]) -> JudgedModel:
    """A model with its torque errors on both halves."""
    return JudgedModel(fitted, *(torque_error(fitted.module, fitted.values, half) for half in halves))


def draw_needed_torques(path: Path, study: ArmStudy) -> None:
    """Measured torques in the second half, with those that the last rung and the best least squares need."""
    best = min(study.references, key=lambda judged: judged.second)
    needed = {}
    for label, judged in (("explain", study.rungs[-1]), ("least squares", best)):
        module, values = judged.fitted.module, judged.fitted.values
        (equations, *_) = joint_equations(module, values, study.halves[1])
        needed[label] = equations.regressor @ linear_parameter_values(module, values)
    draw_torques(path, equations, needed)


def torque_texts(study: ArmStudy) -> dict[str, str]:
    """Tables of the torque errors, and what they say of the last rung."""
    last, best = study.rungs[-1], min(study.references, key=lambda judged: judged.second)
    off = abs(last.inertia / LEAST_SQUARES_INERTIA - 1.0)
    header = ("model", "first half [%]", "second half [%]", "X1 + X3 [N m s²]")
    return {
        "middle": f"{study.halves[1].t[0]:.3f}",
        "duration": f"{study.halves[1].t[-1]:.0f}",
        "rate": f"{1.0 / study.halves[0].dt:.0f}",
        "cutoff": f"{MOTION_CUTOFF_HZ:g}",
        "rungs": markdown_table(header, map(judged_row, (*study.rungs, study.identified))),
        "references": markdown_table(header, map(judged_row, study.references)),
        "last": f"{last.second:.1f}",
        "goal": f"{GOAL_PERCENT:g}",
        "reached": goal_text(last.second, GOAL_PERCENT),
        "inertia": f"{last.inertia:.3f}",
        "inertia_goal": f"{100 * GOAL_INERTIA_SHARE:.0f} % of {LEAST_SQUARES_INERTIA:g}",
        "inertia_reached": goal_text(off, GOAL_INERTIA_SHARE),
        "best": f"{best.second:.1f}",
        "wide": f"{WIDE_CUTOFF_HZ:g}",
        "coarse": f"{study.coarse_inertia:.3f}",
    }


def judged_row(judged: JudgedModel) -> tuple[str, ...]:
    """Label, torque errors and inertia of a model, as text."""
    return judged.fitted.label, f"{judged.first:.1f}", f"{judged.second:.1f}", f"{judged.inertia:.3f}"
