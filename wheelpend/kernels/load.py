"""Compiled kernels of a model, derived once per machine and kept under a name that carries their text's hash.

A workspace's `generated/` folder is text for people and for their own programs. The tool itself never executes it as it
finds it: a text is loaded only when it is, letter for letter, what the derivation makes of the model. So opening
somebody else's workspace runs nothing of theirs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import cast

import derive
from wheelpend.isolation import import_configured
from wheelpend.kernels.cache import cached_text
from wheelpend.kernels.cache_folder import cache_folder
from wheelpend.kernels.first_use import first_use_notice
from wheelpend.kernels.generated_text import generated_name, import_text, write_unless_there
from wheelpend.kernels.kernel_module import KernelModule

DERIVING_NOTICE = "Deriving the equations with every effect, once per machine; later runs find them derived."


def model_module(plant: str, assumptions: dict, effects: Sequence[str]) -> KernelModule:
    """The model's own module: its effects and no others."""
    return load_module(model_text(plant, derive.plants.complete_assumptions(plant, assumptions), effects), plant)


def library_module(
    plant: str, assumptions: dict, user_effects: Sequence[str] = (), released: Sequence[str] = ()
) -> KernelModule:
    """The plant's module with every effect at zero; it does not change when an effect is added to a model.

    ``user_effects`` are names of a user's registered effects, which it holds too. ``released`` are internal
    coordinates: the effects that release one are only in the module where it is named, since they cannot be absent
    while it is free.
    """
    text = library_text(plant, derive.plants.complete_assumptions(plant, assumptions), user_effects, released)
    return load_module(text, "_".join((plant, "library", *sorted(released))))


def free_force_module(plant: str, assumptions: dict, effects: Sequence[str]) -> KernelModule:
    """A module with these effects and no others, and a free force on each row."""
    text = model_text(plant, derive.plants.complete_assumptions(plant, assumptions), effects, missing_force=True)
    return load_module(text, f"{plant}_probing")


def released_coordinates(effects: Sequence[str]) -> tuple[str, ...]:
    """Internal coordinates that these effects release, sorted."""
    return tuple(sorted({derive.effects.find(e).releases for e in effects} - {""}))


def model_text(plant: str, assumptions: dict, effects: Sequence[str], missing_force: bool = False) -> str:
    """Text of a module with these effects and no others, on request with a free force on each row.

    ``assumptions`` are settled: every one of the plant's has its choice.
    """

    def derived_text() -> str:
        return derive.render(derive.compose(plant, assumptions, tuple(effects), missing_force=missing_force))

    return _cached_module_text(plant, assumptions, effects, (False, (), missing_force), derived_text)


def real_time_text(plant: str, assumptions: dict, effects: Sequence[str]) -> str:
    """Text of a module of loops in real time with these effects; ``assumptions`` are settled."""

    def derived_text() -> str:
        return derive.render(derive.compose(plant, assumptions, tuple(effects), missing_force=True), frame="real_time")

    return _cached_module_text(plant, assumptions, effects, ("real_time",), derived_text)


def library_text(plant: str, assumptions: dict, user_effects: Sequence[str] = (), released: Sequence[str] = ()) -> str:
    """Text of a module with every effect of the library and these of the user, under settled assumptions."""
    coordinates = tuple(sorted(released))

    def derived_text() -> str:
        first_use_notice().print_once(DERIVING_NOTICE)
        model = derive.library_model(plant, assumptions, tuple(user_effects), coordinates)
        title = " ".join((plant, "with every effect", *(f"and {name}" for name in coordinates)))
        return derive.render(model, title=title)

    return _cached_module_text(plant, assumptions, user_effects, (True, coordinates, False), derived_text)


def _cached_module_text(
    plant: str, assumptions: dict, effects: Sequence[str], options: tuple, derived_text: Callable[[], str]
) -> str:
    """A module's text from the cache; the rows of the user's effects decide it as well as the names."""
    rows = sorted(repr(derive.effects.USER_EFFECTS[n]) for n in effects if n in derive.effects.USER_EFFECTS)
    depends_on = (sorted(assumptions.items()), sorted(effects), rows, *options)
    return cached_text("derived", plant, depends_on, derived_text)


@lru_cache
def load_module(text: str, name: str) -> KernelModule:
    """Import a derived text under a name with its hash; its machine code is cached beside it."""
    data = text.encode()
    module_name = generated_name(name, data)
    if module_name not in sys.modules:
        path = cache_folder() / f"{module_name}.py"
        write_unless_there(path, data)
        import_configured("numba")
        from wheelpend.kernels.kernel_files import install_cache  # imported late: numba is slow to load
        from wheelpend.kernels.machine_code import FastLoadCache

        install_cache(import_text(module_name, path, data), FastLoadCache)
    return cast(KernelModule, sys.modules[module_name])
