"""Compiled kernels of a model, derived once per machine and kept under a name that carries their text's hash.

A workspace's `generated/` folder is text for people and for their own programs. The tool itself never executes it as it
finds it: a text is loaded only when it is, letter for letter, what the derivation makes of the model. So opening
somebody else's workspace runs nothing of theirs.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import derive
from derive.emit import TEMPLATES
from wheelpend.failures import Failure

if TYPE_CHECKING:
    from wheelpend.model import Model


def cache_folder() -> Path:
    """Where texts and machine code are kept: $WHEELPEND_CACHE, else the user's cache, else a temporary folder."""
    root = os.environ.get("WHEELPEND_CACHE") or os.environ.get("XDG_CACHE_HOME")
    folder = Path(root) / "wheelpend" if root else Path.home() / ".cache" / "wheelpend"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"wheelpend-{os.getuid()}"
        folder.mkdir(parents=True, exist_ok=True)
        return folder


@lru_cache
def derivation_fingerprint() -> str:
    """Hash of everything that decides what the derivation produces: its sources, its templates, sympy and Jinja."""
    from importlib.metadata import version

    digest = hashlib.sha256((version("sympy") + version("jinja2")).encode())
    for path in sorted([*Path(derive.__file__).parent.rglob("*.py"), *TEMPLATES.glob("*.j2")]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def derived_files(model: Model) -> dict[str, str]:
    """Generated files of a model, from the cache where the same model was derived before."""
    return {
        "__init__.py": '"""Kernels generated from model.toml by `wheelpend generate`."""\n',
        f"{model.plant}.py": _text(model.plant, model.assumptions, tuple(model.effects), library=False),
        f"{model.plant}_library.py": _text(
            model.plant, model.assumptions, model.own, library=True, free=freed_by(model.effects)
        ),
    }


def lean(plant: str, assumptions: dict, effects: Sequence[str]) -> ModuleType:
    """The model's own module: its effects and no others."""
    return load(_text(plant, derive.plants.settle(plant, assumptions), tuple(effects), library=False), plant)


def library(plant: str, assumptions: dict, own: Sequence[str] = (), free: Sequence[str] = ()) -> ModuleType:
    """The plant's module with every effect at zero; it does not change when an effect is added to a model.

    ``own`` are names of a user's registered effects. Effects that free something inside the machine are only in it
    where that is named in ``free``: while it is free they cannot be absent.
    """
    text = _text(plant, derive.plants.settle(plant, assumptions), tuple(own), library=True, free=tuple(sorted(free)))
    return load(text, "_".join((plant, "library", *sorted(free))))


def probing(plant: str, assumptions: dict, effects: Sequence[str]) -> ModuleType:
    """A module with these effects and no others, and a free force on each row."""
    text = _text(plant, derive.plants.settle(plant, assumptions), tuple(effects), library=False, forces=True)
    return load(text, f"{plant}_probing")


def library_of(model: Model, effects: Sequence[str] = ()) -> ModuleType:
    """The library's module of a model's plant, assumptions and own effects, with what it or further effects free."""
    return library(model.plant, model.assumptions, model.own, freed_by((*model.effects, *effects)))


def freed_by(effects: Sequence[str]) -> tuple[str, ...]:
    """What these effects free inside the machine."""
    return tuple(sorted({derive.effects.find(e).frees for e in effects} - {""}))


def load(text: str, name: str) -> ModuleType:
    """Import a derived text under a name with its hash; its machine code is cached beside it."""
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    module_name = f"wheelpend_kernels_{name}_{digest}"
    if module_name in sys.modules:
        return sys.modules[module_name]
    path = cache_folder() / f"{module_name}.py"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        derive.write(path.parent, {path.name: text})
    spec = importlib.util.spec_from_file_location(module_name, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    return module


def load_kernels(workspace: str | Path = ".") -> ModuleType:
    """Return the generated module of a workspace, compiled on first use.

    Raises Failure where the folder holds no model or its `generated/` is not what the model derives to.
    """
    from wheelpend.model import Model

    model = Model.open(workspace)
    path = model.workspace / "generated" / f"{model.plant}.py"
    derived = derived_files(model)[path.name]
    if not path.exists() or path.read_text(encoding="utf-8") != derived:
        raise Failure(f"{path} must be what {model.path} derives to, but it is missing, stale or edited. "
                      "Run `wheelpend generate` there.")  # fmt: skip
    return load(derived, model.plant)


def _text(
    plant: str,
    assumptions: dict,
    effects: tuple[str, ...],
    library: bool,
    free: tuple[str, ...] = (),
    forces: bool = False,
) -> str:
    """Text of a module with these effects, on request with a force on each row; or of the library with these besides
    its own, and with what is free.
    """
    own = sorted(repr(derive.effects.OWN[n]) for n in effects if n in derive.effects.OWN)
    place = (plant, derive.plants.fingerprint(plant))
    decides = (place, sorted(assumptions.items()), sorted(effects), own, library, free, forces)
    key = repr((*decides, derivation_fingerprint()))
    path = cache_folder() / f"derived_{hashlib.sha256(key.encode()).hexdigest()[:24]}.txt"
    if path.exists():
        return path.read_text(encoding="utf-8")
    if library:
        model = derive.library_model(plant, assumptions, effects, free)
        text = derive.render(model, title=" ".join((plant, "with every effect", *(f"and {f}" for f in free))))
    else:
        text = derive.render(derive.compose(plant, assumptions, effects, missing_force=forces))
    derive.write(path.parent, {path.name: text})
    return text
