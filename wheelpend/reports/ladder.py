"""The error ladder as a small picture (SVG)."""

from __future__ import annotations

from math import log10
from pathlib import Path

import jinja2

from wheelpend.diagnosis.explain import Explanation

PICTURE_WIDTH_PX, BAR_HEIGHT_PX, LABEL_WIDTH_PX = 720, 34, 190  # px

SVG_TEMPLATE = """<svg xmlns="http://www.w3.org/2000/svg" width="{{ width }}" height="{{ height }}" \
font-family="sans-serif" font-size="15">
<rect width="100%" height="100%" fill="white"/>
<text x="12" y="24" font-weight="bold">Held-out error, in standard deviations of the sensors (logarithmic)</text>
{% for rung in rungs %}
<text x="12" y="{{ rung.y + 22 }}">{{ rung.name }}</text>
<rect x="{{ label }}" y="{{ rung.y + 4 }}" width="{{ rung.length }}" height="26" fill="{{ rung.colour }}"/>
<text x="{{ label + rung.length + 8 }}" y="{{ rung.y + 22 }}">{{ rung.error }}</text>
{% endfor %}
<text x="12" y="{{ height - 12 }}" fill="#666">noise floor {{ floor }}</text>
</svg>
"""


def draw_ladder(result: Explanation, path: Path) -> Path:
    """Write the ladder of an explanation as SVG; bars are logarithmic above the noise floor."""
    rungs = [] if result.nominal_error is None else [("nominal", result.nominal_error, "#9aa0a6")]
    rungs += [("parameters refitted", result.base_error, "#d9622b")]
    rungs += [(f"+ {s.effect}", s.error_after, "#2166ac") for s in result.steps]
    top = max(log10(max(e / result.noise_floor, 1.0)) for _, e, _ in rungs) or 1.0
    rows = [
        {
            "name": name,
            "error": f"{error:.4g}",
            "colour": colour,
            "y": 36 + BAR_HEIGHT_PX * k,
            "length": round(
                4 + (PICTURE_WIDTH_PX - LABEL_WIDTH_PX - 90) * log10(max(error / result.noise_floor, 1.0)) / top
            ),
        }
        for k, (name, error, colour) in enumerate(rungs)
    ]
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    text = environment.from_string(SVG_TEMPLATE).render(
        rungs=rows,
        width=PICTURE_WIDTH_PX,
        label=LABEL_WIDTH_PX,
        height=36 + BAR_HEIGHT_PX * len(rows) + 36,
        floor=f"{result.noise_floor:.4g}",
    )
    path.write_text(text, encoding="utf-8")
    return path
