"""Results of `compare` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.console import print_line, print_table
from wheelpend.reports.numbers import number_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.compare import Comparison
    from wheelpend.diagnosis.missing_force.estimate import ForceConcentration
    from wheelpend.model.record import Model

MAX_LISTED_BURSTS = 12  # times of bursts that are listed


def force_concentration_text(place: ForceConcentration, quantities: PlantUnits) -> str:
    """Where a row's missing force is concentrated, in words."""
    unit = quantities.unit(place.state)
    return (f"{place.row} row: {100 * place.share:.0f} % of the missing force is found where {place.state} lies "
            f"between {place.low:.3g} and {place.high:.3g} {unit}".rstrip() + ".")  # fmt: skip


def print_comparison(result: Comparison, model: Model) -> None:
    """Print a comparison."""
    if result.fitted_first:
        print_line("The model has no parameter values yet: it was fitted to the log first.")
    print_line(f"Error {result.error:.4g} over {result.horizon_s:g} s (noise floor {result.noise_floor:.4g}): "
        "the model " + ("explains the log down to its noise." if result.error < 1.05 * result.noise_floor
                        else "misses something."))  # fmt: skip
    print_table(f"Fit per channel over {result.horizon_s:g} s", ("channel", "fit [%]", "rmse"),
          [(c, f"{f:.2f}", number_text(result.rmse[c])) for c, f in result.fit_percent.items()])  # fmt: skip
    print_table(
        "Error against horizon",
        ("seconds", "error"),
        [(f"{h.seconds:.4g}", "diverged" if h.diverged else number_text(h.error)) for h in result.horizons],
    )
    if result.closed_loop:
        loop = result.closed_loop
        print_line("Closed loop replayed with the model: " + ("it falls over." if loop.diverged else
            ", ".join(f"{c} off by {number_text(v)} rms" for c, v in loop.rmse.items())
            + f", control input off by {number_text(loop.rmse_input)} V rms."))  # fmt: skip
    for row in result.per_log:
        print_line(
            f"Of its own in {row['log']}: " + ", ".join(f"{n} {v:.4g}" for n, v in row.items() if n != "log") + "."
        )
    print_force_errors(result, model)
    print_force_concentrations(result.where, model, result)


def print_force_errors(result: Comparison, model: Model) -> None:
    """Print what the equations leave of the input, and where in time they miss far more than usual."""
    known = {n: e for n, e in result.force_error.items() if e is not None}
    for name, left in known.items():
        print_line(f"{name}: inverse dynamics leave {left:.3g} % of the input unexplained.")
    for name in known:
        found = [b for b in result.bursts if b["log"] == name and not b["at_reversal"]]
        turning = sum(b["log"] == name and b["at_reversal"] for b in result.bursts)
        if found:
            peak, quantities = max(b["peak"] for b in found), plant_units_of(model)
            physical = quantities.in_physical(peak, quantities.force)
            size = f"{peak:.3g} {quantities.force}" + (f" = {physical[0]:.3g} {physical[1]}" if physical else "")
            shown = ", ".join(f"{b['from']:.3f}" for b in found[:MAX_LISTED_BURSTS])
            print_line(
                f"{name}: in {len(found)} short stretches the model misses far more force than usual, up to {size}: at "
                f"t = {shown}{', …' if len(found) > MAX_LISTED_BURSTS else ''} s. Something pushes there, or winds up, "
                "that the model does not have."
            )
        if turning:
            print_line(f"{name}: so it does at {turning} reversals, where friction is hardest to know.")


def print_force_concentrations(places: tuple[ForceConcentration, ...], model: Model, result) -> None:
    """Print where the model fails."""
    if not places:
        return
    quantities = plant_units_of(model)
    print_line("Where it fails:")
    for place in places:
        print_line(f"  {force_concentration_text(place, quantities)}")
    missing = result.missing
    if missing is not None:
        unit = "" if quantities.force == "1" else f" {quantities.force}"
        for row, name in enumerate(result.problem.module.ROWS):
            rms = float(np.sqrt(np.mean(missing.force[:, row] ** 2)))
            found = quantities.in_physical(rms, quantities.force)
            torque = f" = {found[0]:.3g} {found[1]}" if found else ""
            print_line(f"  Missing force on the {name} row: {rms:.3g}{unit}{torque} rms, known to "
                f"± {float(np.mean(missing.sigma[:, row])):.2g}{unit}.")  # fmt: skip
