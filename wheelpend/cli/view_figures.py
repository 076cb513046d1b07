"""A process that writes what a diagnosis found, for the workbench to draw: the missing force, and what explains it.

    python -m wheelpend.cli.view_figures LOG... [--holdout LOG] [--model FILE] --json FILE

takes the words of `wheelpend diagnose`, whose answer it takes up where that was just given.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import derive
from wheelpend import interruption
from wheelpend.api import diagnose
from wheelpend.cli.kept_searches import searched
from wheelpend.diagnosis.missing_force.estimate import MissingForce
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.numerics import gaussian_smoothed
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.reports.page.effect_figures import effect_figure
from wheelpend.reports.page.force_figures import missing_force_if_true, state_figure
from wheelpend.view.asked import asked_of_files, opened_model

MAX_FORCE_SAMPLES = 3000  # of a log
MAX_DRAWN_CANDIDATES = 5
DEFAULT_QUESTION: dict[str, Any] = {"without": [], "law": False}  # as `wheelpend diagnose` asks without options
KEPT_DIGITS = 6
SMOOTHED_S = 0.05  # s, standard deviation of the weights with which a noisy force is drawn


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    asked = asked_of_files()
    with exit_on_failure(asked.json), progress("reading") as update:
        model = opened_model(asked)
        files = [Path(p) for p in asked.logs], [Path(p) for p in asked.holdout]
        found = searched("diagnosis", diagnose, model, files, DEFAULT_QUESTION, update)
        emit_json({"schema": 1, **_drawn(found, plant_units_of(model))}, asked.json)


def _drawn(found: Diagnosis, units: PlantUnits) -> dict[str, Any]:
    """The missing force of each log with the states where it acts, what candidates explain, and their laws."""
    rows = list(found.problem.module.ROWS)
    candidates = found.candidates[:MAX_DRAWN_CANDIDATES]
    explained = {c.effect: missing_force_if_true(found, c) for c in candidates}
    over_state = state_figure(found, units)
    return {
        "over_state": json.loads(over_state.to_json()) if over_state is not None else None,
        "rows": [{"name": row, "unit": units.force_on(row)} for row in rows],
        "forces": [_told(m, units) for m in found.missing],
        "explained": {
            effect: _rounded(_smoothed(found.missing[0].t, force)[_thinned(len(force))].T)
            for effect, force in explained.items()
            if force is not None
        },
        "laws": {
            c.effect: json.loads(effect_figure(derive.effects.find(c.effect), found.problem, c.fit).to_json())
            for c in candidates
        },
    }


def _told(missing: MissingForce, units: PlantUnits) -> dict[str, Any]:
    kept = _thinned(len(missing.t))
    variables = {name: values for name, values in missing.variables.items() if name != "t"}
    return {
        "log": missing.log,
        "t": _rounded(missing.t[kept]),
        "force": _rounded(missing.force[kept].T),
        "sigma": _rounded(missing.sigma[kept].T),
        "variables": {name: _rounded(values[kept]) for name, values in variables.items()},
        "units": {name: units.unit(name) for name in variables},
    }


def _smoothed(t: np.ndarray, force: np.ndarray) -> np.ndarray:
    """A force (n, rows) that carries the sensors' noise, over some time about each sample."""
    order = np.argsort(t)
    width = SMOOTHED_S / max(float(np.median(np.diff(t[order]))), 1e-9)
    found = np.empty_like(force)
    found[order] = np.column_stack([gaussian_smoothed(column, width) for column in force[order].T])
    return found


def _thinned(count: int) -> slice:
    """Every so many samples, so that not too many are kept."""
    return slice(None, None, max(1, -(-count // MAX_FORCE_SAMPLES)))


def _rounded(values: np.ndarray) -> list[Any]:
    """Numbers with as many digits as a drawing shows; what is none is null."""
    size = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    decimals = KEPT_DIGITS - int(np.ceil(np.log10(size)))
    rounded = np.round(values.astype(float), decimals)
    shown = rounded.astype(object)
    shown[~np.isfinite(rounded)] = None
    return list(shown.tolist())


if __name__ == "__main__":
    main()
