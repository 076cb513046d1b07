"""Faults of the wiring of a body on wheels: of input, encoder and IMU, most of which only the equations of motion show.

The wheel-driven pendulum names this check in its plant file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from derive.plants.wheel_pendulum import INPUT, PLANT_NAME
from wheelpend.inspection.clocks import (
    MAX_PHYSICAL_DELAY_S,
    input_shift_finding,
    rate_shift_findings,
    sensor_shift_finding,
)
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.kinematics import (
    RatePair,
    find_range_in_degrees,
    find_rate_faults,
    find_swapped_columns,
    find_wrapped_angles,
    least_squares_residual,
    rate_matches_angle,
)
from wheelpend.inspection.signals import (
    DEGREES_PER_RADIAN,
    JACKKNIFE_BLOCKS,
    MIN_SHIFT_SAMPLES,
    Signals,
    TimeShift,
    scan_time_shifts,
    uniform_signals,
)
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log

MAX_UNEXPLAINED_SHARE = 0.3  # share of the voltage's power; with more left nothing is concluded from the equations
MAX_DAMPING_RATIO_DEVIATION = 0.6  # of X7/X6 from 1, beyond which other readings of theta_w are evaluated
IMU = RatePair("theta_p", "dtheta_p")
NONNEGATIVE_COLUMNS = 6  # of VoltageRegression.constrained, the first ones


class VoltageRegression(NamedTuple):
    """The plant's equations with unknown parameters, smoothed: voltage = matrix · parameters."""

    matrix: np.ndarray  # (rows, 10) X1 ... X7, a constant in each row, dry friction
    constrained: np.ndarray  # (rows, 10) the same space, first for coefficients that a machine has positive, then free


class EncoderHypothesis(NamedTuple):
    """A reading of theta_w, and the fit of the equations to the voltage under it."""

    relative: bool  # measured against the body
    unit: float  # units in a rad
    shift: TimeShift  # of the voltage
    ratio: float  # X7/X6, the drive's damping on the body over that on the wheel: near 1 on a machine


def find_faults(log: Log, relative: bool, corrections: LogCorrections) -> list[Finding]:
    """Faults of wiring, units, signs and clocks; each is cured in a copy before the next is looked for."""
    findings = []
    for check in (
        partial(find_wrapped_angles, names=("theta_w", "theta_p"), corrections=corrections),
        partial(find_swapped_columns, pair=IMU, corrections=corrections),
        partial(find_range_in_degrees, corrections=corrections),
        partial(find_rate_faults, pair=IMU, corrections=corrections),
    ):
        found, log = check(log)
        findings += found
    signals = uniform_signals(log, INPUT, in_range=True)
    if signals is None or not rate_matches_angle(signals, IMU):
        return findings + rate_shift_findings("dtheta_p", "theta_p", corrections.rate_delay_samples, log.dt)
    conflict = corrections.sign.get("dtheta_p", 1) < 0  # the log's copy has a gyro that agrees with the pitch
    found, signals = find_flipped_signs(signals, conflict, corrections)
    findings += found
    return findings + find_clocks_and_encoder(signals, relative, corrections)


def voltage_regression(signals: Signals, relative: bool) -> VoltageRegression:
    """The regressor at smoothed signals, with constant forces and dry friction of the drive beside it.

    Columns: X1 ... X7, a constant in each row, dry friction.
    """
    module, rows = model_module(PLANT_NAME, {}, ()), signals.rows
    pitch, ddp = signals.smooth("theta_p")[rows], signals.smooth("dtheta_p", 1)[rows]
    rate, wheel = signals.smooth("dtheta_p")[rows], signals.smooth("theta_w", 1)[rows]
    ddw = signals.smooth("theta_w", 2)[rows]
    if relative:  # the gyro is less noisy than the derivative of the pitch
        wheel, ddw = wheel + rate, ddw + ddp
    states = np.column_stack((np.zeros(len(rows)), pitch, wheel, rate))
    accelerations, parameters = np.column_stack((ddw, ddp)), np.zeros(module.NP)
    phi = np.concatenate(
        [module.regressor(0.0, x, a, 0.0, parameters)[1] for x, a in zip(states, accelerations, strict=True)]
    )
    slip = np.repeat(wheel - rate, 2)
    dry = np.tanh(slip / (0.05 * np.std(slip) + 1e-300))  # a sign, softened as much as the smoothing softens it
    first = np.arange(len(slip)) % 2 == 0
    return VoltageRegression(np.column_stack((phi, first, ~first, dry)), sign_constrained_columns(phi, first, dry))


def sign_constrained_columns(phi: np.ndarray, first: np.ndarray, dry: np.ndarray) -> np.ndarray:
    """Columns whose coefficients a machine has positive, then the free ones.

    Positive: X1 + X2, X4, X5, dry friction, X7 − X6/2 and 3 X6/2 − X7 (most damping is in the drive, which body and
    wheel share). Free: X2, X3 and the constants.
    """
    x1, x2, x3, x4, x5, x6, x7 = phi.T
    positive = (x1, x4, x5, dry, x6 + 1.5 * x7, x6 + 0.5 * x7)
    return np.column_stack((*positive, x2 - x1, x3, first, ~first))


def voltage_residual(system: VoltageRegression, signals: Signals) -> Callable[[int], tuple[np.ndarray, float]]:
    """Residual and total power of the voltage, shifted by some samples, in least squares with positive coefficients."""
    from scipy.optimize import nnls  # imported late: it is slow to load

    matrix = system.constrained / (np.linalg.norm(system.constrained, axis=0) + 1e-300)
    q, r = np.linalg.qr(matrix)
    both = np.column_stack((r, -r[:, NONNEGATIVE_COLUMNS:]))
    voltage, rows = signals.smooth(INPUT), signals.rows

    def residual(k: int) -> tuple[np.ndarray, float]:
        target = np.repeat(voltage[rows + k], 2)
        x = nnls(both, q.T @ target)[0]
        x[NONNEGATIVE_COLUMNS : matrix.shape[1]] -= x[matrix.shape[1] :]
        return target - matrix @ x[: matrix.shape[1]], float(np.sum((target - target.mean()) ** 2))

    return residual


def unexplained_voltage_share(signals: Signals, relative: bool) -> float:
    """Share of the voltage's power that the equations leave unexplained, at the best time shift."""
    return scan_time_shifts(voltage_residual(voltage_regression(signals, relative), signals)).share


def find_flipped_signs(signals: Signals, conflict: bool, corrections: LogCorrections) -> tuple[list[Finding], Signals]:
    """Find wrong signs of input, encoder and IMU: the smallest set of flips, as all together change nothing.

    ``conflict`` says that gyro and pitch disagreed and that the gyro was turned round.
    """
    imu = pitch_sign_against_wheel(signals) < 0
    turned = with_signs_flipped(signals, {"theta_p", "dtheta_p"} if imu else set())
    as_is, other = (
        min(unexplained_voltage_share(with_signs_flipped(turned, f), r) for r in (False, True))
        for f in (set(), {INPUT})
    )
    voltage = other < MAX_UNEXPLAINED_SHARE and as_is > 2 * other
    if min(as_is, other) > MAX_UNEXPLAINED_SHARE:
        imu = voltage = False
    flips = {"theta_w"} if imu and voltage else {"theta_p", "dtheta_p"} if imu else {INPUT} if voltage else set()
    signals = with_signs_flipped(signals, flips)
    flips ^= {"dtheta_p"} if conflict else set()
    corrections.sign.clear()
    corrections.sign.update(dict.fromkeys(sorted(flips), -1))
    return [flip_finding(n, conflict and n in ("theta_p", "dtheta_p")) for n in sorted(flips)], signals


def flip_finding(name: str, kinematic: bool) -> Finding:
    """The finding that a channel counts the other way."""
    why = (
        "it is opposite to the other of pitch and gyro"
        if kinematic
        else "the equations fit only with its sign turned round"
    )
    sentence = f"{name} counts the other way: {why}."
    return Finding("flipped_sign", name, sentence, f"Map {name} in [columns] with sign = -1.", None)


def with_signs_flipped(signals: Signals, names: set[str]) -> Signals:
    """The signals with some of them turned round."""
    channels = {c: -v if c in names else v for c, v in signals.channels.items()}
    return signals._replace(voltage=-signals.voltage if INPUT in names else signals.voltage, channels=channels)


def pitch_sign_against_wheel(signals: Signals) -> int:
    """Sign with which the wheel's acceleration follows the pitch, 1 on a machine that balances; 0 where unclear.

    From the sum of both rows, where the voltage cancels: sin θp is a positive multiple of the wheel's acceleration plus
    one of the body's, whatever the drive does.
    """
    rows = signals.rows
    columns = signals.smooth("theta_w", 2)[rows], signals.smooth("dtheta_p", 1)[rows], np.ones(len(rows))
    table = np.column_stack((*columns, np.sin(signals.smooth("theta_p")[rows])))
    parts = np.array_split(table, JACKKNIFE_BLOCKS)
    slopes = []
    for left_out in range(-1, JACKKNIFE_BLOCKS):
        stack = np.concatenate([p for k, p in enumerate(parts) if k != left_out])
        slopes.append(float(np.linalg.lstsq(stack[:, :-1], stack[:, -1], rcond=None)[0][0]))
    sigma = math.sqrt((JACKKNIFE_BLOCKS - 1) * float(np.var(slopes[1:])))
    return 0 if abs(slopes[0]) < 5 * sigma else int(np.sign(slopes[0]))


def find_clocks_and_encoder(signals: Signals, relative: bool, corrections: LogCorrections) -> list[Finding]:
    """Find delays between input, encoder and IMU, and a wrong reference or unit of the encoder."""
    imu = imu_time_shift(signals)
    moved = imu.is_significant(1.3)
    aligned = with_imu_advanced(signals, imu.samples) if moved else signals
    best = declared = evaluate_encoder(aligned, relative, 1.0)
    if abs(declared.ratio - 1) > MAX_DAMPING_RATIO_DEVIATION:
        others = [evaluate_encoder(aligned, not relative, 1.0)]
        if 0.3 < declared.ratio / DEGREES_PER_RADIAN < 3.0:  # no drive damps the body so much more than the wheel
            others.append(evaluate_encoder(aligned, relative, DEGREES_PER_RADIAN))
        best = min([o for o in others if is_better(o, declared)], key=lambda o: o.shift.share, default=declared)
    found = encoder_findings(best, declared, corrections)
    explained = best.shift.share < MAX_UNEXPLAINED_SHARE
    return found + clock_findings(
        imu.samples if moved else 0.0, best.shift if explained else None, signals.dt, corrections
    )


def evaluate_encoder(signals: Signals, relative: bool, unit: float) -> EncoderHypothesis:
    """Fit the equations under a reading of theta_w: its reference, and the number of its units in a rad."""
    wheel = signals.channels["theta_w"] / unit
    scaled = signals._replace(channels={**signals.channels, "theta_w": wheel})
    system = voltage_regression(scaled, relative)
    shift = scan_time_shifts(voltage_residual(system, scaled))
    return EncoderHypothesis(relative, unit, shift, body_to_wheel_damping_ratio(system, scaled, round(shift.samples)))


def body_to_wheel_damping_ratio(system: VoltageRegression, signals: Signals, shift: int) -> float:
    """Estimate X7/X6 by plain least squares."""
    target = np.repeat(signals.smooth(INPUT)[signals.rows + shift], 2)
    x = np.linalg.lstsq(system.matrix, target, rcond=None)[0]
    return float(x[6] / x[5]) if x[5] else math.inf


def is_better(other: EncoderHypothesis, declared: EncoderHypothesis) -> bool:
    """True of another reading that gives a plausible machine and a clearly better fit in all blocks but one."""
    wins = int(np.sum(other.shift.blocks < declared.shift.blocks))
    sane = abs(other.ratio - 1) < 0.5 * MAX_DAMPING_RATIO_DEVIATION and other.shift.share < MAX_UNEXPLAINED_SHARE
    return sane and declared.shift.share > 1.5 * other.shift.share and wins >= JACKKNIFE_BLOCKS - 1


def encoder_findings(
    best: EncoderHypothesis, declared: EncoderHypothesis, corrections: LogCorrections
) -> list[Finding]:
    """The finding on the declared reading of theta_w where another one fits better; none where it is the best."""
    gain = f"the equations then leave {declared.shift.share / best.shift.share:.3g} times less of the input unexplained"
    if best.unit != declared.unit:
        corrections.unit["theta_w"] = "deg"
        cure = 'Map theta_w in [columns] with unit = "deg".'
        return [Finding("wrong_unit", "theta_w", f"theta_w looks like degrees: {gain}.", cure, DEGREES_PER_RADIAN)]
    if best.relative != declared.relative:
        corrections.encoder, against = ("relative", "the body") if best.relative else ("absolute", "the vertical")
        sentence = f"theta_w is measured against {against}: {gain}."
        cure = f'Set encoder = "{corrections.encoder}" in [sensors].'
        return [Finding(f"{corrections.encoder}_encoder", "theta_w", sentence, cure, None)]
    return []


def imu_time_shift(signals: Signals) -> TimeShift:
    """Delay of pitch and gyro against the encoder, from the sum of both rows, where the voltage cancels."""
    rows = signals.rows
    wheel, ones = signals.smooth("theta_w", 2)[rows], np.ones(len(rows))
    sine, body_acceleration = np.sin(signals.smooth("theta_p")), signals.smooth("dtheta_p", 1)
    return scan_time_shifts(
        lambda k: least_squares_residual(np.column_stack((wheel, body_acceleration[rows + k], ones)), sine[rows + k])
    )


def with_imu_advanced(signals: Signals, samples: float) -> Signals:
    """The signals with pitch and gyro moved to earlier times."""
    indices = np.arange(len(signals.voltage), dtype=float)
    advanced = {c: np.interp(indices + samples, indices, signals.channels[c]) for c in ("theta_p", "dtheta_p")}
    return signals._replace(channels={**signals.channels, **advanced})


def clock_findings(late_imu: float, voltage: TimeShift | None, dt: float, corrections: LogCorrections) -> list[Finding]:
    """Findings on the clocks of input, encoder, pitch and gyro.

    ``late_imu`` [samples] is against the encoder, with the gyro at the pitch's time; ``voltage`` is against both.
    """
    late_voltage = voltage.samples if voltage and voltage.is_significant(1.3) else 0.0
    gyro, found = corrections.rate_delay_samples, []
    if late_imu and abs(late_voltage - late_imu) < MIN_SHIFT_SAMPLES:
        return [
            *rate_shift_findings("dtheta_p", "theta_p", gyro, dt),
            sensor_shift_finding("theta_w", -0.5 * (late_imu + late_voltage), dt),
        ]
    if gyro and abs(late_imu + gyro) < MIN_SHIFT_SAMPLES:  # the gyro had the encoder's clock, so it is the pitch
        found += rate_shift_findings("theta_p", "dtheta_p", -gyro, dt)
    else:
        found += rate_shift_findings("dtheta_p", "theta_p", gyro, dt)
        if late_imu and not 0 < late_imu * dt <= MAX_PHYSICAL_DELAY_S:
            found.append(sensor_shift_finding("theta_p and dtheta_p", late_imu, dt, "imu_lag"))
    if late_voltage and not 0 < -late_voltage * dt <= MAX_PHYSICAL_DELAY_S:
        found.append(input_shift_finding(INPUT, late_voltage, dt))
    return found
