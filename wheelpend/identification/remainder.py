"""What a model leaves to chance: a random force on each row that feels one, and random errors of sensors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.random_source import RandomSource, Sources
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model.entries import RandomForce, SensorNoise
from wheelpend.model.record import Model

MAX_FORCE_SAMPLES = 2000  # samples of a log on which the modelled forces are measured


@dataclass(frozen=True)
class RowForce:
    """The random force that a row feels."""

    rms: float  # in the unit of the row
    unit: str
    rms_torque: float | None  # the same in N m or N, where the constant for it is known
    share_of_drive: float  # its rms over that of all modelled forces on the row but inertia
    share: float  # the same, or its rms over that of the input's force alone where that is larger
    correlation_time_s: float
    place: str  # the row, or the port along which it acts on several
    at_bound: bool = False  # the correlation time is the longest that these logs allow

    def to_json(self) -> dict[str, Any]:
        """The force under the keys of JSON."""
        return {
            "rms": self.rms,
            "unit": self.unit,
            "rms_torque": self.rms_torque,
            "share_of_drive": self.share_of_drive,
            "share": self.share,
            "correlation_time_s": self.correlation_time_s,
            "place": self.place,
            "at_bound": self.at_bound,
        }


@dataclass(frozen=True)
class SensorError:
    """The random error of a sensor, besides its white noise; of two the time of the larger, and both together."""

    rms: float  # in the unit of the channel
    unit: str
    sigmas: float  # its rms over the sensor's σ
    share_of_signal: float  # its rms over the channel's standard deviation
    correlation_time_s: float
    lag_s: float = 0.0  # time of the low-pass filter behind which it reads; 0 for none
    smaller_sigmas: float = 0.0  # rms over the sensor's σ of the smaller one, where it has two; 0 where it has one
    smaller_time_s: float = 0.0  # correlation time of that

    def to_json(self) -> dict[str, Any]:
        """The error under the keys of JSON."""
        return {
            "rms": self.rms,
            "unit": self.unit,
            "sigmas": self.sigmas,
            "share_of_signal": self.share_of_signal,
            "correlation_time_s": self.correlation_time_s,
            "lag_s": self.lag_s,
            "smaller_sigmas": self.smaller_sigmas,
            "smaller_time_s": self.smaller_time_s,
        }


@dataclass(frozen=True)
class Remainder:
    """What a model leaves to chance."""

    force: dict[str, RowForce] = field(default_factory=dict)  # by row
    sensors: dict[str, SensorError] = field(default_factory=dict)  # by channel
    places: tuple[str, ...] = ()  # where the forces act: rows, or ports between two of them
    repeatable_share: float | None = None  # of the forces' mean square, that a smooth law predicts; None if not sought
    repeating: tuple[Any, ...] = ()  # what was found in looking for it, by row, port or reading
    resonances: tuple[Any, ...] = ()  # narrow bands in which the filter misses far more than around them, by channel
    slow: tuple[Any, ...] = ()  # forces and errors of sensors as slow as is allowed, and whether they would be slower
    impossible: tuple[Any, ...] = ()  # laws of effects that data follow with sizes that nothing has
    instead: tuple[str, ...] = ()  # effects with which hardly any force is needed, and the logs are as likely
    unpredicted: float | None = None  # share of the motion's mean square over the horizon that is missed; None: unknown

    @property
    def is_nothing(self) -> bool:
        """True where neither a random force nor a sensor's random error is left."""
        return not self.force and not self.sensors

    @property
    def what_repeats(self) -> tuple[Any, ...]:
        """What of it does not look like chance, of all that was found."""
        return tuple(f for f in (*self.repeating, *self.slow, *self.resonances, *self.impossible) if f.repeats)

    @property
    def strongest(self) -> RowForce | None:
        """The force that is the largest share of what acts on its row; None without any."""
        return max(self.force.values(), key=lambda f: f.share, default=None)

    @property
    def share(self) -> float:
        """The force that is the largest share of what acts on its row, as that share; 0 without any."""
        return self.strongest.share if self.strongest else 0.0

    def to_json(self) -> dict[str, Any]:
        """The remainder under the keys of JSON."""
        return {
            "force": self.force,
            "sensors": self.sensors,
            "places": self.places,
            "repeatable_share": self.repeatable_share,
            "repeating": self.repeating,
            "resonances": self.resonances,
            "slow": self.slow,
            "impossible": self.impossible,
            "instead": self.instead,
            "unpredicted": self.unpredicted,
        }


class ActingForces(NamedTuple):
    """Root mean squares of the modelled generalised forces on each row (NQ,) but inertia, along the measured motion."""

    together: np.ndarray  # of their sum
    of_input: np.ndarray  # of what the input changes in it

    @property
    def largest(self) -> np.ndarray:
        """The larger of both: in motion at constant speed the drive and what it overcomes cancel."""
        return np.maximum(self.together, self.of_input)


def with_remainder(model: Model, left: Remainder | None) -> Model:
    """The model with what is left to chance in its file; without any where nothing is, or where that is not known."""
    if left is None:
        return model.with_random_sources({}, {})
    ports = {name for name, port in model.plant_signature.couplings.items() if np.count_nonzero(port.weights) > 1}
    forces = {
        row: RandomForce(f.rms, f.correlation_time_s, f.place if f.place in ports else "")
        for row, f in left.force.items()
    }
    errors = {channel: SensorNoise(e.rms, e.correlation_time_s, e.lag_s) for channel, e in left.sensors.items()}
    return model.with_random_sources(forces, errors)


def remainder_of(
    model: Model,
    sources: Sequence[Sources],
    acting: ActingForces,
    sigma: np.ndarray,
    deviation: np.ndarray,
    longest: float,
) -> Remainder:
    """What the sources of some logs amount to, the root mean square over the logs.

    sigma (NY,) is the size of the sensors' noise, deviation (NY,) the standard deviation of what they read, longest [s]
    the correlation time that was allowed.
    """
    plant, kinds = model.plant_signature, sources[0]
    sizes = np.sqrt(np.mean([[s.rms**2 for s in own] for own in sources], axis=0)) if kinds else np.zeros(0)
    forces = {}
    for number, coordinate in enumerate(plant.coordinates):
        on_row = np.array([abs(s.rows[number]) for s in kinds]) * sizes
        if np.any(on_row):
            leading = kinds[int(np.argmax(on_row))]
            forces[coordinate.row] = _row_force(model, plant, number, on_row, leading, acting, longest)
    errors = {}
    for number, channel in enumerate(plant.channels):
        of_channel = [
            (s, float(size)) for s, size in zip(kinds, sizes, strict=True) if s.place == channel.name and not s.is_force
        ]
        if of_channel:
            errors[channel.name] = _sensor_error(
                of_channel, channel.unit, float(sigma[number]), float(deviation[number])
            )
    return Remainder(forces, errors, tuple(s.place for s in kinds if s.is_force))


def _sensor_error(
    sources: Sequence[tuple[RandomSource, float]], unit: str, sigma: float, deviation: float
) -> SensorError:
    """What the sources of one channel, with their sizes, amount to."""
    rms = float(np.sqrt(sum(size**2 for _, size in sources)))
    leading = max(sources, key=lambda s: s[1])[0]
    lag = max((s.correlation_time for s, _ in sources if s.lags), default=0.0)
    share = rms / deviation if deviation else np.inf
    plain = sorted((size, s.correlation_time) for s, size in sources if not s.lags)
    smaller, smaller_time = plain[0] if len(plain) > 1 else (0.0, 0.0)
    return SensorError(rms, unit, rms / sigma, share, leading.correlation_time, lag, smaller / sigma, smaller_time)


def _row_force(
    model: Model,
    plant: PlantSignature,
    number: int,
    on_row: np.ndarray,
    leading: RandomSource,
    acting: ActingForces,
    longest: float,
) -> RowForce:
    rms = float(np.sqrt((on_row**2).sum()))
    together, largest = float(acting.together[number]), float(acting.largest[number])
    constant = plant.scale_constant
    scale = model.constants.get(constant.name) if constant else None
    return RowForce(
        rms,
        plant.force_unit(plant.coordinates[number].unit),
        None if scale is None else rms * scale,
        rms / together if together > 0.0 else np.inf,
        rms / largest if largest > 0.0 else np.inf,
        leading.correlation_time,
        leading.place,
        leading.is_at_bound(longest),
    )


def modelled_forces(module: KernelModule, logs: Sequence[Log], values: Mapping[str, float]) -> ActingForces:
    """What acts on each row of a model of these values, along the measured motion."""
    found = [np.array((driven, driven - idle)) for driven, idle in _sampled_forces(module, logs, values)]
    return ActingForces(*np.sqrt(np.mean(np.square(found), axis=0) if found else np.zeros((2, module.NQ))))


def difference_of_forces(
    module: KernelModule, logs: Sequence[Log], values: Mapping[str, float], others: Mapping[str, float]
) -> np.ndarray:
    """Rms on each row (rows,) of the difference that other values make to what acts, along the measured motion."""
    pairs = zip(*(_sampled_forces(module, logs, v) for v in (values, others)), strict=True)
    found = [driven - otherwise for (driven, _), (otherwise, _) in pairs]
    return np.sqrt(np.mean(np.square(found), axis=0)) if found else np.zeros(module.NQ)


def _sampled_forces(
    module: KernelModule, logs: Sequence[Log], values: Mapping[str, float]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Forces on each row (rows,) in some samples of the logs, with the input as it was and without any."""
    for log in logs:
        parameters, states = kernel_parameters(module, values, log), measured_states(module, log)
        chosen = np.unique(np.linspace(0, len(log) - 1, MAX_FORCE_SAMPLES).astype(int))
        known = dict(zip(module.PARAMETERS, parameters, strict=True))
        linear = np.array([known[n] for n in module.LINEAR])
        for k in chosen[np.isfinite(log.inputs[:, chosen]).all(axis=0)]:
            driven, idle = (
                left - phi @ linear
                for left, phi in (
                    module.regressor(log.t[k], states[k], np.zeros(module.NQ), log.voltage[k] * on, parameters)
                    for on in (1.0, 0.0)
                )
            )
            yield driven, idle
