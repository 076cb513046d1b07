"""Clean simulated logs with one fault put in each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.support import simulated
from wheelpend import Log

RNG_SEED = 3


def clean(seed: int = 0, command: str = "aggressive") -> Log:
    """A sound log of the paper's robot."""
    return simulated(command, seed)


def with_columns(log: Log, **columns: np.ndarray) -> Log:
    """The log with other values of some columns, v_in among them."""
    measured = log.measured.copy()
    for name, values in columns.items():
        if name != "v_in":
            measured[:, log.channels.index(name)] = values
    return replace(log, measured=measured, voltage=columns.get("v_in", log.voltage))


def column(log: Log, name: str) -> np.ndarray:
    """Values of a column."""
    return log.voltage if name == "v_in" else log.measured[:, log.channels.index(name)]


def rows(log: Log, keep: np.ndarray) -> Log:
    """Some rows of a log."""
    reference = None if log.reference is None else log.reference[keep]
    return replace(log, t=log.t[keep], voltage=log.voltage[keep], measured=log.measured[keep], reference=reference)


def dropped(log: Log, share: float = 0.05, retimed: bool = False) -> Log:
    """A share of the rows dropped at random; times keep their gaps, or are made uniform."""
    cut = rows(log, np.random.default_rng(RNG_SEED).random(len(log)) > share)
    return replace(cut, t=np.arange(len(cut)) * log.dt) if retimed else cut


def rounded_times(log: Log, rows_per_row: float = 1.44) -> Log:
    """Times rounded down to the steps of a clock, of which so many pass from row to row."""
    step = log.dt / rows_per_row
    return replace(log, t=step * np.floor(rows_per_row * np.arange(len(log)) + 1e-9))


def jittering_stamps(log: Log, share: float = 0.1) -> Log:
    """Times that jitter by a share of an interval, though the samples are even."""
    off = np.random.default_rng(RNG_SEED).uniform(-1, 1, len(log))
    return replace(log, t=log.t + share * log.dt * off)


def jittering_samples(log: Log, share: float = 0.1) -> Log:
    """Samples of the wheel taken early or late by a share of an interval, though the times are uniform."""
    off = share * log.dt * np.random.default_rng(RNG_SEED).uniform(-1, 1, len(log))
    speed = np.gradient(np.convolve(column(log, "theta_w"), np.ones(9) / 9, mode="same"), log.dt)
    return with_columns(log, theta_w=column(log, "theta_w") + speed * off).part(20, len(log) - 20)


def saturated(log: Log, name: str, share: float = 0.7) -> Log:
    """A sensor whose ceiling is a share of what it would read at most."""
    values = column(log, name)
    ceiling = share * np.abs(values).max()
    return with_columns(log, **{name: np.clip(values, -ceiling, ceiling)})


def joined(first: Log, second: Log) -> Log:
    """Two recordings in one file, the times running on."""
    return replace(
        first,
        t=np.concatenate([first.t, first.t[-1] + first.dt + second.t]),
        voltage=np.concatenate([first.voltage, second.voltage]),
        measured=np.concatenate([first.measured, second.measured]),
        reference=None,
    )


def on_the_floor(log: Log, begin: float, end: float, angle: float = 1.2) -> Log:
    """The robot falls at a time, lies, and stands again at another."""
    lying = (log.t >= begin) & (log.t <= end)
    noise = np.random.default_rng(RNG_SEED).normal(scale=0.0087, size=(len(log), 2))
    before, after = (np.interp(at, log.t, column(log, "theta_p")) for at in (begin, end))
    down = np.clip((log.t - begin) / 0.3, 0, 1) ** 2 * np.clip((end - log.t) / 0.3, 0, 1) ** 2
    angle_then = angle * down + np.where(log.t > 0.5 * (begin + end), after, before) * (1 - down)
    pitch = np.where(lying, angle_then + noise[:, 0], column(log, "theta_p"))
    rate = np.where(lying, np.gradient(angle_then, log.dt) + noise[:, 1], column(log, "dtheta_p"))
    wheel = column(log, "theta_w").copy()
    wheel[log.t > end] += np.interp(begin, log.t, wheel) - np.interp(end, log.t, wheel)
    wheel[lying] = wheel[np.argmax(lying)]
    return with_columns(log, theta_p=pitch, dtheta_p=rate, theta_w=wheel)


def at_rest(log: Log) -> Log:
    """A robot that is held while its motor is told something: nothing moves."""
    noise = np.random.default_rng(RNG_SEED).normal(scale=0.0087, size=(len(log), 2))
    return with_columns(log, theta_w=np.zeros(len(log)), theta_p=noise[:, 0], dtheta_p=noise[:, 1])


def in_counts(log: Log, counts: float = 4096) -> Log:
    """The encoder in raw counts."""
    return with_columns(log, theta_w=np.round(column(log, "theta_w") * counts / (2 * np.pi)))


def as_pwm(log: Log, limit: float, supply: float = 24.0, whole: bool = True) -> Log:
    """The input as duty of a supply, in whole numbers or not, clipped at ±limit."""
    duty = np.clip(column(log, "v_in") / supply * limit, -limit, limit)
    return with_columns(log, v_in=np.round(duty) if whole else duty)


def spiky(log: Log, name: str, count: int = 30, size: float = 0.5) -> Log:
    """Single readings far off, some up and some down."""
    rng = np.random.default_rng(RNG_SEED)
    values = column(log, name).copy()
    values[rng.choice(np.arange(100, len(log) - 100), count, replace=False)] += size * rng.choice([-1, 1], count)
    return with_columns(log, **{name: values})


def slipped(log: Log, name: str, time: float = 8.0, size: float = 0.7) -> Log:
    """A sensor that loses counts once."""
    return with_columns(log, **{name: column(log, name) + size * (log.t > time)})


def smoothed(log: Log, name: str, cutoff_hz: float = 10.0) -> Log:
    """A channel that was filtered before it was logged."""
    from scipy.signal import butter, sosfiltfilt

    filtered = sosfiltfilt(butter(4, cutoff_hz, fs=1.0 / log.dt, output="sos"), column(log, name))
    return with_columns(log, **{name: filtered})
