"""Random forces that an engine plays: what a filter assumes of them, and what it does not.

A force is a path over time, drawn in advance, and where it grows with the speed multiplied by that as it comes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, lfilter, sosfilt, unit_impulse

FIRST_ORDER_TIME_S, SHOT_TIME_S = 0.1, 0.05  # s, correlation times of the first-order force and of the shots' lag
SHOT_RATE_HZ = 10.0  # impulses a second: at the shots' lag every other one meets one that has not faded
BAND_HZ, BAND_ORDER = (0.5, 5.0), 2  # Hz, edges of the band-limited force; order of its Butterworth filter
SETTLING_TIME_S = 10.0  # s before the log, in which a force forgets how it began


@dataclass(frozen=True)
class ForceKind:
    """A kind of random force with a standard deviation of 1."""

    draw: Callable[[np.random.Generator, int, float], np.ndarray]  # random, steps, step [s] -> path (steps,)
    correlation_time: float | None  # s, where it has one
    with_speed: bool = False  # times the wheels' speed relative to its rms
    words: str = ""


def first_order(time: float) -> Callable[[np.random.Generator, int, float], np.ndarray]:
    """Noise of first order (Ornstein and Uhlenbeck) with a correlation time [s], exact at every step."""

    def draw(random: np.random.Generator, steps: int, step: float) -> np.ndarray:
        fade = np.exp(-step / time)
        innovation = np.sqrt(1.0 - fade**2) * random.normal(size=steps)
        innovation[0] = random.normal()  # as likely as any later value
        return lfilter([1.0], [1.0, -fade], innovation)

    return draw


def shots(random: np.random.Generator, steps: int, step: float) -> np.ndarray:
    """Impulses at random moments and of random sizes, through a lag of first order."""
    settling = round(SETTLING_TIME_S / step)
    count = random.poisson(SHOT_RATE_HZ * step, size=settling + steps)
    sizes = np.sqrt(count) * random.normal(size=count.size)
    fade = np.exp(-step / SHOT_TIME_S)
    path = lfilter([1.0], [1.0, -fade], sizes)[settling:]
    return path * np.sqrt((1.0 - fade**2) / (SHOT_RATE_HZ * step))


def band_limited(random: np.random.Generator, steps: int, step: float) -> np.ndarray:
    """Noise between two frequencies."""
    settling = round(SETTLING_TIME_S / step)
    sections = butter(BAND_ORDER, BAND_HZ, btype="bandpass", fs=1.0 / step, output="sos")
    gain = np.linalg.norm(sosfilt(sections, unit_impulse(settling)))
    return sosfilt(sections, random.normal(size=settling + steps))[settling:] / gain


FORCE_KINDS = {
    "first_order": ForceKind(first_order(FIRST_ORDER_TIME_S), FIRST_ORDER_TIME_S, words="first order, 0.1 s"),
    "shots": ForceKind(shots, SHOT_TIME_S, words="filtered shots, 10 a second, 0.05 s"),
    "band_limited": ForceKind(band_limited, None, words="0.5 to 5 Hz"),
    "with_speed": ForceKind(
        first_order(FIRST_ORDER_TIME_S),
        FIRST_ORDER_TIME_S,
        with_speed=True,
        words="first order, 0.1 s, times the speed",
    ),
}
