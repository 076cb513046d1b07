"""`wheelpend design` around a design: the logs it builds on, and the file of the command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wheelpend.errors import Failure
from wheelpend.experiments.design import Design, design
from wheelpend.experiments.pose import logs_of_last_change
from wheelpend.model.record import Model
from wheelpend.reports.text.design import design_text
from wheelpend.reports.text.table import TextBlocks
from wheelpend.simulation.references import save_trajectory


class WrittenDesign(NamedTuple):
    """A designed command and the file that holds it."""

    design: Design
    path: Path
    logs: tuple[str, ...]  # that were used

    def to_json(self) -> dict[str, Any]:
        """The design's own keys, with the file and the logs."""
        return {**self.design.to_json(), "file": str(self.path), "logs": self.logs}

    def text(self) -> TextBlocks:
        """Lines and tables for the terminal."""
        return design_text(self.design, self.path, self.logs)


def write_design(
    model: Model,
    logs: Sequence[Path],
    between: Sequence[str],
    output: Path,
    *,
    progress: Callable[[str], None],
    **options: Any,
) -> WrittenDesign:
    """Design a command and write it; without logs from those of the workspace's last change.

    ``options`` are those of ``wheelpend.experiments.design.design``. Raises Failure unless ``output`` ends in .csv.
    """
    if output.suffix.lower() != ".csv":
        raise Failure(f"A command is written as CSV, so -o must end in .csv, but it is {output}.")
    known = tuple(logs) or logs_of_last_change(model)
    designed = design(model, known, between=between, progress=progress, **options)
    save_trajectory(output, designed.t, designed.theta_ref, designed.dtheta_ref, model.table)
    return WrittenDesign(designed, output, tuple(map(str, known)))
