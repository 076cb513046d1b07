"""Case study of the measured balancing robot: a gearbox that sticks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from derive.parameter_name import effect_of
from wheelpend.api import explain
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.drawing import draw_error_ladder, draw_robot
from wheelpend.benchmarks.measured.rungs import steps_table
from wheelpend.diagnosis.compare import Comparison, compare
from wheelpend.diagnosis.explain import Ladder
from wheelpend.identification.identify import Identification, identify
from wheelpend.inspection.inspect import Inspection, inspect_file
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

PAGE_TEMPLATE_PATH = Path(__file__).with_name("robot.md")
ROBOT_MODEL = """\
plant = "wheel_pendulum"
effects = []

[sensors]
encoder = "relative"                   # the encoders sit in the motors
"""
HARD_FLOOR = """
[assumptions]
ground_friction = false                # hard tyres on a hard floor: all viscous friction is the drive's
"""


class RobotStudy(NamedTuple):
    """The measured robot: inspected, explained without any effect, and refitted as a whole with dry friction."""

    log: Log
    inspection: Inspection
    explanation: Ladder
    identification: Identification  # hard floor and dry friction, on the whole log
    comparison: Comparison  # of that model with the same log

    @property
    def standstills(self) -> Sequence[tuple[float, float]]:
        """Stretches in which the drive stands still, from and to [s]."""
        return self.inspection.stand_still.get("theta_w", [])


def robot_page_text(path: Path, out: Path, update: Callable[[str], None]) -> str:
    """The page on the balancing robot, after robot.md; draws its figures into the folder ``out``."""
    study = study_robot(path, update)
    draw_robot(out / "robot_stands.svg", study.log, study.standstills)
    draw_error_ladder(out / "robot_ladder.svg", study.explanation)
    return PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        model=ROBOT_MODEL,
        **log_texts(study),
        **explanation_texts(study.explanation),
        **identification_texts(study.identification),
        where=concentration_list(study.comparison),
    )


def study_robot(path: Path, update: Callable[[str], None]) -> RobotStudy:
    """Inspect and explain the log, then fit all of it with dry friction and compare."""
    model = Model.parse(ROBOT_MODEL)
    log, inspection = inspect_file(model, path)
    explanation = explain(model, [path], progress=update)
    with_dry_friction = Model.parse(ROBOT_MODEL + HARD_FLOOR).with_effects(["coulomb_drive"])
    update("fitting all of the log with dry friction")
    identification = identify(with_dry_friction, [path], method="shooting")
    return RobotStudy(log, inspection, explanation, identification, compare(identification.model, [path]))


def log_texts(study: RobotStudy) -> dict[str, str]:
    """Channels, jitter and standstills of the log."""
    rows = [
        (channel, *(f"{row[k]:.4g}" for k in ("minimum", "maximum", "noise")))
        for channel, row in study.inspection.channels.items()
    ]
    return {
        "channels": markdown_table(("channel", "least", "greatest", "noise"), rows),
        "jitter": f"{100 * study.inspection.jitter:.1f}",
        "still": f"{sum(end - begin for begin, end in study.standstills):.2f}",
        "duration": f"{study.log.duration:.1f}",
        "stretches": "; ".join(f"{begin:.2f}–{end:.2f}" for begin, end in study.standstills),
    }


def explanation_texts(explanation: Ladder) -> dict[str, str]:
    """Steps, errors and verdict of the explanation, with size and gain of its first effect."""
    first = explanation.steps[0]
    return {
        "steps": steps_table(explanation),
        "first": first.effect,
        "size": f"{first.coefficients.get('torque', float('nan')):.3f}",
        "cut": f"{100 * (1 - first.error_after / first.error_before):.0f}",
        "base": f"{explanation.base_error:.2f}",
        "error": f"{explanation.error:.2f}",
        "verdict": explanation.verdict,
    }


def identification_texts(identification: Identification) -> dict[str, str]:
    """Back-EMF and dry friction from the whole log."""
    parameters, unit = identification.parameters, identification.unit
    back_emf = parameters[next(n for n in parameters if unit[n] == "V s/rad" and not effect_of(n))]
    return {
        "k": f"{back_emf.value:.2f} ± {back_emf.sigma:.2f}",
        "torque": f"{parameters['coulomb_drive.torque'].value:.3f}",
    }


def concentration_list(comparison: Comparison) -> str:
    """The ranges of a state in which the missing force is concentrated, as a Markdown list."""
    return "\n".join(
        f"- {place.row} row: {100 * place.share:.0f} % of the missing force lies where {place.state} is between "
        f"{place.low:.3g} and {place.high:.3g}"
        for place in comparison.where
    )
