"""The settings that a repetition of the paper's simulations needs, and those that the paper does not state."""

from __future__ import annotations

from collections.abc import Iterator

from wheelpend.paper.numbers import SIMULATION_SETTINGS
from wheelpend.paper.printed_numbers import NumberCheck

SIMULATION_REQUIREMENTS = {  # settings of a closed-loop simulation and its tables, with their purpose
    "integration step": "the solver's step",
    "duration": "how long the log is over which the tables are made",
    "proportional gain": "the controller",
    "integral gain": "the controller",
    "derivative gain": "the controller",
    "signal behind the derivative gain": "the measured rate, or its difference from the command's",
    "commands": "the excitation",
    "initial state": "where the robot starts",
    "encoder counts": "the wheel angle's steps",
    "noise of the pitch": "the measurement",
    "noise of the pitch rate": "the measurement",
    "number of draws": "a single draw of the noise says little about an estimator",
}


def check_simulation() -> Iterator[NumberCheck]:
    """A check for every required setting that the paper does not state."""
    for name, why in SIMULATION_REQUIREMENTS.items():
        if name not in SIMULATION_SETTINGS:
            yield NumberCheck(
                name, "missing", "", "", f"{why}; `wheelpend reproduce` measures what depends on it", "read"
            )
