"""A case: hostile files and the commands that meet them, in a form that can be kept, played again and made smaller."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Case:
    """Commands run one after the other in a fresh workspace into which files have been put."""

    kind: str  # what was drawn: what the journal counts
    commands: tuple[tuple[str, ...], ...]
    files: dict[str, bytes] = field(default_factory=dict)  # by name; they replace those of the workspace

    def to_json(self) -> dict[str, Any]:
        """Plain data; bytes that are no text as base64, characters that stand for odd bytes of a name escaped."""
        return {
            "kind": self.kind,
            "commands": [
                [part.encode("utf-8", "surrogateescape").decode("latin-1") for part in c] for c in self.commands
            ],
            "files": {name: base64.b64encode(data).decode() for name, data in self.files.items()},
        }

    @staticmethod
    def of_json(data: dict[str, Any]) -> Case:
        """The case that `to_json` wrote."""
        commands = tuple(
            tuple(part.encode("latin-1").decode("utf-8", "surrogateescape") for part in c) for c in data["commands"]
        )
        return Case(data["kind"], commands, {n: base64.b64decode(text) for n, text in data["files"].items()})

    def size(self) -> int:
        """Characters and bytes that somebody has to read."""
        return sum(map(len, self.files.values())) + sum(len(part) for c in self.commands for part in c)
