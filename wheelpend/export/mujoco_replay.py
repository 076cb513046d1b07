"""A log replayed in MuJoCo with the exported scene."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.mujoco_target import SCENE_FILE, mujoco_files, scene_values
from wheelpend.export.replay import Replay, ReplaySegment


def replay_in_mujoco(exported: ExportedModel, replay: Replay) -> tuple[float | None, str]:
    """Error [σ] of the scene on logs, and with what it ran, or why not."""
    try:
        import mujoco
    except ImportError:
        return None, "MuJoCo is not installed here"
    try:
        model = mujoco.MjModel.from_xml_string(mujoco_files(exported)[SCENE_FILE])
    except ValueError as error:
        return None, f"this MuJoCo ({mujoco.__version__}) does not read the scene: {str(error).splitlines()[0]}"
    data, radius = mujoco.MjData(model), scene_values(exported)["radius"]
    scene = _Scene(mujoco, model, data, radius, np.asarray(exported.module.OUTPUT_MATRIX))
    predicted = [np.concatenate([_segment(scene, s) for s in log.segments]) for log in replay.logs]
    return replay.error_of(predicted), f"run by MuJoCo {mujoco.__version__} in steps of {model.opt.timestep:g} s"


class _Scene(NamedTuple):
    """The engine with a scene in it."""

    mujoco: Any
    model: Any
    data: Any
    radius: float  # of the wheel [m]
    output: np.ndarray  # (channels, 4) of wheel, pitch and their rates

    def readings(self) -> np.ndarray:
        """What the channels (channels,) read now."""
        state = np.concatenate([self.data.qpos, self.data.qvel]) / [self.radius, 1.0, self.radius, 1.0]
        return self.output @ state


def _segment(scene: _Scene, segment: ReplaySegment) -> np.ndarray:
    """Readings (N, channels) over a segment, from its state; a command that is under way as it begins is not there."""
    mujoco, model, data = scene.mujoco, scene.model, scene.data
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:] = (
        (segment.state[0] * scene.radius, segment.state[1]),
        (segment.state[2] * scene.radius, segment.state[3]),
    )
    if model.na:
        data.act[:] = segment.acting
    read = [scene.readings()]
    for interval, command in zip(segment.intervals, segment.commands, strict=True):
        data.ctrl[:] = command
        for _ in range(max(1, round(interval / model.opt.timestep))):
            mujoco.mj_step(model, data)
        read.append(scene.readings())
    return np.array(read)
