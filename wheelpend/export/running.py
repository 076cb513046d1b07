"""Programs of this machine that run an export: found, or said to be absent."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

RUN_LIMIT_S = 600.0
C_COMPILERS = ("cc", "gcc", "clang")
COMPILER_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno")


def found_program(names: Sequence[str], variable: str = "") -> str:
    """The first of these programs that is installed, or the one that an environment variable names; "" for none."""
    given = os.environ.get(variable, "") if variable else ""
    return next((path for name in (given, *names) if name and (path := shutil.which(name))), "")


def run_program(command: Sequence[str], folder: Path, given: str = "") -> tuple[str, str]:
    """Standard output of a command in a folder, and in words what went wrong; "" where nothing did."""
    try:
        done = subprocess.run(
            command, cwd=folder, input=given, capture_output=True, text=True, timeout=RUN_LIMIT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return "", f"{command[0]} did not run: {error}"
    if done.returncode:
        return "", f"{command[0]} ended with {done.returncode}: {done.stderr.strip()[:300]}"
    return done.stdout, ""
