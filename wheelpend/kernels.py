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

import derive
from derive.emit import TEMPLATES
from wheelpend.failures import Failure


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


def derived_files(plant: str, assumptions: dict, effects: Sequence[str]) -> dict[str, str]:
    """Generated files of a model, from the cache where the same model was derived before."""
    settled = derive.plants.settle(plant, assumptions)
    return {
        "__init__.py": '"""Kernels generated from model.toml by `wheelpend generate`."""\n',
        f"{plant}.py": _text(plant, settled, tuple(effects), library=False),
        f"{plant}_library.py": _text(plant, settled, (), library=True),
    }


def lean(plant: str, assumptions: dict, effects: Sequence[str]) -> ModuleType:
    """The model's own module: its effects and no others."""
    return load(_text(plant, derive.plants.settle(plant, assumptions), tuple(effects), library=False), plant)


def library(plant: str, assumptions: dict) -> ModuleType:
    """The plant's module with every effect at zero; it does not change when an effect is added to a model."""
    return load(_text(plant, derive.plants.settle(plant, assumptions), (), library=True), f"{plant}_library")


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
    derived = derived_files(model.plant, model.assumptions, model.effects)[path.name]
    if not path.exists() or path.read_text(encoding="utf-8") != derived:
        raise Failure(f"{path} must be what {model.path} derives to, but it is missing, stale or edited. "
                      "Run `wheelpend generate` there.")  # fmt: skip
    return load(derived, model.plant)


@lru_cache(maxsize=64)
def _derive(plant: str, assumptions: tuple, effects: tuple[str, ...], library: bool) -> str:
    settled = dict(assumptions)
    if library:
        return derive.render(derive.library_model(plant, settled), title=f"{plant} with every effect")
    return derive.render(derive.compose(plant, settled, effects))


def _text(plant: str, assumptions: dict, effects: tuple[str, ...], library: bool) -> str:
    key = repr((plant, sorted(assumptions.items()), sorted(effects), library, derivation_fingerprint()))
    path = cache_folder() / f"derived_{hashlib.sha256(key.encode()).hexdigest()[:24]}.txt"
    if path.exists():
        return path.read_text(encoding="utf-8")
    text = _derive(plant, tuple(sorted(assumptions.items(), key=lambda i: i[0])), tuple(effects), library)
    derive.write(path.parent, {path.name: text})
    return text
