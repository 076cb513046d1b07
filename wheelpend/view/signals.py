"""A process that writes a log's signals as they are read, and how each is read, for the workbench to draw and correct.

    python -m wheelpend.view.signals LOG [--model FILE] --json FILE

Beside the JSON it writes an array: time, then inputs and channels in turn. Where there is no model yet the log is read
as inspection proposes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from wheelpend import interruption
from wheelpend.inspection.first_look import first_look
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.guess import guess_column_maps
from wheelpend.logs.read import load_log, open_file
from wheelpend.model.record import Model
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.view.asked import asked_of_files

MAP_KEYS = ("column", "unit", "sign", "scale", "offset", "times")


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    asked = asked_of_files()
    with exit_on_failure(asked.json), progress("reading"):
        path, model_path = Path(asked.logs[0]), Path(asked.model)
        model = Model.open(model_path) if model_path.exists() else Model.parse(first_look(path).model)
        emit_json({"schema": 1, **_written(model, path, Path(asked.json).parent)}, asked.json)


def _written(model: Model, path: Path, folder: Path) -> dict[str, Any]:
    """Write the series of a log; what it is of, and how each quantity is read."""
    table = model.table
    guessed = guess_column_maps(path, model.columns, table)
    maps = {**model.columns, **guessed}
    log = load_log(path, maps, table)
    names = [*table.inputs, *log.channels]
    signals = [*log.inputs[: len(table.inputs)], *log.measured.T]
    np.save(folder / "signals.npy", np.asfortranarray(np.column_stack([log.t, *signals])))  # drawn column by column
    return {
        "logs": [{"name": path.name, "file": "signals.npy", "names": names}],
        "units": [table.units[n] for n in names],
        "columns": list(open_file(path).names),
        "maps": {n: _stated(maps.get(n, ColumnMap(n))) | {"guessed": n in guessed} for n in names},
    }


def _stated(found: ColumnMap) -> dict[str, Any]:
    return {key: getattr(found, key) for key in MAP_KEYS}


if __name__ == "__main__":
    main()
