"""Faults of a recording as such: what a sensor or a file says that no machine did.

A recording is cured where that is safe: what is no measurement is left out, and the fault says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from wheelpend.logs.finding import Finding
from wheelpend.logs.log import EXCERPT_SAMPLES, GAP_INTERVAL_RATIO
from wheelpend.logs.noise import find_quantum, noise_of_values
from wheelpend.logs.runs import runs_of
from wheelpend.logs.white_noise import difference_noise

CEILING_RUN_SAMPLES = 3  # equal readings in a row, from which on a sensor is at its ceiling
MIN_CEILING_SAMPLES = 10  # of them in all
MIN_CEILING_STEPS = 3.0  # quanta by which a reading enters or leaves a ceiling; a machine that stops creeps by one
MIN_CEILING_KINK = 0.1  # the same of a reading without quanta, in usual steps
MAX_DIP_KINKS = 1.5  # kinks by which a reading leaves a plateau and returns to it
MAX_FLICKER_LEVELS = 6  # of a speed in counts near its largest, rows that come early or late among them
MIN_PLATEAU_SHARE = 0.9  # of the readings of a plateau, that are at a ceiling
MAX_REST_SHARE = 0.05  # of the largest speed, up to which a machine counts as at rest, whatever the gyro's offset
USUAL_LARGEST = 0.99  # quantile of the speeds that counts as the largest, spikes apart
HELD_BAND_SHARE, HELD_BAND_SIGMAS = 0.02, 8.0  # of its way, and of noise, within which a machine stands still
MIN_HELD_RATIO, MIN_HELD_SAMPLES = 0.5, 5  # of standing still to half of the way, and samples, of one that is held
LYING_ANGLE_RAD = 0.35  # from upright, from where on no wheel catches the body: 20°
LYING_BAND_RAD = 0.05  # within which a body that lies stays; a free one falls further within LYING_TIME_S
LYING_TIME_S = 0.5
LYING_BLOCK_S = 0.05  # over which noise is averaged
SEAM_NEIGHBOURS = 8  # samples before and after a seam that are compared
MIN_SEAM_TURN = 2.5  # the same of a change of speed
MIN_SEAM_SIGMAS = 12.0  # by which a speed jumps
MIN_SEAM_STEPS = 5.0  # times the largest of the steps around
MIN_NEIGHBOUR_SIGMAS = 6.0  # the same of the means of its neighbours, where another channel jumps already
MAX_SEAMS, MAX_SEAM_SHARE = 20, 1e-3  # of a log, and of its samples, beyond both of which jumps are something else


def readings_at_ceiling(values: np.ndarray, speed: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Mask (N,) of the readings that repeat the largest or the least value, and that value; none of a sound channel.

    A machine that stops creeps into its extreme, and noise never repeats a value: readings that run into the extreme at
    full speed and stay are a sensor at its ceiling. A speed of few counts flickers between two of them, and does not.
    An extreme at which the machine rests is none: ``speed`` (N,) is the channel's rate, or the channel where it is a
    rate, None where unknown.
    """
    found, ceiling = np.zeros(len(values), dtype=bool), 0.0
    known = values[np.isfinite(values)]
    if known.size < 2 * MIN_CEILING_SAMPLES or known.min() == known.max():
        return found, ceiling
    steps = np.abs(np.diff(values))
    usual = MIN_CEILING_KINK * float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0
    for extreme in (known.max(), known.min()):
        runs = runs_of(values == extreme) - [0, 1]  # first and last samples
        runs = runs[runs[:, 1] - runs[:, 0] + 1 >= CEILING_RUN_SAMPLES]
        if int(np.sum(runs[:, 1] - runs[:, 0] + 1)) < MIN_CEILING_SAMPLES or rests(values == extreme, speed):
            continue
        inside = values != extreme
        least = max(usual, MIN_CEILING_STEPS * find_quantum(values[inside]))
        kink = kinks(values, runs)
        if 0 < least < kink and not flickers(values, extreme, kink):
            found |= values == extreme
            ceiling = float(extreme) if abs(extreme) > abs(ceiling) else ceiling
    return found, ceiling


def rests(samples: np.ndarray, speed: np.ndarray | None) -> bool:
    """True where a machine of known speed (N,) is at rest in most of the samples of a mask (N,)."""
    if speed is None or not np.isfinite(speed[samples]).any():
        return False
    size = np.abs(speed)
    return bool(np.nanmedian(size[samples]) <= MAX_REST_SHARE * np.nanquantile(size, USUAL_LARGEST))


def flickers(values: np.ndarray, extreme: float, kink: float) -> bool:
    """True of a signal (N,) of few levels that goes to and fro between an extreme and the next of them.

    A sensor at its ceiling that noise takes away from it has as many values there as readings.
    """
    near = np.abs(values - extreme) <= MAX_DIP_KINKS * kink
    at = [np.flatnonzero(values[a:b] == extreme) for a, b in runs_of(near)]
    plateau = sum(int(k[-1] - k[0] + 1) for k in at if k.size)
    few = np.unique(values[near]).size <= MAX_FLICKER_LEVELS
    return few and sum(k.size for k in at) < MIN_PLATEAU_SHARE * plateau


def kinks(values: np.ndarray, runs: np.ndarray) -> float:
    """Median of the steps with which a signal (N,) comes into stretches and leaves them, and of those next to them."""
    steps = np.abs(np.diff(values))
    pairs = [steps[a - 2 : a] for a, _ in runs if a > 1] + [steps[b : b + 2] for _, b in runs if b + 2 < len(values)]
    largest = [float(p.max()) for p in pairs if np.isfinite(p).all()]
    return float(np.median(largest)) if largest else 0.0


def saturated(name: str, values: np.ndarray, speed: np.ndarray | None) -> tuple[np.ndarray, list[Finding]]:
    """A channel (N,) without the readings at its ceiling, and the finding on them; ``speed`` as readings_at_ceiling."""
    at_ceiling, ceiling = readings_at_ceiling(values, speed)
    if not at_ceiling.any():
        return values, []
    count = int(at_ceiling.sum())
    sentence = (f"{name} is stuck at {abs(ceiling):.4g} in {count} samples ({100 * count / len(values):.2g} %), in "
                f"{len(runs_of(at_ceiling))} places: the sensor is saturated, and these readings are left "
                "out.")  # fmt: skip
    cure = "Set a larger range of the sensor, or move the machine less."
    return np.where(at_ceiling, np.nan, values), [Finding("saturation", name, sentence, cure, abs(ceiling))]


def lying_samples(t: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Mask (N,) of the samples in which a body that must be balanced rests far from upright, with its fall.

    A free body that leans falls: one that keeps its angle for LYING_TIME_S is held by something, the floor.
    """
    found = np.zeros(len(t), dtype=bool)
    far = np.abs(np.where(np.isfinite(angle), angle, 0.0)) > LYING_ANGLE_RAD
    interval = float(np.median(np.diff(t)))
    block = max(round(LYING_BLOCK_S / interval), 1)
    width = max(round(LYING_TIME_S / interval / block), 2)
    runs = runs_of(far | np.isnan(angle)) - [0, 1]  # first and last samples
    far_before = np.concatenate([[0], np.cumsum(far)])
    long = (runs[:, 1] - runs[:, 0] >= (width - 1) * block) & (far_before[runs[:, 1] + 1] > far_before[runs[:, 0]])
    for first, last in runs[long]:
        means = [np.nanmean(part) for k in range(first, last + 1, block)
                 if np.isfinite(part := angle[k : min(k + block, last + 1)]).any()]  # fmt: skip
        if len(means) >= width:
            windows = np.lib.stride_tricks.sliding_window_view(means, width)
            found[first : last + 1] |= bool((np.ptp(windows, axis=1) < LYING_BAND_RAD).any())
    return found


def lying_finding(name: str, t: np.ndarray, lying: np.ndarray, machine: str) -> Finding:
    """The finding on the stretches in which a machine lies on the floor."""
    runs = runs_of(lying) - [0, 1]  # first and last samples
    total = float(sum(t[b] - t[a] for a, b in runs))
    first = runs[0][0]
    what = "throughout" if lying.mean() > 0.99 else f"for {total:.3g} s in all, first from t = {t[first]:.6g} s"
    sentence = f"{name} rests far from upright {what}: the {machine} lies or is held, and those samples are left out."
    return Finding("lying", name, sentence, "Cut them off, or record a log in which it stands.", total)


def held_samples(t: np.ndarray, places: Sequence[np.ndarray]) -> int:
    """Number of first samples in which a machine that nothing drives is held: it stands still, and then it moves.

    One that is let go from rest creeps off, but the time in which it goes a fiftieth of its way is short against that
    in which it goes half of it: a quarter of it under a constant force. 0 where it is not held, or noise hides that.
    """
    last, half = len(t), len(t)
    for values in places:
        gone = np.abs(values - values[:1])
        way = float(np.nanmax(gone, initial=0.0))
        leaves = int(np.argmax(gone > HELD_BAND_SHARE * way))
        if HELD_BAND_SIGMAS * difference_noise(values[:leaves]) > HELD_BAND_SHARE * way:  # of a coarse log's swing more
            return 0
        last = min(last, leaves)
        half = min(half, int(np.argmax(gone > 0.5 * way)))
    held = last < len(t) and t[last] - t[0] > MIN_HELD_RATIO * (t[half] - t[last])
    return last if held and last >= MIN_HELD_SAMPLES else 0


def held_finding(t: np.ndarray, held: int, machine: str) -> Finding:
    """The finding on the first samples, in which a machine is held."""
    sentence = (f"The {machine} stands still until t = {t[held]:.4g} s and then moves, though nothing drives it: "
                "something holds it, and those samples are left out.")  # fmt: skip
    return Finding("held", "", sentence, "Cut them off, or begin a log when the machine is let go.", float(t[held]))


def find_seams(t: np.ndarray, channels: Mapping[str, np.ndarray], positions: list[str]) -> list[tuple[int, list[str]]]:
    """Samples after which several channels jump at once, with those: where another recording begins.

    One channel that jumps may be an encoder that slipped, rates that jump together a collision: a place, and with it
    another channel or the place's own speed, must jump.
    """
    interval = np.diff(t)
    near = interval < GAP_INTERVAL_RATIO * np.median(interval)
    near[: 2 * SEAM_NEIGHBOURS] = near[len(near) - 2 * SEAM_NEIGHBOURS :] = False
    jumps = {name: (places := jumps_of(values))[near[places]] for name, values in channels.items()}
    seams = np.unique(np.concatenate([np.zeros(0, dtype=int), *(jumps[name] for name in positions)])).tolist()
    if not 0 < len(seams) <= max(MAX_SEAMS, MAX_SEAM_SHARE * len(t)):
        return []
    evidence = {k: [name for name, places in jumps.items() if k in places] for k in seams}
    noise = {c: noise_of_values(v) for c, v in channels.items()}
    return [(k, names) for k in seams if len(names := joined_channels(k, evidence[k], channels, noise)) > 1]


def joined_channels(
    k: int, level: list[str], channels: Mapping[str, np.ndarray], noises: Mapping[str, float]
) -> list[str]:
    """Channels whose value or speed jumps for good after sample k, those in ``level`` in one step by far.

    ``noises`` are their standard deviations.
    """
    found = []
    n, x = SEAM_NEIGHBOURS, np.arange(SEAM_NEIGHBOURS) - 0.5 * (SEAM_NEIGHBOURS - 1)
    for name, values in channels.items():
        windows = values[k - 2 * n + 1 : k + 1 + 2 * n].reshape(4, n)  # two before, two after
        if not np.isfinite(windows).all():
            continue
        slopes, means = windows @ x / (x @ x), windows.mean(axis=1)
        noise = noises[name] + 1e-9 * abs(values[k])
        spread = noise * np.sqrt(2 / n + n**2 / (2 * (x @ x)))
        if abs(means[2] - means[1]) > MIN_NEIGHBOUR_SIGMAS * spread + 1.5 * n * np.abs(slopes[1:3]).max():
            found.append(name)
        changes = np.abs(np.diff(slopes))
        noisy = MIN_SEAM_SIGMAS * noise * np.sqrt(2 / (x @ x))
        if name in level and changes[1] > noisy + MIN_SEAM_TURN * max(changes[0], changes[2]):
            found.append(f"the speed of {name}")
    return found if set(found) & set(level) else []


def jumps_of(values: np.ndarray) -> np.ndarray:
    """Samples (k,) after which a signal (N,) makes one step that all those around it are small against."""
    steps = np.abs(np.diff(values))
    width = 2 * SEAM_NEIGHBOURS + 1
    if len(steps) < width or np.isnan(steps).all():
        return np.zeros(0, dtype=int)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, SEAM_NEIGHBOURS), width)
    usual = float(np.nanmedian(steps))
    far = np.flatnonzero(steps > MIN_SEAM_STEPS * usual)
    largest = np.concatenate([far[:0], *(part[steps[part] >= windows[part].max(axis=1)] for part in _blocks(far))])
    others = [np.partition(windows[part], -2, axis=1)[:, -2] for part in _blocks(largest)]
    return largest[steps[largest] > MIN_SEAM_STEPS * np.concatenate([steps[:0], *others])]


def _blocks(places: np.ndarray) -> list[np.ndarray]:
    """Indices (n,) in blocks, so that the windows around those of a block take little memory."""
    return [
        places[k : k + EXCERPT_SAMPLES // SEAM_NEIGHBOURS]
        for k in range(0, len(places), EXCERPT_SAMPLES // SEAM_NEIGHBOURS)
    ]


def seam_finding(t: np.ndarray, seams: list[tuple[int, list[str]]]) -> Finding:
    """The finding on places where another recording begins."""
    k, names = seams[0]
    times = ", ".join(f"{t[s + 1]:.6g}" for s, _ in seams)
    who = f"{', '.join(names[:-1])} and {names[-1]}"
    sentence = (f"{who} jump at once at t = {times} s, though the times go on: recordings, perhaps of different "
                "machines, were joined. No segment spans the place.")  # fmt: skip
    cure = "Cut the file there and give the parts as logs of their own."
    return Finding("joined", "t", sentence, cure, float(t[k + 1]))
