"""Compiled kernels of a model, derived once per machine and kept under a name that carries their text's hash.

A workspace's `generated/` folder is text for people and for their own programs. The tool itself never executes it as it
finds it: a text is loaded only when it is, letter for letter, what the derivation makes of the model. So opening
somebody else's workspace runs nothing of theirs.

"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import py_compile
import sys
from collections.abc import Sequence
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING

import derive
from wheelpend.kernels.cache import cache_folder, cached_text

if TYPE_CHECKING:
    from wheelpend.kernels.first_use import FirstUseNotice

KERNEL_MODULE_PREFIX = "wheelpend_kernels_"  # of the names of modules


def model_module(plant: str, assumptions: dict, effects: Sequence[str]) -> ModuleType:
    """The model's own module: its effects and no others."""
    return load_module(
        _module_text(plant, derive.plants.settle(plant, assumptions), tuple(effects), library=False), plant
    )


def library_module(
    plant: str, assumptions: dict, user_effects: Sequence[str] = (), released: Sequence[str] = ()
) -> ModuleType:
    """The plant's module with every effect at zero; it does not change when an effect is added to a model.

    ``own`` are names of a user's registered effects. Effects that free something inside the machine are only in it
    where that is named in ``free``: while it is free they cannot be absent.
    """
    text = _module_text(
        plant,
        derive.plants.settle(plant, assumptions),
        tuple(user_effects),
        library=True,
        released=tuple(sorted(released)),
    )
    return load_module(text, "_".join((plant, "library", *sorted(released))))


def free_force_module(plant: str, assumptions: dict, effects: Sequence[str]) -> ModuleType:
    """A module with these effects and no others, and a free force on each row."""
    text = _module_text(plant, derive.plants.settle(plant, assumptions), tuple(effects), library=False, forces=True)
    return load_module(text, f"{plant}_probing")


def released_coordinates(effects: Sequence[str]) -> tuple[str, ...]:
    """What these effects free inside the machine."""
    return tuple(sorted({derive.effects.find(e).frees for e in effects} - {""}))


@lru_cache
def load_module(text: str, name: str) -> ModuleType:
    """Import a derived text under a name with its hash; its machine code is cached beside it."""
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    module_name = f"{KERNEL_MODULE_PREFIX}{name}_{digest}"
    if module_name in sys.modules:
        return sys.modules[module_name]
    path = cache_folder() / f"{module_name}.py"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        derive.write(path.parent, {path.name: text})
    if not os.path.exists(importlib.util.cache_from_source(str(path))):
        py_compile.compile(str(path))  # whatever Python is told to write: this folder is ours
    from wheelpend.kernels.machine_code import install_fast_load_cache  # imported late: numba is slow to load

    spec = importlib.util.spec_from_file_location(module_name, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    install_fast_load_cache(module)
    first_use_notice()
    return module


@lru_cache
def first_use_notice() -> FirstUseNotice:
    """What says so when something is derived or compiled that later runs find."""
    from wheelpend.kernels.first_use import (
        FirstUseNotice,  # imported late: a module that is loaded imports numba anyway
    )

    return FirstUseNotice(KERNEL_MODULE_PREFIX)


def _module_text(
    plant: str,
    assumptions: dict,
    effects: tuple[str, ...],
    library: bool,
    released: tuple[str, ...] = (),
    forces: bool = False,
) -> str:
    """Text of a module with these effects, on request with a force on each row; or of the library with these besides
    its own, and with what is free.
    """
    own = sorted(repr(derive.effects.OWN[n]) for n in effects if n in derive.effects.OWN)
    decides = (sorted(assumptions.items()), sorted(effects), own, library, released, forces)

    def derived() -> str:
        if library:
            first_use_notice().print_once(
                "Deriving the equations with every effect, once per machine; later runs find them derived."
            )
            model = derive.library_model(plant, assumptions, effects, released)
            return derive.render(model, title=" ".join((plant, "with every effect", *(f"and {f}" for f in released))))
        return derive.render(derive.compose(plant, assumptions, effects, missing_force=forces))

    return cached_text("derived", plant, decides, derived)
