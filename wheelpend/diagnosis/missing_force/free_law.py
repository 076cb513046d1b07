"""Accepting a free-form law as an effect of the user's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.errors import Failure
from wheelpend.model.record import Model
from wheelpend.model.toml_file import USER_EFFECTS_FILE

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


def check_law_name(model: Model, name: str | None) -> None:
    """Raise Failure where a law could not be accepted under this name; before the search, which takes a while."""
    if name is not None:
        from wheelpend.model.user_effects import check_name_is_free  # imported late: it takes tomlkit

        check_name_is_free(name, model.own, model.workspace / USER_EFFECTS_FILE)


def accept_law(model: Model, law: FreeLaw | None, name: str) -> str:
    """Write a law to the workspace's effects.toml under the user's name; returns what to do with it.

    Raises Failure where there is no law.
    """
    if law is None:
        raise Failure(f"There must be a law to accept as {name}, but none was found. Nothing was written.")
    from wheelpend.model.user_effects import write_user_effects  # imported late: it takes tomlkit

    renamed = law.with_name(name)
    path = write_user_effects(model.workspace, renamed.tables(), model.plant_signature)
    steps = " Then ".join(f"`wheelpend add {effect} LOG`" for effect in renamed.laws)
    return f"Wrote {' and '.join(renamed.laws)} to {path}. {steps} adds it to the model."
