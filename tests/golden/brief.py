"""The part of a record that is committed: per chain one JSON file with, of each step, what it answered.

Answers are kept as they are; of commands that give no JSON the text where it is short; of written logs a few figures
per column.
"""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path
from typing import Any

DIGEST = re.compile(r'"[0-9a-f]{64}"')  # of a text whose last digits differ from processor to processor
LONGEST = 60  # lines of a text that is kept
EXPECTED = Path(__file__).parent / "expected"


def brief(chain: Path) -> dict[str, Any]:
    """What is committed of a chain's record, by step."""
    return {step.name: brief_step(step) for step in sorted(chain.iterdir())}


def brief_step(step: Path) -> dict[str, Any]:
    """What is committed of a step's record."""
    kept: dict[str, Any] = json.loads(_read(step / "call.json"))
    if (step / "answer.json").exists():
        kept["answer"] = json.loads(DIGEST.sub('"<digest>"', _read(step / "answer.json")))
    texts = {"stderr": step / "stderr.txt"} | {p.name: p for p in sorted(step.glob("files/**/model.toml"))}
    if "answer" not in kept:
        texts["stdout"] = step / "stdout.txt"
    lines = {name: _read(path).splitlines() for name, path in texts.items()}
    kept |= {name: text for name, text in lines.items() if 0 < len(text) <= LONGEST or name == "model.toml"}
    tables = {path.name: table_figures(path) for path in sorted(step.glob("files/*.csv"))}
    return kept | ({"tables": tables} if tables else {})


def table_figures(path: Path) -> dict[str, Any]:
    """Rows of a table, and of each column of numbers the first, the last, the mean and the root mean square."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {name: _column([row[name] for row in rows]) for name in (rows[0] if rows else {})}
    return {"rows": len(rows), "columns": columns}


def _column(cells: list[str]) -> dict[str, float] | None:
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return None
    square = math.fsum(v * v for v in values) / len(values)
    return {"first": values[0], "last": values[-1], "mean": math.fsum(values) / len(values), "rms": math.sqrt(square)}


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def write_brief(record: Path, into: Path = EXPECTED) -> None:
    """Write what is committed of a record."""
    into.mkdir(parents=True, exist_ok=True)
    for chain in sorted(record.iterdir()):
        text = json.dumps(brief(chain), indent=1, ensure_ascii=False, sort_keys=True)
        (into / f"{chain.name}.json").write_text(text + "\n", encoding="utf-8")
