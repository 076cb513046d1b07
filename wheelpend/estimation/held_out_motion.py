"""Held-out motion by which what was fitted can hardly be judged: in another direction, at one speed, driven harder."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.estimation.segments import Segments
from wheelpend.logs.columns import ColumnTable

SPEED_TIME_S = 0.1  # over which a speed is a mean: a ringing is no direction
MOVING_SHARE = 0.1  # of the largest speed: below it a machine hardly moves, or moves alike
LARGEST_QUANTILE = 0.98  # of speeds and inputs, taken for the largest
MIN_HARDER = 1.2  # times the largest fitted input, beyond which another drives harder
UNSEEN_SHARE = 0.01  # of the fitted motion, up to which a direction is not in it
HOLDOUT_ADVICE = "Hold out another log (--holdout), or a stretch in which the machine does more (wheelpend split)."


def held_out_motion_warnings(fitted: Segments, held_out: Segments, table: ColumnTable) -> list[str]:
    """Warnings on the places of a log that the held-out motion runs otherwise than the fitted one, or at one speed."""
    said = []
    for place in table.places:
        before, after = (mean_speeds(part, place) for part in (fitted, held_out))
        if runs_the_other_way(before, after):
            said.append(
                f"{held_out.log.name}: all that is fitted of {place} runs one way, and most of what is held out the "
                f"other. What depends on the direction, or is a constant, shows only there. {HOLDOUT_ADVICE}"
            )
        elif runs_at_one_speed(before, after):
            said.append(
                f"{held_out.log.name}: what is held out of {place} runs at one speed, where friction, back-EMF and a "
                f"constant are alike and inertia does not show. {HOLDOUT_ADVICE}"
            )
    return said


def held_out_input_warnings(fitted: Sequence[Segments], held_out: Segments, table: ColumnTable) -> list[str]:
    """Warnings on the inputs that drive most of what is held out of a log harder than all that is fitted of any."""
    said = []
    for k, name in enumerate(table.inputs):
        before, after = np.concatenate([inputs_of(part, k) for part in fitted]), inputs_of(held_out, k)
        if is_driven_harder(before, after):
            unit = table.units[name]
            said.append(
                f"{held_out.log.name}: most of what is held out is driven harder than all that is fitted, by {name} of "
                f"{largest_value(after):.3g} {unit} against {largest_value(before):.3g} {unit}. What limits the input "
                f"shows only there. {HOLDOUT_ADVICE}"
            )
    return said


def is_driven_harder(before: np.ndarray, after: np.ndarray) -> bool:
    """True of an input (n,) and (m,) of which most after is larger than all before, spikes aside, and by much."""
    least = MIN_HARDER * largest_value(before)
    return bool(least < largest_value(after) and 2 * np.count_nonzero(np.abs(after) > least) > len(after))


def inputs_of(segments: Segments, place: int) -> np.ndarray:
    """The known values (n,) of an input in the samples of the segments."""
    values = [segments.log.inputs[place][a:b] for a, b in segments.bounds]
    found = np.concatenate([np.zeros(0), *values])
    return found[np.isfinite(found)]


def runs_the_other_way(before: np.ndarray, after: np.ndarray) -> bool:
    """True of speeds (n,) and (m,) of which those after have mostly a direction that hardly any before have."""
    least = MOVING_SHARE * max(largest_value(before), largest_value(after))
    fitted, held_out = ([np.count_nonzero(sign * v > least) for sign in (1.0, -1.0)] for v in (before, after))
    new = int(np.argmax(held_out))
    return bool(0 < sum(fitted) * UNSEEN_SHARE >= fitted[new] and 2 * held_out[new] > len(after))


def runs_at_one_speed(before: np.ndarray, after: np.ndarray) -> bool:
    """True of speeds (n,) and (m,) of which those after are no rest and differ by little, as against those before."""
    least = MOVING_SHARE * largest_value(before)
    return bool(len(after)) and abs(float(np.mean(after))) > least > float(np.ptp(after))


def largest_value(values: np.ndarray) -> float:
    """The largest size of values (n,), but for the few that spikes make; 0 without any."""
    return float(np.quantile(np.abs(values), LARGEST_QUANTILE)) if values.size else 0.0


def mean_speeds(segments: Segments, place: str) -> np.ndarray:
    """Mean speeds (n,) of a place over a short time, from the samples of the segments on."""
    log = segments.log
    values, lag = log.measured[:, log.channels.index(place)], max(1, round(SPEED_TIME_S / log.dt))
    begins = [np.arange(a, b - lag) for a, b in segments.bounds]
    first = np.concatenate([np.zeros(0, dtype=np.int64), *begins])
    speeds = (values[first + lag] - values[first]) / (log.t[first + lag] - log.t[first])
    return speeds[np.isfinite(speeds)]
