"""The border to JSON: strict numbers, null for what is not one, schema 1.

What is written of a record, and under which keys, the record's own ``to_json`` says.
"""

from __future__ import annotations

import json
import math
import re
from typing import Any, Protocol

import numpy as np

SURROGATE_PATTERN = re.compile("[\ud800-\udfff]")  # in their place Python reads such bytes


class Result(Protocol):
    """A record that says what of it is written; values may be records, arrays and numbers of NumPy."""

    def to_json(self) -> dict[str, Any]:
        """Values under the keys of JSON."""


def to_json(result: Result) -> dict[str, Any]:
    """A result as plain JSON data with schema 1."""
    return {"schema": 1, **plain_data(result.to_json())}


def dumps(data: dict) -> str:
    """Strict JSON text; bytes of a file's name that are no UTF-8 stand in it as escapes."""
    text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
    return SURROGATE_PATTERN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def plain_data(value: Any) -> Any:
    """Reduce a value to dicts, lists, numbers, strings, booleans and null; raises TypeError where that is not known."""
    if hasattr(value, "to_json"):
        return plain_data(value.to_json())
    if isinstance(value, dict):
        return {str(k): plain_data(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
        return [plain_data(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain_data(value.tolist())
    if value is None or isinstance(value, str):
        return value
    return _plain_number(value)


def _plain_number(value: Any) -> bool | int | float | None:
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    raise TypeError(f"What is written as JSON must have a to_json or be plain data, but {type(value).__name__} is not.")
