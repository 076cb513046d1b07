"""The recursive identifier on one record of the paper's noise, beside the record's Cramér-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from wheelpend.benchmarks.in_the_loop.observed import Observed
from wheelpend.benchmarks.random_force.bound import efficient_estimates
from wheelpend.export.exported_model import ExportedModel, exported_model
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import base_parameter_names, machine_values
from wheelpend.simulation.simulate import simulate

RECORD_COMMAND, RECORD_DURATION_S, RECORD_PERIOD_S = "aggressive", 20.0, 0.001
START_OFF_SHARE, MOST_OFF_SIGMAS = 0.2, 2.0  # standard deviation of what each parameter begins off by, and the most


class Learnt(NamedTuple):
    """A parameter at the end of a record."""

    begin: float  # where it was begun
    value: float
    sigma: float  # standard error that the identifier says
    truth: float
    bound: float  # Cramér-Rao bound of the standard deviation on this record
    efficient: float  # what an efficient estimate would be on this very record


@dataclass(frozen=True)
class Answer:
    """What one record showed."""

    key: str
    failure: str = ""
    parameters: dict[str, Learnt] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {
            "key": self.key,
            "failure": self.failure,
            "parameters": {n: list(p) for n, p in self.parameters.items()},
        }


def try_record(seed: int) -> Answer:
    """Identify the paper's robot on the way through a record, from parameters that are a fifth off."""
    model = Model.default()
    log = simulate(model, command=RECORD_COMMAND, duration=RECORD_DURATION_S, seed=seed)
    values, best = machine_values(model, {}), efficient_estimates(model, log, seed)
    exported = exported_model(known_model(model, values), period=RECORD_PERIOD_S)
    names = [exported.module.PARAMETERS[i] for i in exported.learnt]
    truth = np.array([values[n] for n in names])
    off = np.clip(np.random.default_rng(seed).normal(size=len(names)), -MOST_OFF_SIGMAS, MOST_OFF_SIGMAS)
    begin = truth * (1.0 + START_OFF_SHARE * off)
    value, sigma = learnt_values(exported, begin, log.voltage, log.measured)
    rows = zip(names, begin, value, sigma, truth, strict=True)
    return Answer(f"learn {seed}", parameters={
        n: Learnt(float(b), float(v), float(s), float(t), best[n].sigma, float(t) + best[n].error)
        for n, b, v, s, t in rows
    })  # fmt: skip


def known_model(model: Model, truth: Mapping[str, float]) -> Model:
    """The model with true values; of these the identifier is told no more than how large a third of them is."""
    return model.with_fit({n: (truth[n], 0.01 * abs(truth[n])) for n in base_parameter_names(model)})


def learnt_values(
    exported: ExportedModel, begin: np.ndarray, voltage: np.ndarray, measured: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Values and standard errors (n,) that the identifier ends with."""
    identifier = Observed(exported, begin)
    for k in range(len(voltage)):
        identifier.see(measured[k])
        identifier.go_on(float(voltage[k]))
    return identifier.parameters[exported.learnt], np.sqrt(np.diag(identifier.learnt))
