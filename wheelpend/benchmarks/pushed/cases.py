"""What is hidden in which log of the engine, and which random force acts beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.benchmarks.hidden_effects.cases import benchmark_plant, can_be_hidden, is_supported_by_engine
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS
from wheelpend.benchmarks.random_force.machine import PLACE_WEIGHTS
from wheelpend.diagnosis.likelihood.whitened_scores import DETECTABLE_SIGMAS
from wheelpend.estimation.problem import simpler_effects
from wheelpend.model import model_kernels
from wheelpend.model.record import Model

CASE_KINDS = ("nothing", "single", "left_out")  # in turn
SIZE_RANGE_SIGMAS = (8.0, 30.0)  # standard errors that the true force leaves, drawn evenly on a logarithmic scale
DEFAULT_COUNT = 192  # logs: eight of each kind with each force at each place
CASE_SEED = 21

Sizes = Mapping[str, Mapping[str, float]]  # by effect and parameter, that a log just shows


@dataclass(frozen=True)
class Case:
    """One log."""

    number: int  # its random numbers follow from it
    kind: str  # nothing, single or left_out
    force: str
    place: str
    effect: str = ""
    sigmas: float = 0.0  # size of the effect, in standard errors that the force leaves

    @property
    def key(self) -> str:
        """Unique name, under which the outcome is stored."""
        hidden = f"{self.effect} {self.sigmas:g} σ" if self.effect else ""
        return " ".join(filter(None, (str(self.number), self.kind, self.force, self.place, hidden)))

    @property
    def pilot_key(self) -> str:
        """Name under which the sizes stand that a log with this force just shows."""
        return f"pilot {self.force} {self.place}"

    @property
    def without(self) -> tuple[str, ...]:
        """Effects that the library does not have."""
        return (*alike(self.effect), *including(self.effect)) if self.kind == "left_out" else ()


def alike(effect: str) -> tuple[str, ...]:
    """An effect, and those that the plant's equations cannot tell from it."""
    twins = model_kernels.library_module_of(Model.default(), []).TWINS
    return (effect, *twins.get(effect, ()))


def including(effect: str) -> tuple[str, ...]:
    """Effects that contain one, or approach it."""
    module = model_kernels.library_module_of(Model.default(), [])
    known = (e.name for e in derive.effects.applicable_to(benchmark_plant()))
    return tuple(name for name in known if effect in simpler_effects(module, name))


def plan(count: int = DEFAULT_COUNT) -> list[Case]:
    """The cases, the first so many of them a sample of all."""
    return [_case(number) for number in range(count)]


@cache
def hideable_effects() -> tuple[Effect, ...]:
    """Effects that the engine offers and whose size has a standard error: no events, and no inner parameters."""
    known = (e for e in derive.effects.applicable_to(benchmark_plant()) if can_be_hidden(e))
    sized = (e for e in known if not (e.event or e.releases or e.profiled))
    return tuple(e for e in sized if is_supported_by_engine([(n, 0.0) for n in e.full_names]))


def hidden_values(case: Case, shown: Sizes) -> dict[str, float]:
    """The hidden effect's parameters, of either sign where that is possible."""
    if not case.effect:
        return {}
    effect, sizes = derive.effects.find(case.effect), shown[case.effect]
    both_signs = all(p.minimum < 0.0 for p in effect.parameters)
    sign = (-1.0) ** (case.number // len(CASE_KINDS)) if both_signs else 1.0
    share = sign * case.sigmas / DETECTABLE_SIGMAS / np.sqrt(len(sizes))
    return {effect.name_of(p): float(f"{share * sizes[p.name]:.6g}") for p in effect.parameters}


def _case(number: int) -> Case:
    """Kinds, forces and places in turn, so that all of them meet; effect and size at random."""
    random = np.random.default_rng((CASE_SEED, number))
    turn, kind = number // len(CASE_KINDS), CASE_KINDS[number % len(CASE_KINDS)]
    force = list(FORCE_KINDS)[turn % len(FORCE_KINDS)]
    place = list(PLACE_WEIGHTS)[turn // len(FORCE_KINDS) % len(PLACE_WEIGHTS)]
    effect = hideable_effects()[random.integers(len(hideable_effects()))].name
    low, high = np.log(SIZE_RANGE_SIGMAS)
    sigmas = round(float(np.exp(random.uniform(low, high))), 1)
    return Case(number, kind, force, place, *((effect, sigmas) if kind != "nothing" else ()))
