"""Numba, imported so that nothing of the current folder becomes its configuration.

Numba reads `.numba_config.yaml` of the current folder while it is imported, where PyYAML is installed: a log's folder
could name a cache folder there, whose index is unpickled. So it is imported from the root of the file system.
"""

from __future__ import annotations

import os
import sys


def import_numba() -> None:
    """Import numba, unless that was done, with no configuration but that of the environment."""
    if "numba" in sys.modules:
        return
    try:
        current = os.getcwd()
    except FileNotFoundError:  # the folder was removed, and holds nothing
        current = ""
    try:
        os.chdir(os.sep)
        import numba  # noqa: F401  # imported here, and late: it is slow to load
    finally:
        if current:
            os.chdir(current)
