"""Small made-up logs as they come from a bench: other names, other units, counters, counts and duties."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from tests.support import simulated
from wheelpend import Model, simulate

DT_S = 0.005


def write_csv(path: Path, columns: dict[str, np.ndarray], header: bool = True) -> Path:
    """A CSV file of columns (N,)."""
    rows = [",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([*([",".join(columns)] if header else []), *rows]) + "\n", encoding="utf-8")
    return path


def driven_axis(rows: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], volts and way [m] (rows,) of an axis with viscous friction that a sum of sines drives."""
    t = np.arange(rows) * DT_S
    return t, (volts := 6.0 * np.sin(3.1 * t) + 4.0 * np.sin(7.7 * t + 1)), way_of(volts)


def way_of(volts: np.ndarray) -> np.ndarray:
    """Way [m] (N,) of an axis from rest under volts (N,)."""
    speed, place, places = 0.0, 0.0, []
    time_constant = 0.8 / 12.0
    lost = 1.0 - np.exp(-DT_S / time_constant)  # of the difference to the speed that a command leads to, in a sample
    for u in volts:
        places.append(place)
        difference = speed - u / 12.0
        place += u / 12.0 * DT_S + difference * time_constant * lost
        speed -= difference * lost
    return np.array(places)


def fast_motor() -> dict[str, np.ndarray]:
    """Columns (300,) of a motor that is switched on: it turns, at last by 86 degrees from sample to sample."""
    t = np.arange(300) / 150.0
    degrees = 153.9 + 12900.0 * (t - 0.07 * (1.0 - np.exp(-t / 0.07)))
    return {"t": t, "angle": degrees, "pwm": np.r_[0.0, np.full(299, 100.0)]}


def two_wheels() -> dict[str, np.ndarray]:
    """Columns (225,) of both wheels of a robot under a staircase of duties: counts, filtered differences of these."""
    t = np.arange(225) * 0.1
    found = {"ms": 1e3 * t}
    for side, speed in (("left", 310.0), ("right", 280.0)):
        duty = 10.0 * np.floor(t / 3.0)
        uneven = 1.0 + 0.05 * np.random.default_rng(int(speed)).standard_normal(t.size)
        counts = np.round(np.cumsum(speed * uneven * duty / 100.0 * np.diff(t, prepend=0.0)))
        filtered = lfilter([0.3], [1.0, -0.7], np.diff(counts, prepend=0.0) * 0.1152)
        found |= {f"{side}_pulses": counts, f"{side}_speed": filtered.round(3), f"{side}_pwm": duty + (side == "left")}
    return found


def swing(
    rows: int = 3000, begin: float = 1.9, torque: np.ndarray | None = None, law: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], torques [N m] and angles from hanging [rad] (rows,) of a pendulum.

    Its torque is ``torque`` (rows,), or ``law`` times the sign of the rate that was measured a moment before.
    """
    t, angle, speed, angles, torques = np.arange(rows) * DT_S, begin, 0.0, [], []
    for k in range(rows):
        angles.append(angle)
        u = torque[k] if torque is not None else law * np.sign(angle - angles[max(k - 4, 0)])
        torques.append(u)
        for _ in range(5):
            speed += DT_S / 5 * (u - 1.2 * np.sin(angle) - 0.01 * speed) / 0.05
            angle += DT_S / 5 * speed
    return t, np.array(torques), np.array(angles)


def arm_with_torque_sensor(acts: bool = False) -> dict[str, np.ndarray]:
    """An arm whose torque is read with noise of 0.03 N m, a tenth of its scatter, at a sensor; or noise that acts."""
    t, rng = np.arange(3000) * DT_S, np.random.default_rng(11)
    torque = 0.4 * np.sin(1.1 * t) + 0.2 * np.sin(2.3 * t + 1.0) + 0.1 * np.sin(9.1 * t)
    read = torque + 0.03 * rng.standard_normal(t.size)
    _, _, angle = swing(begin=0.0, torque=read if acts else torque)
    return {"time": t, "tau_N m": read, "q_rad": angle + 1e-5 * rng.standard_normal(t.size)}


def balancing_robot(seed: int = 3, duration: float = 12.0) -> dict[str, np.ndarray]:
    """Columns (N,) of a balancing robot as it writes them, under names that say nothing.

    Milliseconds, PWM counts of ±255, a battery's volts that sag, 1440 counts a turn of the wheel against the body, and
    pitch and gyro in degrees, turned round.
    """
    log = simulate(Model.default(), duration=duration, seed=seed, sample=0.005)
    wheel, pitch, rate = log.measured.T
    rng = np.random.default_rng(seed)
    battery = 24.2 - 0.04 * log.t - 0.3 * np.abs(log.voltage) / 24 + 0.01 * rng.normal(size=log.t.size)
    return {
        "ms": 51234 + np.round(1e3 * log.t),
        "m": np.clip(np.round(255 * log.voltage / battery), -255, 255),
        "vb": np.round(battery, 2),
        "pos": np.round((wheel - pitch) * 1440 / (2 * np.pi)),
        "ang": -np.round(np.degrees(pitch), 2),
        "rate": -np.round(np.degrees(rate), 2),
    }


def robot(**other: np.ndarray) -> dict[str, np.ndarray]:
    """A simulated robot's log [rad] without noise, under names as robots have them."""
    log = simulated(seed=3, noise=False, sample=0.01)
    columns = dict(zip(log.channels, log.measured.T, strict=True))
    found = {"time": log.t, "pitch": columns["theta_p"], "gyro": columns["dtheta_p"], "wheel": columns["theta_w"]}
    return found | {"voltage": log.voltage} | other


def late_motor(reading: str = "counts", late: float = 1.0, jitter: float = 0.0) -> dict[str, np.ndarray]:
    """Columns (250,) of a motor under steps held for 0.8 s, each logged so many rows after it acts.

    It is read in ``counts``, as a ``speed`` of what it went since the row before, or in counts while a ``relay`` turns
    it round at two places. Rows come every 20 ms, some of them up to ``jitter`` of that early or late.
    """
    random, fine, rows, dt = np.random.default_rng(8), 200, 250, 0.02
    levels = random.uniform(-10.0, 10.0, 8)
    begins = np.arange(rows) + jitter * random.uniform(-0.5, 0.5, rows)
    acting = np.repeat(np.r_[0.0, levels], 40)[: rows + 2]
    place, speed, places, volts = 0.0, 0.0, [], 8.0
    acted = np.repeat(acting, fine)
    for k in range(acted.size):
        places.append(place)
        if reading == "relay":
            volts = -volts if k % fine == 0 and place * volts > 0.0 and abs(place) > 2.0 else volts
            acted[k] = volts
        place, speed = place + speed * dt / fine, speed + (acted[k] / 0.2 - speed) / 0.08 * dt / fine
    at = np.clip(np.round((begins + late) * fine).astype(int), 0, acted.size - 1)
    counts = np.round(np.array(places)[at] * 1320 / (2 * np.pi))
    found = {"t": begins * dt, "volts": acting[:rows]}
    if reading == "relay":
        at = np.round(begins * fine).astype(int)
        return {"t": begins * dt, "volts": acted[at], "counts": np.round(np.array(places)[at] * 1320 / (2 * np.pi))}
    if reading == "speed":
        return found | {"rpm": np.diff(counts, prepend=counts[:1]) / 1320 * 60 / dt}
    return found | {"counts": counts}
