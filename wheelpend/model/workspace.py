"""A workspace: model.toml, the code generated from it, and the history of its changes with their errors."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import derive
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.model.toml_file import MODEL_FILE
from wheelpend.serialise import plain_data

HISTORY_FILE = "history.json"


class HistoryEntry(NamedTuple):
    """A change of the model, and the validation errors [σ] before and after it where it was refitted."""

    change: str  # add or remove, and the effect
    error_before: float | None
    error_after: float | None
    logs: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The entry under the keys of history.json."""
        return {
            "change": self.change,
            "error_before": self.error_before,
            "error_after": self.error_after,
            "logs": self.logs,
        }


def create(folder: Path, plant: str = derive.plants.DEFAULT_PLANT, text: str = "") -> Model:
    """Start a workspace with a first model of a plant, or that of a text; raises Failure where there is one already."""
    path = folder / MODEL_FILE
    if path.exists():
        raise Failure(f"{folder} must not hold a model yet, but {path} exists. Choose another folder.")
    model = Model.parse(text) if text else Model.default(plant)
    folder.mkdir(parents=True, exist_ok=True)
    write_generated_code(folder / "generated", model)
    return model.save(path)


def write_generated_code(folder: Path, model: Model) -> None:
    """Derive the model and write its generated code."""
    derive.write(folder, model_kernels.derived_files(model))


def generated_code_diff(model: Model) -> str:
    """Unified diff from the workspace's generated code to what its model derives to; empty where they agree."""
    files = model_kernels.derived_files(model)
    return derive.differences(model.workspace / "generated", files)


def save(model: Model, entries: Sequence[HistoryEntry] = ()) -> None:
    """Save generated code, model and history, in this order: what was interrupted is not in the history."""
    folder = model.workspace
    model_kernels.derived_files(model)  # a model that does not derive changes nothing
    changes = [*history(folder), *map(plain_data, entries)]  # read first: one that cannot be read changes nothing
    write_generated_code(folder / "generated", model)
    model.save()
    if entries:
        write_text(folder / HISTORY_FILE, json.dumps(changes, indent=1))


def history(folder: Path) -> list[dict]:
    """Every recorded change, oldest first; raises Failure where the file cannot be read."""
    path = folder / HISTORY_FILE
    if not path.exists():
        return []
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise Failure(f"{path} must be JSON, but it is not ({error}). Move it away to start a new history.") from None
    return entries if isinstance(entries, list) else []
