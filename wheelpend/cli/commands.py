"""The application with the commands of every module."""

from __future__ import annotations

from wheelpend.cli import export, logs, loop, paper, view, workspace
from wheelpend.cli.app import app

COMMAND_MODULES = (loop, logs, workspace, export, view, paper)  # which fill the application when they are imported

__all__ = ["COMMAND_MODULES", "app"]
