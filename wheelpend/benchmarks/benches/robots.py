"""A robot that balances on two wheels in steps of 20 µs, apart from the tool's simulator: gears may stick, or slip.

Symplectic Euler steps of wheels and body; friction is an impulse between them, applied last (Moreau's time stepping).
The robot has a loop of its own, as small ones do: from row to row it reads its encoder and its IMU and sets a voltage.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.isolation import import_configured

njit = import_configured("numba").njit
ROBOT_STEP_S = 2e-5
BEGIN_RAD, FALLEN_RAD = 0.03, 0.8
FRESH_SHARE = 0.3  # of the newest difference of counts in the wheel's speed that the loop goes by


class Robot(NamedTuple):
    """Wheels at φ, a body at θ and motors between them, divided by the torque of a volt: in V, s and rad."""

    roll: float  # inertia of φ̈ in the wheels' row [V s²], without the rotors
    lean: float  # inertia of θ̈ in the body's row [V s²], without the rotors
    coupling: float  # of both, times cos θ [V s²]
    rotor: float  # inertia of the rotors, which turn with φ - θ [V s²]
    weight: float  # moment of gravity on the body, over sin θ [V]
    damping: float  # back-EMF and bearings, times φ̇ - θ̇ [V s]
    dry: float  # friction of the gears [V]


class Imu(NamedTuple):
    """A gyro and an accelerometer, and how they become a pitch: filtered for some time, or else the true one."""

    tilt: float  # that the pitch reads too much [rad]
    rate_bias: float  # [rad/s]
    radius_over_gravity: float  # s²: the wheels' acceleration becomes so much tilt
    time_constant: float  # s, of the complementary filter; 0 of none
    pitch_noise: float  # [rad]
    rate_noise: float  # [rad/s]


class Loop(NamedTuple):
    """What the robot does from row to row: it reads, and sets a voltage by its state."""

    interval_s: float
    gains: tuple[float, ...]  # of place, pitch [V/rad] and their rates [V s/rad]
    limit: float  # V
    late: int  # rows by which a voltage acts late
    counts: int  # of the encoder a turn of the wheels against the body


def gains_of(robot: Robot, interval_s: float, sizes: Sequence[float], volts: float) -> tuple[float, ...]:
    """Gains of least squares (Kalman 1960) for sizes (4,) of place, pitch and their rates, and volts."""
    from scipy.linalg import expm, solve_discrete_are  # imported late: slow to load

    off, turned = robot.coupling - robot.rotor, np.array([1.0, -1.0])  # the generalised force of a volt
    inertia = np.array([[robot.roll + robot.rotor, off], [off, robot.lean + robot.rotor]])
    system = np.zeros((5, 5))
    system[:2, 2:4] = np.eye(2)
    system[2:4, 1] = np.linalg.solve(inertia, [0.0, robot.weight])
    system[2:4, 2:4] = -np.linalg.solve(inertia, robot.damping * np.outer(turned, turned))
    system[2:4, 4] = np.linalg.solve(inertia, turned)
    held = expm(system * interval_s)  # the voltage held for an interval
    a, b = held[:4, :4], held[:4, 4:]
    weights, price = np.diag(np.asarray(sizes) ** -2.0), np.array([[volts**-2.0]])
    riccati = solve_discrete_are(a, b, weights, price)
    return tuple(float(g) for g in np.linalg.solve(price + b.T @ riccati @ b, b.T @ riccati @ a)[0])


def balanced(
    robot: Robot, imu: Imu, loop: Loop, wanted: np.ndarray, pushes: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray] | None:
    """Readings (N, 3) of encoder, pitch and gyro [rad, rad/s] and the voltages (N,) set by them; None where it fell.

    ``wanted`` (N,) are places of the wheels [rad]; ``pushes`` (N,) act on the wheels, each for a row [V]. The encoder
    sits on the body, and turns against it.
    """
    pitch_noise, rate_noise = rng.standard_normal((2, wanted.size))
    readings, set_voltages = np.zeros((wanted.size, 3)), np.zeros(wanted.size)
    noises = (imu.pitch_noise * pitch_noise, imu.rate_noise * rate_noise)
    stands = _balance(robot, imu, loop, wanted, pushes, *noises, readings, set_voltages)
    return (readings, set_voltages) if stands else None


@njit
def _balance(robot, imu, loop, wanted, pushes, pitch_noise, rate_noise, readings, voltages):
    interval = loop.interval_s
    steps = round(interval / ROBOT_STEP_S)
    wheel, body, wheel_speed, body_speed, gained = 0.0, BEGIN_RAD, 0.0, 0.0, 0.0
    fused, turned_before, rate_before, speed_seen = body + imu.tilt, -body, 0.0, 0.0
    for k in range(wanted.size):
        turned = np.floor((wheel - body) * loop.counts / (2 * np.pi) + 0.5) * 2 * np.pi / loop.counts
        rate = body_speed + imu.rate_bias + rate_noise[k]
        if imu.time_constant > 0.0:
            leans = body + imu.tilt - np.arctan(gained / interval * imu.radius_over_gravity)
            fused += interval * ((rate + rate_before) / 2 + (leans + pitch_noise[k] - fused) / imu.time_constant)
        else:
            fused = body + imu.tilt + pitch_noise[k]
        speed_seen += FRESH_SHARE * ((turned - turned_before) / interval + rate - speed_seen)
        turned_before, rate_before = turned, rate
        readings[k] = turned, fused, rate
        place, pitch, speed, turning = loop.gains
        wanted_voltage = place * (wanted[k] - turned - fused) - pitch * fused - speed * speed_seen - turning * rate
        voltages[k] = min(max(wanted_voltage, -loop.limit), loop.limit)
        acts = voltages[k - loop.late] if k >= loop.late else 0.0
        before = wheel_speed
        for _ in range(steps):
            wheel_speed, body_speed = _stepped(robot, interval / steps, body, wheel_speed, body_speed, acts, pushes[k])
            wheel += interval / steps * wheel_speed
            body += interval / steps * body_speed
        gained = wheel_speed - before
        if abs(body) > FALLEN_RAD:
            return False
    return True


@njit
def _stepped(robot, step, body, wheel_speed, body_speed, voltage, push):
    first, second = robot.roll + robot.rotor, robot.lean + robot.rotor
    off = robot.coupling * np.cos(body) - robot.rotor
    det = first * second - off * off
    motor = voltage - robot.damping * (wheel_speed - body_speed)
    on_wheel = motor + push + robot.coupling * np.sin(body) * body_speed**2
    on_body = robot.weight * np.sin(body) - motor
    wheel_speed += step * (second * on_wheel - off * on_body) / det
    body_speed += step * (first * on_body - off * on_wheel) / det
    impulse = -(wheel_speed - body_speed) * det / (first + second + 2 * off)  # that stops the gears
    impulse = min(max(impulse, -step * robot.dry), step * robot.dry)
    return wheel_speed + impulse * (second + off) / det, body_speed - impulse * (first + off) / det
