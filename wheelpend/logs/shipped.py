"""The logs that come with the package."""

from __future__ import annotations

from pathlib import Path

from wheelpend.errors import Failure

PACKAGE_FOLDER = Path(__file__).resolve().parents[1]
DEMO_LOG, DEMO_HOLDOUT_LOG = "demo.csv", "demo_holdout.csv"


def data_folder() -> Path:
    """Folder of the shipped logs: in the package, or beside it in a clone; raises Failure where they are missing."""
    for folder in (PACKAGE_FOLDER / "data", PACKAGE_FOLDER.parent / "data"):
        if (folder / DEMO_LOG).exists():
            return folder
    raise Failure(
        f"The shipped logs must lie in {PACKAGE_FOLDER / 'data'}, but they are missing. Install wheelpend again."
    )
