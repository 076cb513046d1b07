"""A log replayed by the FMU in co-simulation, under FMPy."""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.fmu_target import fmu_content
from wheelpend.export.fmu_variables import FmuVariables, finite, fmu_variables
from wheelpend.export.replay import Replay, ReplaySegment

REPLAYED_VERSION = 2  # of FMI


def replay_in_fmu(exported: ExportedModel, replay: Replay) -> tuple[float | None, str]:
    """Error [σ] of the FMU of FMI 2.0 on logs, and with what it ran, or why not."""
    if importlib.util.find_spec("fmpy") is None:
        return None, "FMPy is not installed here"
    content = fmu_content(exported, REPLAYED_VERSION)
    if not any(path.startswith("binaries/") for path in content):
        return None, "no C compiler is installed here that compiles the FMU"
    with tempfile.TemporaryDirectory(prefix="wheelpend-export-") as name:
        for path, held in content.items():
            (Path(name) / path).parent.mkdir(parents=True, exist_ok=True)
            (Path(name) / path).write_bytes(held)
        return _replayed(exported, replay, name)


def _replayed(exported: ExportedModel, replay: Replay, folder: str) -> tuple[float | None, str]:
    """Error [σ] of an FMU whose files are in a folder, and with what it ran, or why it did not."""
    import fmpy
    from fmpy.simulation import instantiate_fmu

    said: list[str] = []
    description = fmpy.read_model_description(folder, validate=False)
    try:
        fmu = instantiate_fmu(folder, description, "CoSimulation", logger=lambda *given: said.append(_text(given[-1])))
    except Exception as error:  # FMPy raises no narrower one
        return None, f"FMPy could not load the FMU ({error})"
    try:
        predicted = _FmuRun(exported, fmu).predicted(replay)
    except fmpy.fmi1.FMICallException as error:
        return None, f"the FMU refused: {said[-1] if said else error}"
    finally:
        fmu.freeInstance()
    return replay.error_of(predicted), f"run by FMPy {fmpy.__version__} as co-simulation of FMI 2.0"


def _text(message: bytes | str) -> str:
    """A message of the FMU's log."""
    return message.decode("utf-8", "replace") if isinstance(message, bytes) else message


class _FmuRun:
    """Segments of logs, run one after the other by an instance."""

    def __init__(self, exported: ExportedModel, fmu: Any) -> None:
        self.exported, self.fmu = exported, fmu
        self.variables: FmuVariables = fmu_variables(exported)
        self.remembered = np.zeros(exported.size)

    def predicted(self, replay: Replay) -> list[np.ndarray]:
        """Readings (samples, NY) of each log."""
        return [np.concatenate([self.segment(s, log.parameters) for s in log.segments]) for log in replay.logs]

    def segment(self, segment: ReplaySegment, parameters: np.ndarray) -> np.ndarray:
        """Readings (N, NY) over a segment, from its state."""
        fmu, time = self.fmu, segment.time
        fmu.reset()
        self.set_start(segment, parameters)
        fmu.setupExperiment(startTime=time)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        inputs, outputs = references(self.variables.inputs), references(self.variables.outputs)
        read = [fmu.getReal(outputs)]
        for interval, command in zip(segment.intervals, segment.commands, strict=True):
            fmu.setReal(inputs, command)
            fmu.doStep(time, interval)
            time += interval
            read.append(fmu.getReal(outputs))
        self.remembered = np.array(fmu.getReal(references(self.variables.states)))
        return np.array(read)

    def set_start(self, segment: ReplaySegment, parameters: np.ndarray) -> None:
        """Parameters and states as they are when the segment begins."""
        module = self.exported.module
        states = self.remembered if segment.carries_on else np.zeros(self.exported.size)
        states[: module.NX] = segment.state
        if module.LAG >= 0:
            states[module.NV] = segment.acting
        self.fmu.setReal(references(self.variables.states), states)
        declared = [i for i, n in enumerate(module.PARAMETERS) if n not in module.MISSING_FORCES]
        self.fmu.setReal(references(self.variables.parameters), [finite(v) for v in parameters[declared]])
        if self.variables.commands:
            self.fmu.setReal(references(self.variables.commands), segment.before.ravel())


def references(variables: tuple) -> list[int]:
    """Value references of variables."""
    return [v.reference for v in variables]
