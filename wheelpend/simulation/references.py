"""Reference trajectories of what is controlled: the built-in ones, in degrees in the paper and here in rad, and files.

Of a plant that moves along a length they are in m.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.logs.checks import check_time
from wheelpend.logs.columns import DEFAULT_TABLE, ColumnTable
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


def reference(command: str, t: np.ndarray, table: ColumnTable = DEFAULT_TABLE) -> tuple[np.ndarray, np.ndarray]:
    """Commanded value [rad, or m] and its rate at the times t [s], from a built-in command or a file.

    A file is a CSV or Parquet with ``t``, the plant's reference, theta_ref for instance, and perhaps its rate,
    dtheta_ref; it is linear between its rows.
    Raises Failure for an unknown command, a file that cannot be used, and times beyond its end.
    """
    if command in BUILT_IN_COMMANDS_DEG:
        angle = np.radians(BUILT_IN_COMMANDS_DEG[command](t))
        return angle, np.gradient(angle, t)
    times, angles, rates = read_trajectory(command_file(command, table), table)
    if t[-1] > times[-1] + 0.5 * float(np.median(np.diff(times))):
        raise Failure(f"{command} must last as long as is to be simulated, {t[-1]:g} s, but it ends at "
                      f"{times[-1]:g} s. Ask for a shorter duration.")  # fmt: skip
    return np.interp(t, times, angles), np.interp(t, times, rates)


def command_duration(command: str, table: ColumnTable = DEFAULT_TABLE) -> float:
    """Duration of a command [s]; a file's is that of its last row."""
    if command in BUILT_IN_COMMANDS_DEG:
        return BUILT_IN_DURATION_S
    return float(read_trajectory(command_file(command, table), table)[0][-1])


def trajectory_columns(table: ColumnTable) -> tuple[str, str]:
    """Columns of a command file beside t: the commanded value and its rate."""
    value = table.reference or DEFAULT_TABLE.reference
    return value, f"d{value}"


def command_file(command: str, table: ColumnTable) -> Path:
    """Path of a command file; raises Failure, listing the built-in commands, where the name has no such suffix."""
    path = Path(command)
    if path.suffix.lower() not in COMMAND_FILE_SUFFIXES:
        raise Failure(f"No command named '{command}'. Known commands: {', '.join(sorted(BUILT_IN_COMMANDS_DEG))}; "
                      f"or a CSV file with t, {' and '.join(trajectory_columns(table))}.")  # fmt: skip
    return path


def read_trajectory(path: Path, table: ColumnTable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times from the first row [s], commanded value and its rate of a file, (N,) each."""
    file = open_table(path)
    column, rate = trajectory_columns(table)
    if absent := [n for n in ("t", column) if n not in file.names]:
        raise Failure(f"{path.name}: a command needs the columns t and {column}, but {' and '.join(absent)} "
                      f"{'is' if len(absent) == 1 else 'are'} missing. `wheelpend design` writes one.")  # fmt: skip
    numbers = file.read([n for n in file.names if n in ("t", column, rate)])
    _check_trajectory(path.name, numbers, table)
    t = numbers["t"] - numbers["t"][0]
    angle = numbers[column]
    return t, angle, numbers[rate] if rate in numbers else np.gradient(angle, t)


def _check_trajectory(name: str, numbers: dict[str, np.ndarray], table: ColumnTable) -> None:
    commanded = trajectory_columns(table)[0]
    check_length(name, len(numbers["t"]))
    check_time(name, numbers["t"])
    for column, values in numbers.items():
        unknown = np.flatnonzero(~np.isfinite(values))
        if len(unknown):
            raise Failure(f"{name}: a command must have a value in every row; row {unknown[0] + 1} of {column} has "
                          "none.")  # fmt: skip
    if table.range_channel and np.abs(numbers[commanded]).max() > np.pi / 2:
        what = table.words.controlled or table.range_channel
        raise Failure(f"{name}: {commanded} is a {what} in rad and must stay within ±π/2, but it reaches "
                      f"{np.abs(numbers[commanded]).max():g}. Is it in degrees?")  # fmt: skip


def save_trajectory(
    path: Path, t: np.ndarray, angle: np.ndarray, rate: np.ndarray, table: ColumnTable = DEFAULT_TABLE
) -> None:
    """Write a command as CSV, complete or not at all: times [s], commanded value, its rate, (N,) each."""
    import polars as pl  # imported late: it is slow to load, and only this needs it

    names = ("t", *trajectory_columns(table))
    write_text(path, pl.DataFrame(dict(zip(names, (t, angle, rate), strict=True))).write_csv(float_precision=9))
