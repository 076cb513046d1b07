"""Figures as text for the page: every array of numbers once, in 16 bits between its least and its greatest value."""

from __future__ import annotations

from base64 import b64decode, b64encode
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.io.json import to_json_plotly

MAX_PACKED_VALUE = 32767  # of 16 bits; what is no number is -32768
MIN_QUARTILE_STEPS = 50  # of the 16 bits, that the middle half of the values must span


def figure_text(figure: go.Figure) -> str:
    """JSON of a figure in which no ``<`` stands; UNPACKING_SCRIPT turns it into data and layout again."""
    seen: dict[str, int] = {}
    plain = figure.to_plotly_json()
    text = to_json_plotly({"data": _packed(plain["data"], seen), "layout": plain["layout"]})
    return script_text(text)


def script_text(json: str) -> str:
    """JSON as it may stand in a script's element: no ``<`` in it ends that."""
    return json.replace("<", "\\u003c").replace(">", "\\u003e")


UNPACKING_SCRIPT = f"""
function unpacked(text) {{
  const arrays = [];
  return JSON.parse(text, (key, value) => {{
    if (value?.packed === undefined && value?.again === undefined) return value;
    if (value.again !== undefined) return arrays[value.again];
    const bytes = Uint8Array.from(atob(value.packed), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const numbers = Array.from({{length: bytes.length / 2}}, (_, k) => view.getInt16(2 * k, true));
    const read = numbers.map((n) => n < -{MAX_PACKED_VALUE} ? null : value.middle + n * value.step);
    arrays.push(read);
    return read;
  }});
}}
"""


def _packed(value: Any, seen: dict[str, int]) -> Any:
    """A part of a figure with its arrays packed; ``seen`` holds the number of each that came before."""
    if isinstance(value, dict) and "bdata" in value:
        return _packed_array(value, np.frombuffer(b64decode(value["bdata"]), value["dtype"]).astype(float), seen)
    if isinstance(value, dict):
        return {key: _packed(part, seen) for key, part in value.items()}
    return [_packed(part, seen) for part in value] if isinstance(value, list | tuple) else value


def _packed_array(found: dict[str, Any], values: np.ndarray, seen: dict[str, int]) -> dict[str, Any]:
    """An array in 16 bits, or as it was ``found`` where a few values are so far out that the others would be lost."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    middle, step = 0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low) / MAX_PACKED_VALUE or 1.0
    quartiles = np.quantile(finite, (0.25, 0.75)) if finite.size else (0.0, 0.0)
    if high > low and quartiles[1] - quartiles[0] < MIN_QUARTILE_STEPS * step:
        return found
    whole = np.where(np.isfinite(values), np.rint((values - middle) / step), -MAX_PACKED_VALUE - 1)
    text = b64encode(whole.astype("<i2").tobytes()).decode()
    name = f"{text} {middle} {step}"
    if name in seen:
        return {"again": seen[name]}
    seen[name] = len(seen)
    return {"packed": text, "middle": middle, "step": step}
