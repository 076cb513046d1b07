"""One log of the studies: what the filter-error method says of it, beside the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from time import monotonic
from typing import Any, NamedTuple

import numpy as np

import derive
from wheelpend.benchmarks.hidden_effects.cases import size_parameters
from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS
from wheelpend.benchmarks.random_force.bound import Efficient, efficient_estimates
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS
from wheelpend.benchmarks.random_force.machine import LOG_COMMAND, LOG_DURATION_S, PLACE_WEIGHTS, rough_log
from wheelpend.errors import Failure
from wheelpend.estimation.estimate import Estimate
from wheelpend.identification.identify import identify
from wheelpend.identification.remainder import Remainder
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import base_parameter_names, machine_values
from wheelpend.simulation.simulate import simulate

SIZE_IN_STANDARD_ERRORS = 10.0  # of a lawful effect, in standard errors that the true force leaves
EVENT_START_SHARE = 0.5  # of an event's true size, from which a fit begins: its moments mean nothing at size 0
EVENT_TIMES_S = {  # s, true ones between two samples, and to a hundredth of a second, as a search has them
    "payload_step.time": (6.4321, 6.43),
    "external_push.start": (6.4321, 6.43),
    "external_push.end": (7.6543, 7.65),
}


@dataclass(frozen=True)
class Case:
    """One log and what is asked about it."""

    study: str  # complete, forces, pilot or lawful
    seed: int
    kind: str = ""  # of the random force; "" for none
    place: str = ""  # where it acts
    effect: str = ""  # lawful, in log and model
    size: float = 0.0  # of the effect's size; a pilot's is the typical one

    @property
    def key(self) -> str:
        """Unique name, under which the answer is stored."""
        return " ".join(filter(None, (self.study, self.kind, self.place, self.effect, str(self.seed))))


class Found(NamedTuple):
    """A number as estimated, beside the truth."""

    value: float
    sigma: float
    truth: float
    bound: float | None = None  # Cramér-Rao bound of its standard deviation, where that is known
    efficient: float | None = None  # what an efficient estimate would be on this very log, where that is known

    @property
    def deviation(self) -> float:
        """Distance from the truth in standard errors."""
        return (self.value - self.truth) / self.sigma


class FoundForce(NamedTuple):
    """A random force on a row as estimated; 0 where none was."""

    rms: float  # V
    correlation_time: float  # s
    true_rms: float  # V, as it was played; 0 where none was


@dataclass(frozen=True)
class Answer:
    """What was found on a log."""

    case: Case
    failure: str = ""
    parameters: dict[str, Found] = field(default_factory=dict)  # those that are identifiable
    lost: tuple[str, ...] = ()  # parameters that are said not to be identifiable
    places: tuple[str, ...] = ()  # where random forces were found
    forces: dict[str, FoundForce] = field(default_factory=dict)  # by row
    seconds: float = 0.0  # that identification took

    @property
    def size(self) -> Found | None:
        """The size of the lawful effect; None where it was not found."""
        return self.parameters.get(size_name(self.case.effect))

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {
            "case": list(vars(self.case).values()),
            "failure": self.failure,
            "parameters": {n: list(f) for n, f in self.parameters.items()},
            "lost": self.lost,
            "places": self.places,
            "forces": {n: list(f) for n, f in self.forces.items()},
            "seconds": self.seconds,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Answer:
        """An answer as the journal has it."""
        return cls(
            Case(*data["case"]),
            data["failure"],
            {n: Found(*f) for n, f in data["parameters"].items()},
            tuple(data["lost"]),
            tuple(data["places"]),
            {n: FoundForce(*f) for n, f in data["forces"].items()},
            data["seconds"],
        )


def try_case(case: Case) -> Answer:
    """Make a case's log, identify the model from it, and set the truth beside what comes out."""
    try:
        return complete_answer(case) if case.study == "complete" else rough_answer(case)
    except (Failure, np.linalg.LinAlgError) as failure:
        return Answer(case, failure=str(failure))


def complete_answer(case: Case) -> Answer:
    """The answer on a log of this project's simulator, in which nothing is hidden and no random force acts."""
    model = Model.default()
    log = simulate(model, command=LOG_COMMAND, duration=LOG_DURATION_S, seed=case.seed)
    truth = {n: machine_values(model, {})[n] for n in base_parameter_names(model)}
    return identified(case, model, log, truth, {}, efficient_estimates(model, log, case.seed))


def rough_answer(case: Case) -> Answer:
    """The answer on a log of the engine, with a random force and perhaps a lawful effect that the model has too."""
    hidden = hidden_values(case.effect, case.size)
    played = rough_log(case.kind, case.place, case.seed, hidden)
    rms = float(np.sqrt(np.mean(played.force**2)))
    rows = zip(("wheel", "body"), PLACE_WEIGHTS[case.place], strict=True)
    forces = {row: abs(weight) * rms for row, weight in rows if weight}
    return identified(case, model_with(case.effect, case.size), played.log, {**TRUE_PARAMETERS, **hidden}, forces)


def identified(
    case: Case,
    model: Model,
    log: Log,
    truth: Mapping[str, float],
    forces: Mapping[str, float],
    efficient: Mapping[str, Efficient] | None = None,
) -> Answer:
    """The answer of the filter-error method; ``forces`` are the true rms by row [V]."""
    begin = monotonic()
    found = identify(model, [log], method="filter_error")
    seconds = monotonic() - begin
    left = found.remainder or Remainder()
    force = left.force
    rows = {
        row: FoundForce(force[row].rms, force[row].correlation_time_s, forces.get(row, 0.0))
        if row in force
        else FoundForce(0.0, 0.0, forces[row])
        for row in sorted({*force, *forces})
    }
    usable = {n: e for n, e in found.parameters.items() if e.identifiable}
    return Answer(
        case,
        parameters={n: beside_truth(e, truth[n], (efficient or {}).get(n)) for n, e in usable.items()},
        lost=tuple(n for n in found.parameters if n not in usable),
        places=left.places,
        forces=rows,
        seconds=seconds,
    )


def beside_truth(estimate: Estimate, truth: float, best: Efficient | None) -> Found:
    """An estimate beside the truth, and beside the most precise one where that is known."""
    if best is None:
        return Found(estimate.value, estimate.sigma, truth)
    return Found(estimate.value, estimate.sigma, truth, best.sigma, truth + best.error)


def size_name(effect: str) -> str:
    """Full name of an effect's size; "" without an effect."""
    row = derive.effects.find(effect) if effect else None
    return row.name_of(next(iter(size_parameters(row)))) if row else ""


def hidden_values(effect: str, size: float) -> dict[str, float]:
    """True values of an effect of this size, {"effect.parameter": value}; the typical size where it is 0."""
    row = derive.effects.find(effect) if effect else None
    values = {row.name_of(p): p.typical for p in row.parameters} if row else {}
    values |= {name: EVENT_TIMES_S[name][0] for name in values if name in EVENT_TIMES_S}
    return values | ({size_name(effect): size} if size else {})


def model_with(effect: str, size: float = 0.0) -> Model:
    """The default model with a lawful effect that begins at size 0, an event near its moments at half its size."""
    model = Model.default()
    if not effect:
        return model
    hidden = hidden_values(effect, size)
    starts = {name: (EVENT_TIMES_S[name][1], None) for name in hidden if name in EVENT_TIMES_S}
    if starts:
        starts[size_name(effect)] = (EVENT_START_SHARE * hidden[size_name(effect)], None)
    return model.with_effects([effect]).with_fit(starts)


__all__ = ["FORCE_KINDS", "Answer", "Case", "Found", "FoundForce", "try_case"]
