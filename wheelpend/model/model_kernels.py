"""Kernels of a Model: the generated files of its workspace, and the modules that the tool loads for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.errors import Failure
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import library_module, library_text, load_module, model_text, released_coordinates
from wheelpend.model.record import Model


def derived_files(model: Model) -> dict[str, str]:
    """Generated files of a model, from the cache where the same model was derived before."""
    return {
        "__init__.py": '"""Kernels generated from model.toml by `wheelpend generate`."""\n',
        f"{model.plant}.py": model_text(model.plant, model.assumptions, model.effects),
        f"{model.plant}_library.py": library_text(
            model.plant, model.assumptions, model.own, released_coordinates(model.effects)
        ),
    }


def library_module_of(model: Model, effects: Sequence[str] = ()) -> KernelModule:
    """The library's module of a model's plant and assumptions, with what its and further effects release."""
    return library_module(model.plant, model.assumptions, model.own, released_coordinates((*model.effects, *effects)))


def load_kernels(workspace: str | Path = ".") -> KernelModule:
    """Return the generated module of a workspace, compiled on first use.

    Raises Failure where the folder holds no model or its `generated/` is not what the model derives to.
    """
    model = Model.open(workspace)
    path = model.workspace / "generated" / f"{model.plant}.py"
    derived = derived_files(model)[path.name]
    if not path.is_file() or path.read_bytes() != derived.encode():
        raise Failure(f"{path} must be what {model.path} derives to, but it is missing, stale or edited. "
                      "Run `wheelpend generate` there.")  # fmt: skip
    return load_module(derived, model.plant)
