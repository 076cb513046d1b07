"""Two columns that are one angle: a pendulum's bob, whose x and y a camera saw go to and fro on an arc."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.column_names import is_called_angle, stated_base
from wheelpend.inspection.survey import Survey
from wheelpend.logs.outliers import without_spikes
from wheelpend.logs.white_noise import difference_noise

MAX_ARC_RAD = 1.2 * math.pi  # of a swing: two angles a quarter apart in phase go round and round
MAX_ROUND_SHARE = 0.2  # of the distances from a straight line, that are left from the circle
MAX_NOISE_SHARE = 0.7  # of those distances, that noise may make where it is all that is left
MIN_READINGS = 20


class Arc(NamedTuple):
    """A circle about a pivot, of which a bob sweeps a part."""

    x: float  # of the pivot, in the file's unit
    y: float
    radius: float
    grows_downward: bool  # True where y grows downward, as in an image


def arc_sentence(survey: Survey) -> str:
    """That a file's two places are one angle, with its formula; nothing of any other file."""
    places = survey.of_role("position")
    angular = any(stated_base(n) == "rad" or is_called_angle(n) for n in places)
    if len(places) != 2 or angular or survey.of_role("input"):
        return ""
    found = ((pair, find_arc(*(survey.values[n] for n in pair))) for pair in (places, places[::-1]))
    (first, second), arc = next(((pair, arc) for pair, arc in found if arc), (places, None))
    if arc is None:
        return ""
    down = f"{second} - {arc.y:.5g}" if arc.grows_downward else f"{arc.y:.5g} - {second}"
    return (
        f"{first} and {second} go to and fro on a circle of {arc.radius:.4g} about ({arc.x:.5g}, {arc.y:.5g}): they "
        f"are the one angle of a pendulum, seen by a camera, and no two. Write it into the file as a column theta_1 = "
        f"atan2({first} - {arc.x:.5g}, {down}) in their place; a pivot that was measured is better than this one. "
        "If they are two all the same, say --plant."
    )


def find_arc(x: np.ndarray, y: np.ndarray) -> Arc | None:
    """The circle on which points (N,) go to and fro, least squares of the distances from it; None of other points.

    The pivot is above the arc: a bob hangs.
    """
    from scipy.optimize import least_squares  # imported late: it takes longer to load than most commands

    x, y = without_spikes(x), without_spikes(y)
    known = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(known) < MIN_READINGS:
        return None
    points = np.column_stack((x[known], y[known]))
    middle = points.mean(axis=0)
    centred = points - middle
    straight = float(np.linalg.svd(centred, compute_uv=False)[-1])  # root of the squared distances from a line
    guess, *_ = np.linalg.lstsq(np.c_[2.0 * centred, np.ones(len(centred))], (centred**2).sum(axis=1), rcond=None)
    begin = np.r_[guess[:2], math.sqrt(max(guess[2] + guess[:2] @ guess[:2], 0.0))]
    fitted = least_squares(lambda c: np.hypot(*(centred - c[:2]).T) - c[2], begin)
    pivot, radius = fitted.x[:2], abs(float(fitted.x[2]))
    angles = np.arctan2(*(centred - pivot).T)
    turned = np.angle(np.exp(1j * (angles - np.angle(np.mean(np.exp(1j * angles))))))
    left = math.sqrt(2.0 * fitted.cost)
    noise = math.sqrt(len(points)) * math.hypot(*(difference_noise(v) for v in points.T))
    round_enough = left < MAX_ROUND_SHARE * straight or left < noise < MAX_NOISE_SHARE * straight
    if not (round_enough and float(np.ptp(turned)) < MAX_ARC_RAD and abs(pivot[1]) > abs(pivot[0])):
        return None
    return Arc(float(middle[0] + pivot[0]), float(middle[1] + pivot[1]), radius, bool(pivot[1] < 0.0))
