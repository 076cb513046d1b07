"""Random sources: forces on a machine that no law predicts, and errors of its sensors that are no white noise.

Both are zero-mean noise of first order, of a size and a correlation time. Where several rows feel the same force it
acts along a port, equal and opposite on the parts that meet there. The error of a sensor behind a low-pass filter has
the filter's time as its correlation time, and is moved by what the sensor should read as well.
Source: Jategaonkar, Flight Vehicle System Identification (2015), chapter 5; Maine and Iliff (1981).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from derive.plant_signature import PlantSignature

MAX_CORRELATION_TIME_S, MAX_CORRELATION_SHARE = 1.0, 0.05  # s, and of a log's duration: slower ones are offsets
MIN_CORRELATION_SAMPLES = 0.5  # sample intervals: a faster source is white
AT_BOUND_SHARE = 0.99  # of the longest correlation time, above which a source is at that bound


@dataclass(frozen=True)
class RandomSource:
    """A random force or a random error of a sensor, independent of everything else."""

    place: str  # the row or the port on which a force acts, the channel of a sensor
    rows: tuple[float, ...]  # (NQ,) weights on the rows
    readings: tuple[float, ...]  # (NY,) weights on the readings
    rms: float = 0.0  # in the unit of the row, or of the channel
    correlation_time: float = MAX_CORRELATION_TIME_S  # s
    lags: bool = False  # a sensor's error, that of a low-pass filter too

    @property
    def is_force(self) -> bool:
        """True of a force, False of a sensor's error."""
        return any(self.rows)

    @property
    def kind(self) -> tuple:
        """What it is, whatever its size and time."""
        return (self.rows, self.readings, self.lags)

    def is_at_bound(self, longest: float) -> bool:
        """True where its correlation time is the longest [s] that is allowed."""
        return self.correlation_time > AT_BOUND_SHARE * longest

    def with_noise(self, rms: float, correlation_time: float) -> RandomSource:
        """The source with another size and correlation time."""
        return replace(self, rms=rms, correlation_time=correlation_time)


Sources = tuple[RandomSource, ...]  # that act together, in one log


def possible_forces(plant: PlantSignature, channels: int) -> Sources:
    """Forces that a machine may feel: between two of its parts, then on each row; no two of them on the same rows."""
    count, silent = len(plant.coordinates), (0.0,) * channels
    places = {name: port.weights for name, port in plant.couplings.items()}
    places |= {c.row: tuple(float(k == n) for k in range(count)) for n, c in enumerate(plant.coordinates)}
    distinct: dict[tuple[float, ...], str] = {}
    for place, rows in places.items():
        distinct.setdefault(tuple(rows), place)
    return tuple(RandomSource(place, rows, silent) for rows, place in distinct.items())


def all_errors(outputs: Sequence[str], rows: int) -> Sources:
    """Errors that sensors can have: one of each channel, and the same as those of a filter."""
    count, silent = len(outputs), (0.0,) * rows
    plain = [RandomSource(name, silent, tuple(float(k == n) for k in range(count))) for n, name in enumerate(outputs)]
    return (*plain, *(replace(error, lags=True) for error in plain))


def possible_errors(outputs: Sequence[str], rows: int) -> Sources:
    """Errors that the sensors of a machine may have: those of filters where there are several.

    What a sensor alone reads late the machine has done late, as far as its log can tell: that is a delay or a lag of
    what drives it, which are effects.
    """
    errors = all_errors(outputs, rows)
    return errors if len(outputs) > 1 else tuple(e for e in errors if not e.lags)


def correlation_bounds(durations: Sequence[float], sample_interval: float) -> tuple[float, float]:
    """Shortest and longest correlation time [s] that logs of these durations can tell from white noise and offset."""
    longest = min(MAX_CORRELATION_TIME_S, MAX_CORRELATION_SHARE * min(durations))
    return min(MIN_CORRELATION_SAMPLES * sample_interval, 0.5 * longest), longest


def noise_array(sources: Sources) -> np.ndarray:
    """Size and correlation time of each source, and 1 where it lags (sources, 3), as kernels take them."""
    return np.array([(s.rms, s.correlation_time, float(s.lags)) for s in sources]).reshape(-1, 3)


def mixing_matrix(weights: Sequence[tuple[float, ...]], rows: int) -> np.ndarray:
    """Weights of sources on rows or readings as a matrix (rows, sources)."""
    return np.array(weights, dtype=float).reshape(-1, rows).T.copy()


def scaled_sources(sources: Sequence[Sources], force_share: float, error_share: float = 1.0) -> tuple[Sources, ...]:
    """Each log's sources with the forces, and the sensors' errors, a share as large."""
    shares = {True: force_share, False: error_share}
    return tuple(tuple(s.with_noise(s.rms * shares[s.is_force], s.correlation_time) for s in own) for own in sources)


def with_forces(
    sources: Sequence[Sources], share: float, slowness: float, shortest: float, largest: float = np.inf
) -> tuple[Sources, ...]:
    """Each log's sources with the forces a share as large, and that much slower, but no faster than shortest [s].

    None is larger than ``largest``.
    """

    def changed(source: RandomSource) -> RandomSource:
        rms, time = min(source.rms * share, largest), max(source.correlation_time * slowness, shortest)
        return source.with_noise(rms, time) if source.is_force else source

    return tuple(tuple(map(changed, own)) for own in sources)


def with_one_changed(
    sources: Sequence[Sources], number: int, *, share: float = 1.0, slowness: float = 1.0
) -> tuple[Sources, ...]:
    """Each log's sources with the so-manieth alone a share as large, and that much slower."""

    def changed(source: RandomSource) -> RandomSource:
        return source.with_noise(share * source.rms, slowness * source.correlation_time)

    return tuple(tuple(changed(s) if k == number else s for k, s in enumerate(own)) for own in sources)
