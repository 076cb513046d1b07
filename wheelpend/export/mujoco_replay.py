"""A log replayed in MuJoCo with the exported scene."""

from __future__ import annotations

from typing import Any

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
    predicted = [
        np.concatenate([_segment(mujoco, model, data, radius, s) for s in log.segments]) for log in replay.logs
    ]
    return replay.error_of(predicted), f"run by MuJoCo {mujoco.__version__} in steps of {model.opt.timestep:g} s"


def _segment(mujoco: Any, model: Any, data: Any, radius: float, segment: ReplaySegment) -> np.ndarray:
    """Readings (N, 3) over a segment, from its state; a command that is under way as it begins is not there."""
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:] = (
        (segment.state[0] * radius, segment.state[1]),
        (segment.state[2] * radius, segment.state[3]),
    )
    if model.na:
        data.act[:] = segment.acting
    read = [_readings(data, radius)]
    for interval, command in zip(segment.intervals, segment.commands, strict=True):
        data.ctrl[:] = command
        for _ in range(max(1, round(interval / model.opt.timestep))):
            mujoco.mj_step(model, data)
        read.append(_readings(data, radius))
    return np.array(read)


def _readings(data: Any, radius: float) -> list[float]:
    return [data.qpos[0] / radius, data.qpos[1], data.qvel[1]]
