"""A law's terms as effects of one's own: texts, parameters, and the tables that effects.toml holds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from derive import effects as library
from derive.parameter_name import full_name
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.missing_force.law_terms import Term
from wheelpend.model.user_effects import effect_from_table

FAMILY_BY_PORT = {"drive": "drive", "ground": "ground", "body": "body"}  # of an effect, by the port it acts on
LAW_EFFECT_SENTENCE = "A free-form law that was fitted to what no effect explained."


class LawEffect(NamedTuple):
    """The terms that act on one port, as an effect of one's own."""

    name: str
    on: str
    law: str
    parameters: dict[str, dict[str, Any]]  # of the table: unit, scope, starts, minimum
    origin: dict[str, tuple[int, str]]  # for each parameter its term's number and its name there

    def table(self, values: Mapping[str, float]) -> dict[str, Any]:
        """The effect as a table of effects.toml, with the estimated size as the typical one."""
        parameters = {}
        for name, given in self.parameters.items():
            found = values.get(full_name(self.name, name), given.get("starts", [0.1])[0])
            value = float(f"{found:.4g}") or 0.1
            shape = {"starts": [value]} if "starts" in given else {}
            parameters[name] = {**given, "typical": value, **shape}
        return {
            "family": FAMILY_BY_PORT.get(self.on, "body"),
            "sentence": LAW_EFFECT_SENTENCE,
            "on": self.on,
            "law": self.law,
            "parameters": parameters,
        }


def effects_from_terms(terms: Mapping[int, Term], name: str) -> tuple[LawEffect, ...]:
    """The effects that numbered terms make: one for each port, and one apart for dry friction.

    A single one has the given name, several have the port added.
    """
    groups: dict[tuple[str, bool], list[int]] = {}
    for number, term in terms.items():
        groups.setdefault((term.port, term.dry), []).append(number)
    single = len(groups) == 1
    return tuple(
        _effect(name if single else f"{name}_{port}{'_dry' if dry else ''}", port, {n: terms[n] for n in numbers})
        for (port, dry), numbers in groups.items()
    )


def _effect(name: str, port: str, terms: Mapping[int, Term]) -> LawEffect:
    texts: list[str] = []
    parameters: dict[str, dict[str, Any]] = {}
    origin: dict[str, tuple[int, str]] = {}
    for number, term in terms.items():
        new = {n: f"{n}_{number}" for n in (*(s for s, _ in term.sizes), *(s.name for s in term.shapes))}
        texts.append(rename_symbols(term.text, new))
        for size, unit in term.sizes:
            parameters[new[size]] = {"unit": unit, **({"scope": "per log"} if term.per_log else {})}
        for shape in term.shapes:
            parameters[new[shape.name]] = {"unit": shape.unit, "starts": [shape.value]}
            if shape.minimum is not None:
                parameters[new[shape.name]]["minimum"] = float(f"{shape.minimum:.3g}")
        origin |= {n: (number, old) for old, n in new.items()}
    return LawEffect(name, port, " + ".join(texts), parameters, origin)


def rename_symbols(text: str, names: Mapping[str, str]) -> str:
    """A law with other names."""
    return re.sub(r"[A-Za-z_]\w*", lambda match: names.get(match[0], match[0]), text)


def full_parameter_names(effects: Sequence[LawEffect]) -> dict[tuple[int, str], str]:
    """Full name effect.parameter of each number in each term."""
    return {place: full_name(e.name, parameter) for e in effects for parameter, place in e.origin.items()}


def register(effects: Sequence[LawEffect], values: Mapping[str, float], plant: PlantSignature) -> tuple[str, ...]:
    """Make a law's effects known, for kernels and fits; returns their names."""
    return library.register([effect_from_table(e.name, e.table(values), plant) for e in effects])
