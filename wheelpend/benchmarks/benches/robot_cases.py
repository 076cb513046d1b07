"""What is drawn of a balancing robot: wheels, body and motor, its IMU, its loop, the ground, and what is hidden."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.benches.robots import Imu, Loop, Robot, balanced, gains_of

ROBOT_RATES_HZ, ROBOT_SPANS_S, WHEEL_COUNTS = (100.0, 200.0), (10.0, 20.0), (360, 1000, 2000)
FILTER_TIMES_S = (0.5, 1.0, 2.0)  # of a pitch that is fused with an accelerometer
GRAVITY_M_S2, ROUGHNESS_S = 9.81, 0.1  # correlation time of the force by rough ground
PITCH_NOISE_RAD, RATE_NOISE = 0.002, 0.005  # rad, rad/s
MAX_CLIPPED = 0.05  # share of a log at the limit of the supply


class RobotLog(NamedTuple):
    """What a robot logged, and what a plain model of it lacks: parameters by full name."""

    t: np.ndarray  # (N,) s
    voltages: np.ndarray  # (N,)
    readings: np.ndarray  # (N, 3) encoder between wheels and body, pitch [rad] and gyro [rad/s]
    hidden: dict[str, float]


def balancing(rng: np.random.Generator) -> RobotLog:
    """The log of a robot that stands up to places it is sent to; those that fall or lack supply are drawn again."""
    while True:
        drawn = _drawn(rng)
        if drawn is not None:
            return drawn


def _drawn(rng: np.random.Generator) -> RobotLog | None:
    interval, span = 1.0 / float(rng.choice(ROBOT_RATES_HZ)), float(rng.choice(ROBOT_SPANS_S))
    t, supply = np.arange(round(span / interval)) * interval, float(rng.choice([6.0, 12.0]))
    radius, is_sticky = rng.uniform(0.03, 0.08), rng.random() < 0.7
    robot = _robot(rng, supply, radius, supply * rng.uniform(0.02, 0.08) * is_sticky)
    gains = gains_of(robot, interval, (rng.uniform(2.0, 6.0), 0.2, 10.0, 2.0), supply * rng.uniform(0.1, 0.5))
    loop = Loop(interval, gains, supply, int(rng.random() < 0.3), int(rng.choice(WHEEL_COUNTS)))
    fused = float(rng.choice(FILTER_TIMES_S)) if rng.random() < 0.4 else 0.0
    zeros = rng.normal(0.0, 0.015), rng.normal(0.0, 0.01)
    imu = Imu(*zeros, radius / GRAVITY_M_S2, fused, PITCH_NOISE_RAD, RATE_NOISE)
    hold = round(rng.uniform(1.5, 3.0) / interval)
    wanted = np.repeat(rng.uniform(-3.0, 3.0, t.size // hold + 1), hold)[: t.size]
    pushes = supply * rng.choice([0.0, 0.01, 0.03]) * _rough(rng, interval, t.size)
    made = balanced(robot, imu, loop, wanted, pushes, rng)
    if made is None or np.mean(np.abs(made[1]) >= supply) > MAX_CLIPPED:
        return None
    return RobotLog(t, made[1], made[0], _hidden(robot, imu, loop))


def _robot(rng: np.random.Generator, supply: float, radius: float, dry: float) -> Robot:
    mass, height = rng.uniform(0.3, 1.5), rng.uniform(0.04, 0.15)  # kg, m
    wheels, weight = mass * rng.uniform(0.05, 0.2), supply / rng.uniform(1.5, 4.0)  # kg of two discs, V
    per_volt = mass * GRAVITY_M_S2 * height / weight  # N m
    return Robot(
        roll=(mass + 1.5 * wheels) * radius**2 / per_volt,
        lean=mass * height**2 * rng.uniform(1.15, 1.5) / per_volt,
        coupling=mass * radius * height / per_volt,
        rotor=mass * radius**2 * rng.uniform(0.05, 0.3) / per_volt,
        weight=weight,
        damping=supply / rng.uniform(12.0, 40.0),
        dry=dry,
    )


def _rough(rng: np.random.Generator, interval: float, count: int) -> np.ndarray:
    """A force (N,) of first order, of rms 1."""
    from scipy.signal import lfilter  # imported late: slow to load

    kept = np.exp(-interval / ROUGHNESS_S)
    return lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], rng.standard_normal(count))


def _hidden(robot: Robot, imu: Imu, loop: Loop) -> dict[str, float]:
    """What acts on the log; a complementary filter makes an offset of the gyro one of the pitch, too."""
    hidden = {
        "coulomb_drive.torque": robot.dry,
        "actuator_delay.delay": loop.late * loop.interval_s,
        "imu_bias.bias": imu.tilt + imu.time_constant * imu.rate_bias,
        "gyro_bias.bias": imu.rate_bias,
    }
    if imu.time_constant:
        hidden["accelerometer_tilt.gain"] = imu.radius_over_gravity / imu.time_constant
        hidden["accelerometer_tilt.time_constant"] = imu.time_constant
    return {name: float(size) for name, size in hidden.items() if size}
