"""Faults of wiring, units, signs and clocks in a log of the wheel-driven pendulum.

First what needs no model: the gyro must be the derivative of the pitch. Then the structure of the plant's equations,
with unknown parameters: smoothed signals are put into the regressor and each hypothesis about the log (a flipped sign,
an encoder that measures against the body, a shifted clock) is judged by the share of the voltage that it leaves
unexplained, with parameters that a machine can have.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import permutations
from typing import NamedTuple

import numpy as np

from wheelpend import kernels
from wheelpend.findings import Cures, Finding
from wheelpend.logs import CHANNELS, Log, stretches
from wheelpend.numerics import gaussian

LONGEST = 40_000  # samples looked at for signs and clocks; a longer log is represented by its middle
SHORTEST = 400  # samples, below which nothing is concluded on signs and clocks
FARTHEST = 30  # samples, the largest time shift looked for
NEAREST = 2.5  # samples, the smallest time shift reported
BLOCKS = 8  # of a log, whose disagreement gives an estimate its standard error
SHORT_DELAY = 0.006  # s; a delay that physics may have and the diagnosis finds (actuator_delay, imu_lag)
SMOOTHING = 0.03  # s, standard deviation of the finest Gaussian; at least 3 samples
COARSER = (1.0, 2.0, 4.0, 8.0)  # smoothing tried, against the finest, until noise no longer matters
PURE = 2e-4  # unexplained share of the power up to which noise, fed back by the controller, cannot feign a shift
RELATED = 0.8  # correlation of gyro and derivative of the pitch from which they are compared
ALIKE = 0.05  # share that an angle's derivative may leave of a signal that counts as its rate under another name
EXPLAINED = 0.3  # share of the voltage that may stay unexplained before nothing is concluded from the equations
DEGREES = 180 / math.pi
ODD = 0.6  # X7/X6 further than this from 1 raises doubts about theta_w
INPUT = "v_in"
PLANT = "wheel_pendulum"


class Signals(NamedTuple):
    """A stretch of a log on a uniform grid, without missing samples."""

    dt: float  # s
    voltage: np.ndarray  # (N,) V, mean of what acted within dt around each sample
    channels: dict[str, np.ndarray]  # (N,) each
    coarseness: float = 1.0  # of the smoothing, against the finest

    @property
    def width(self) -> float:
        """Standard deviation of the smoothing Gaussian [s]."""
        return self.coarseness * max(SMOOTHING, 3 * self.dt)

    @property
    def rows(self) -> np.ndarray:
        """Indices of the samples that are used, clear of the ends, as dense as smoothing leaves information."""
        margin = int(4 * self.width / self.dt) + FARTHEST + 1
        return np.arange(margin, len(self.voltage) - margin, max(int(0.5 * self.width / self.dt), 1))

    def smooth(self, name: str, order: int = 0) -> np.ndarray:
        """A derivative of a channel, or of the voltage, behind the Gaussian (N,)."""
        signal = self.voltage if name == INPUT else self.channels[name]
        result = gaussian(signal, self.width / self.dt)
        for _ in range(order):  # differences keep a constant exactly at zero, truncated Gaussians do not
            result = np.gradient(result, self.dt)
        return result


class Shift(NamedTuple):
    """Where a scan over time shifts has its optimum."""

    samples: float  # by which the shifted signal is late
    sigma: float  # standard error [samples]
    gain: float  # unexplained power at no shift over that at the optimum
    share: float  # unexplained share of the power at the optimum
    blocks: np.ndarray  # (BLOCKS,) that share, block by block

    def is_clear(self, gain: float) -> bool:
        """Whether the shift is there beyond doubt: large, certain, inside the range scanned, and worth it."""
        inside = NEAREST <= abs(self.samples) < FARTHEST - 0.5
        return inside and abs(self.samples) > 5 * self.sigma and self.gain > gain


class Equations(NamedTuple):
    """The plant's equations with unknown parameters, smoothed: voltage = matrix · parameters."""

    matrix: np.ndarray  # (rows, columns) as in COLUMNS
    limited: np.ndarray  # (rows, columns) the same space, for coefficients that a machine has positive, then free ones


class Reading(NamedTuple):
    """A way to read theta_w, and how well the equations then explain the voltage."""

    relative: bool  # measured against the body
    unit: float  # units in a rad
    shift: Shift  # of the voltage
    ratio: float  # X7/X6, the drive's damping on the body over that on the wheel: near 1 on a machine


def find_faults(log: Log, relative: bool, cures: Cures) -> list[Finding]:
    """Faults of wiring, units, signs and clocks; each is cured in a copy before the next is looked for."""
    findings = []
    for check in (find_wrapped, find_swapped, find_degrees, find_kinematic):
        found, log = check(log, cures)
        findings += found
    signals = uniform_signals(log, upright=True)
    if signals is None or not agree(signals):
        return findings + lone_finding("dtheta_p", cures.late_gyro, log.dt)
    conflict = cures.sign.get("dtheta_p", 1) < 0  # the log's copy has a gyro that agrees with the pitch
    found, signals = find_flipped(signals, conflict, cures)
    findings += found
    return findings + find_clocks_and_encoder(signals, relative, cures)


# ---- signals


def uniform_signals(log: Log, upright: bool) -> Signals | None:
    """The log's longest gapless stretch on a uniform grid, at most LONGEST samples of it; None where it is too short.

    ``upright`` leaves out a robot that fell.
    """
    runs = stretches(log if upright else replace(log, channels=("",) * len(log.channels)), 0, len(log))
    first, last = max(runs, key=lambda r: r[1] - r[0], default=(0, 0))
    spare = max(last - first - LONGEST, 0) // 2
    first, last = first + spare, last - spare
    if last - first < SHORTEST:
        return None
    t, dt = log.t[first:last], log.dt
    grid = np.arange(t[0] + dt, t[-1] - dt, dt)
    charge = np.concatenate(([0.0], np.cumsum(log.voltage[first : last - 1] * np.diff(t))))  # V s; V is held
    edges = np.append(grid, grid[-1] + dt) - 0.5 * dt
    channels = {}
    for name, values in zip(log.channels, log.measured[first:last].T, strict=True):
        known = np.isfinite(values)
        if known.sum() < SHORTEST // 4:
            return None
        channels[name] = np.interp(grid, t[known], values[known])
    signals = Signals(dt, np.diff(np.interp(edges, t, charge)) / dt, channels)
    return signals if len(signals.rows) >= 4 * BLOCKS else None


def with_channel(log: Log, name: str, values: np.ndarray) -> Log:
    """The log with other values (N,) of one channel."""
    measured = log.measured.copy()
    measured[:, log.channels.index(name)] = values
    return replace(log, measured=measured)


def channel(log: Log, name: str) -> np.ndarray:
    """Measured values (N,) of a channel."""
    return log.measured[:, log.channels.index(name)]


def block_sums(squares: np.ndarray) -> np.ndarray:
    """Sums (BLOCKS,) over consecutive blocks."""
    return np.array([part.sum() for part in np.array_split(squares, BLOCKS)])


def scan(residual: Callable[[int], tuple[np.ndarray, float]]) -> Shift:
    """Optimal time shift; ``residual`` gives what stays unexplained at a shift of some samples, and the total power."""
    shares = []
    for k in range(-FARTHEST, FARTHEST + 1):
        rest, power = residual(k)
        shares.append(block_sums(rest**2) / power)
    table = np.array(shares)  # (shifts, blocks)
    others = [optimum(table.sum(axis=1) - table[:, b]) for b in range(BLOCKS)]
    whole = table.sum(axis=1)
    best = int(np.argmin(whole))
    sigma = math.sqrt((BLOCKS - 1) * float(np.var(others)))  # jackknife
    return Shift(optimum(whole), sigma, float(whole[FARTHEST] / whole[best]), float(whole[best]), table[best])


def optimum(costs: np.ndarray) -> float:
    """Shift [samples] of least cost, by a parabola through the three lowest neighbours."""
    k = int(np.argmin(costs))
    if k in (0, len(costs) - 1):
        return float(k - FARTHEST)
    bend = costs[k - 1] - 2 * costs[k] + costs[k + 1]
    return k - FARTHEST + (float(0.5 * (costs[k - 1] - costs[k + 1]) / bend) if bend > 0 else 0.0)


# ---- without a model


def find_wrapped(log: Log, cures: Cures) -> tuple[list[Finding], Log]:
    """Angles that jump by a whole turn; returns them continuous."""
    found = []
    for name in ("theta_w", "theta_p"):
        values = channel(log, name)
        known = np.flatnonzero(np.isfinite(values))
        steps = np.diff(values[known])
        for turn, unit in ((2 * math.pi, "2π"), (360.0, "360°")):
            jumps = np.abs(np.abs(steps) - turn) < 0.25 * turn
            usual = float(np.max(np.abs(steps[~jumps]), initial=0.0))
            if not jumps.any() or usual > 0.25 * turn or np.ptp(values[known]) > 1.05 * turn:
                continue
            sentence = f"{name} jumps by about {unit} in {int(jumps.sum())} places: it is wrapped into one turn."
            cure = f"Unwrap it before it is used (numpy.unwrap with period {turn:.6g})."
            found.append(Finding("wrapped_angle", name, sentence, cure, turn))
            continuous = values.copy()
            continuous[known] = np.unwrap(values[known], period=turn)
            log = with_channel(log, name, continuous)
            break
    return found, log


def find_swapped(log: Log, cures: Cures) -> tuple[list[Finding], Log]:
    """Columns under each other's names: another pair than pitch and gyro is an angle and its rate."""
    signals = uniform_signals(log, upright=False)
    if signals is None:
        return [], log
    for coarseness in COARSER:
        coarser = signals._replace(coarseness=coarseness)
        if coarseness > 1 and len(coarser.rows) < 4 * BLOCKS:
            break
        misfit = {p: rate_misfit(coarser, *p) for p in permutations((INPUT, *CHANNELS), 2) if p[1] != INPUT}
        best = min(misfit, key=lambda p: misfit[p])
        if misfit[best] < PURE:
            break
    if misfit[best] > ALIKE or 5 * misfit[best] > misfit["theta_p", "dtheta_p"]:
        return [], log
    source = interchange(*best)
    cures.source.update(source)
    values = {INPUT: log.voltage, **{c: channel(log, c) for c in CHANNELS}}
    names = " and ".join(sorted(source))
    sentence = f"{best[1]} is the derivative of {best[0]}, so the columns {names} seem to be interchanged."
    finding = Finding("swapped_channels", names, sentence, "Map them in [columns].", None)
    measured = np.column_stack([values[source[c]] if c in source else channel(log, c) for c in log.channels])
    return [finding], replace(log, voltage=values[source.get(INPUT, INPUT)], measured=measured)


def interchange(angle: str, rate: str) -> dict[str, str]:
    """Which column holds each quantity that is not in its own, where two columns turn out to be pitch and gyro."""
    source = {"theta_p": angle, "dtheta_p": rate}
    free = [c for c in source if c not in (angle, rate)]
    source |= {c: free.pop() for c in (INPUT, "theta_w") if c in (angle, rate)}
    return {c: s for c, s in source.items() if c != s}


def rate_misfit(signals: Signals, angle: str, rate: str, lenient: bool = False) -> float:
    """Share of a signal that another's derivative leaves; 1 where sign or size forbid that it is its rate.

    Pitch and gyro under their own names may have either sign and a factor of 1.5, ``lenient`` any: it is judged later.
    """
    rows, leader, follower = signals.rows, signals.smooth(angle, 1)[signals.rows], signals.smooth(rate)
    own = (angle, rate) == ("theta_p", "dtheta_p")
    misfits = [1.0]
    for k in range(-FARTHEST, FARTHEST + 1, 3):
        c = np.cov(leader, follower[rows + k])
        if c[0, 0] <= 0 or c[1, 1] <= 0:
            continue
        size = math.sqrt(c[1, 1] / c[0, 0])
        if lenient or (is_rate(size, 1.5 if own else 1.25) and (own or c[0, 1] > 0)):
            misfits.append(float(1 - c[0, 1] ** 2 / (c[0, 0] * c[1, 1])))
    return min(misfits)


def is_rate(size: float, slack: float) -> bool:
    """Whether a signal this many times as large as another's derivative may be it, in one unit or another."""
    return any(1 / slack < size / scale < slack for scale in (1.0, DEGREES, 1 / DEGREES))


def find_degrees(log: Log, cures: Cures) -> tuple[list[Finding], Log]:
    """A pitch beyond what a robot survives, time and again: it is in degrees. Returns it in rad."""
    pitch = channel(log, "theta_p")
    state = np.where(np.abs(pitch) > 1.6, 1, np.where(np.abs(pitch) < 0.8, -1, 0))
    state = state[state != 0]  # far, near; what lies between belongs to what came before
    returns = int(np.sum(np.diff(state) < 0))
    if returns < 2:  # one return may be a robot that somebody picked up
        return [], log
    cures.unit["theta_p"] = "deg"
    sentence = f"theta_p goes to {np.nanmax(np.abs(pitch)):.3g} and comes back {returns} times: it looks like degrees."
    finding = Finding("wrong_unit", "theta_p", sentence, 'Map it in [columns] with unit = "deg".', DEGREES)
    return [finding], with_channel(log, "theta_p", pitch / DEGREES)


def find_kinematic(log: Log, cures: Cures) -> tuple[list[Finding], Log]:
    """Compare the gyro with the derivative of the pitch: sign, scale, clock. Returns a gyro that agrees."""
    signals = uniform_signals(log, upright=False)
    if signals is None or not agree(signals):
        return [], log
    signals, late = purest(signals)
    rows, rate, gyro = signals.rows, signals.smooth("theta_p", 1), signals.smooth("dtheta_p")
    cross = np.cov(rate[rows], gyro[rows + round(late.samples)])
    slopes = cross[0, 1] / cross[0, 0], cross[1, 1] / cross[0, 1]  # noise in the one or in the other: between them
    found, log = check_scale(log, slopes, cures)
    if slopes[0] < 0:  # which of the two it is, the equations tell
        cures.sign["dtheta_p"] = -1
        log = with_channel(log, "dtheta_p", -channel(log, "dtheta_p"))
    if late.share < PURE and late.is_clear(1.1):
        cures.late_gyro = late.samples
        log = shifted(log, "dtheta_p", late.samples * signals.dt)
    return found, log


def agree(signals: Signals) -> bool:
    """Whether the gyro is recognisable as the derivative of the pitch; without that the equations say nothing."""
    return rate_misfit(signals, "theta_p", "dtheta_p", lenient=True) <= 1 - RELATED**2


def purest(signals: Signals) -> tuple[Signals, Shift]:
    """Smooth until gyro and derivative of the pitch agree but for a share PURE, and say by how much the gyro is late.

    Noise in the pitch moves the robot through the controller, a moment later: with too little smoothing that looks like
    a shift.
    """
    for coarseness in COARSER:
        smoothed = signals._replace(coarseness=coarseness)
        if len(smoothed.rows) < 4 * BLOCKS:
            break
        signals, late = smoothed, rate_shift(smoothed)
        if late.share < PURE:
            break
    return signals, late


def rate_shift(signals: Signals) -> Shift:
    """By how much the gyro comes after the derivative of the pitch."""
    rows, rate, gyro = signals.rows, signals.smooth("theta_p", 1), signals.smooth("dtheta_p")
    ones = np.ones(len(rows))
    return scan(lambda k: residual_of(np.column_stack((gyro[rows + k], ones)), rate[rows]))


def check_scale(log: Log, slopes: tuple[float, float], cures: Cures) -> tuple[list[Finding], Log]:
    """Gross difference in scale between the gyro and the derivative of the pitch; returns a gyro of the right size."""
    low, high = sorted(abs(s) for s in slopes)
    if low < 1.15 and high > 1 / 1.15:
        return [], log
    factor = math.sqrt(low * high)
    sentence = f"dtheta_p is {factor:.3g} times the derivative of theta_p"
    name = next((c for c, f in (("dtheta_p", DEGREES), ("theta_p", 1 / DEGREES)) if 0.85 < factor / f < 1.18), "")
    if name:
        unit = "deg/s" if name == "dtheta_p" else "deg"
        cures.unit[name] = unit
        size, cure = DEGREES, f'Map {name} in [columns] with unit = "{unit}".'
        sentence += f": {name} looks like {unit}."
    else:
        name, size, cure = "dtheta_p", factor, "Find out the unit of each and convert the column."
        sentence += "; they cannot both be in rad and rad/s."
    correct, scale = (name, DEGREES) if name == "theta_p" else ("dtheta_p", factor)
    return [Finding("wrong_unit", name, sentence, cure, size)], with_channel(
        log, correct, channel(log, correct) / scale
    )


def shifted(log: Log, name: str, seconds: float) -> Log:
    """The log with one channel moved to earlier times."""
    values = channel(log, name)
    known = np.isfinite(values)
    return with_channel(log, name, np.interp(log.t + seconds, log.t[known], values[known]))


def residual_of(matrix: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """What least squares leaves of a target, and the target's power about its mean."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return target - matrix @ solution, float(np.sum((target - target.mean()) ** 2))


# ---- with the structure of the equations


def equations(signals: Signals, relative: bool) -> Equations:
    """Put smoothed signals into the regressor, with constant forces and dry friction of the drive beside it.

    Columns: X1 ... X7, a constant in each row, dry friction.
    """
    module, rows = kernels.lean(PLANT, {}, ()), signals.rows
    pitch, rate, bend = (
        s[rows] for s in (signals.smooth("theta_p"), signals.smooth("dtheta_p"), signals.smooth("dtheta_p", 1))
    )
    wheel, wheel_bend = signals.smooth("theta_w", 1)[rows], signals.smooth("theta_w", 2)[rows]
    if relative:  # the gyro is less noisy than the derivative of the pitch
        wheel, wheel_bend = wheel + rate, wheel_bend + bend
    states = np.column_stack((np.zeros(len(rows)), pitch, wheel, rate))
    bends, parameters = np.column_stack((wheel_bend, bend)), np.zeros(module.NP)
    phi = np.concatenate([module.regressor(0.0, x, a, 0.0, parameters)[1] for x, a in zip(states, bends, strict=True)])
    slip = np.repeat(wheel - rate, 2)
    dry = np.tanh(slip / (0.05 * np.std(slip) + 1e-300))  # a sign, softened as much as the smoothing softens it
    first = np.arange(len(slip)) % 2 == 0
    return Equations(np.column_stack((phi, first, ~first, dry)), limit(phi, first, dry))


def limit(phi: np.ndarray, first: np.ndarray, dry: np.ndarray) -> np.ndarray:
    """Columns whose coefficients a machine has positive, then the free ones.

    Positive: X1 + X2, X4, X5, dry friction, X7 − X6/2 and 3 X6/2 − X7 (most damping is in the drive, which body and
    wheel share). Free: X2, X3 and the constants.
    """
    x1, x2, x3, x4, x5, x6, x7 = phi.T
    positive = (x1, x4, x5, dry, x6 + 1.5 * x7, x6 + 0.5 * x7)
    return np.column_stack((*positive, x2 - x1, x3, first, ~first))


POSITIVE = 6  # columns of Equations.limited


def explain_voltage(system: Equations, signals: Signals) -> Callable[[int], tuple[np.ndarray, float]]:
    """What the equations, with parameters that a machine can have, leave of the voltage shifted by some samples."""
    from scipy.optimize import nnls  # imported late: it takes long to load

    matrix = system.limited / (np.linalg.norm(system.limited, axis=0) + 1e-300)
    q, r = np.linalg.qr(matrix)
    both = np.column_stack((r, -r[:, POSITIVE:]))
    voltage, rows = signals.smooth(INPUT), signals.rows

    def residual(k: int) -> tuple[np.ndarray, float]:
        target = np.repeat(voltage[rows + k], 2)
        x = nnls(both, q.T @ target)[0]
        x[POSITIVE : matrix.shape[1]] -= x[matrix.shape[1] :]
        return target - matrix @ x[: matrix.shape[1]], float(np.sum((target - target.mean()) ** 2))

    return residual


def unexplained(signals: Signals, relative: bool) -> float:
    """Share of the voltage that the equations leave, at the best time shift."""
    return scan(explain_voltage(equations(signals, relative), signals)).share


def find_flipped(signals: Signals, conflict: bool, cures: Cures) -> tuple[list[Finding], Signals]:
    """Signs between input, encoder and IMU; the smallest set of flips, as all together change nothing.

    ``conflict`` says that gyro and pitch disagreed and that the gyro was turned round.
    """
    imu = pitch_against_wheel(signals) < 0
    turned = flipped(signals, {"theta_p", "dtheta_p"} if imu else set())
    as_is, other = (min(unexplained(flipped(turned, f), r) for r in (False, True)) for f in (set(), {INPUT}))
    voltage = other < EXPLAINED and as_is > 2 * other
    if min(as_is, other) > EXPLAINED:
        imu = voltage = False
    flips = {"theta_w"} if imu and voltage else {"theta_p", "dtheta_p"} if imu else {INPUT} if voltage else set()
    signals = flipped(signals, flips)
    flips ^= {"dtheta_p"} if conflict else set()
    cures.sign.clear()
    cures.sign.update(dict.fromkeys(sorted(flips), -1))
    return [flip_finding(n, conflict and n in ("theta_p", "dtheta_p")) for n in sorted(flips)], signals


def flip_finding(name: str, kinematic: bool) -> Finding:
    """Say that a channel counts the other way."""
    why = (
        "it is opposite to the other of pitch and gyro"
        if kinematic
        else "the equations fit only with its sign turned round"
    )
    sentence = f"{name} counts the other way: {why}."
    return Finding("flipped_sign", name, sentence, f"Map {name} in [columns] with sign = -1.", None)


def flipped(signals: Signals, names: set[str]) -> Signals:
    """The signals with some of them turned round."""
    channels = {c: -v if c in names else v for c, v in signals.channels.items()}
    return signals._replace(voltage=-signals.voltage if INPUT in names else signals.voltage, channels=channels)


def pitch_against_wheel(signals: Signals) -> int:
    """Sign with which the wheel's acceleration follows the pitch, 1 on a machine that balances; 0 where unclear.

    From the sum of both rows, where the voltage cancels: sin θp is a positive multiple of the wheel's acceleration plus
    one of the body's, whatever the drive does.
    """
    rows = signals.rows
    columns = signals.smooth("theta_w", 2)[rows], signals.smooth("dtheta_p", 1)[rows], np.ones(len(rows))
    table = np.column_stack((*columns, np.sin(signals.smooth("theta_p")[rows])))
    parts = np.array_split(table, BLOCKS)
    slopes = []
    for left_out in range(-1, BLOCKS):
        stack = np.concatenate([p for k, p in enumerate(parts) if k != left_out])
        slopes.append(float(np.linalg.lstsq(stack[:, :-1], stack[:, -1], rcond=None)[0][0]))
    sigma = math.sqrt((BLOCKS - 1) * float(np.var(slopes[1:])))
    return 0 if abs(slopes[0]) < 5 * sigma else int(np.sign(slopes[0]))


def find_clocks_and_encoder(signals: Signals, relative: bool, cures: Cures) -> list[Finding]:
    """Clocks of input, encoder and IMU against each other, what the encoder measures against and in which unit."""
    imu = imu_shift(signals)
    moved = imu.is_clear(1.3)
    aligned = move_imu(signals, imu.samples) if moved else signals
    best = declared = read_wheel(aligned, relative, 1.0)
    if abs(declared.ratio - 1) > ODD:
        others = [read_wheel(aligned, not relative, 1.0)]
        if 0.3 < declared.ratio / DEGREES < 3.0:  # the drive cannot damp the body so much more than the wheel
            others.append(read_wheel(aligned, relative, DEGREES))
        best = min([o for o in others if is_better(o, declared)], key=lambda o: o.shift.share, default=declared)
    found = wheel_findings(best, declared, cures)
    explained = best.shift.share < EXPLAINED
    return found + clock_findings(imu.samples if moved else 0.0, best.shift if explained else None, signals.dt, cures)


def read_wheel(signals: Signals, relative: bool, unit: float) -> Reading:
    """Judge a reading of theta_w: its reference, and how many of its units make a rad."""
    wheel = signals.channels["theta_w"] / unit
    scaled = signals._replace(channels={**signals.channels, "theta_w": wheel})
    system = equations(scaled, relative)
    shift = scan(explain_voltage(system, scaled))
    return Reading(relative, unit, shift, damping_ratio(system, scaled, round(shift.samples)))


def damping_ratio(system: Equations, signals: Signals, shift: int) -> float:
    """Estimate X7/X6 by plain least squares."""
    target = np.repeat(signals.smooth(INPUT)[signals.rows + shift], 2)
    x = np.linalg.lstsq(system.matrix, target, rcond=None)[0]
    return float(x[6] / x[5]) if x[5] else math.inf


def is_better(other: Reading, declared: Reading) -> bool:
    """Whether another reading of theta_w is right beyond doubt: a sane machine, clearly better nearly everywhere."""
    wins = int(np.sum(other.shift.blocks < declared.shift.blocks))
    sane = abs(other.ratio - 1) < 0.5 * ODD and other.shift.share < EXPLAINED
    return sane and declared.shift.share > 1.5 * other.shift.share and wins >= BLOCKS - 1


def wheel_findings(best: Reading, declared: Reading, cures: Cures) -> list[Finding]:
    """Say what of the declared reading of theta_w is wrong."""
    gain = f"the equations then leave {declared.shift.share / best.shift.share:.3g} times less of the input unexplained"
    if best.unit != declared.unit:
        cures.unit["theta_w"] = "deg"
        cure = 'Map theta_w in [columns] with unit = "deg".'
        return [Finding("wrong_unit", "theta_w", f"theta_w looks like degrees: {gain}.", cure, DEGREES)]
    if best.relative != declared.relative:
        cures.encoder, against = ("relative", "the body") if best.relative else ("absolute", "the vertical")
        sentence = f"theta_w is measured against {against}: {gain}."
        cure = f'Set encoder = "{cures.encoder}" in [sensors].'
        return [Finding(f"{cures.encoder}_encoder", "theta_w", sentence, cure, None)]
    return []


def imu_shift(signals: Signals) -> Shift:
    """By how much pitch and gyro come after the encoder, from the sum of both rows, where the voltage cancels."""
    rows = signals.rows
    wheel, ones = signals.smooth("theta_w", 2)[rows], np.ones(len(rows))
    sine, bend = np.sin(signals.smooth("theta_p")), signals.smooth("dtheta_p", 1)
    return scan(lambda k: residual_of(np.column_stack((wheel, bend[rows + k], ones)), sine[rows + k]))


def move_imu(signals: Signals, samples: float) -> Signals:
    """The signals with pitch and gyro moved to earlier times."""
    places = np.arange(len(signals.voltage), dtype=float)
    moved = {c: np.interp(places + samples, places, signals.channels[c]) for c in ("theta_p", "dtheta_p")}
    return signals._replace(channels={**signals.channels, **moved})


def clock_findings(late_imu: float, voltage: Shift | None, dt: float, cures: Cures) -> list[Finding]:
    """Say which of input, encoder, pitch and gyro has a clock of its own.

    ``late_imu`` [samples] is against the encoder, with the gyro at the pitch's time; ``voltage`` is against both.
    """
    late_voltage = voltage.samples if voltage and voltage.is_clear(1.3) else 0.0
    gyro, found = cures.late_gyro, []
    if late_imu and abs(late_voltage - late_imu) < NEAREST:
        return [*lone_finding("dtheta_p", gyro, dt), late_finding("theta_w", -0.5 * (late_imu + late_voltage), dt)]
    if gyro and abs(late_imu + gyro) < NEAREST:  # the gyro had the encoder's clock, so it is the pitch
        found += lone_finding("theta_p", -gyro, dt)
    else:
        found += lone_finding("dtheta_p", gyro, dt)
        if late_imu and not 0 < late_imu * dt <= SHORT_DELAY:
            found.append(late_finding("theta_p and dtheta_p", late_imu, dt))
    if late_voltage and not 0 < -late_voltage * dt <= SHORT_DELAY:
        found.append(late_finding(INPUT, late_voltage, dt))
    return found


def lone_finding(name: str, samples: float, dt: float) -> list[Finding]:
    """Say that one of pitch and gyro is late or early against the other, if it is."""
    if not samples:
        return []
    other = {"theta_p": "dtheta_p", "dtheta_p": "theta_p"}[name]
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    sentence = f"{name} is logged {amount} {'after' if samples > 0 else 'before'} {other}."
    cure = f"Shift {name} in time, or take both from the same clock and filter."
    return [Finding("time_shift", name, sentence, cure, samples * dt)]


def late_finding(name: str, samples: float, dt: float) -> Finding:
    """Say that a channel is late (samples > 0) or early against the others."""
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    if name == INPUT and samples < 0:
        why = "a delay in the actuator (effect actuator_delay) or a clock offset"
        sentence = f"The input acts {amount} later than logged: {why}."
    elif name == INPUT:
        sentence = (
            f"The input is logged {amount} after it acts: no machine does that, so it is a fault of clocks or logging."
        )
    elif samples > 0:
        lag = " (effect imu_lag)" if name != "theta_w" else ""
        sentence = f"{name} is logged {amount} after the other signals: a delay in the sensor{lag} or a clock offset."
    else:
        sentence = f"{name} is logged {amount} before the other signals: a fault of clocks or logging."
    cure = f"Shift {name} in time where the clock is at fault; add the effect where the delay is real."
    cure = cure if "effect" in sentence else f"Shift {name} in time, or log everything by one clock."
    return Finding("time_shift", name, sentence, cure, (-1 if name == INPUT else 1) * samples * dt)
