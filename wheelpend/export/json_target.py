"""A model as numbers, units and equations that any tool can read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

import derive
from wheelpend.export.exported_model import ExportedModel
from wheelpend.model.equations import derived_model, equation_sections
from wheelpend.serialise import dumps, plain_data
from wheelpend.version import version

MODEL_JSON = "model.json"


def json_files(exported: ExportedModel) -> dict[str, str]:
    """Text of the file by path."""
    return {MODEL_JSON: dumps({"schema": 1, **plain_data(_content(exported))}) + "\n"}


def _content(exported: ExportedModel) -> dict[str, Any]:
    model, module = exported.model, exported.module
    hidden = set(module.MISSING_FORCES)
    derived = derived_model(model)
    known = model.all_parameters
    names = [n for n in module.PARAMETERS if n not in hidden and n in exported.sigma]
    return {
        "wheelpend": version(),
        "plant": model.plant,
        "assumptions": model.assumptions,
        "effects": list(model.effects),
        "states": list(module.STATES),
        "inputs": list(module.INPUTS),
        "outputs": list(module.OUTPUTS),
        "parameters": {
            name: {
                "value": float(exported.parameters[i]),
                "sigma": exported.sigma.get(name),
                "unit": module.UNITS[i] if i < len(module.UNITS) else "",
                "identified": name in known and known[name].identified is not None,
            }
            for i, name in enumerate(module.PARAMETERS)
            if name not in hidden
        },
        "covariance": {"names": names, "matrix": _covariance(exported, names)},
        "random_force": {row: vars(force) for row, force in model.random_force.items()},
        "sensor_error": {channel: vars(error) for channel, error in model.sensor_error.items()},
        "equations": equation_sections(derived, str),
        "equations_sympy": {
            coordinate.row: sp.srepr(row)
            for coordinate, row in zip(derived.plant.moving, derived.residual, strict=True)
        },
        **_beside_the_equations(derived),
        "sample_period_s": exported.period,
    }


def _beside_the_equations(derived: derive.Model) -> dict[str, Any]:
    """What `equations_sympy` do not hold: dry friction, forces with a memory, sensors, and what the command meets."""
    rows = [c.row for c in derived.plant.moving]
    return {
        "dry_friction": [
            {
                "port": surface.port,
                "direction": str(surface.direction),
                "law_sympy": sp.srepr(surface.law),
                "weights": dict(zip(rows, surface.slip, strict=True)),
            }
            for surface in derived.surfaces
        ],
        "hysteresis": [
            {
                "force": str(h.force),
                "before": str(h.before),
                "path": str(h.path),
                "law_sympy": sp.srepr(h.law),
                "weights": dict(zip(rows, h.weights, strict=True)),
            }
            for h in derived.hystereses
        ],
        "sensors_sympy": {
            channel.name: sp.srepr(sp.sympify(reading))
            for channel, reading in zip(derived.plant.channels, derived.readings, strict=True)
        },
        "input": {
            "delay": str(derived.delay),
            "lag": str(derived.lag),
            "drive_sympy": sp.srepr(sp.sympify(derived.drive)) if derived.lag else "",
        },
        "sensor_delay": {"delay": str(derived.sensor_delay), "channels": list(derived.delayed_channels)},
    }


def _covariance(exported: ExportedModel, names: Sequence[str]) -> list[list[float | None]]:
    """The model's standard errors with the correlations of a fit (n, n); None where that does not tell them."""
    fitted = exported.fitted_covariance
    variance = dict(zip(fitted.names, np.diag(fitted.matrix), strict=True)) if fitted else {}
    place = {n: k for k, n in enumerate(fitted.names) if variance[n] > 0.0} if fitted else {}

    def entry(a: str, b: str) -> float | None:
        both = exported.sigma[a] * exported.sigma[b]
        if a == b:
            return both
        if fitted is None or a not in place or b not in place:
            return None
        return float(both * fitted.matrix[place[a], place[b]] / np.sqrt(variance[a] * variance[b]))

    return [[entry(a, b) for b in names] for a in names]
