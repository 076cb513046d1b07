"""Numbers as text: rounded, with their standard error, with their unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheelpend.model.units import plant_units_of

if TYPE_CHECKING:
    from wheelpend.model.record import Model


def number_text(value: float | None) -> str:
    """Four significant digits."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.4g}"


def estimate_text(value: float, sigma: float | None, unit: str) -> str:
    """A value with its standard error and unit."""
    spread = f" ± {sigma:.2g}" if sigma is not None and np.isfinite(sigma) else ""
    return f"{value:.5g}{spread} {unit if unit != '1' else ''}".rstrip()


def effect_size_text(coefficients: dict, sigma: dict, unit: dict, model: Model, drive: float | None = None) -> str:
    """Coefficients of an effect, in N·m or N too where a volt's worth is known, and as a share of the drive voltage."""
    parts, quantities = [], plant_units_of(model)
    for name, value in coefficients.items():
        text = f"{name} {estimate_text(value, sigma.get(name), unit[name])}"
        if found := quantities.in_physical(value, unit[name]):
            text += f" = {found[0]:.4g} {found[1]}"
        if drive and unit[name] == quantities.force:
            text += f", {100 * abs(value) / drive:.1f} % of the rms drive voltage"
        parts.append(text)
    return "; ".join(parts)


def rms_drive_voltage(problem) -> float:
    """Root mean square of the voltage of the training logs [V]."""
    return float(np.sqrt(np.nanmean(np.concatenate([p.log.voltage for p in problem.training]) ** 2)))
