"""Kernels of a Model: the generated files of its workspace, and the modules that the tool loads for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from wheelpend.errors import Failure
from wheelpend.kernels.load import _module_text, library_module, load_module, released_coordinates

if TYPE_CHECKING:
    from wheelpend.model.record import Model


def derived_files(model: Model) -> dict[str, str]:
    """Generated files of a model, from the cache where the same model was derived before."""
    return {
        "__init__.py": '"""Kernels generated from model.toml by `wheelpend generate`."""\n',
        f"{model.plant}.py": _module_text(model.plant, model.assumptions, tuple(model.effects), library=False),
        f"{model.plant}_library.py": _module_text(
            model.plant, model.assumptions, model.own, library=True, released=released_coordinates(model.effects)
        ),
    }


def library_module_of(model: Model, effects: Sequence[str] = ()) -> ModuleType:
    """The library's module of a model's plant, assumptions and own effects, with what it or further effects free."""
    return library_module(model.plant, model.assumptions, model.own, released_coordinates((*model.effects, *effects)))


def load_kernels(workspace: str | Path = ".") -> ModuleType:
    """Return the generated module of a workspace, compiled on first use.

    Raises Failure where the folder holds no model or its `generated/` is not what the model derives to.
    """
    from wheelpend.model.record import Model

    model = Model.open(workspace)
    path = model.workspace / "generated" / f"{model.plant}.py"
    derived = derived_files(model)[path.name]
    if not path.exists() or path.read_text(encoding="utf-8") != derived:
        raise Failure(f"{path} must be what {model.path} derives to, but it is missing, stale or edited. "
                      "Run `wheelpend generate` there.")  # fmt: skip
    return load_module(derived, model.plant)
