"""What an export carries, what it cannot carry, and how large its error is where it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import derive

Carriage = Literal["exactly", "approximately", "not"]


@dataclass(frozen=True)
class Carried:
    """How a target carries an effect."""

    carried: Carriage
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """The entry under the keys of JSON."""
        return {"carried": self.carried, "note": self.note}


@dataclass(frozen=True)
class Ledger:
    """An export's account of itself: EXPORT.md and EXPORT.json."""

    target: str
    plant: str
    effects: Mapping[str, Carried]
    error: float | None = None  # ours on the replayed log [σ]
    error_in_target: float | None = None  # of the same log, run in the target [σ]
    replayed: str = ""  # on what, with what; or why not
    notes: tuple[str, ...] = ()  # on what else is not as in the model
    files: Mapping[str, str] = field(default_factory=dict)  # SHA-256 by path

    def to_json(self) -> dict[str, Any]:
        """The ledger under the keys of JSON."""
        return {
            "target": self.target,
            "plant": self.plant,
            "effects": dict(self.effects),
            "error": self.error,
            "error_in_target": self.error_in_target,
            "replayed": self.replayed,
            "notes": list(self.notes),
            "files": dict(self.files),
        }

    def text(self) -> str:
        """EXPORT.md."""
        lines = [
            f"# Export of {self.plant} to {self.target}",
            "",
            "What of the model is in these files, written by `wheelpend export`. Export again instead of editing them.",
            "",
            "| effect | carried | |",
            "|---|---|---|",
            *(f"| {_words(name)} | {c.carried} | {c.note} |" for name, c in self.effects.items()),
        ]
        lines = lines if self.effects else [*lines[:3], "", "The model has no effects beside its plant."]
        lines += ["", *self.error_lines()]
        if self.notes:
            lines += ["", "Also:", "", *(f"- {note}" for note in self.notes)]
        lines += ["", "Files:", "", *(f"- `{name}`" for name in sorted(self.files))]
        return "\n".join(lines) + "\n"

    def error_lines(self) -> list[str]:
        """The errors of the replay, or why there is none."""
        if self.error is None:
            return [f"No log was replayed: {self.replayed}."]
        if self.error_in_target is None:
            return [f"Error of the model on the log: {self.error:.4g} σ. In the target: not known, {self.replayed}."]
        return [
            f"Error on the log, from the same states: {self.error:.4g} σ of the model, {self.error_in_target:.4g} σ in "
            f"the target ({self.replayed})."
        ]


def _words(effect: str) -> str:
    return f"`{effect}`: {derive.effects.find(effect).sentence}"


def all_exactly(effects: Sequence[str]) -> dict[str, Carried]:
    """The entries of a target that has the kernels themselves."""
    return {name: Carried("exactly") for name in effects}
