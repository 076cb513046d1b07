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
from wheelpend.benchmarks.speed.growth.page import draw_panel
from wheelpend.isolation import import_configured, python_command, python_environment
from wheelpend.parallel import cores
from wheelpend.reports.console import err, exit_on_failure, print_line

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.fleets.scaling -->", "<!-- end of scaling -->"
PICTURE_NAME = "fleet_growth.svg"
EMPTY_SIZES, TRIED_WORKERS = (10, 100, 1000, 10_000), (1, 2, 8)
CLIENT_SIZES = (1000, 10_000, 100_000)  # without workers, for what the client's memory and its last steps take
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
        client = [_measured(0, n) for n in CLIENT_SIZES]
        text = section_text(efficient, empty, client)
        print_line(text)
        if out:
            draw_growth(out.parent / PICTURE_NAME, empty, client)
            write_between(out, out.read_text(encoding="utf-8"), BEGIN_MARK, END_MARK, text)


def _measured(workers: int, logs: int, *options: str) -> CampaignCost:
    """The cost of one campaign, in a process of its own."""
    module = "wheelpend.benchmarks.fleets.one_campaign"
    command = python_command("-m", module, "--workers", str(workers), "--logs", str(logs), *options)
    said = subprocess.run(command, env=python_environment(), check=True, stdout=subprocess.PIPE, text=True).stdout
    found = CampaignCost(**json.loads(said.splitlines()[-1]))
    err.print(f"{workers} workers, {logs} logs {' '.join(options)}: {found.seconds:.1f} s", markup=False)
    return found


def draw_growth(path: Path, empty: Sequence[CampaignCost], client: Sequence[CampaignCost]) -> None:
    """Time over the number of logs, a curve for each number of workers and the client's last steps; and its memory."""
    matplotlib = import_configured("matplotlib")  # late: who measures one campaign needs none
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    times, memory = figure.subplots(1, 2)
    draw_panel(times, time_curves(empty, client), "seconds")
    draw_panel(memory, time_curves((), client), "megabytes")
    for axes, label in ((times, "time [s]"), (memory, "memory of the client [MB]")):
        axes.set_xlabel("logs")
        axes.set_ylabel(label)
    with matplotlib.rc_context({"svg.hashsalt": path.name}):
        figure.savefig(path, metadata={"Date": None})


def time_curves(empty: Sequence[CampaignCost], client: Sequence[CampaignCost]) -> list[ScalingCurve]:
    """Time over the number of logs, by workers, and of what follows the last log."""
    found = []
    for workers in dict.fromkeys(c.workers for c in empty):
        own = [c for c in empty if c.workers == workers]
        name = f"{workers} {'worker' if workers == 1 else 'workers'}"
        found.append(ScalingCurve(name, "logs", tuple(ScalingPoint(c.logs, c.seconds, c.megabytes) for c in own)))
    points = tuple(ScalingPoint(c.logs, c.last_seconds, c.megabytes) for c in client)
    return [*found, ScalingCurve("results, summary and table", "logs", points)]


def section_text(
    efficient: Sequence[CampaignCost], empty: Sequence[CampaignCost], client: Sequence[CampaignCost]
) -> str:
    """What was measured, in Markdown, and what a million logs would take by that."""
    alone = next(c for c in efficient if not c.workers)
    head = (
        f"`identify` of {alone.logs} simulated logs of {LOG_DURATION_S:g} s on {cores()} cores. Efficiency is the "
        "time of one process over that of so many workers, for each core that they have; the first few "
        "logs, with which every process loads its kernels, stand by themselves:"
    )
    columns = ("workers", "time [s]", "logs a second", "efficiency", "first few logs [s]")
    first = markdown_table(columns, [_efficiency_row(c, alone) for c in efficient])
    growth = ("workers", "logs", "a log [ms]", "of it the client's [ms]")
    second = markdown_table(growth, [_growth_row(c) for c in empty])
    picture = f"![Time and memory of a campaign over its logs]({PICTURE_NAME})"
    words = ("Logs that are not analysed at all, each with a result of usual size that is kept in Parquet: what a "
             "campaign adds.")  # fmt: skip
    alike = ("logs", "results, summary and table after the last [s]", "memory [MB]", "on disk, a log [kB]")
    third = markdown_table(alike, [_client_row(c) for c in client])
    of_client = ("The client alone, with such results and no workers. Memory is what it took beyond what it had after "
                 "a first few logs; 2000 results at a time are read from their files.")  # fmt: skip
    command = "`python -m wheelpend.benchmarks.fleets.scaling --out docs/fleets.md` writes this."
    outlook = share_text(alone, empty), million_text(alone, empty, client)
    return "\n\n".join((head, first, words, second, of_client, third, picture, *outlook, command))


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
    return str(found.workers), f"{found.logs:,}", f"{each:.1f}", f"{client:.1f}"


def _client_row(found: CampaignCost) -> tuple[str, ...]:
    disk = f"{found.kilobytes_on_disk / found.logs:.2f}"
    return f"{found.logs:,}", f"{found.last_seconds:.1f}", f"{found.megabytes:.0f}", disk


def efficiency(found: CampaignCost, alone: CampaignCost) -> float:
    """Share of what its cores could do that a campaign does."""
    return alone.seconds / (found.seconds * min(max(found.workers, 1), cores()))


def million_text(alone: CampaignCost, empty: Sequence[CampaignCost], client: Sequence[CampaignCost]) -> str:
    """What 10⁶ logs would take, from these figures."""
    largest = max(empty, key=lambda c: (c.logs, -c.workers))
    analysis, handing = alone.seconds / alone.logs, largest.client_seconds / largest.logs
    smaller, larger = sorted(client, key=lambda c: c.logs)[-2:]
    memory = (larger.megabytes - smaller.megabytes) / (larger.logs - smaller.logs)
    disk, last = larger.kilobytes_on_disk / larger.logs, larger.last_seconds / larger.logs
    return (
        f"**A million logs**, of no stated units, by these figures and not tried: {_hours(analysis):,.0f} hours of one "
        f"core for the analyses. One client can hand out and write down {1.0 / handing:.0f} logs a second, which is "
        f"{_hours(handing):.1f} hours at least, and work for {analysis / handing:.0f} cores. It needs some "
        f"{memory * OUTLOOK_LOGS / 1e3:.1f} GB of memory, for names, places and the numbers of the summary, not for "
        f"the results; {disk * OUTLOOK_LOGS / 1e6:.1f} GB of Parquet; and {_hours(last):.1f} hours for summary and "
        "table. Beyond that split the manifest, and query the data sets together."
    )


def _hours(seconds_a_log: float) -> float:
    """Hours of a million logs."""
    return OUTLOOK_LOGS * seconds_a_log / SECONDS_PER_HOUR


if __name__ == "__main__":
    typer.run(main)
