"""The page: the steps of the work from top to bottom, and beside them what became of the model."""

from __future__ import annotations

from nicegui import ui

from wheelpend.view.bench import Bench


def show_workbench(bench: Bench) -> None:
    """Lay out the workbench for a window that opens."""
    ui.label(f"wheelpend {bench.folder}")
