"""Which logs the benchmark tries: every effect at several sizes, pairs, triples, nothing, and effects left out.

Drawn by a fixed seed and shuffled within rounds, so that the first so many cases are a stratified sample of all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle, zip_longest
from types import ModuleType

import numpy as np

import derive
from derive.effects import Effect
from wheelpend import kernels
from wheelpend.benchmark.engine import SUPPORTED
from wheelpend.model import Model

SIZES = (1.0, 0.3, 3.0, 0.1)  # times the typical one
SINGLES = 3  # draws of each effect and size
COMPLETE, PAIRS, TRIPLES = 200, 120, 30
LEFT_OUT = 3  # draws of each effect
SOURCES = ("simulator", "simulator", "engine")  # a third comes from the engine
COMMANDS = ("aggressive", "aggressive", "simple")
SOFT = 0.01  # s, over which a dry friction engages that is soft on purpose


@dataclass(frozen=True)
class Case:
    """One log and what is asked about it."""

    kind: str  # complete, single, pair, triple, left_out
    hide: tuple[tuple[str, float], ...]  # effect.parameter and value
    seed: int
    command: str = "aggressive"
    source: str = "simulator"  # or engine
    size: float = 1.0  # times the typical one
    engage: float = 0.0  # s, over which the engine's dry friction engages; 0 is sharp
    without: tuple[str, ...] = ()  # effects taken out of the library

    @property
    def effects(self) -> tuple[str, ...]:
        """What is hidden."""
        return tuple(dict.fromkeys(name.partition(".")[0] for name, _ in self.hide))

    @property
    def key(self) -> str:
        """A name by which the case is found again."""
        hidden = ",".join(f"{n}={v:.6g}" for n, v in self.hide) or "nothing"
        out = f" without {','.join(self.without)}" if self.without else ""
        soft = f" engaging in {self.engage:g} s" if self.engage else ""
        return f"{self.kind} {self.source} {self.command} {self.seed} {hidden}{soft}{out}"


def plan(effects: Sequence[Effect] | None = None) -> list[Case]:
    """All cases, in rounds that each hold a share of every kind."""
    module = kernels.library_of(Model.default())
    known = [e for e in (effects or derive.effects.LIBRARY.values()) if _can_be_hidden(e, module)]
    kinds = [list(make(known)) for make in (singles, complete, left_out, pairs, triples)]
    return [case for round_ in zip_longest(*map(_evenly(max(map(len, kinds))), kinds)) for case in round_ if case]


def _evenly(length: int):
    """Spread a kind's cases over as many rounds as the longest kind has."""

    def spread(cases: list[Case]) -> list[Case | None]:
        places: list[Case | None] = [None] * length
        for number, case in enumerate(cases):
            places[number * length // len(cases)] = case
        return places

    return spread


def _can_be_hidden(effect: Effect, module: ModuleType) -> bool:
    """Whether a log can show it: the plant's own parameters do not contain it."""
    return effect.full_names[0] in module.PARAMETERS and effect.full_names[0] not in module.ABSORBED


def draw(effect: Effect, size: float, random: np.random.Generator) -> tuple[tuple[str, float], ...]:
    """An effect at about a multiple of its typical size, of either sign where that is possible.

    Shapes, which have no size, keep their typical value; a limit shrinks as the effect grows.
    """
    factor = size * random.uniform(0.8, 1.25)
    sign = 1.0 if any(p.minimum >= 0.0 for p in effect.parameters) else float(random.choice([-1.0, 1.0]))
    found = []
    for p in effect.parameters:
        value = p.typical
        if p in effect.sizes:
            value = sign * factor * p.typical if p.absent == 0.0 else p.typical / factor
        found.append((f"{effect.name}.{p.name}", float(f"{value:.6g}")))
    return tuple(found)


def offered(hide: Sequence[tuple[str, float]]) -> bool:
    """Whether the engine has these effects."""
    return all(name in SUPPORTED for name, _ in hide)


def singles(effects: Sequence[Effect]) -> Iterator[Case]:
    """Every effect at every size, a third of them from the engine where it has them."""
    random, sources, commands = np.random.default_rng(1), cycle(SOURCES), cycle(COMMANDS)
    for seed in range(SINGLES):
        for size in SIZES:
            for number in random.permutation(len(effects)):
                hide = draw(effects[number], size, random)
                yield case_of("single", hide, 1000 * seed + int(number), next(commands), next(sources), size)


def case_of(kind: str, hide, seed: int, command: str, source: str, size: float = 1.0, without=()) -> Case:
    """A case, from the engine where that has the effects; every other dry friction of it is soft."""
    source = source if offered(hide) else "simulator"
    dry = any(name.partition(".")[0] in ("coulomb_drive", "rolling_resistance") for name, _ in hide)
    engage = SOFT if source == "engine" and dry and seed % 2 else 0.0
    return Case(kind, tuple(hide), seed, command, source, size, engage, tuple(without))


def complete(effects: Sequence[Effect]) -> Iterator[Case]:
    """Logs in which nothing is hidden."""
    for seed, source, command in zip(range(COMPLETE), cycle(SOURCES), cycle((*COMMANDS, "simple")), strict=False):
        yield Case("complete", (), 5000 + seed, command, source)


def pairs(effects: Sequence[Effect]) -> Iterator[Case]:
    """Two effects at once."""
    yield from _several("pair", effects, 2, PAIRS)


def triples(effects: Sequence[Effect]) -> Iterator[Case]:
    """Three effects at once."""
    yield from _several("triple", effects, 3, TRIPLES)


def _several(kind: str, effects: Sequence[Effect], count: int, cases: int) -> Iterator[Case]:
    random, sources = np.random.default_rng(count), cycle(SOURCES)
    for seed in range(cases):
        chosen = random.choice(len(effects), size=count, replace=False)
        hide = tuple(entry for number in chosen for entry in draw(effects[number], 1.0, random))
        yield case_of(kind, hide, 9000 + 1000 * count + seed, "aggressive", next(sources))


def left_out(effects: Sequence[Effect]) -> Iterator[Case]:
    """Every effect with itself taken out of the library."""
    random, sources = np.random.default_rng(9), cycle(SOURCES)
    for seed in range(LEFT_OUT):
        for number in random.permutation(len(effects)):
            effect = effects[number]
            hide = draw(effect, 1.0, random)
            yield case_of(
                "left_out", hide, 20000 + 1000 * seed + int(number), "aggressive", next(sources), 1.0, (effect.name,)
            )
