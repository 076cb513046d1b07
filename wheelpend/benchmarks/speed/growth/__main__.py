"""``python -m wheelpend.benchmarks.speed.growth``: measure the growth of time and memory, and write it into a page."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.speed.growth.curve import ScalingCurve, ScalingPoint
from wheelpend.benchmarks.speed.growth.measure import measure_in_process, measure_once
from wheelpend.benchmarks.speed.growth.page import markdown_table, write
from wheelpend.benchmarks.speed.growth.work import write_log
from wheelpend.reports.console import exit_on_failure, print_line

LOG_SAMPLE_COUNTS = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
DIAGNOSIS_SAMPLE_COUNTS = (10_000, 100_000, 300_000, 1_000_000)
EFFECT_COUNTS = (5, 10, 20, 30, 50)  # the library's that last and release nothing, then up to twenty of a user's own
BATCH_SIZES = (1, 10, 100, 1_000, 10_000)


def main(
    out: Annotated[Path, typer.Option(help="Page whose marked place gets the figures.")] = Path("docs/performance.md"),
    longest: Annotated[int, typer.Option(help="Samples of the longest log.")] = LOG_SAMPLE_COUNTS[-1],
    one: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    """Measure growth and write it into a page, with a picture."""
    if one:
        print(json.dumps(measure_once(one)))
        return
    with exit_on_failure(), tempfile.TemporaryDirectory() as folder:
        found: list[ScalingCurve] = []
        for curve in measure_curves(Path(folder), [n for n in LOG_SAMPLE_COUNTS if n <= longest]):
            found.append(curve)
            write(out, found)
        print_line(markdown_table(found))


def measure_curves(folder: Path, lengths: list[int]) -> Iterator[ScalingCurve]:
    """Every kind of work over its sizes; logs of up to the last of ``lengths`` samples lie in the folder."""
    write_log(folder, lengths[-1])
    for kind, over, sizes in (
        ("identify", "samples", lengths),
        ("identify --method filtered", "samples", lengths),
        ("diagnose", "samples", DIAGNOSIS_SAMPLE_COUNTS),
        ("diagnose", "effects", EFFECT_COUNTS),
        ("closed_loop_batch", "machines", BATCH_SIZES),
    ):
        points: list[ScalingPoint] = []
        for size in sizes:
            print(f"{kind}, {size:,} {over}", file=sys.stderr)
            points.append(measure_in_process(f"{kind} of {over}", size, folder))
        yield ScalingCurve(kind, over, tuple(points))


if __name__ == "__main__":
    typer.run(main)
