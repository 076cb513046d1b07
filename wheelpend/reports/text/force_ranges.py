"""Ranges of the states in which the missing force is concentrated, and its size on each row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from wheelpend.model.units import PlantUnits
from wheelpend.reports.names import axis_name_text
from wheelpend.reports.numbers import digits_text, percent_text, physical_text, typeset_number_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.compare import Comparison
    from wheelpend.diagnosis.missing_force.estimate import ForceConcentration
    from wheelpend.diagnosis.verdict import Diagnosis


def force_range_text(found: ForceConcentration, quantities: PlantUnits) -> str:
    """Range of a state that holds most of a row's missing force, for the terminal."""
    low, high, unit = digits_text(found.low, 3), digits_text(found.high, 3), quantities.unit(found.state)
    return (f"{found.row} row: {percent_text(found.share)} of the missing force is found where {found.state} lies "
            f"between {low} and {high} {unit}".rstrip() + ".")  # fmt: skip


def typeset_force_ranges(found: Sequence[ForceConcentration], quantities: PlantUnits) -> list[str]:
    """The same of every row for the page."""
    return [
        f"{c.row} row: {percent_text(c.share)} of the missing force is found where "
        f"{axis_name_text(c.state, quantities)} lies "
        f"between {typeset_number_text(c.low, 3)} and {typeset_number_text(c.high, 3)} {quantities.unit(c.state)}."
        for c in found
    ]


def missing_force_text(result: Comparison | Diagnosis, quantities: PlantUnits) -> Iterator[str]:
    """Ranges in which the model fails, then the rms of the missing force on each row with its standard error."""
    if not result.where:
        return
    yield "Where the model as it stands fails:"
    for concentration in result.where:
        yield f"  {force_range_text(concentration, quantities)}"
    if result.problem is not None:
        for missing in result.missing:
            place = f" in {missing.log}" if len(result.missing) > 1 else ""
            for k, row in enumerate(result.problem.module.ROWS):
                own, force = quantities.force_on(row), missing.force[:, k]
                if force.any():  # else the sensors' errors explain all
                    yield _row_force_text(row + " row" + place, force, missing.sigma[:, k], own, quantities)


def _row_force_text(place: str, force: np.ndarray, sigma: np.ndarray, own: str, quantities: PlantUnits) -> str:
    unit = "" if own == "1" else f" {own}"
    rms = float(np.sqrt(np.mean(force**2)))
    physical = physical_text(rms, own, quantities, 3)
    size = f"{digits_text(rms, 3)}{unit}" + (f" = {physical}" if physical else "") + " rms"
    return f"  Missing force on the {place}: {size}, known to ± {digits_text(float(np.mean(sigma)), 2)}{unit}."
