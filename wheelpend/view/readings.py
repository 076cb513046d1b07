"""A process that writes the signals of logs as they are read, and how the model file says to read them.

    python -m wheelpend.view.readings LOG... [--model FILE] --json FILE

Where there is no model, or none that reads a log, the signals are the columns of the file themselves. Beside the JSON
it writes an array for each log: time, then every signal in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from derive import plants
from wheelpend import interruption
from wheelpend.errors import Failure
from wheelpend.logs.columns import ColumnMap, is_summed
from wheelpend.logs.guess import guess_column_maps
from wheelpend.logs.read import find_time_column, open_file, signals_of_file
from wheelpend.logs.units import UNIT_CONVERSIONS
from wheelpend.model.record import Model
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.view.asked import asked_of_files, opened_model

MAX_COLUMNS = 16  # of a file that no model reads, that are drawn


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    asked = asked_of_files()
    with exit_on_failure(asked.json), progress("reading"):
        model = opened_model(asked) if Path(asked.model).exists() else None
        written = [_written(model, Path(path), Path(asked.json).parent / str(k)) for k, path in enumerate(asked.logs)]
        emit_json({"schema": 1, "logs": written}, asked.json)


def _written(model: Model | None, path: Path, file: Path) -> dict[str, Any]:
    """Write the series of a log, and say what is of what; the refusal is that of a model that cannot read it."""
    said: dict[str, Any] = {"name": path.name, "file": f"{file.name}.npy", "refusal": "", "left_out": []}
    columns = open_file(path).names
    try:
        t, series = _as_read(model, path) if model else _as_they_are(path)
    except Failure as failure:
        said["refusal"] = str(failure)
        t, series = _as_they_are(path)
    said["left_out"] = list(series)[MAX_COLUMNS:]
    drawn = dict(list(series.items())[:MAX_COLUMNS])
    _save_columns(file.with_suffix(".npy"), [t, *drawn.values()])
    form = {"columns": columns, "quantities": _quantities(model, path), "sensors": _sensors(model)} if model else {}
    return said | {"channels": list(drawn)} | form


def _save_columns(file: Path, columns: Sequence[np.ndarray]) -> None:
    """Write columns (N,) as an array (N, columns), of which one is read at a time; none is held twice."""
    shape = len(columns[0]), len(columns)
    written = np.lib.format.open_memmap(file, "w+", float, shape, fortran_order=True)
    for number, column in enumerate(columns):
        written[:, number] = column


def _as_read(model: Model, path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time [s] and signals of a log, in the units of the plant, in their usual order."""
    t, signals = signals_of_file(
        path, {**model.columns, **guess_column_maps(path, model.columns, model.table)}, model.table
    )
    ordered = (*model.table.inputs, *model.table.channels, model.table.reference)
    return t, {name: signals[name] for name in ordered if name in signals and not np.isnan(signals[name]).all()}


def _as_they_are(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time, or the number of the sample, and the columns of a file that change."""
    from wheelpend.inspection.file_values import numeric_columns  # imported late: loads SciPy's filters

    file = open_file(path)
    values = numeric_columns(path, file)
    clock = find_time_column(file, "", list(values))
    t = values.pop(clock.column) if clock else np.arange(len(next(iter(values.values()))), dtype=float)
    scale = UNIT_CONVERSIONS[clock.unit][1] if clock and clock.unit else 1.0
    return scale * (t - t[0]), {n: np.where(np.isinf(v), np.nan, v) for n, v in values.items() if np.ptp(v) != 0.0}


def _quantities(model: Model, path: Path) -> list[dict[str, Any]]:
    """How each quantity of the plant is read: by its entry of [columns], or as guessed, beside what is stated."""
    guessed = guess_column_maps(path, model.columns, model.table)
    return [
        {
            "name": name,
            "own_unit": (own := model.table.units[name]),
            "units": [u for u, (base, _) in UNIT_CONVERSIONS.items() if base == own or is_summed(name, u, model.table)],
            "is_guessed": name in guessed,
            "is_required": name in model.table.required,
            "stated": vars(model.columns.get(name) or ColumnMap(name)),
            **vars(model.columns.get(name) or guessed.get(name) or ColumnMap(name)),
        }
        for name in model.table.names
    ]


def _sensors(model: Model) -> list[dict[str, Any]]:
    """The entries of [sensors] by their keys: choices of the plant, noise, and counts or step of each channel."""
    found = [
        {"key": f"sensors.{a.name}", "label": a.name, "value": model.assumptions[a.name], "choices": list(a.choices)}
        for a in plants.assumptions_of(model.plant)
        if a.section == "sensors"
    ]
    stated = model.sensors.of_plant
    for channel in model.plant_signature.channels:
        name, sensor = channel.name, channel.sensor
        noise = stated.get(sensor.noise_key, model.sensors.noise.get(name, "auto"))
        noise_key = f"sensors.{sensor.noise_key or f'noise.{name}'}"
        found.append({"key": noise_key, "label": f"noise of {name} [{channel.unit}], or auto", "value": noise})
        if sensor.counts_key:
            counts = stated.get(sensor.counts_key, "")
            found.append(
                {"key": f"sensors.{sensor.counts_key}", "label": f"counts of {name} per turn", "value": counts}
            )
        else:
            step = model.sensors.step.get(name, "")
            found.append({"key": f"sensors.step.{name}", "label": f"step of {name} [{channel.unit}]", "value": step})
    return found


if __name__ == "__main__":
    main()
