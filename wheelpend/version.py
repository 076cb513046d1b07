"""The version of the installed package."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed


def version() -> str:
    """Version, or 'uninstalled' when the package runs from a folder."""
    try:
        return installed("wheelpend")
    except PackageNotFoundError:
        return "uninstalled"
