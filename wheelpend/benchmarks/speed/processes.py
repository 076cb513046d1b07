"""Rows: the time of a process from its start to its end."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from wheelpend.benchmarks.speed.record import Times
from wheelpend.benchmarks.speed.setting import EXPERIMENT_DURATION_S, Setting
from wheelpend.benchmarks.speed.timing import Contender, best_in_turn, timed
from wheelpend.errors import Failure
from wheelpend.isolation import python_command, python_environment
from wheelpend.logs.read import save_log
from wheelpend.model.record import Model
from wheelpend.model.template import model_file_text
from wheelpend.simulation.simulate import simulate

DERIVED_EFFECTS = (
    "coulomb_drive", "viscous_asymmetry", "stribeck_drive", "quadratic_drive", "cogging", "ground_viscous",
    "rolling_resistance", "slope", "wheel_runout", "air_drag", "com_offset", "body_damping", "tether_spring",
    "voltage_offset", "imu_bias",
)  # fmt: skip
DERIVATION_SCRIPT = """
import derive
model = derive.compose("{plant}", derive.plants.complete_assumptions("{plant}", {{}}), {effects!r})
derive.render(model)
"""


def second_run(s: Setting) -> Times:
    """``wheelpend identify`` of a 20 s log by a new process, against the same with nothing compiled."""
    with tempfile.TemporaryDirectory() as folder:
        log, model = Path(folder) / "log.csv", Path(folder) / "model.toml"
        save_log(log, s.log())
        model.write_text(model_file_text(s.model.plant), encoding="utf-8")
        command = ["-m", "wheelpend", "identify", str(log), "--model", str(model)]
        first = process(command, cache=folder)()
        process(command)()  # fills the cache, if need be
        return Times(best_in_turn(process(command))[0], first)


def first_demo(s: Setting) -> Times:
    """``wheelpend demo`` by a new process with nothing derived or compiled, against the same with all of that."""
    with tempfile.TemporaryDirectory() as folder:
        command, cache = ["-m", "wheelpend", "demo", "--out", str(Path(folder) / "demo")], str(Path(folder) / "cache")
        first = process(command, cache)()
        return Times(first, process(command, cache)())


def other_assumption(s: Setting) -> Times:
    """The first ``wheelpend identify`` under an assumption that was not made before, against the second."""
    return _first_after(s, 'ground_friction_reaction = "body"', 'ground_friction_reaction = "none"')


def other_encoder(s: Setting) -> Times:
    """The first ``wheelpend identify`` with a relative encoder, against the second."""
    return _first_after(s, 'encoder = "absolute"', 'encoder = "relative"')


def _first_after(s: Setting, line: str, other: str) -> Times:
    """The first and the second identify of a 20 s log with a line of the model file changed, beside the usual model."""
    text = model_file_text(s.model.plant)
    if line not in text:
        raise Failure(f"The model file that `new` writes must have the line {line}.")
    with tempfile.TemporaryDirectory() as folder:
        log, model, cache = Path(folder) / "log.csv", Path(folder) / "model.toml", str(Path(folder) / "cache")
        command = ["-m", "wheelpend", "identify", str(log), "--model", str(model)]
        first = 0.0
        for now in (text, text.replace(line, other)):
            save_log(log, simulate(Model.parse(now), duration=EXPERIMENT_DURATION_S))
            model.write_text(now, encoding="utf-8")
            first = process(command, cache)()
        return Times(first, process(command, cache)())


def derivation(s: Setting) -> Times:
    """Derive and render the model with 15 effects in a new process, against importing sympy in one."""
    text = DERIVATION_SCRIPT.format(plant=s.model.plant, effects=DERIVED_EFFECTS)
    return Times(*best_in_turn(process(["-c", text]), process(["-c", "import sympy"])))


def process(arguments: Sequence[str], cache: str | None = None) -> Contender:
    """Contender that starts this interpreter with arguments, on request with another folder of compiled kernels."""
    environment = python_environment() | ({"WHEELPEND_CACHE": cache} if cache else {})

    def run() -> None:
        done = subprocess.run(python_command(*arguments), env=environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise Failure(f"{' '.join(arguments)} must run, but it said: {done.stderr.strip()}")

    return timed(run, perf_counter)
