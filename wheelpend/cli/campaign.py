"""What `wheelpend campaign` does around a campaign: files, and an interruption."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import typer

from wheelpend.campaigns.runner import Campaign, campaign
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.model.record import Model
from wheelpend.reports.console import err, print_result, print_warnings, progress
from wheelpend.reports.text.campaign import csv_text, is_campaign_table, print_campaign
from wheelpend.simulation.hidden import parse_hidden

INTERRUPTED_EXIT_CODE = 130  # exit code, as of a program that Ctrl-C ends


class SimulationRequest(NamedTuple):
    """Logs to simulate, as the command line has them."""

    seeds: int
    command: str
    duration: float | None  # s
    hide: list[str]


def run_campaign(
    model: Model,
    source: SimulationRequest | Sequence[Path],
    do: str,
    method: str,
    tau: Any,
    out: Path,
    json: str | None,
) -> None:
    """Run a campaign, or go on with one, write its table and print its summary."""
    keep = out.with_name(f"{out.name}.partial")
    question: dict[str, Any] = {"do": do, "method": method, "tau": tau, "keep": keep}
    try:
        with progress("reading") as update:
            if isinstance(source, SimulationRequest):
                hidden = parse_hidden(source.hide)
                question |= {"command": source.command, "duration": source.duration, "hide": hidden}
                result = campaign(model, seeds=range(source.seeds), progress=update, **question)
            else:
                result = campaign(model, measured_logs(source, out), progress=update, **question)
    except KeyboardInterrupt:
        kept = f" What came so far is in {keep}: the same command goes on from there." if keep.exists() else ""
        err.print(f"Interrupted.{kept}", markup=False)
        raise typer.Exit(INTERRUPTED_EXIT_CODE) from None
    write_text(out, csv_text(result))
    keep.unlink(missing_ok=True)
    check_some_log_usable(result, out)
    print_result(result, json, lambda: print_campaign(result, out))


def measured_logs(logs: Sequence[Path], out: Path) -> list[Path]:
    """The logs without what earlier campaigns wrote beside them; raises Failure where a log would be written over."""
    tables = [log for log in logs if is_campaign_table(log)]
    kept = [log for log in logs if log not in tables]
    if tables:
        print_warnings([f"{', '.join(map(str, tables))} is left out: it is what a campaign wrote."])
    if out.resolve() in [log.resolve() for log in kept]:
        raise Failure(f"--out must be another file than the logs, but {out} is one of them. Name another.")
    return kept


def check_some_log_usable(result: Campaign, out: Path) -> None:
    """Raise Failure where no log could be used."""
    if result.summary.failed == result.summary.logs:
        first = result.logs[0]
        raise Failure(f"At least one log must be of use, but none of {len(result.logs)} is; {out} has every message. "
                      f"Of {first.log}: {first.failure}")  # fmt: skip
