"""A process that writes what a model predicts of logs, sample by sample, for the workbench to draw.

    python -m wheelpend.view.predictions LOG... [--holdout LOG] [--model FILE] --json FILE

takes the words of `wheelpend compare`. Beside the JSON, which says what is of what, it writes an array for each log:
time, then measured and predicted of every channel in turn.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend import interruption
from wheelpend.diagnosis.predict import predict
from wheelpend.model.record import Model
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.view.asked import asked_of_files, opened_model


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    asked = asked_of_files()
    with exit_on_failure(asked.json), progress("reading") as update:
        model = opened_model(asked)
        written = list(_written(model, asked, Path(asked.json).parent, update))
        emit_json({"schema": 1, "logs": written}, asked.json)


def _written(
    model: Model, asked: argparse.Namespace, folder: Path, update: Callable[[str], None]
) -> Iterator[dict[str, Any]]:
    """Write the series of each log, held-out ones first, since they judge; yields what they are of."""
    files = [(path, True) for path in asked.holdout] + [(path, False) for path in asked.logs]
    for number, (path, held_out) in enumerate(files):
        found = predict(model, Path(path), progress=update)
        pairs = np.stack([found.measured, found.predicted], axis=-1).reshape(len(found.t), -1)
        series = np.column_stack([found.t, np.where(np.isinf(pairs), np.nan, pairs)])
        np.save(folder / f"{number}.npy", np.asfortranarray(series))  # drawn column by column
        name = Path(path).name
        told = {"name": name, "path": str(path), "held_out": held_out, "duration_s": float(found.t[-1] - found.t[0])}
        yield {**told, "file": f"{number}.npy", "channels": list(found.channels)}


if __name__ == "__main__":
    main()
