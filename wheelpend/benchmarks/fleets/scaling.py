"""``python -m wheelpend.benchmarks.fleets.scaling``: what a campaign costs, on an idle machine."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.fleets.one_campaign import LOG_DURATION_S, CampaignCost
from wheelpend.benchmarks.markdown import markdown_table, write_between
from wheelpend.benchmarks.speed.growth.curve import ScalingCurve, ScalingPoint
from wheelpend.benchmarks.speed.growth.page import draw
from wheelpend.isolation import python_command, python_environment
from wheelpend.parallel import cores
from wheelpend.reports.console import err, exit_on_failure, print_line

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.fleets.scaling -->", "<!-- end of scaling -->"
PICTURE_NAME = "fleet_growth.svg"
EMPTY_SIZES, TRIED_WORKERS = (10, 100, 1000, 10_000), (1, 2, 8)
IDENTIFIED_LOGS = 60
OUTLOOK_LOGS = 1_000_000
SECONDS_PER_HOUR = 3600.0


def main(
    longest: Annotated[int, typer.Option(min=100, help="Logs of the longest campaign without an analysis.")] = 10_000,
    identified: Annotated[int, typer.Option(min=2, help="Logs of those that identify.")] = IDENTIFIED_LOGS,
    out: Annotated[Path | None, typer.Option(help="Write tables and picture into this page, docs/fleets.md.")] = None,
) -> None:
    """Measure each campaign in a process of its own; takes some twenty minutes on two idle cores."""
    with exit_on_failure():
        efficient = [_measured(w, identified, "--identify") for w in (0, *TRIED_WORKERS)]
        empty = [_measured(w, n) for w in TRIED_WORKERS for n in EMPTY_SIZES if n <= longest]
        text = section_text(efficient, empty)
        print_line(text)
        if out:
            draw(out.parent / PICTURE_NAME, curves(empty))
            write_between(out, out.read_text(encoding="utf-8"), BEGIN_MARK, END_MARK, text)


def _measured(workers: int, logs: int, *options: str) -> CampaignCost:
    """The cost of one campaign, in a process of its own."""
    module = "wheelpend.benchmarks.fleets.one_campaign"
    command = python_command("-m", module, "--workers", str(workers), "--logs", str(logs), *options)
    said = subprocess.run(command, env=python_environment(), check=True, stdout=subprocess.PIPE, text=True).stdout
    found = CampaignCost(**json.loads(said.splitlines()[-1]))
    err.print(f"{workers} workers, {logs} logs {' '.join(options)}: {found.seconds:.1f} s", markup=False)
    return found


def curves(empty: Sequence[CampaignCost]) -> list[ScalingCurve]:
    """Time and memory over the number of logs: a curve for each number of workers, and what follows the last log."""
    found = []
    for workers in dict.fromkeys(c.workers for c in empty):
        own = [c for c in empty if c.workers == workers]
        name = f"{workers} {'worker' if workers == 1 else 'workers'}"
        found.append(ScalingCurve(name, "logs", tuple(ScalingPoint(c.logs, c.seconds, c.megabytes) for c in own)))
    last = [c for c in empty if c.workers == empty[0].workers]
    points = tuple(ScalingPoint(c.logs, c.last_seconds, c.megabytes) for c in last)
    return [*found, ScalingCurve("results, summary, table", "logs", points)]


def section_text(efficient: Sequence[CampaignCost], empty: Sequence[CampaignCost]) -> str:
    """What was measured, in Markdown, and what a million logs would take by that."""
    alone = next(c for c in efficient if not c.workers)
    head = (
        f"`identify` of {alone.logs} simulated logs of {LOG_DURATION_S:g} s on {cores()} cores. Efficiency is the "
        "time of one process over that of so many workers, for each core that they have; the first few "
        "logs, with which every process loads its kernels, stand by themselves:"
    )
    columns = ("workers", "time [s]", "logs a second", "efficiency", "first few logs [s]")
    first = markdown_table(columns, [_efficiency_row(c, alone) for c in efficient])
    growth = ("workers", "logs", "a log [ms]", "of it the client's [ms]", "results, summary and table [s]",
               "memory of the client [MB]", "on disk, a log [kB]")  # fmt: skip
    second = markdown_table(growth, [_growth_row(c) for c in empty])
    picture = f"![Time and memory of a campaign over its logs]({PICTURE_NAME})"
    words = ("Logs that are not analysed at all, each with a result of usual size that is kept in Parquet: what a "
             "campaign adds. Memory is what the client took beyond what it had when its cluster stood.")  # fmt: skip
    command = "`python -m wheelpend.benchmarks.fleets.scaling --out docs/fleets.md` writes this."
    parts = (head, first, words, second, picture, share_text(alone, empty), million_text(alone, empty), command)
    return "\n\n".join(parts)


def share_text(alone: CampaignCost, empty: Sequence[CampaignCost]) -> str:
    """What a campaign adds to an analysis."""
    largest = max(empty, key=lambda c: (c.logs, -c.workers))
    each, analysis = largest.seconds / largest.logs, alone.seconds / alone.logs
    return (
        f"A campaign adds {1e3 * each:.0f} ms a log, {100.0 * each / analysis:.1f} % of what the `identify` of such a "
        "short one takes in one process (10 % is the aim); of longer logs and of a `diagnose` it is less."
    )


def _efficiency_row(found: CampaignCost, alone: CampaignCost) -> tuple[str, ...]:
    workers = str(found.workers) if found.workers else "none: one process"
    share = f"{100.0 * efficiency(found, alone):.0f} %"
    return workers, f"{found.seconds:.1f}", f"{found.logs / found.seconds:.2f}", share, f"{found.first_seconds:.1f}"


def _growth_row(found: CampaignCost) -> tuple[str, ...]:
    each, client = (1e3 * t / found.logs for t in (found.seconds, found.client_seconds))
    last, disk = f"{found.last_seconds:.2f}", f"{found.kilobytes_on_disk / found.logs:.2f}"
    return str(found.workers), f"{found.logs:,}", f"{each:.1f}", f"{client:.1f}", last, f"{found.megabytes:.0f}", disk


def efficiency(found: CampaignCost, alone: CampaignCost) -> float:
    """Share of what its cores could do that a campaign does."""
    return alone.seconds / (found.seconds * min(max(found.workers, 1), cores()))


def million_text(alone: CampaignCost, empty: Sequence[CampaignCost]) -> str:
    """What 10⁶ logs would take, from these figures."""
    largest = max(empty, key=lambda c: (c.logs, -c.workers))
    smaller = next(c for c in empty if c.workers == largest.workers and c.logs < largest.logs)
    analysis, client = alone.seconds / alone.logs, largest.client_seconds / largest.logs
    memory = (largest.megabytes - smaller.megabytes) / (largest.logs - smaller.logs)
    disk, last = largest.kilobytes_on_disk / largest.logs, largest.last_seconds / largest.logs
    return (
        f"**A million logs**, of no stated units, by these figures and not tried: {_hours(analysis):,.0f} hours of one "
        f"core for the analyses. One client can hand out and write down {1.0 / client:.0f} logs a second, which is "
        f"{_hours(client):.1f} hours at least, and work for {analysis / client:.0f} cores. It needs some "
        f"{memory * OUTLOOK_LOGS / 1e3:.1f} GB of memory, for names, places and the numbers of the summary, not for "
        f"the results; {disk * OUTLOOK_LOGS / 1e6:.1f} GB of Parquet; and {_hours(last):.1f} hours for summary and "
        "table. Beyond that split the manifest, and query the data sets together."
    )


def _hours(seconds_a_log: float) -> float:
    """Hours of a million logs."""
    return OUTLOOK_LOGS * seconds_a_log / SECONDS_PER_HOUR


if __name__ == "__main__":
    typer.run(main)
