"""The `wheelpend` command: the application with the commands of every module, and its entry point."""

from __future__ import annotations

import gc
import os

from wheelpend.cli import logs, loop, paper, workspace
from wheelpend.cli.app import app
from wheelpend.isolation import leave_out_current_folder

COMMAND_MODULES = (loop, logs, workspace, paper)  # which fill the application when they are imported


def main() -> None:
    """Entry point of the `wheelpend` command."""
    leave_out_current_folder()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded; in small problems more are in the way
    gc.set_threshold(100_000)  # what modules leave while they load is kept: to look for garbage there costs a tenth
    app()
