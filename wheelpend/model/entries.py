"""The entries of a model.toml as records: parameters, random sources, sensors, controller, columns."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

from derive.plant_signature import ChannelSpec

Noise = float | Literal["auto"]


@dataclass(frozen=True)
class ParameterValue:
    """A parameter: its nominal value, and the estimate with its standard error."""

    nominal: float | None = None
    identified: float | None = None
    sigma: float | None = None  # standard error of identified

    @property
    def best(self) -> float | None:
        """The identified value, or else the nominal one."""
        return self.nominal if self.identified is None else self.identified


@dataclass(frozen=True)
class Sensors:
    """Noise and quantisation of the sensors, as far as they are known, and what the plant's own keys say of them."""

    noise: dict[str, Noise] = field(default_factory=dict)  # standard deviation of any channel, in its unit
    step: dict[str, float] = field(default_factory=dict)  # of a quantised channel, in its unit; 0 where unknown
    of_plant: dict[str, Any] = field(default_factory=dict)  # by keys that the plant brings: noise, counts, assumptions

    def noise_of(self, channel: ChannelSpec) -> float | None:
        """Standard deviation of a channel as stated [its unit]; None where it is to be found from the data."""
        stated = self.noise.get(channel.name, self.of_plant.get(channel.sensor.noise_key, "auto"))
        return None if stated == "auto" else float(stated)

    def step_of(self, channel: ChannelSpec) -> float | None:
        """Step of a quantised channel as stated [its unit]; None where nothing is known."""
        counts = self.of_plant.get(channel.sensor.counts_key)
        return self.step.get(channel.name) or (2 * math.pi / counts if counts else None)


@dataclass(frozen=True)
class Controller:
    """The feedback law that computes the input."""

    kind: Literal["pid"]
    gains: tuple[float, float, float]  # of the error, its integral, its rate [V/rad, V/(rad s), V s/rad for instance]


@dataclass(frozen=True)
class Column:
    """The column of a log that holds a quantity, with its unit, sign, scale, offset and factor."""

    column: str
    unit: str = ""
    sign: int = 1  # or -1
    scale: float = 1.0
    offset: float = 0.0  # in the quantity's unit, added after sign and scale
    times: str = ""  # another column of the log, which multiplies it sample by sample
    smooth: float = 0.0  # s, over which an input is smoothed that a sensor reads
    held: str = "after"  # or before: whether an input in a row acts after it, or acted before it


@dataclass(frozen=True)
class Input:
    """The input as the actuator is commanded, where that is not as the plant's file has it."""

    unit: str  # V, A, N m or N


@dataclass(frozen=True)
class RandomForce:
    """A random force that identification left on a row, noise of first order."""

    rms: float  # in the unit of the row
    correlation_time: float  # s
    place: str = ""  # the port along which it acts, where that is on several rows


@dataclass(frozen=True)
class SensorNoise:
    """A random error that a sensor has besides its white noise, noise of first order."""

    rms: float  # in the unit of the channel
    correlation_time: float  # s
    lag: float = 0.0  # s, time of the low-pass filter behind which it reads; 0 for none


@dataclass(frozen=True)
class ModelFile:
    """The tables of a model.toml."""

    plant: str
    effects: tuple[str, ...] = ()
    assumptions: dict[str, Any] = field(default_factory=dict)
    constants: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, ParameterValue] = field(default_factory=dict)
    effect: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)
    sensors: Sensors = field(default_factory=Sensors)
    controller: Controller | None = None
    columns: dict[str, Column] = field(default_factory=dict)
    simulation: dict[str, float] | None = None
    input: Input | None = None
    random_force: dict[str, RandomForce] = field(default_factory=dict)  # by row
    sensor_error: dict[str, SensorNoise] = field(default_factory=dict)  # by channel
