"""A workspace: model.toml, the code generated from it, and the history of its changes with their errors."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from datetime import date
from errno import ENOTDIR
from pathlib import Path
from typing import Any, NamedTuple

import derive
from wheelpend.errors import Failure
from wheelpend.files import read_text, write_errors
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.model.toml_file import MODEL_FILE
from wheelpend.model.transaction import GENERATED_FOLDER, finish_change, held, replace_together
from wheelpend.serialise import plain_data

HISTORY_FILE = "history.json"


class HistoryEntry(NamedTuple):
    """A change of the model; where it was refitted the validation errors [σ] before and after it, and its parameters.

    In history.json it has the date on which it was saved, too.
    """

    change: str  # add or remove, and the effect
    error_before: float | None
    error_after: float | None
    logs: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, float | None]] = {}  # as fitted with it: value and sigma by name

    def to_json(self) -> dict[str, Any]:
        """The entry under the keys of history.json."""
        return {
            "change": self.change,
            "error_before": self.error_before,
            "error_after": self.error_after,
            "logs": self.logs,
            "parameters": self.parameters,
        }


def create(folder: Path, plant: str = derive.plants.DEFAULT_PLANT, text: str = "") -> Model:
    """Start a workspace with a first model of a plant, or that of a text; raises Failure where there is one already."""
    check_new(folder)
    path = folder / MODEL_FILE
    model = Model.parse(text) if text else Model.default(plant)
    files = {**generated_code(model), MODEL_FILE: model.text.encode()}
    with write_errors(str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
    with held(folder):
        finish_change(folder)
        check_new(folder)
        replace_together(folder, files)
    return Model.open(path)


def check_new(folder: Path) -> None:
    """Raise Failure where no workspace can begin in a folder, as far as can be told before it does."""
    path = folder / MODEL_FILE
    with write_errors(str(folder)):
        there = next(p for p in (folder, *folder.absolute().parents) if p.exists())
        if not there.is_dir():
            raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(there))
        if path.exists():
            raise Failure(f"{folder} must not hold a model yet, but {path} exists. Choose another folder.")


def generated_code(model: Model) -> dict[str, bytes]:
    """The model's generated code by its place in a workspace."""
    return {f"{GENERATED_FOLDER}/{name}": text.encode() for name, text in model_kernels.derived_files(model).items()}


def generate(model: Model) -> Path:
    """Derive the model and write its generated code; returns the folder."""
    replace_together(model.workspace, generated_code(model))
    return model.workspace / GENERATED_FOLDER


def generated_code_diff(model: Model) -> str:
    """Unified diff from the workspace's generated code to what its model derives to; empty where they agree."""
    files = model_kernels.derived_files(model)
    return derive.differences(model.workspace / GENERATED_FOLDER, files)


def save(model: Model, entries: Sequence[HistoryEntry] = (), *, opened: Model | None = None) -> None:
    """Save generated code, model and history together.

    Raises Failure, and changes nothing, where one of them cannot be read or written, and where the model file is no
    longer as it was ``opened``.
    """
    folder, path = model.workspace, model.path
    if path is None:
        raise Failure("A model needs a path to be saved at; this one has none yet.")
    files = {**generated_code(model), path.name: model.text.encode()}
    with held(folder):
        if opened is not None:
            require_unchanged(opened)
        if entries:
            today = {"date": date.today().isoformat()}
            changes = [*history(folder), *(plain_data(entry) | today for entry in entries)]
            files[HISTORY_FILE] = json.dumps(changes, indent=1).encode()
        replace_together(folder, files)


def save_values(opened: Model, model: Model) -> None:
    """Save a model whose values are new; raises Failure where its file is no longer as it was opened."""
    with held(opened.workspace):
        require_unchanged(opened)
        model.save()


def require_unchanged(opened: Model) -> None:
    """Raise Failure where a model's file has changed since it was opened: what was found is of another model."""
    if opened.path is not None and Model.open(opened.path).text != opened.text:
        raise Failure(
            f"{opened.path} must stay as it is until a command has ended that saves it, but it was changed meanwhile. "
            "Nothing was saved; run the command again."
        )


def history(folder: Path) -> list[dict]:
    """Every recorded change, oldest first; raises Failure where the file cannot be read."""
    path = folder / HISTORY_FILE
    if not path.exists():
        return []
    text = read_text(path)
    try:
        entries = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Failure(f"{path} must be JSON, but it is not ({error}). Move it away to start a new history.") from None
    if not (isinstance(entries, list) and all(isinstance(entry, dict) for entry in entries)):
        raise Failure(f"{path} must be a list of changes, but it is not. Move it away to start a new history.")
    return entries
