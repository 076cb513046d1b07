"""The finding that an input is read by a sensor whose noise does not act: a torque, a current, a battery's voltage.

What a command does from row to row moves the machine, also where a noisy controller made it. The noise with which a
torque is read does not, and a model takes it for a force; behind a lag it is less, so that a lag of the actuator would
be found which is none.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import is_whole
from wheelpend.logs.log import Log, gapless_ranges
from wheelpend.logs.noise import repeated_share
from wheelpend.logs.smoothed_input import likeliest_width

MIN_SAMPLES, WINDOW_SAMPLES = 1000, 256
MIN_WIDTH_ROWS = 1.0  # of the best smoothing, below which an input is no smooth signal with noise
MIN_NOISE_SHARE = 0.01  # of an input's rms
MAX_REPEATED_SHARE = 0.2  # of its values: a command is held, noise never repeats
HALF_POWER = 0.1325  # frequency times the width at which a Gaussian passes half of the power
NOISY_BAND = 1.5, 0.8  # of that frequency, and of half of the sampling rate
SLOW_OCTAVES = 3  # below it, in which an input acts that acts at all
NEIGHBOURS_ALIKE = 1.5  # frequencies of a window that tell the same
MIN_ACTING_SIGMAS = 5.0  # of what it does there
MAX_SHARE_ERROR = 0.2  # of what quick changes do over what slow ones do, with which it is told that they do nothing
MAX_NOTHING_ERRORS = 1.6  # that nothing is told to be at most: 2.5 standard errors of its square
MAX_NOTHING_SHARE = 0.05  # that counts as nothing however well it is known: slow changes leak into quick ones


class Transfer(NamedTuple):
    """What an input does to an acceleration, by frequency."""

    frequency: np.ndarray  # (F,) Hz
    moved: np.ndarray  # (F,) complex: acceleration per input
    weight: np.ndarray  # (F,) inverse variance of that

    @staticmethod
    def of(values: np.ndarray, signal: np.ndarray, order: int, dt: float) -> Transfer:
        """From an input (n,) to a signal (n,), of which differences of that order are the acceleration's."""
        from scipy.signal import csd, welch  # imported late: scipy.signal takes longer to load than most commands

        options = {"fs": 1.0 / dt, "nperseg": WINDOW_SAMPLES}
        values, acceleration = values[: len(values) - order], np.diff(signal, order) / dt**order
        frequency, power = welch(values, **options)
        cross, own = csd(values, acceleration, **options)[1], welch(acceleration, **options)[1]
        windows = len(values) / WINDOW_SAMPLES
        rest = np.maximum(own - np.abs(cross) ** 2 / power, own / windows)  # what the input does not make
        return Transfer(frequency[1:], cross[1:] / power[1:], power[1:] * windows / rest[1:])

    def size(self, low: float, high: float) -> tuple[float, float]:
        """What the input does between two frequencies [Hz], and its error: the root of its mean square.

        A delay turns what it does round and round, so that its squares are summed, less what noise makes of them. The
        error is of a band in which it does nothing.
        """
        band = (self.frequency >= low) & (self.frequency < high)
        total = float(self.weight[band].sum())
        if not total:
            return 0.0, np.inf
        square = (float(np.abs(self.moved[band]) ** 2 @ self.weight[band]) - band.sum()) / total
        return max(square, 0.0) ** 0.5, (NEIGHBOURS_ALIKE * band.sum()) ** 0.25 / total**0.5


def find_noisy_inputs(log: Log, corrections: LogCorrections) -> list[Finding]:
    """The findings on inputs whose quick changes do not act though their slow ones do."""
    found = []
    first, last = max(gapless_ranges(log, 0, len(log)), key=lambda r: r[1] - r[0], default=(0, 0))
    if last - first < MIN_SAMPLES:
        return []
    part = log.part(first, last)
    for name, values in zip(corrections.table.inputs, part.inputs, strict=False):
        if is_whole(values) or repeated_share(values) > MAX_REPEATED_SHARE:
            continue
        width, noise = likeliest_width(values)
        rms = float(np.std(values))
        if width < MIN_WIDTH_ROWS or noise < MIN_NOISE_SHARE * rms:
            continue
        share, error = quick_share(part, values, width, corrections.table.rates)
        if error > MAX_SHARE_ERROR or share > max(MAX_NOTHING_ERRORS * error, MAX_NOTHING_SHARE):
            continue
        seconds = float(f"{width * log.dt:.2g}")
        corrections.smooth[name] = seconds
        sentence = (f"{name} is read with noise of {noise:.2g} {corrections.table.units[name]} "
                    f"({100 * noise / rms:.3g} % of its scatter) that does not act: its quick changes move the machine "
                    f"by {share:.2g} ± {error:.2g} of what slow ones do.")  # fmt: skip
        cure = (f"Map {name} in [columns] with smooth = {seconds:g}: it is then smoothed from both sides, without "
                "delay. As it is its noise counts as a force, and less so behind a lag that is none.")  # fmt: skip
        found.append(Finding("noisy_input", name, sentence, cure, noise))
    return found


def quick_share(log: Log, values: np.ndarray, width: float, rates: Collection[str]) -> tuple[float, float]:
    """What quick changes of an input (N,) do over what slow ones do, and its error, by the channel that tells it best.

    Quick is what a Gaussian of that width [rows] takes away, and slow what it leaves. Infinite where no channel tells.
    """
    half_power, best = HALF_POWER / (width * log.dt), (np.inf, np.inf)
    for channel, signal in zip(log.channels, log.measured.T, strict=True):
        if not np.isfinite(signal).all() or not np.ptp(signal):
            continue
        transfer = Transfer.of(values, signal, 1 if channel in rates else 2, log.dt)
        slow = [transfer.size(half_power / 2.0 ** (k + 1), half_power / 2.0**k) for k in range(SLOW_OCTAVES)]
        sure = max((size for size, error in slow if size > MIN_ACTING_SIGMAS * error), default=0.0)
        quick, error = transfer.size(NOISY_BAND[0] * half_power, NOISY_BAND[1] * transfer.frequency[-1])
        if sure and error / sure < best[1]:
            best = quick / sure, error / sure
    return best
