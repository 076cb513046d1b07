"""Excitations: reference trajectories of an angle from upright, which drive, step, sweep, or are sums of sines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.simulation.references import BUILT_IN_COMMANDS_DEG

FADE_DURATION_S = 1.0  # s in which a trajectory sets in and fades out, so that it starts and ends at rest
LEAN_DURATION_S = 1.5  # s of leaning, in which a drive gains or loses its speed
STEP_RISE_TIME_S = 0.15  # s in which a step is taken
MULTISINE_COMPONENTS = 4  # sines of a multisine
MIN_FREQUENCY_HZ = 0.04  # of a multisine's components
MAX_FREQUENCY_HZ = 3.0


class Excitation(NamedTuple):
    """A reference trajectory of an angle from upright."""

    name: str  # for people: completes "20 s of ..."
    angle: Callable[[np.ndarray], np.ndarray]  # [rad] at times (N,) [s]
    builtin: str = ""  # its name among the commands, where it is one

    def trajectory(self, t: np.ndarray, factor: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """The angle [rad] and its rate [rad/s] at the times t, (N,) each, made smaller by a factor."""
        angle = factor * self.angle(t)
        return angle, np.gradient(angle, t)


def builtin_excitations() -> tuple[Excitation, ...]:
    """The built-in commands."""
    return tuple(Excitation(f"the command '{n}'", _angle_rad(n), n) for n in sorted(BUILT_IN_COMMANDS_DEG))


def _angle_rad(name: str) -> Callable[[np.ndarray], np.ndarray]:
    return lambda t: np.radians(BUILT_IN_COMMANDS_DEG[name](t))


def excitation_family() -> tuple[Excitation, ...]:
    """Drives, steps, sweeps and multisines at several amplitudes and frequencies."""
    found = [steady_drives(a, hold) for a in (0.03, 0.1) for hold in (3.0, 6.0)]
    found += [square_wave(a, period) for a in (0.05, 0.2) for period in (2.0, 6.0)]
    found += [sweep(a) for a in (0.05, 0.25)]
    found += [schroeder_multisine(a, low, high) for a in (0.05, 0.2) for low, high in ((0.05, 0.4), (0.4, 3.0))]
    return tuple(found)


def steady_drives(lean: float, hold: float) -> Excitation:
    """Lean to gain speed, roll at it, lean back to lose it, and the same the other way, again and again."""
    push = LEAN_DURATION_S
    one_way = 2 * (push + hold)

    def angle(t: np.ndarray) -> np.ndarray:
        phase = t % (2 * one_way)
        way = np.where(phase < one_way, 1.0, -1.0)
        phase = phase % one_way
        gain = _smooth_pulse(phase, 0.0, push) - _smooth_pulse(phase, push + hold, 2 * push + hold)
        return lean * way * gain

    return Excitation(f"steady drives of {hold:g} s, gained by leaning {lean:g} rad", _faded(angle))


def square_wave(height: float, period: float) -> Excitation:
    """A square wave whose edges take a moment."""

    def angle(t: np.ndarray) -> np.ndarray:
        wave = np.sin(2 * np.pi * t / period)
        return height * np.tanh(wave * period / (2 * np.pi * STEP_RISE_TIME_S))

    return Excitation(f"steps of ±{height:g} rad every {period / 2:g} s", _faded(angle))


def sweep(height: float, low: float = 0.1, high: float = 3.0) -> Excitation:
    """A sine whose frequency grows geometrically from low to high [Hz], whatever the duration."""

    def angle(t: np.ndarray) -> np.ndarray:
        growth = np.log(high / low) / max(float(t[-1]), 1e-9)
        return height * np.sin(2 * np.pi * low * np.expm1(growth * t) / growth)

    return Excitation(f"a sweep of ±{height:g} rad from {low:g} to {high:g} Hz", _faded(angle))


def schroeder_multisine(height: float, low: float, high: float) -> Excitation:
    """A multisine over a band [Hz], with phases after Schroeder, which keep its peak low."""
    frequencies = np.geomspace(low, high, MULTISINE_COMPONENTS)
    phases = -np.pi * np.arange(MULTISINE_COMPONENTS) * (np.arange(MULTISINE_COMPONENTS) + 1) / MULTISINE_COMPONENTS
    amplitudes = np.full(MULTISINE_COMPONENTS, height / np.sqrt(MULTISINE_COMPONENTS))
    return multisine(frequencies, amplitudes, phases, f"a multisine of {height:g} rad from {low:g} to {high:g} Hz")


def multisine(
    frequencies: Sequence[float] | np.ndarray, amplitudes: np.ndarray, phases: np.ndarray, name: str = ""
) -> Excitation:
    """A sum of sines: frequencies [Hz], amplitudes [rad], phases [rad], (n,) each."""
    named = name or "a multisine of " + ", ".join(
        f"{a:.2g} rad at {f:.2g} Hz" for f, a in sorted(zip(frequencies, amplitudes, strict=True))
    )

    def angle(t: np.ndarray) -> np.ndarray:
        return amplitudes @ np.sin(2 * np.pi * np.outer(frequencies, t) + phases[:, None])

    return Excitation(named, _faded(angle))


def _smooth_pulse(t: np.ndarray, first: float, last: float) -> np.ndarray:
    """1 between two times and 0 outside, with soft edges."""
    return 0.5 * (
        np.tanh((t - first - STEP_RISE_TIME_S) / STEP_RISE_TIME_S)
        - np.tanh((t - last + STEP_RISE_TIME_S) / STEP_RISE_TIME_S)
    )


def _faded(angle: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """The same trajectory, which sets in and fades out."""

    def eased(t: np.ndarray) -> np.ndarray:
        edge = min(FADE_DURATION_S, float(t[-1]) / 4)
        rise = np.clip(np.minimum(t, t[-1] - t) / edge, 0.0, 1.0)
        return angle(t) * 0.5 * (1.0 - np.cos(np.pi * rise))

    return eased
