"""Faults that the equations of motion show on any machine: flipped signs, a shifted input, what an encoder is against.

The equations with unknown parameters, at smoothed signals: what a machine has positive must come out so. Each machine's
own parameters are fitted with a constant force and friction beside them; the wrong sign of a channel leaves more of
the input unexplained than the right one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.nonnegative import nonnegative_solution
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.inspection.clocks import MAX_PHYSICAL_DELAY_S, input_shift_finding
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.kinematics import RatePair
from wheelpend.inspection.signals import (
    MIN_ANALYSED_SAMPLES,
    MIN_SIGN_SAMPLES,
    Signals,
    TimeShift,
    scan_time_shifts,
    share_in_common,
    uniform_signals,
)
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

MAX_UNEXPLAINED_SHARE = 0.3  # share of the input's power; with more left nothing is concluded from the equations
MIN_ENCODER_SAMPLES = 200  # that tell what a second link's angle is measured against, by tenfold misfits
MIN_FLIP_GAIN = 2.0  # times less of the input that is left where signs are turned round
MIN_CLEAR_FLIP_GAIN = 10.0  # times more, with which a sign is right whatever else speaks against it
MIN_KEPT_SHARE = 0.8  # of the square of a speed, from which on it is kept
MIN_POWER_SHARE = 0.3  # of the product of an input's and a speed's rms, from which on the one works on the other
CONSTANT_SHARE = 1e-9  # of an input, by which it may vary and is one value
SAME_SHARE_TOLERANCE = 1e-6  # relative difference of shares that is rounding, which differs from processor to processor
MIN_FRICTION_SHARE = 0.9  # of an input's power that the sign of a rate explains, from which on it is like dry friction
MIN_TURNED_SHARE = 0.05  # of the samples, that a rate has each sign in where the input can be seen to follow it
MIN_SHIFT_GAIN = 1.3  # times less of it at another time
MIN_MISFIT_SHARE = 0.05  # of the input's power, that the equations leave without a shift: below they hold well enough
MAX_SHIFT_DISAGREEMENT = 0.3  # of a shift, by which another one differs that springs beside the equations lead to


class InputRegression(NamedTuple):
    """The equations with unknown parameters: share of the input · input + known = matrix · parameters, row by row."""

    matrix: np.ndarray  # (samples · rows, columns): first what is positive on a machine, then what is free
    positive: int  # columns
    share: np.ndarray  # (samples, rows) of the input
    known: np.ndarray  # (samples, rows)


def find_input_faults(
    log: Log, module: KernelModule, pairs: Sequence[RatePair], corrections: LogCorrections
) -> list[Finding]:
    """Flipped signs and an input that is logged at another time; none where the equations do not explain the log."""
    positions = module.OUTPUT_MATRIX[:, : module.NQ]
    if len(module.INPUTS) != 1 or np.linalg.matrix_rank(positions) < module.NQ:
        return []
    signals = uniform_signals(log, module.INPUT, in_range=True, least=least_samples(module))
    if signals is None or is_constant(signals):
        return []
    unpulled = not corrections.table.pulled or corrections.table.units.get(module.OUTPUTS[0]) == "m"
    alike, against = friction_like_coordinate(signals, module)
    if alike:
        return [friction_like_finding(signals.input, alike, against=against, turned=against and unpulled)]
    flipped = flipped_columns(signals, module, pairs)
    if flipped and unpulled and takes_work(signals, module):
        flipped = ()
    corrections.sign.update(dict.fromkeys(flipped, -corrections.sign.get(flipped[0], 1) if flipped else -1))
    findings = [flip_finding(name) for name in flipped]
    signals = with_signs_flipped(signals, flipped)
    if late := signals.is_long and _time_shift(signals, module):
        findings.append(input_shift_finding(signals.input, late, signals.dt))
    return findings


def takes_work(signals: Signals, module: KernelModule) -> bool:
    """True of a machine with one place, which nothing pulls, whose input works on it while it gets no slower.

    With the other sign it would give work, and no machine does so at no expense of its speed. A controller that holds a
    speed makes the input fall where the speed rises, so that a regression may find either sign.
    """
    if module.NQ != 1:
        return False
    speed = signals.smooth(module.OUTPUTS[0], 1)[signals.rows]
    force = signals.smooth(signals.input)[signals.rows]
    quarter = max(len(speed) // 4, 1)
    first, last, mean = (float(np.mean(part**2)) for part in (speed[:quarter], speed[-quarter:], speed))
    power = float(np.mean(force * speed))
    works = power > MIN_POWER_SHARE * math.sqrt(float(np.mean(force**2)) * mean)
    return works and last >= MIN_KEPT_SHARE * first


def is_right_as_it_is(log: Log, module: KernelModule) -> bool:
    """True where the equations of a machine with one input leave far more of it with its sign turned round."""
    signals = uniform_signals(log, module.INPUT, in_range=True, least=least_samples(module))
    if signals is None or is_constant(signals):
        return False
    as_is, other = (unexplained_share(s, module) for s in (signals, with_signs_flipped(signals, [signals.input])))
    return as_is < MAX_UNEXPLAINED_SHARE and other > MIN_CLEAR_FLIP_GAIN * as_is


def is_constant(signals: Signals) -> bool:
    """True of an input that does not change but for the rounding of its mean between samples."""
    return float(np.ptp(signals.voltage)) <= CONSTANT_SHARE * float(np.abs(signals.voltage).max(initial=0.0))


def least_samples(module: KernelModule | None) -> int:
    """Samples without a gap, from which on signs are judged: fewer of a machine with only one place."""
    return MIN_SIGN_SAMPLES if module is not None and module.NQ == 1 else MIN_ANALYSED_SAMPLES


def _time_shift(signals: Signals, module: KernelModule) -> float:
    """Samples by which the input is logged too late, or too early by more than an actuator's delay; 0 where neither.

    What the equations lack shifts the phase of an input too: a spring, or what gives before it slides, by up to a
    quarter of its period. So a shift counts only where the equations leave much of the input without it, and where
    springs beside them lead to the same.
    """
    system = input_regression(signals, module)
    late = scan_time_shifts(input_residual(system, signals))
    physical = 0 < -late.samples * signals.dt <= MAX_PHYSICAL_DELAY_S  # a delay that the diagnosis finds
    misfit = late.gain * late.share
    if physical or late.share > MAX_UNEXPLAINED_SHARE or misfit < MIN_MISFIT_SHARE or not _is_shift(late):
        return 0.0
    other = scan_time_shifts(input_residual(with_springs(system, signals, module), signals))
    alike = abs(other.samples - late.samples) < MAX_SHIFT_DISAGREEMENT * abs(late.samples)
    return late.samples if alike and _is_shift(other) else 0.0


def _is_shift(late: TimeShift) -> bool:
    return late.is_significant(MIN_SHIFT_GAIN)


def with_springs(system: InputRegression, signals: Signals, module: KernelModule) -> InputRegression:
    """The equations with a spring of either sign on each coordinate beside them."""
    values, slopes = (np.column_stack([signals.smooth(c, k)[signals.rows] for c in module.OUTPUTS]) for k in range(2))
    places = states_from(module, values, slopes)[:, : module.NQ]
    springs = (places[:, :, None] * np.eye(module.NQ)).reshape(-1, module.NQ)
    return system._replace(matrix=np.column_stack([system.matrix, springs]))


def find_second_encoder_fault(
    log: Log, module: KernelModule, declared: str, corrections: LogCorrections
) -> list[Finding]:
    """A second link's angle that is measured against the other thing than declared: the vertical, or the first link.

    None where the equations do not explain the log, nor with a motor, whose input is most of what they say.
    """
    first, second = module.OUTPUTS[:2]
    signals = None if module.INPUTS else uniform_signals(log, "", in_range=True, least=MIN_ENCODER_SAMPLES)
    if signals is None:
        return []
    turn = -1.0 if declared == "relative" else 1.0
    angles = signals.channels[second] + turn * signals.channels[first]
    as_is, other = (
        gravity_misfit(s, module) for s in (signals, signals._replace(channels={**signals.channels, second: angles}))
    )
    if other > MAX_UNEXPLAINED_SHARE or as_is < MIN_FLIP_GAIN * other:
        return []
    corrections.second_encoder, against = ("absolute", "the vertical") if turn < 0.0 else ("relative", "the first link")
    sentence = (f"{second} is measured against {against}, not as the model says: the equations then leave "
                f"{as_is / other:.2g} times less.")  # fmt: skip
    cure = f'Set second_encoder = "{corrections.second_encoder}" in [assumptions].'
    return [Finding(f"{corrections.second_encoder}_second_encoder", second, sentence, cure, None)]


def gravity_misfit(signals: Signals, module: KernelModule) -> float:
    """Share of what gravity does to a machine without input that the equations with unknown parameters leave."""
    system = input_regression(signals, module)
    rest, power = positive_least_squares(system)(system.known)
    return float(np.sum(rest**2)) / (power + 1e-300)


def friction_like_coordinate(signals: Signals, module: KernelModule) -> tuple[str, bool]:
    """The coordinate whose rate's sign the input follows, now or some samples later; empty where it follows none.

    And whether it acts against that rate.

    A command that sets the machine in motion is ahead of the sign; one that is made of the measured rate comes with it
    or after it, and is then dry friction to the equations, with either sign.
    """
    rows, outputs = signals.rows, module.OUTPUTS
    values, slopes = (np.column_stack([signals.smooth(c, order)[rows] for c in outputs]) for order in range(2))
    signs = soft_sign(states_from(module, values, slopes)[:, module.NQ :])
    voltage = signals.smooth(signals.input)
    for k, name in enumerate(module.STATES[: module.NQ]):
        if min(np.mean(signs[:, k] > 0.0), np.mean(signs[:, k] < 0.0)) < MIN_TURNED_SHARE:
            continue  # what goes one way has one sign, and so has what drives it
        shifts = range(1 - signals.max_shift, signals.max_shift)
        shared = [share_in_common(voltage[rows + late], signs[:, k]) for late in shifts]
        best = shifts[int(np.argmax(shared))]
        if best >= 0 and max(shared) > MIN_FRICTION_SHARE:
            return name, float((voltage[rows + best] - voltage.mean()) @ signs[:, k]) < 0.0
    return "", False


def friction_like_finding(name: str, coordinate: str, *, against: bool, turned: bool) -> Finding:
    """The finding that an input is a function of the sign of a rate, with or ``against`` it.

    It is ``turned`` where nothing else could have moved the machine.
    """
    verb, other = ("opposes", "with") if against else ("follows", "against")
    sentence = (f"{name} {verb} the sign of the rate of {coordinate}, so it cannot be told from dry friction: neither "
                "its size nor its time against the sensors can be judged by this log.")  # fmt: skip
    cure = (f"Record a log in which {name} also acts {other} the motion and while the machine stands, such as a sum of "
            "sines, or one of free motion.")  # fmt: skip
    if turned:
        cure = f"A motor that drives it counts the other way: set sign = -1 in its entry of [columns]. {cure}"
    return Finding("friction_like_input", name, sentence, cure, None)


def flipped_columns(signals: Signals, module: KernelModule, pairs: Sequence[RatePair]) -> tuple[str, ...]:
    """The columns that count the other way, by what the input does; or, where that is right, by what it does not do.

    Not where a spring beside the equations does as well: in a sine it pulls against the inertia.
    """
    by_input = partial(unexplained_share, module=module)
    if found := smallest_flip(signals, pairs, by_input):
        turned = with_signs_flipped(signals, found)
        as_is, other = (unexplained_share(s, module, springs=True) for s in (signals, turned))
        return found if as_is > MIN_FLIP_GAIN * other else ()
    if not undriven_share(signals, module) or by_input(signals) > MAX_UNEXPLAINED_SHARE:
        return ()

    def by_rest(trial: Signals) -> float:
        return undriven_share(trial, module) if by_input(trial) <= MAX_UNEXPLAINED_SHARE else math.inf

    return smallest_flip(signals, pairs, by_rest)


def smallest_flip(signals: Signals, pairs: Sequence[RatePair], misfit: Callable[[Signals], float]) -> tuple[str, ...]:
    """The smallest set of columns with whose signs turned round the equations fit; empty where they fit as they are.

    ``misfit`` is the share that the equations leave of what it measures. An angle and its rate turn together. All
    turned round is the same machine: of two complements the smaller one.
    """
    paired = {c for p in pairs for c in p}
    groups = [(signals.input,), *((c,) for c in signals.channels if c not in paired), *map(tuple, pairs)]
    as_is = misfit(signals)
    for size in range(1, len(groups) // 2 + 1):
        sets = [tuple(c for group in chosen for c in group) for chosen in combinations(groups, size)]
        shares = [misfit(with_signs_flipped(signals, s)) for s in sets]
        best = int(np.argmax(np.array(shares) <= (1.0 + SAME_SHARE_TOLERANCE) * min(shares)))  # the first of equal ones
        if shares[best] < MAX_UNEXPLAINED_SHARE and as_is > MIN_FLIP_GAIN * shares[best]:
            return sets[best]
    return ()


def flip_finding(name: str) -> Finding:
    """The finding that a channel counts the other way."""
    sentence = f"{name} counts the other way: the equations fit only with its sign turned round."
    return Finding("flipped_sign", name, sentence, f"Map {name} in [columns] with sign = -1.", None)


def with_signs_flipped(signals: Signals, names: Sequence[str]) -> Signals:
    """The signals with some of them turned round."""
    channels = {c: -v if c in names else v for c, v in signals.channels.items()}
    return signals._replace(voltage=-signals.voltage if signals.input in names else signals.voltage, channels=channels)


def unexplained_share(signals: Signals, module: KernelModule, *, springs: bool = False) -> float:
    """Share of the input's power that the equations leave unexplained, at the best time shift."""
    system = input_regression(signals, module)
    residual = input_residual(with_springs(system, signals, module) if springs else system, signals)
    return scan_time_shifts(residual, signals.max_shift).share


def undriven_share(signals: Signals, module: KernelModule) -> float:
    """Share of their largest term that the equations of the rows that no input drives leave; 0 where each is driven.

    A pole's acceleration, the push of its cart and gravity balance: with the one turned round they do not.
    """
    system, left, power = input_regression(signals, module), 0.0, 0.0
    matrix = system.matrix.reshape(*system.share.shape, -1)
    for row in np.flatnonzero(~system.share.any(axis=0) & ~system.known.any(axis=0)):
        terms = matrix[:, row]
        largest = int(np.argmax(np.linalg.norm(terms[:, : system.positive], axis=0)))
        others = np.delete(terms, largest, axis=1)
        rest, _ = positive_least_squares(system._replace(matrix=others, positive=system.positive - 1))(
            -terms[:, largest]
        )
        left, power = left + float(rest @ rest), power + float(terms[:, largest] @ terms[:, largest])
    return left / power if power else 0.0


def input_regression(signals: Signals, module: KernelModule) -> InputRegression:
    """The regressor at smoothed signals, with constant forces and friction of each coordinate beside it."""
    rows, outputs = signals.rows, module.OUTPUTS
    values, slopes, bends = (np.column_stack([signals.smooth(c, order)[rows] for c in outputs]) for order in range(3))
    states = states_from(module, values, slopes)
    rates = states_from(module, slopes, bends)[:, module.NQ :]
    zeros = np.zeros(module.NP)
    entries = [(module.regressor(0.0, x, a, 0.0, zeros), module.regressor(0.0, x, a, 1.0, zeros)[0])
               for x, a in zip(states, rates, strict=True)]  # fmt: skip
    known, phi = (np.array([e[0][k] for e in entries]) for k in range(2))
    share = np.array([e[1] for e in entries]) - known
    speed = states[:, module.NQ :]
    friction = np.concatenate(
        [speed[:, :, None] * np.eye(module.NQ), soft_sign(speed)[:, :, None] * np.eye(module.NQ)], 2
    )
    constant = np.broadcast_to(np.eye(module.NQ), (len(rows), module.NQ, module.NQ))
    signed = np.isin(module.LINEAR, module.SIGNED)
    columns = [phi[:, :, ~signed], friction, phi[:, :, signed], constant]
    weight = 1.0 / (np.sqrt(np.mean(phi**2, axis=(0, 2))) + 1e-300)  # rows may have different units
    matrix = np.concatenate(columns, axis=2) * weight[:, None]
    return InputRegression(
        matrix.reshape(-1, matrix.shape[2]), int((~signed).sum()) + friction.shape[2], share * weight, known * weight
    )


def soft_sign(speed: np.ndarray) -> np.ndarray:
    """Signs (N, n), softened as much as the smoothing softens them."""
    return np.tanh(speed / (0.05 * np.std(speed, axis=0) + 1e-300))


def input_residual(system: InputRegression, signals: Signals) -> Callable[[int], tuple[np.ndarray, float]]:
    """Residual and total power of the input, shifted by some samples, in least squares with positive coefficients."""
    fitted = positive_least_squares(system)
    voltage, rows = signals.smooth(signals.input), signals.rows
    return lambda k: fitted(system.share * voltage[rows + k, None] + system.known)


def positive_least_squares(system: InputRegression) -> Callable[[np.ndarray], tuple[np.ndarray, float]]:
    """Residual and total power of a target (samples, rows) in least squares with positive coefficients."""
    q, r = np.linalg.qr(system.matrix)
    signed = np.arange(system.matrix.shape[1]) >= system.positive

    def residual(sought: np.ndarray) -> tuple[np.ndarray, float]:
        target = sought.ravel()
        solution, _ = nonnegative_solution(r, q.T @ target, signed)
        return target - system.matrix @ solution, float(np.sum((target - target.mean()) ** 2))

    return residual
