"""What a log is taken from: a file, a frame or arrays in memory, or a log that is one already."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol, Union

import numpy as np
from numpy.typing import ArrayLike

from wheelpend.errors import Failure
from wheelpend.logs.log import Log
from wheelpend.logs.tables import Table

LOG_KINDS = "a path, a Log, a DataFrame or a dict of arrays"


class Frame(Protocol):
    """A table in memory with named columns, such as a DataFrame of pandas or Polars."""

    @property
    def columns(self) -> Any:
        """Names of the columns, in order."""

    def __getitem__(self, name: Any, /) -> Any:
        """The values of a column (N,)."""


LogLike = Union[str, os.PathLike, Log, Mapping[str, ArrayLike], Frame]  # all that is turned into a log
LogsLike = Union[LogLike, Sequence[LogLike]]


def as_list(logs: LogsLike) -> list[LogLike]:
    """Some logs, or one, as a list; raises Failure for what holds no logs, and for what can be gone through once."""
    if isinstance(logs, (str, os.PathLike, Log, Mapping)) or hasattr(logs, "columns"):
        return [logs]
    if not isinstance(logs, Sequence):
        raise Failure(f"Logs must each be {LOG_KINDS}, one or a list of them, not {type(logs).__name__}.")
    return list(logs)


def resolved_paths(logs: LogsLike) -> list[str]:
    """Absolute paths of those logs that are in files."""
    return [str(Path(p).resolve()) for p in as_list(logs) if isinstance(p, (str, os.PathLike))]


def names_of(logs: Sequence[LogLike]) -> Iterator[str]:
    """What each of some logs is called where it has no name of its own: by its place, where there are several."""
    return (f"log {k}" if len(logs) > 1 else "log" for k in range(1, len(logs) + 1))


def table_in_memory(name: str, source: Mapping[str, ArrayLike] | Frame) -> Table:
    """The columns of a frame or of a dict of arrays; raises Failure where it is neither.

    A named index of pandas counts as a column. Columns that are not read may hold anything.
    """
    if isinstance(source, Mapping):
        return _table(name, "dict", source, list(source))
    if hasattr(source, "collect"):
        raise Failure(f"{name}: a log must be in memory, but a {type(source).__name__} is still to be computed. "
                      "Give what its collect() returns.")  # fmt: skip
    if not (hasattr(source, "columns") and hasattr(source, "__getitem__")):
        raise Failure(f"{name}: a log must be {LOG_KINDS}, not {type(source).__name__}.")
    frame = _with_index_as_column(source)
    return _table(name, "DataFrame", frame, list(frame.columns))


def _table(name: str, kind: str, source: Mapping[str, ArrayLike] | Frame, keys: list) -> Table:
    if not keys:
        raise Failure(f"{name}: a log must have columns, but this {kind} has none.")
    return Table([str(k) for k in keys], partial(_columns, name, source, {str(k): k for k in keys}), kind=kind)


def _with_index_as_column(frame: Frame) -> Frame:
    named = getattr(getattr(frame, "index", None), "name", None) is not None
    return frame.reset_index() if named and hasattr(frame, "reset_index") else frame


def _columns(log: str, source: Any, keys: Mapping[str, Any], names: Sequence[str]) -> dict[str, np.ndarray]:
    """Columns (N,) of one length, by name; copies, so that what happens to the source does not change the log."""
    found = {name: numbers(log, name, source[keys[name]]) for name in names}
    lengths = {name: len(values) for name, values in found.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise Failure(f"{log}: every column must have one value per sample, but their lengths differ: {said}. "
                      "Resample them onto one clock.")  # fmt: skip
    return found


def numbers(log: str, name: str, column: Any) -> np.ndarray:
    """A column as float64 (N,), NaN where a value is missing; instants of a calendar in s from the first.

    Raises Failure where it has another shape or holds no real numbers.
    """
    values = column.to_numpy() if hasattr(column, "to_numpy") else _as_array(log, name, column)
    if values.ndim != 1:
        raise Failure(f"{log}: {name} must have one value per sample, of shape (N,), but its shape is {values.shape}."
                      " Give each channel by itself.")  # fmt: skip
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(float), np.nan)
    if values.dtype.kind in "mM":
        return (values - values[:1]) / np.timedelta64(1, "s")
    if values.dtype.kind == "O":
        values = _known_or_nan(values)
    if values.dtype.kind not in "iuf":
        raise Failure(f"{log}: {name} must hold real numbers, but it is of type {_type_name(column, values)}. "
                      "Convert it first.")  # fmt: skip
    return np.array(values, dtype=float)


def _as_array(log: str, name: str, column: Any) -> np.ndarray:
    try:
        return column if isinstance(column, np.ma.MaskedArray) else np.asarray(column)
    except ValueError:
        raise Failure(f"{log}: {name} must have one value per sample, but its rows differ in length.") from None


def _known_or_nan(values: np.ndarray) -> np.ndarray:
    """Objects as numbers, where all are numbers or missing (None, or pandas' NA, which is not equal to itself)."""
    missing = np.array([v is None or type(v).__name__ in ("NAType", "NaTType") for v in values], dtype=bool)
    if all(isinstance(v, (int, float, np.number)) and not isinstance(v, bool) for v in values[~missing]):
        return np.where(missing, np.nan, np.where(missing, 0.0, values)).astype(float)
    return values


def _type_name(column: Any, values: np.ndarray) -> str:
    return str(getattr(column, "dtype", values.dtype))
