"""The result of a reproduction: the paper's numbers and ours."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from wheelpend.reproduction.choices import Choice
from wheelpend.reproduction.experiment import Robot
from wheelpend.reproduction.tables import Cell, Condition, Deviation, Prediction
from wheelpend.reproduction.trials import Trial


@dataclass(frozen=True)
class Reproduction:
    """The paper's numbers and ours; what was not asked for is empty."""

    what: str
    seeds: int
    duration_s: float
    table1: tuple[Cell, ...] = ()
    table2: tuple[Cell, ...] = ()
    started_at_rest: tuple[Cell, ...] = ()  # the filtered method (FOH) with the filters' initial state zero
    conditions: tuple[Condition, ...] = ()
    table3: tuple[Deviation, ...] = ()
    predictions: tuple[Prediction, ...] = ()
    choices: tuple[Choice, ...] = ()
    unstable_pole: float = 0.0  # of the upright robot without controller [1/s]
    written: tuple[str, ...] = ()
    robot: Robot | None = field(repr=False, default=None)
    trials: tuple[Trial, ...] = field(repr=False, default=())

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "what": self.what,
            "seeds": self.seeds,
            "duration_s": self.duration_s,
            "table1": self.table1,
            "table2": self.table2,
            "started_at_rest": self.started_at_rest,
            "conditions": self.conditions,
            "table3": self.table3,
            "predictions": self.predictions,
            "choices": self.choices,
            "unstable_pole": self.unstable_pole,
            "written": self.written,
        }
