"""The cases of the benchmark: effects at several sizes, pairs, triples, nothing, effects left out, stick-slip.

Drawn by a fixed seed and shuffled within rounds, so that the first so many cases are a stratified sample of all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, zip_longest

import numpy as np

import derive
from derive.effects import Effect, EffectParameter
from derive.parameter_name import effect_of
from derive.plant_signature import PlantSignature
from wheelpend.benchmarks.hidden_effects.engine import SUPPORTED_PARAMETERS
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.model import model_kernels
from wheelpend.model.record import Model

SIZE_FACTORS = (1.0, 0.3, 3.0, 0.1)  # times the typical one
SINGLE_DRAWS = 3  # draws of each effect and size
COMPLETE_CASE_COUNT, PAIR_CASE_COUNT, TRIPLE_CASE_COUNT = 200, 120, 30
LEFT_OUT_DRAWS = 3  # draws of each effect
STICK_SLIP_DRAWS = 4  # draws of each dry friction and command
ENGINE_LOG_PERIOD = 3  # one log in so many comes from the engine
COMMAND_CYCLE = ("aggressive", "aggressive", "aggressive", "simple")  # not as long as the sources', so that all meet
DRY_FRICTION_EFFECTS = ("coulomb_drive", "rolling_resistance", "stribeck_drive")
LOW_NOISE_FACTOR = 0.1  # times the paper's sensor noise, from which the controller makes a shaking that never sticks
EVENT_TIME_RANGES_S = {  # s, from and to: when something happens, well inside a log of 20 s
    "payload_step.time": (5.0, 12.0),
    "external_push.start": (4.0, 12.0),
}
PUSH_DURATION_RANGE_S = (0.3, 2.0)  # s, from and to: how long a push lasts
SIZE_REDUCTION_FACTOR = 0.7  # times the size, where the robot falls
SOFT_ENGAGE_TIME_S = 0.01  # s, over which a dry friction engages that is soft on purpose


@dataclass(frozen=True)
class Case:
    """One log and what is asked about it."""

    kind: str  # complete, single, pair, triple, left_out, stick_slip
    hide: tuple[tuple[str, float], ...]  # effect.parameter and value
    seed: int
    command: str = "aggressive"
    source: str = "simulator"  # or engine
    size: float = 1.0  # times the typical one
    engage: float = 0.0  # s, over which the engine's dry friction engages; 0 is sharp
    without: tuple[str, ...] = ()  # effects taken out of the library
    noise: float = 1.0  # of pitch and gyro, in multiples of the paper's; other than 1 only from the engine

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the hidden effects, in the order of ``hide``."""
        return tuple(dict.fromkeys(effect_of(name) for name, _ in self.hide))

    @property
    def key(self) -> str:
        """Unique name, under which the outcome is stored."""
        hidden = ",".join(f"{n}={v:.6g}" for n, v in self.hide) or "nothing"
        out = f" without {','.join(self.without)}" if self.without else ""
        soft = f" engaging in {self.engage:g} s" if self.engage else ""
        quiet = f" with {self.noise:g} of the noise" if self.noise != 1.0 else ""
        return f"{self.kind} {self.source} {self.command} {self.seed} {hidden}{soft}{quiet}{out}"

    def with_smaller_effects(self) -> Case:
        """The same with every size smaller, and a limit farther away."""
        factors = {
            e.name_of(p): SIZE_REDUCTION_FACTOR if p.absent == 0.0 else 1 / SIZE_REDUCTION_FACTOR
            for e in map(derive.effects.find, self.effects)
            for p in size_parameters(e)
        }
        return replace(self, hide=tuple((n, float(f"{v * factors.get(n, 1.0):.6g}")) for n, v in self.hide))


def benchmark_plant() -> PlantSignature:
    """The plant of the benchmark."""
    return plant_signature("wheel_pendulum", derive.plants.complete_assumptions("wheel_pendulum", {}))


def plan(effects: Sequence[Effect] | None = None) -> list[Case]:
    """All cases, in rounds that each hold a share of every kind."""
    known = [e for e in (effects or derive.effects.applicable_to(benchmark_plant())) if can_be_hidden(e)]
    kinds = [list(make(known)) for make in (singles, complete, left_out, pairs, triples, stick_slip)]
    return [
        case for round_ in zip_longest(*map(_spread_evenly(max(map(len, kinds))), kinds)) for case in round_ if case
    ]


def _spread_evenly(length: int):
    """Spread a kind's cases over as many rounds as the longest kind has."""

    def spread(cases: list[Case]) -> list[Case | None]:
        places: list[Case | None] = [None] * length
        for number, case in enumerate(cases):
            places[number * length // len(cases)] = case
        return places

    return spread


def can_be_hidden(effect: Effect) -> bool:
    """True if a log can show the effect: the plant's own parameters do not absorb it."""
    module = model_kernels.library_module_of(Model.default(), [effect.name])
    return effect.full_names[0] in module.PARAMETERS and effect.full_names[0] not in module.ABSORBED


def draw_effect(effect: Effect, size: float, random: np.random.Generator) -> tuple[tuple[str, float], ...]:
    """Parameter values of an effect at about a multiple of its typical size, of either sign where that is possible.

    Parameters that are no sizes keep their typical value; a limit shrinks as the effect grows. An event happens well
    inside the log.
    """
    factor, scaled = size * random.uniform(0.8, 1.25), size_parameters(effect)
    sign = 1.0 if any(p.minimum >= 0.0 for p in scaled) else float(random.choice([-1.0, 1.0]))
    found = {effect.name_of(p): p.typical for p in effect.parameters}
    for p in scaled:
        found[effect.name_of(p)] = sign * factor * p.typical if p.absent == 0.0 else p.typical / factor
    for name in [n for n in found if n in EVENT_TIME_RANGES_S]:
        found[name] = round(random.uniform(*EVENT_TIME_RANGES_S[name]), 4)  # between two samples
    if "external_push.end" in found:
        found["external_push.end"] = found["external_push.start"] + round(random.uniform(*PUSH_DURATION_RANGE_S), 4)
    return tuple((name, float(f"{value:.6g}")) for name, value in found.items())


def size_parameters(effect: Effect) -> tuple[EffectParameter, ...]:
    """Parameters that say how large an effect is; the times of an event are not among them."""
    return tuple(p for p in effect.sizes if effect.name_of(p) not in (*EVENT_TIME_RANGES_S, "external_push.end"))


def is_supported_by_engine(hide: Sequence[tuple[str, float]]) -> bool:
    """True if the engine offers every one of these parameters."""
    return all(name in SUPPORTED_PARAMETERS for name, _ in hide)


class SourceSchedule:
    """Assigns logs to a source: every third to the engine, a later one where it lacks an effect of the one due."""

    def __init__(self, first: int = 0) -> None:
        self.due = first  # thirds of a log that the engine owes

    def next(self, hide: Sequence[tuple[str, float]]) -> str:
        """The source of the next log."""
        self.due += 1
        if self.due < ENGINE_LOG_PERIOD or not is_supported_by_engine(hide):
            return "simulator"
        self.due -= ENGINE_LOG_PERIOD
        return "engine"


def singles(effects: Sequence[Effect]) -> Iterator[Case]:
    """Every effect at every size; each effect, each size and each command comes from the engine every third time."""
    random, turn = np.random.default_rng(1), 0
    sources = [SourceSchedule(number % ENGINE_LOG_PERIOD) for number in range(len(effects))]
    for seed in range(SINGLE_DRAWS):
        for size in SIZE_FACTORS:
            for number in random.permutation(len(effects)):
                hide = draw_effect(effects[number], size, random)
                command = COMMAND_CYCLE[(turn // ENGINE_LOG_PERIOD + number) % len(COMMAND_CYCLE)]
                yield make_case("single", hide, 1000 * seed + int(number), command, sources[number].next(hide), size)
            turn += 1


def make_case(kind: str, hide, seed: int, command: str, source: str, size: float = 1.0) -> Case:
    """Case with the engine's dry friction soft for odd seeds, except Stribeck friction, which stays sharp."""
    dry = any(effect_of(name) in DRY_FRICTION_EFFECTS[:2] for name, _ in hide)
    engage = SOFT_ENGAGE_TIME_S if source == "engine" and dry and seed % 2 else 0.0
    return Case(kind, tuple(hide), seed, command, source, size, engage)


def complete(effects: Sequence[Effect]) -> Iterator[Case]:
    """Logs in which nothing is hidden."""
    sources = SourceSchedule()
    for seed, command in zip(range(COMPLETE_CASE_COUNT), cycle(("aggressive", "simple")), strict=False):
        yield Case("complete", (), 5000 + seed, command, sources.next(()))


def pairs(effects: Sequence[Effect]) -> Iterator[Case]:
    """Two effects at once."""
    yield from _several("pair", effects, 2, PAIR_CASE_COUNT)


def triples(effects: Sequence[Effect]) -> Iterator[Case]:
    """Three effects at once."""
    yield from _several("triple", effects, 3, TRIPLE_CASE_COUNT)


def _several(kind: str, effects: Sequence[Effect], count: int, cases: int) -> Iterator[Case]:
    random, sources = np.random.default_rng(count), SourceSchedule()
    for seed in range(cases):
        chosen = random.choice(len(effects), size=count, replace=False)
        hide = tuple(entry for number in chosen for entry in draw_effect(effects[number], 1.0, random))
        yield make_case(kind, hide, 9000 + 1000 * count + seed, "aggressive", sources.next(hide))


def left_out(effects: Sequence[Effect]) -> Iterator[Case]:
    """Every effect with itself taken out of the library, once of three times from the engine."""
    random = np.random.default_rng(9)
    sources = [SourceSchedule(number % ENGINE_LOG_PERIOD) for number in range(len(effects))]
    for seed in range(LEFT_OUT_DRAWS):
        for number in random.permutation(len(effects)):
            effect = effects[number]
            hide = draw_effect(effect, 1.0, random)
            place, source = 20000 + 1000 * seed + int(number), sources[number].next(hide)
            yield replace(make_case("left_out", hide, place, "aggressive", source), without=(effect.name,))


def stick_slip(effects: Sequence[Effect]) -> Iterator[Case]:
    """Dry friction in the engine at speeds and a noise so small that it truly sticks, sampled at 1 kHz."""
    random = np.random.default_rng(11)
    for seed in range(STICK_SLIP_DRAWS):
        for effect in (e for e in effects if e.name in DRY_FRICTION_EFFECTS):
            for command in ("slow", "simple"):
                hide = draw_effect(effect, 1.0, random)
                if is_supported_by_engine(hide):
                    yield Case("stick_slip", hide, 30000 + seed, command, "engine", noise=LOW_NOISE_FACTOR)
