"""Findings of an inspection, and the lines of a model.toml that cure them."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from wheelpend.logs.columns import DEFAULT_TABLE, HELD_AFTER, HELD_BEFORE, ColumnMap, ColumnTable, guess_input_unit
from wheelpend.logs.finding import Finding
from wheelpend.logs.units import unit_ending

__all__ = ["Finding", "LogCorrections", "with_consistent_signs", "with_settings"]

COLUMN_KEYS = ("column", "unit", "sign", "scale", "offset", "times", "smooth", "held")  # of an entry of [columns]
CURING_KEYS = {  # of an entry of [columns], by the kind of finding that they cure
    "flipped_sign": ("sign", "offset"),
    "wrong_unit": ("unit", "scale"),
    "counts": ("scale",),
    "noisy_input": ("smooth",),
    "late_command": ("held",),
    "swapped_channels": COLUMN_KEYS,
}
ENCODER_SETTINGS = {  # what cures a finding on what an encoder is read against
    "relative_encoder": {"sensors.encoder": "relative"},
    "absolute_encoder": {"sensors.encoder": "absolute"},
    "relative_second_encoder": {"assumptions.second_encoder": "relative"},
    "absolute_second_encoder": {"assumptions.second_encoder": "absolute"},
}


@dataclass
class LogCorrections:
    """Corrections that would cure a log: column, unit and sign of each quantity, and the encoders' reference."""

    known: Mapping[str, ColumnMap]  # with which the log was read
    table: ColumnTable = DEFAULT_TABLE  # of the plant
    guessed: Collection[str] = ()  # of the quantities, those whose column was guessed
    source: dict[str, str] = field(default_factory=dict)  # quantity: the one whose column holds it
    unit: dict[str, str] = field(default_factory=dict)
    sign: dict[str, int] = field(default_factory=dict)
    scale: dict[str, float] = field(default_factory=dict)  # by which a column is multiplied beside how it was read
    smooth: dict[str, float] = field(default_factory=dict)  # s, of inputs
    late: set[str] = field(default_factory=set)  # inputs that act since the row before
    encoder: str = ""  # absolute or relative, where the declared one is wrong
    second_encoder: str = ""  # likewise of a second link's
    rate_delay_samples: float = 0.0  # samples by which a rate lags its angle; no line of a model file cures that

    def text(self) -> str:
        """Sections of a model.toml that cure a log; empty when there is nothing to cure."""
        corrected = {
            *self.guessed,
            *self.source,
            *self.unit,
            *self.scale,
            *self.smooth,
            *self.late,
            *(c for c, sign in self.sign.items() if sign < 0),
        }
        names = [c for c in self.table.names if c in corrected]
        lines = ["[columns]", *(f"{name} = {self.column(name)}" for name in names)] if names else []
        lines += [""] * bool(lines and self.encoder)
        lines += ["[sensors]", f'encoder = "{self.encoder}"'] if self.encoder else []
        if self.second_encoder:
            lines += [*([""] if lines else []), "[assumptions]", f'second_encoder = "{self.second_encoder}"']
        unit = self.other_input_unit
        lines += [*([""] if lines else []), "[input]", f'unit = "{unit}"'] if unit else []
        return "".join(f"{line}\n" for line in lines)

    @property
    def other_input_unit(self) -> str:
        """The unit of the input by the name of its guessed column, where that is another than the plant's."""
        name = self.table.input
        found = guess_input_unit(self.known[name].column) if name in self.guessed and name in self.known else ""
        return found if found != self.table.units.get(name) else ""

    def column(self, name: str) -> str:
        """Entry of [columns] for a quantity, on top of how it was read."""
        wanted = self.column_map(name)
        parts = [
            f"column = {json.dumps(wanted.column, ensure_ascii=False)}",
            *([f'unit = "{wanted.unit}"'] if wanted.unit else []),
            *([f"scale = {wanted.scale!r}"] if wanted.scale != 1.0 else []),
            *(["sign = -1"] if wanted.sign < 0 else []),
            *([f"offset = {wanted.offset:.9g}"] if wanted.offset else []),
            *([f"times = {json.dumps(wanted.times, ensure_ascii=False)}"] if wanted.times else []),
            *([f"smooth = {wanted.smooth!r}"] if wanted.smooth else []),
            *([f'held = "{wanted.held}"'] if wanted.held != HELD_AFTER else []),
        ]
        return "{ " + ", ".join(parts) + " }"

    def column_map(self, name: str) -> ColumnMap:
        """How a quantity should be read, on top of how it was."""
        source = self.source.get(name, name)
        known = self.known.get(source, ColumnMap(source))
        unit = self.unit.get(name, known.unit if source == name else "")
        if name == self.table.input and self.other_input_unit:
            ending = unit_ending(self.other_input_unit, known.column)
            unit = ending if ending != self.other_input_unit else ""
        turn = self.sign.get(name, 1)
        scale = known.scale * self.scale.get(name, 1.0)
        smooth = self.smooth.get(name, known.smooth if source == name else 0.0)
        held = HELD_BEFORE if name in self.late else known.held
        return ColumnMap(known.column, unit, known.sign * turn, scale, known.offset * turn, known.times, smooth, held)

    def column_settings(self, name: str, keys: Collection[str] = COLUMN_KEYS) -> dict[str, Any]:
        """What `wheelpend set` would change of how a quantity is read: these keys, and a column that was guessed."""
        stated = self.known.get(name) if name not in self.guessed else None
        before = vars(stated or ColumnMap(name))
        wanted = {k: v for k, v in vars(self.column_map(name)).items() if v != before[k]}
        return {f"columns.{name}.{k}": v for k, v in wanted.items() if k in keys or k == "column"}

    def settings_for(self, finding: Finding) -> Mapping[str, Any]:
        """What cures a finding; empty where that is not for the model file to say."""
        if finding.kind in ENCODER_SETTINGS:
            return ENCODER_SETTINGS[finding.kind]
        keys = CURING_KEYS.get(finding.kind, ())
        names = [n for n in finding.channel.split(" and ") if n in self.table.names]
        found = [self.column_settings(n, keys) for n in names] if keys else []
        curing = [s for s in found if any(key.rpartition(".")[2] in keys for key in s)]
        return {key: value for settings in curing for key, value in settings.items()}

    def sign_cure(self, name: str) -> str:
        """What to do about a quantity that counts the other way than it was read."""
        if self.known.get(self.source.get(name, name), ColumnMap(name)).sign < 0:
            return f"Map {name} in [columns] without its sign = -1."
        return f"Map {name} in [columns] with sign = -1."


def with_consistent_signs(findings: list[Finding], corrections: LogCorrections) -> list[Finding]:
    """The findings, those on signs saying just what the corrections propose: one for each quantity turned round."""
    turned = sorted(c for c, sign in corrections.sign.items() if sign < 0)
    known = {f.channel: f for f in findings if f.kind == "flipped_sign"}
    kept = [f for f in findings if f.kind != "flipped_sign"]
    for name in turned:
        against = corrections.table.rates.get(name, "the other channels")
        unsure = f"{name} counts the other way than {against}; which of the two is wrong, this log does not tell."
        sentence = known[name].sentence if name in known else unsure
        kept.append(Finding("flipped_sign", name, sentence, corrections.sign_cure(name), None))
    return kept


def with_settings(findings: list[Finding], corrections: LogCorrections) -> tuple[Finding, ...]:
    """The findings, each with what `wheelpend set` takes to cure it."""
    return tuple(f._replace(settings=corrections.settings_for(f)) for f in findings)
