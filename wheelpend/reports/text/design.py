"""`wheelpend design`: the command written as a file, and what it is expected to bring in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wheelpend.errors import Failure
from wheelpend.experiments.advice import CLEAR_SEPARATION_SIGMA
from wheelpend.experiments.design import Design, ExpectedErrors, Peaks, design
from wheelpend.experiments.pose import logs_of_last_change
from wheelpend.experiments.question import MAX_EQUIVALENT_ERROR_DIFFERENCE
from wheelpend.model.record import Model
from wheelpend.reports.console import print_line, print_table
from wheelpend.serialise import to_json
from wheelpend.simulation.references import save_trajectory


@dataclass(frozen=True)
class WrittenDesign:
    """A designed command and where it was written."""

    design: Design
    path: Path
    logs: tuple[str, ...]  # that were used
    units: dict[str, str]  # of the parameters

    def to_json(self) -> dict[str, Any]:
        """The design's own keys, with the file and the logs."""
        return {**to_json(self.design), "file": str(self.path), "logs": list(self.logs)}

    def print_summary(self) -> None:
        """Print it."""
        print_design(self)


def write_design(
    model: Model,
    logs: Sequence[Path],
    between: Sequence[str],
    output: Path,
    *,
    progress: Callable[[str], None],
    **options: Any,
) -> WrittenDesign:
    """Design a command and write it; without logs from those of the workspace's last change."""  # fmt: skip
    if output.suffix.lower() != ".csv":
        raise Failure(f"A command is written as CSV, so -o must end in .csv, but it is {output}.")
    known = tuple(logs) or logs_of_last_change(model)
    designed = design(model, known, between=between, progress=progress, **options)
    save_trajectory(output, designed.t, designed.theta_ref, designed.dtheta_ref)
    module = designed.question.problem.module
    units = dict(zip(module.PARAMETERS, module.UNITS, strict=True))
    return WrittenDesign(designed, output, tuple(map(str, known)), units)


def print_design(written: WrittenDesign) -> None:
    """Print what the command is, what it asks of the robot and what it is expected to bring."""
    d = written.design
    if written.logs:
        print_line(f"Beside {', '.join(written.logs)}:")
    print_line(f"Wrote {written.path}: {d.duration_s:g} s of {d.command}.")
    _print_separation(d)
    _print_expected_errors(d, written.units)
    asked = [
        (_command_text(d, k, ""), f"{p.pitch:.3f}", f"{p.voltage:.1f}", f"{p.wheel_travel:.0f}")
        for k, p in d.peaks.items()
    ]
    print_table("What it asks of the robot", ("command", "pitch [rad]", "voltage [V]", "wheels turn [rad]"), asked)
    for sentence in d.sentences:
        print_line(sentence)
    if not d.own_controller:
        gains = ", ".join(f"{g:.4g}" for g in d.gains)
        print_line(
            f"The model has no [controller]; it was rehearsed with a PID on the pitch, made for it: gains = [{gains}]."
        )
    print_line(f"Try it: wheelpend simulate -o log.csv --command {written.path}")


def _print_separation(d: Design) -> None:
    if d.separation is None:
        return
    rows = [(_command_text(d, k), f"{v:.1f}") for k, v in d.separation.items() if v is not None]
    print_table(f"{d.between[0]} or {' or '.join(d.between[1:])}: standard errors apart", ("after", "apart"), rows)
    reached = d.separation["designed"] or 0.0
    longer = d.duration_s * (CLEAR_SEPARATION_SIGMA / max(reached, 1e-9)) ** 2 / 60.0
    if reached < CLEAR_SEPARATION_SIGMA and longer < 60.0:
        print_line(f"{CLEAR_SEPARATION_SIGMA:g} would be clear: a record of about {longer:.0f} min would be needed.")
    elif reached < CLEAR_SEPARATION_SIGMA:
        print_line(
            f"{CLEAR_SEPARATION_SIGMA:g} would be clear, which no command comes near: "
            "`wheelpend diagnose` says what else may help."
        )
    elif d.gap is not None and d.gap < MAX_EQUIVALENT_ERROR_DIFFERENCE:
        print_line(
            f"Their errors will differ by {100 * d.gap:.2g} % only, so that `wheelpend diagnose` will still list both; "
            "the smaller one is right."
        )


def _print_expected_errors(d: Design, units: dict[str, str]) -> None:
    shown = [
        k for k in ("logs", "builtin", "designed") if any(getattr(v, k) is not None for v in d.parameters.values())
    ]
    rows = [
        (n, f"{v.value:.4g}", units[n], *(_relative_error_text(v, getattr(v, k)) for k in shown))
        for n, v in d.parameters.items()
    ]
    print_table("Expected standard errors", ("parameter", "value", "unit", *(_command_text(d, k) for k in shown)), rows)


def _relative_error_text(value: ExpectedErrors, error: float) -> str:
    """A standard error in percent of the value, or in its own unit where the value is lost in it."""
    if error == float("inf"):
        return "unknown"
    share = 100.0 * error / abs(value.value) if value.value else float("inf")
    return f"{share:.2g} %" if share < 100.0 else f"{error:.2g}"


def _command_text(d: Design, kind: str, beside: str = "+ ") -> str:
    """What stands for the logs at hand, the best built-in command, and the designed one."""
    beside = "" if all(v.logs is None for v in d.parameters.values()) else beside
    if kind == "logs":
        return "logs alone"
    if kind == "designed":
        return f"{beside}designed"
    asked: Peaks = d.peaks[kind]
    return f"{beside}{d.builtin}" + ("" if asked.factor == 1.0 else f" × {asked.factor:.2f}")
