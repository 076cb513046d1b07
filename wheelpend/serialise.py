"""Results as JSON: the records' own names, strict numbers, null for what is not one."""

from __future__ import annotations

import json
import math
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

JSON_KEY_OF_FIELD = {"low": "from", "high": "to", "repeats": "missing"}


def to_json(result: Any) -> dict:
    """A result record as plain JSON data with schema 1; fields hidden from the record's text are left out."""
    return {"schema": 1, **plain_data(result)}


def dumps(data: dict) -> str:
    """Strict JSON text."""
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)


def plain_data(value: Any) -> Any:
    """Reduce a value to dicts, lists, numbers, strings, booleans and null."""
    if hasattr(value, "to_json"):  # a record that says itself what of it is written
        return plain_data(value.to_json())
    if is_dataclass(value) and not isinstance(value, type):
        return {
            JSON_KEY_OF_FIELD.get(f.name, f.name): plain_data(getattr(value, f.name)) for f in fields(value) if f.repr
        }
    if hasattr(value, "_fields"):
        return {JSON_KEY_OF_FIELD.get(n, n): plain_data(v) for n, v in zip(value._fields, value, strict=True)}
    if isinstance(value, dict):
        return {str(k): plain_data(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_data(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain_data(value.tolist())
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value if value is None or isinstance(value, str) else str(value)
