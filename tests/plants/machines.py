"""Models and simulated logs of every shipped plant under its assumptions, and of one that a user wrote."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

from derive import plants
from tests.support import ROOT
from wheelpend import Log, Model, simulate
from wheelpend.model.user_plants import load_plant

LEVER = "lever"  # a user's plant, in lever.py
LEVER_FILE = ROOT / "tests" / "plants" / "lever.py"


class Machine(NamedTuple):
    """A plant under assumptions, with what its file does not state."""

    plant: str
    assumptions: str = ""
    values: Mapping[str, float] | None = None  # of X1, X2, ...
    gains: tuple[float, float, float] | None = None
    begin: str = ""  # where it is let go
    constants: str = ""


LINK = {"X1": 0.4, "X2": 1.5, "X3": 0.3}
LINKS = {"X1": 0.09, "X2": 0.03, "X3": 0.03, "X4": 0.3}
DRIVEN_LINKS = {"X1": 0.5, "X2": 0.1, "X3": 0.1, "X4": 2.0, "X5": 0.8, "X6": 0.5}
SECOND_DRIVEN = {"X1": 0.5, "X2": 0.1, "X3": 0.1, "X4": 2.0, "X5": 0.8, "X6": 0.3}
ARM = {**SECOND_DRIVEN, "X6": 0.8, "X7": 0.3}
TURNING = {"X8": 0.4, "X9": 0.3, "X10": 0.5}
MACHINES = {
    "wheel_pendulum": Machine("wheel_pendulum"),
    "turning": Machine(
        "wheel_pendulum", "planar = false", {**plants.reference_of("wheel_pendulum"), **TURNING}, constants="W = 0.5"
    ),
    "slide": Machine("slide"),
    "shaft": Machine("shaft", constants="alpha = 0.1"),
    "pendulum": Machine("pendulum", begin="theta_1 = 1.0"),
    "driven pendulum": Machine("pendulum", "driven = true", LINK, (12.0, 4.0, 3.0), constants="alpha = 0.1"),
    "two links": Machine("pendulum", "links = 2", LINKS, begin="theta_1 = 1.0\ntheta_2 = -0.5"),
    "two driven links": Machine(
        "pendulum", "links = 2\ndriven = true", DRIVEN_LINKS, (12.0, 4.0, 3.0), constants="alpha = 0.1"
    ),
    "driven second link": Machine(
        "pendulum",
        'links = 2\ndriven = "second"\nrate_sensor = "both"',
        SECOND_DRIVEN,
        (6.0, 2.0, 1.0),
        constants="alpha = 0.1",
    ),
    "arm": Machine("pendulum", 'links = 2\ndriven = "both"', ARM, (3.0, 1.0, 0.5), constants="alpha = 0.1"),
    "cart_pole": Machine("cart_pole", gains=(-60.0, -30.0, -12.0)),
    LEVER: Machine(LEVER),
}


def model_text(name: str) -> str:
    """The text of a model.toml with nominal values a tenth too small."""
    machine = MACHINES[name]
    if machine.plant == LEVER:
        load_plant(LEVER_FILE)
    values = machine.values or plants.reference_of(machine.plant)
    gains = machine.gains or plants.gains_of(machine.plant)
    constants = "\n".join([*(f"{n} = {v}" for n, v in plants.constants_of(machine.plant).items()), machine.constants])
    lines = [f'plant = "{machine.plant}"', "[assumptions]", machine.assumptions, "[constants]", constants]
    lines += ["[parameters]", *(f"{n} = {{ nominal = {0.9 * v:.6g} }}" for n, v in values.items())]
    lines += ["[simulation]", *(f"{n} = {v}" for n, v in values.items()), machine.begin]
    lines += ["[controller]", 'kind = "pid"', f"gains = {list(gains)}"] if gains else []
    return "\n".join(lines) + "\n"


@lru_cache
def model_of(name: str) -> Model:
    """A model that can be simulated."""
    return Model.parse(model_text(name))


@lru_cache
def log_of(name: str, duration: float = 8.0, **hide: float) -> Log:
    """A simulated log; effects are hidden as effect__parameter=value."""
    hidden = {n.replace("__", "."): v for n, v in hide.items()}
    return simulate(model_of(name), duration=duration, sample=0.005, hide=hidden)
