"""Accepting a free-form law as an effect of the user's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.errors import Failure
from wheelpend.model.record import Model
from wheelpend.model.user_effects import OWN_FILE

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


def check_name(model: Model, name: str | None) -> None:
    """Raise Failure where a law could not be accepted under this name; before the search, which takes a while."""
    if name is not None:
        from wheelpend.model.user_effects import refuse_taken

        refuse_taken(name, model.own, model.workspace / OWN_FILE)


def accept(model: Model, law: FreeLaw | None, name: str) -> str:
    """Write a law to the workspace's effects.toml under the user's name; returns what to do with it.

    Raises Failure where there is no law.
    """
    if law is None:
        raise Failure(f"There must be a law to accept as {name}, but none was found. Nothing was written.")
    from wheelpend.model.user_effects import write_own

    renamed = law.called(name)
    path = write_own(model.workspace, renamed.tables(), model.nameplate)
    steps = " Then ".join(f"`wheelpend add {effect} --data LOG`" for effect in renamed.laws)
    return f"Wrote {' and '.join(renamed.laws)} to {path}. {steps} adds it to the model."
