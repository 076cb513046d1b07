"""Case study of a measured servo that swings a pendulum: friction that grows with the load of the gearbox."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from derive.parameter_name import effect_of
from wheelpend.api import explain
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.drawing import draw_error_ladder
from wheelpend.benchmarks.measured.pairs import pair_texts
from wheelpend.benchmarks.measured.roll_out import best_roll_out_values, roll_out, roll_out_error
from wheelpend.benchmarks.measured.rungs import FittedModel, fitted_models, goal_text, ladder_texts
from wheelpend.benchmarks.measured.servo_logs import ESTIMATION_LOGS, SERVO_MODEL, VALIDATION_LOGS
from wheelpend.benchmarks.measured.traces import draw_roll_outs
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import read_logs
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

PAGE_TEMPLATE_PATH = Path(__file__).with_name("servo.md")
GOAL_RATIO = 1.15  # of the roll-out error on validation logs to that of the best values of the same model
SHOWN_LOGS = ("sin_sin_100", "up_and_down_200", "sin_time_square_400")  # of the validation logs, one of each trajectory


class RollOuts(NamedTuple):
    """Mean absolute roll-out errors of a model [rad]."""

    estimation: float
    validation: float


class JudgedRung(NamedTuple):
    """A rung with its roll-outs, and the same model with the values that are best for these on the estimation logs."""

    fitted: FittedModel
    identified: RollOuts
    best_values: dict[str, float]
    best: RollOuts

    @property
    def ratio(self) -> float:
        """Validation error over that of the best values."""
        return self.identified.validation / self.best.validation


class ServoStudy(NamedTuple):
    """The servo explained on three logs with nine held out, and every rung judged by roll-outs."""

    estimation: Sequence[Log]
    validation: Sequence[Log]
    explanation: Ladder
    rungs: list[JudgedRung]


def servo_page_text(folder: Path, pairs: Path, out: Path, update: Callable[[str], None]) -> str:
    """The page on the servo, after servo.md, with the known answers on pairs; draws its figures into ``out``."""
    study = study_servo(folder, update)
    draw_error_ladder(out / "servo_ladder.svg", study.explanation)
    logs = [log for log in study.validation if Path(log.name).stem in SHOWN_LOGS]
    draw_roll_outs(out / "servo_roll_out.svg", logs, [roll_outs_of(study.rungs[-1], log) for log in logs])
    return PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        model=SERVO_MODEL, **ladder_texts(study.explanation), **roll_out_texts(study), **pair_texts(pairs)
    )


def study_servo(folder: Path, update: Callable[[str], None]) -> ServoStudy:
    """Explain the estimation logs with the others held out, and judge every rung by roll-outs on both."""
    model = Model.parse(SERVO_MODEL)
    given, held_out = ([folder / f"{name}.csv" for name in names] for names in (ESTIMATION_LOGS, VALIDATION_LOGS))
    estimation, validation = read_logs(given, model), read_logs(held_out, model)
    explanation = explain(model, given, held_out, progress=update)
    rungs = []
    for fitted in fitted_models(explanation):
        update(f"roll-outs: {fitted.label}")
        rungs.append(judged_rung(fitted, estimation, validation))
    return ServoStudy(estimation, validation, explanation, rungs)


def judged_rung(fitted: FittedModel, estimation: Sequence[Log], validation: Sequence[Log]) -> JudgedRung:
    """Roll-out errors of a model with its values, and with those that are best for the estimation logs."""
    best = best_roll_out_values(fitted, estimation)
    identified, fitted_best = (
        RollOuts(*(roll_out_error(fitted.module, values, logs) for logs in (estimation, validation)))
        for values in (fitted.values, best)
    )
    return JudgedRung(fitted, identified, best, fitted_best)


def roll_outs_of(judged: JudgedRung, log: Log) -> dict[str, np.ndarray]:
    """Roll-outs (N,) [rad] of a log with the identified values and with the best ones, by label."""
    values = {"identified": judged.fitted.values, "best roll-out": judged.best_values}
    return {label: roll_out(judged.fitted.module, v, log) for label, v in values.items()}


def roll_out_texts(study: ServoStudy) -> dict[str, str]:
    """Table of the roll-outs, and what it says of the last rung."""
    last = study.rungs[-1]
    header = ("model", "estimation [rad]", "validation [rad]", "best values: estimation", "validation", "ratio")
    return {
        "estimation": ", ".join(f"`{name}`" for name in ESTIMATION_LOGS),
        "duration": f"{study.estimation[0].duration:.0f}",
        "rate": f"{1.0 / study.estimation[0].dt:.0f}",
        "roll_outs": markdown_table(header, map(rung_row, study.rungs)),
        "own_values": markdown_table(("parameter", "identified", "best roll-out"), value_rows(last)),
        "ratio": f"{last.ratio:.2f}",
        "goal": f"{GOAL_RATIO:g}",
        "reached": goal_text(last.ratio, GOAL_RATIO),
    }


def rung_row(judged: JudgedRung) -> tuple[str, ...]:
    """Label, roll-out errors and their ratio of a rung, as text."""
    errors = (*judged.identified, *judged.best)
    return (judged.fitted.label, *(f"{e:.4f}" for e in errors), f"{judged.ratio:.2f}")


def value_rows(judged: JudgedRung) -> list[tuple[str, str, str]]:
    """Name, identified and best value of every parameter, as text."""
    module = judged.fitted.module
    names = [n for n in judged.fitted.values if effect_of(n) or n in module.PARAMETERS[: module.OWN_PARAMETERS]]
    return [(f"`{n}`", f"{judged.fitted.values[n]:.4g}", f"{judged.best_values[n]:.4g}") for n in names]
