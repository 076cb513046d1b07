"""Which way a machine with one place sets out from rest, and whether its input pushed it there.

A machine that rests while nothing is commanded, or hangs while something is, begins to move the way that its input then
goes. Equations with unknown friction and a constant force may fit a single step with either sign: what decays and what
grows differ by a constant.
"""

from __future__ import annotations

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import channel_values
from wheelpend.logs.checks import starts_at_rest
from wheelpend.logs.log import Log
from wheelpend.logs.noise import noise_of_values

FIRST_MOTION_SHARE = 0.02  # of the way from end to end, after which a machine has set out
MIN_MOTION_SIGMAS = 8.0  # of the sensor's noise
MIN_STRAIGHT_SHARE = 0.9  # of the way gone by then, that the place is away
MAX_REST_SHARE = 0.05  # of the largest input, that counts as none while a machine rests
MIN_PUSH_SHARE = 0.2  # of the largest change of the input, that its mean change until then is


def sets_out_backwards(log: Log, place: str, *, hangs: bool) -> bool:
    """True of a place that moves against its input from rest; ``hangs`` where gravity may hold it at first.

    Else the input must be zero there: against a load something may be commanded that only lets it down.
    """
    values, known = channel_values(log, place), np.isfinite(channel_values(log, place))
    values, pushes = values[known], np.nan_to_num(log.voltage[known])
    largest = float(np.abs(pushes).max(initial=0.0))
    if values.size < 3 or not starts_at_rest(values) or (not hangs and abs(pushes[0]) > MAX_REST_SHARE * largest):
        return False
    away = values - values[0]
    gone = np.abs(away) > max(FIRST_MOTION_SHARE * float(np.ptp(values)), MIN_MOTION_SIGMAS * noise_of_values(values))
    count = int(np.argmax(gone))
    way = float(np.abs(np.diff(values[: count + 1])).sum())
    if not gone.any() or abs(away[count]) < MIN_STRAIGHT_SHARE * way:
        return False
    change = pushes - pushes[0]
    push, largest = change[:count], float(np.abs(change).max())
    one_sided = push.min(initial=0.0) * push.max(initial=0.0) >= 0.0
    return one_sided and bool(abs(push.mean()) >= MIN_PUSH_SHARE * largest and push.mean() * away[count] < 0.0)


def backward_start(place: str, corrections: LogCorrections) -> Finding:
    """The finding that a place and its rates count the other way than its input."""
    turned = [place, *(rate for rate, of in corrections.table.rates.items() if of == place)]
    corrections.sign.update({c: -corrections.sign.get(c, 1) for c in turned})
    name = corrections.table.input
    sentence = f"{place} sets out from rest against {name}: one of them counts the other way."
    return Finding("flipped_sign", place, sentence, f"Map {place} in [columns] with sign = -1.", None)
