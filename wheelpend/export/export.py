"""An accepted model in another language or simulator, with a ledger of what it carries."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from wheelpend.errors import Failure, did_you_mean
from wheelpend.export.c_replay import replay_in_c
from wheelpend.export.c_target import c_files
from wheelpend.export.compensation import compensation_of
from wheelpend.export.exported_model import ExportedModel, exported_model
from wheelpend.export.fmu_replay import replay_in_fmu
from wheelpend.export.fmu_target import fmu_carried, fmu_files, fmu_notes
from wheelpend.export.javascript_replay import replay_in_javascript
from wheelpend.export.javascript_target import javascript_files
from wheelpend.export.json_target import json_files
from wheelpend.export.ledger import Carried, Ledger, all_exactly
from wheelpend.export.mujoco_replay import replay_in_mujoco
from wheelpend.export.mujoco_target import mujoco_carried, mujoco_files, mujoco_notes
from wheelpend.export.replay import Replay, replay_of
from wheelpend.files import write_files
from wheelpend.identification.identify import identify
from wheelpend.logs.read import load_log
from wheelpend.logs.sources import LogsLike, as_list
from wheelpend.model.record import Model
from wheelpend.serialise import dumps, to_json

LEDGER_TEXT, LEDGER_JSON = "EXPORT.md", "EXPORT.json"
PERIOD_LIMITS_S = (1e-5, 1.0)
MAX_LEDGER_BYTES = 10_000_000

Files = Mapping[str, str | bytes]
ReplayRun = Callable[[ExportedModel, Replay], tuple[float | None, str]]  # error in the target, and how or why not


@dataclass(frozen=True)
class Target:
    """A language or a simulator."""

    sentence: str
    files: Callable[[ExportedModel], Files]
    carried: Callable[[ExportedModel], Mapping[str, Carried]]
    replay: ReplayRun | None  # None where nothing runs there
    tells_correlations: bool = False  # which a fit to the logs gives


@dataclass(frozen=True)
class Export:
    """What was exported: texts and binary files by path, the ledger's among them."""

    ledger: Ledger
    files: Files

    def content(self) -> dict[str, bytes]:
        """The files as they are written."""
        return {name: _bytes(file) for name, file in self.files.items()}

    def to_json(self) -> dict[str, Any]:
        """The ledger under the keys of JSON."""
        return self.ledger.to_json()


EXPORT_TARGETS = {
    "c": Target(
        "a C99 library: simulation, observer, compensator, recursive identifier",
        c_files,
        lambda e: all_exactly(e.model.effects),
        replay_in_c,
    ),
    "js": Target(
        "an ES module with the same functions",
        javascript_files,
        lambda e: all_exactly(e.model.effects),
        replay_in_javascript,
    ),
    "fmu": Target(
        "FMUs of FMI 2.0 and 3.0, for model exchange and co-simulation",
        fmu_files,
        fmu_carried,
        replay_in_fmu,
    ),
    "mujoco": Target(
        "an MJCF of the robot that moves as identified",
        mujoco_files,
        mujoco_carried,
        replay_in_mujoco,
    ),
    "json": Target(
        "parameters with covariance, random force, equations, units",
        json_files,
        lambda e: {n: Carried("exactly", "as equations and values; nothing runs") for n in e.model.effects},
        None,
        tells_correlations=True,
    ),
}


def export_model(
    model: Model,
    target: str,
    logs: LogsLike = (),
    holdout: LogsLike = (),
    *,
    period: float | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Export:
    """Export a model as it stands to one of EXPORT_TARGETS, for a machine that is sampled every ``period`` [s].

    On ``logs``, or the hold-out logs, it is replayed in the target, from the states that our own prediction begins in,
    and its error there stands in the ledger beside ours. Raises Failure for an unknown target, and where a parameter
    has no value.
    """
    chosen = _target(target)
    given = as_list(logs) or as_list(holdout)
    progress("deriving the kernels for loops in real time")
    first = load_log(given[0], model.columns, model.table) if given else None
    exported = exported_model(model, first, period)
    if chosen.tells_correlations and given:
        found = identify(model, as_list(logs) or given, progress=progress)
        exported = replace(exported, fitted_covariance=found.covariance)
    progress("translating")
    files = chosen.files(exported)
    error = in_target = None
    replayed = "none was given"
    if given:
        replay = replay_of(exported, model, as_list(logs) or given, holdout, progress)
        error = replay.error
        progress("replaying the log in the target")
        in_target, replayed = chosen.replay(exported, replay) if chosen.replay else (None, "nothing runs there")
    notes = tuple(_notes(exported, target, files))
    ledger = Ledger(
        target, model.plant, chosen.carried(exported), error, in_target, replayed, notes,
        {name: hashlib.sha256(_bytes(file)).hexdigest() for name, file in files.items()},
    )  # fmt: skip
    return Export(ledger, {**files, LEDGER_TEXT: ledger.text(), LEDGER_JSON: dumps(to_json(ledger)) + "\n"})


def checked_request(target: str, period: float | None, folder: Path) -> None:
    """Raise Failure where a target is unknown, a period [s] makes no sense, or a folder cannot be written in."""
    _target(target)
    if period is not None and not PERIOD_LIMITS_S[0] <= period <= PERIOD_LIMITS_S[1]:
        raise Failure(f"--period must be the seconds between two samples, {PERIOD_LIMITS_S[0]:g} to "
                      f"{PERIOD_LIMITS_S[1]:g}, not {period:g}.")  # fmt: skip
    if folder.exists() and not folder.is_dir():
        raise Failure(f"An export is written into a folder, but {folder} is a file. Name another with -o.")


def _target(name: str) -> Target:
    if name not in EXPORT_TARGETS:
        raise Failure(
            f"The target must be one of {', '.join(EXPORT_TARGETS)}, not '{name}'.{did_you_mean(name, EXPORT_TARGETS)}"
        )
    return EXPORT_TARGETS[name]


def write_export(export: Export, folder: Path) -> None:
    """Write an export into a folder, which is made; raises Failure where that holds a file that no export wrote.

    A file that an earlier export wrote and nobody changed since is replaced.
    """
    known = _known_files(folder)
    content = export.content()
    new = {name: hashlib.sha256(held).hexdigest() for name, held in content.items()}
    for name in export.files:
        path = folder / name
        own = (known.get(name), new[name])  # the latter of an export that was killed before its ledger was written
        if path.exists() and name not in (LEDGER_TEXT, LEDGER_JSON) and _digest(path) not in own:
            raise Failure(f"An export must not overwrite what it did not write, but {path} is there and "
                          f"{'was changed since' if name in known else 'is none of its files'}. Move it, or name "
                          "another folder with -o.")  # fmt: skip
    for ledger in (folder / LEDGER_TEXT, folder / LEDGER_JSON):
        if ledger.exists() and not known and _digest(ledger) != new[ledger.name]:
            raise Failure(f"An export must not overwrite what it did not write, but {ledger} is there. Move it, or "
                          "name another folder with -o.")  # fmt: skip
    for name in export.files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    write_files(folder, content)


def _bytes(file: str | bytes) -> bytes:
    return file.encode() if isinstance(file, str) else file


def _known_files(folder: Path) -> dict[str, str]:
    """SHA-256 by path of what an earlier export wrote there; nothing where its ledger is none."""
    path = folder / LEDGER_JSON
    try:
        if not path.is_file() or path.stat().st_size > MAX_LEDGER_BYTES:
            return {}
        ledger = json.loads(path.read_text(encoding="utf-8"))
        known = {str(k): str(v) for k, v in ledger["files"].items()}
        return known if ledger["schema"] == 1 and ledger["target"] in EXPORT_TARGETS else {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def _notes(exported: ExportedModel, target: str, files: Files) -> list[str]:
    """What else is not as in the model."""
    if target == "json":
        return []
    if target == "fmu":
        return fmu_notes(files)
    if target == "mujoco":
        return mujoco_notes(exported)
    notes = []
    if exported.inputs > 1:
        notes.append("There is no compensator: several inputs drive the machine.")
    elif (compensation := compensation_of(exported)) is None:
        notes.append("There is no compensator: none of the model's effects can be taken away by a command.")
    else:
        left = ", ".join(e for e in exported.model.effects if e not in compensation.effects)
        notes.append(f"The compensator takes {', '.join(compensation.effects)} away, each by two standard errors less "
                     f"than identified{left and f'; not {left}'}.")  # fmt: skip
    if exported.module.SENSOR_DELAY >= 0:
        notes.append("Observer and identifier take the readings of late sensors as if they were prompt.")
    if any(s.lags for s in exported.sources):
        notes.append("Observer and identifier take the error of a sensor behind a low-pass filter as a plain error.")
    if not exported.model.random_force and not exported.model.sensor_error:
        notes.append("No random force stands in model.toml: either `identify --save` was not run, or it left nothing "
                     "to chance. The observer expects a small one.")  # fmt: skip
    return notes
