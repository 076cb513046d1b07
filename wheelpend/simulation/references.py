"""Reference trajectories of the pitch: the built-in ones, in degrees in the paper and here in rad, and files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.logs.checks import check_time
from wheelpend.logs.log import REFERENCE_COLUMN
from wheelpend.logs.tables import check_length, open_table

BUILT_IN_COMMANDS_DEG: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "simple": lambda t: 20.0 * np.sin(t),
    "aggressive": lambda t: (
        3.0 * np.sin(7 * t) + 6.0 * (np.cos(4 * t) - np.sin(t)) + 10.0 * np.cos(3 * t) * np.sin(5 * t) ** 2
    ),
    "upright": lambda t: np.zeros_like(t),
}  # degrees; simple and aggressive are the paper's, section 4
BUILT_IN_DURATION_S = 20.0  # s of a built-in command
COMMAND_FILE_SUFFIXES = (".csv", ".parquet", ".pq")
REFERENCE_RATE_COLUMN = "dtheta_ref"


def reference(command: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Commanded pitch [rad] and its rate [rad/s] at the times t [s], from a built-in command or a file.

    A file is a CSV or Parquet with ``t``, ``theta_ref`` and perhaps ``dtheta_ref``; it is linear between its rows.
    Raises Failure for an unknown command, a file that cannot be used, and times beyond its end.
    """
    if command in BUILT_IN_COMMANDS_DEG:
        angle = np.radians(BUILT_IN_COMMANDS_DEG[command](t))
        return angle, np.gradient(angle, t)
    times, angles, rates = read_trajectory(command_file(command))
    if t[-1] > times[-1] + 0.5 * float(np.median(np.diff(times))):
        raise Failure(f"{command} must last as long as is to be simulated, {t[-1]:g} s, but it ends at "
                      f"{times[-1]:g} s. Ask for a shorter duration.")  # fmt: skip
    return np.interp(t, times, angles), np.interp(t, times, rates)


def command_duration(command: str) -> float:
    """Duration of a command [s]; a file's is that of its last row."""
    if command in BUILT_IN_COMMANDS_DEG:
        return BUILT_IN_DURATION_S
    return float(read_trajectory(command_file(command))[0][-1])


def command_file(command: str) -> Path:
    """Path of a command file; raises Failure, listing the built-in commands, where the name has no such suffix."""
    path = Path(command)
    if path.suffix.lower() not in COMMAND_FILE_SUFFIXES:
        raise Failure(f"No command named '{command}'. Known commands: {', '.join(sorted(BUILT_IN_COMMANDS_DEG))}; "
                      "or a CSV file with t, theta_ref and dtheta_ref.")  # fmt: skip
    return path


def read_trajectory(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times from the first row [s], pitch [rad] and its rate [rad/s] of a file, (N,) each."""
    file = open_table(path)
    if absent := [n for n in ("t", REFERENCE_COLUMN) if n not in file.names]:
        raise Failure(f"{path.name}: a command needs the columns t and theta_ref, but {' and '.join(absent)} "
                      f"{'is' if len(absent) == 1 else 'are'} missing. `wheelpend design` writes one.")  # fmt: skip
    numbers = file.read([n for n in file.names if n in ("t", REFERENCE_COLUMN, REFERENCE_RATE_COLUMN)])
    _check_trajectory(path.name, numbers)
    t = numbers["t"] - numbers["t"][0]
    angle = numbers[REFERENCE_COLUMN]
    return t, angle, numbers[REFERENCE_RATE_COLUMN] if REFERENCE_RATE_COLUMN in numbers else np.gradient(angle, t)


def _check_trajectory(name: str, numbers: dict[str, np.ndarray]) -> None:
    check_length(name, len(numbers["t"]))
    check_time(name, numbers["t"])
    for column, values in numbers.items():
        unknown = np.flatnonzero(~np.isfinite(values))
        if len(unknown):
            raise Failure(f"{name}: a command must have a value in every row; row {unknown[0] + 1} of {column} has "
                          "none.")  # fmt: skip
    if np.abs(numbers[REFERENCE_COLUMN]).max() > np.pi / 2:
        raise Failure(f"{name}: theta_ref is a pitch in rad and must stay within ±π/2, but it reaches "
                      f"{np.abs(numbers[REFERENCE_COLUMN]).max():g}. Is it in degrees?")  # fmt: skip


def save_trajectory(path: Path, t: np.ndarray, angle: np.ndarray, rate: np.ndarray) -> None:
    """Write a command as CSV, complete or not at all: times [s], pitch [rad], rate [rad/s], (N,) each."""
    import polars as pl  # imported late: it is slow to load, and only this needs it

    table = pl.DataFrame({"t": t, REFERENCE_COLUMN: angle, REFERENCE_RATE_COLUMN: rate})
    write_text(path, table.write_csv(float_precision=9))
