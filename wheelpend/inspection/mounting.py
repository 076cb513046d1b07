"""How a body's angle sensor is mounted: turned over, a robot that stands reads half a turn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.plant_fit import Candidate
from wheelpend.inspection.survey import Survey
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.units import UNIT_CONVERSIONS, stated_unit

MAX_SWAY_RAD = 0.5  # about half a turn, within which a robot balances


class Mounting(NamedTuple):
    """A sensor that reads half a turn where the body stands upright."""

    offset: float  # rad, what is added to its readings
    maps: Mapping[str, ColumnMap]  # of the channel, in the unit in which that is half a turn
    sentence: str


def turned_over(survey: Survey, best: Candidate, maps: Mapping[str, ColumnMap]) -> Mounting | None:
    """The mounting of a robot's pitch sensor that reads half a turn throughout; None of any other.

    A robot on wheels cannot hang, where a pole on a cart can.
    """
    name = best.table.range_channel
    column = best.columns.get(name, "")
    on_wheels = all(best.table.units[p] == "rad" for p in best.table.places)
    if not name or not on_wheels or column not in survey.values or not best.table.inputs:
        return None
    entry = maps.get(name, ColumnMap(column))
    readings = survey.values[column][np.isfinite(survey.values[column])] * entry.scale
    for unit in ("rad",) if stated_unit(column) else dict.fromkeys((entry.unit or "rad", "deg")):  # stated: read so
        angle = readings * UNIT_CONVERSIONS[unit][1]
        middle = float(np.median(angle))
        if angle.size and np.abs(np.abs(angle) - math.pi).max() < MAX_SWAY_RAD and np.ptp(angle) < 2 * MAX_SWAY_RAD:
            sentence = (f"{column} reads about half a turn while the robot stands: its sensor is mounted upside down, "
                        "hence the offset.")  # fmt: skip
            found = entry if stated_unit(column) else replace(entry, unit=unit)
            return Mounting(-math.copysign(math.pi, middle), {name: found}, sentence)
    return None
