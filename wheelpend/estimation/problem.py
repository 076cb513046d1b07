"""The estimation problem: a model, its kernels, and the segments that it is fitted to and validated on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

import derive
from derive.effects import Effect
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.segments import DataSplit
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.step_size import stable_step
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import released_coordinates
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model

MIN_WAY_BACK = 0.05  # of its way, that a machine must go the other way to show how that differs


@dataclass(frozen=True)
class EstimationProblem:
    """A model, the kernels that simulate it, and the segments of logs that it is fitted to and validated on."""

    model: Model
    module: KernelModule  # the library's kernels, or the model's own
    data: DataSplit
    noise: tuple[Noise, ...]  # of each log, estimation logs first
    horizon: float  # s
    max_step: float  # s
    warnings: tuple[str, ...]
    fallback_starts: tuple[dict[str, float], ...] = ()  # starts before any fit: nominal values or the slowest filters
    without: tuple[str, ...] = ()  # effects that are no candidates, on request
    redundant_effects: tuple[str, ...] = ()  # nor are these: others explain what they do
    only_lasting: bool = False  # nor is what moves by itself inside the machine, where the horizon would have shown it
    carries: bool = False  # True for a coupled model, in which each segment takes over from the one before
    restrictions: Restrictions = (
        NO_RESTRICTIONS  # parameters that are fixed, at the model's values, and bounds of others
    )

    @property
    def floor(self) -> float:
        """Expected error of the true model [σ], the mean over the logs."""
        return float(np.mean([n.floor for n in self.noise]))

    @property
    def simulator(self) -> Simulator:
        """Its kernels with its integration step."""
        return Simulator(self.module, self.max_step)

    @property
    def plant(self) -> PlantSignature:
        """Signature of the plant under the model's assumptions."""
        return self.model.plant_signature

    @property
    def runs_one_way(self) -> bool:
        """True where the only place of a machine goes one way in all logs, but for a small share of its way."""
        places = self.model.table.places
        if len(places) != 1 or not self.logs:
            return False
        place = self.logs[0].channels.index(places[0])
        ways = np.sum([log.ways[place] for log in self.logs], axis=0)
        return bool(ways.min() < MIN_WAY_BACK * ways.sum())

    def effect(self, name: str) -> Effect:
        """A row of the library as it reads on this plant."""
        return derive.effects.in_plant_units(derive.effects.find(name), self.plant)

    def knows(self, effect: str) -> bool:
        """True of an effect that is in these kernels: of one by which something moves inside others are made."""
        return {*derive.effects.find(effect).full_names} <= {*self.module.PARAMETERS}

    def port_weights(self, port: str) -> np.ndarray:
        """A port's coordinate as weights (NQ,) on the generalised coordinates."""
        return np.array(self.plant.port(port).weights)

    @property
    def base(self) -> tuple[str, ...]:
        """Names of the model's own parameters."""
        return self.module.PARAMETERS[: self.module.OWN_PARAMETERS]

    @property
    def unfitted_start(self) -> Mapping[str, float]:
        """Values before any fit, the nominal ones where the model has some; empty where no start was sought."""
        return next(iter(self.fallback_starts), {})

    @property
    def logs(self) -> tuple[Log, ...]:
        """Estimation logs."""
        return self.data.logs

    @property
    def samples(self) -> int:
        """Number of samples of the estimation logs that were read."""
        return sum(log.samples for log in self.logs)

    def effects(self) -> tuple[Effect, ...]:
        """Library effects that can be tested with the plant, its assumptions and the known constants."""
        rows = derive.effects.applicable_to(self.plant, self.model.own)
        return tuple(derive.effects.in_plant_units(e, self.plant) for e in rows if not self.why_not_testable(e))

    def candidates(self) -> tuple[Effect, ...]:
        """Testable effects that the model may be missing: neither in it nor simpler than one that is."""
        simpler = {s for e in self.model.effects for s in simpler_effects(self.module, e)}
        return tuple(e for e in self.effects() if e.name not in self.model.effects and e.name not in simpler)

    def replaced(self, effect: str) -> tuple[str, ...]:
        """Effects of the model that an effect contains or approaches, and so replaces."""
        return tuple(s for s in simpler_effects(self.module, effect) if s in self.model.effects)

    def with_candidates(self, *effects: str) -> EstimationProblem:
        """The problem with kernels that contain these effects besides its model's."""
        module = library_module_of(self.model, effects)
        carries = carries_over(module, (*self.model.effects, *effects))
        return replace(self, module=module, carries=carries)

    def with_effects(self, effects: Sequence[str]) -> EstimationProblem:
        """The problem of a model with these effects instead."""
        return replace(self, model=self.model.with_effects(list(effects))).with_candidates()

    def why_not_testable(self, effect: Effect) -> str:
        """Reason why an effect cannot be tested on these logs; empty where it can."""
        if effect.name in self.without:
            return "was left out on request"
        if effect.name in self.redundant_effects:
            return "lowers the error, but not beside the effects that explain the rest"
        if self.only_lasting and effect.releases:
            return "moves inside the machine, which would have shown over the horizon: it was judged there"
        if effect.varies and self.runs_one_way:
            return "is no other than friction on a machine that goes one way: these logs hardly go the other"
        free = released_coordinates(self.model.effects)
        if effect.releases and free and effect.releases not in free:
            return f"releases a second internal coordinate, beside {', '.join(free)}"
        return why_not_testable(
            effect,
            self.model,
            library_module_of(self.model, [effect.name]) if effect.releases else self.module,
        )


def why_not_testable(effect: Effect, model: Model, module: KernelModule) -> str:
    """Reason why an effect cannot be tested with a model and its library's kernels; empty where it can."""
    if own := module.ABSORBED.get(effect.full_names[0]):
        return f"is part of {', '.join(own)} on this plant"
    if effect.full_names[0] not in module.PARAMETERS:
        return "cannot be written under these assumptions"
    absent = [c for c in needed_constants(model, effect.name) if c not in model.constants]
    return f"needs {', '.join(absent)} in [constants]" if absent else ""


def needed_constants(model: Model, effect: str) -> tuple[str, ...]:
    """Known constants that an effect's equations contain."""
    module = library_module_of(model, [effect])
    names = derive.effects.find(effect).full_names
    return tuple(dict.fromkeys(c for n in names for c in module.NEEDS.get(n, ())))


def simpler_effects(module: KernelModule, effect: str) -> tuple[str, ...]:
    """Effects that one contains, and the one that it approaches: beside any of these it would be there twice."""
    approached = derive.effects.find(effect).approaches
    return (*module.CONTAINS.get(effect, {}), *filter(None, [approached]))


def narrower_effects(module: KernelModule, effect: str) -> tuple[str, ...]:
    """Simpler effects of the same force: those that one replaces, and those that it covers, beside which it may be."""
    return (*simpler_effects(module, effect), *derive.effects.find(effect).covers)


def extended_effects(model: Model, effect: str) -> list[str]:
    """A model's effects with one more, which replaces those that it contains or approaches."""
    simpler = simpler_effects(library_module_of(model), effect)
    return [*(e for e in model.effects if e not in simpler), effect]


def require_testable(effect: Effect, model: Model) -> None:
    """Raise Failure where an effect that is to be added cannot be identified from any data."""
    if why := why_not_testable(effect, model, library_module_of(model, [effect.name])):
        raise Failure(f"An effect that is added must be one that data can tell, but {effect.name} {why}. "
                      "Nothing was changed.")  # fmt: skip


def with_stable_step(problem: EstimationProblem, values: Mapping[str, float]) -> EstimationProblem:
    """The problem with a step in which its internal coordinates are stable, at the stiffest bounds of their effects."""
    if problem.module.NA == problem.module.NQ:
        return problem
    stiffest = {**values, **problem.module.STIFFEST}
    step = 2.0 * stable_step(problem.module, stiffest, problem.logs[0])  # 0.5 over the fastest rate
    return replace(problem, max_step=min(problem.max_step, step))


def carries_over(module: KernelModule, effects: Sequence[str]) -> bool:
    """True where one of the effects has states that carry over from one segment to the next."""
    return any(e in module.CARRYING for e in effects)
