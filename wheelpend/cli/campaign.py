"""`wheelpend campaign` around a campaign: its files, and an interruption."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from wheelpend.campaigns.manifest import Listed, listed_logs
from wheelpend.campaigns.result_set import is_result_set
from wheelpend.campaigns.runner import Campaign, campaign
from wheelpend.campaigns.table import is_campaign_table, write_csv
from wheelpend.campaigns.text import campaign_text
from wheelpend.errors import Failure
from wheelpend.interruption import note_resumable
from wheelpend.logs.read import check_file
from wheelpend.model.record import Model
from wheelpend.reports.console import print_result, print_text, print_warnings, progress
from wheelpend.simulation.hidden import parse_hidden

RESULTS_SUFFIX = ".results"


class SimulationRequest(NamedTuple):
    """Logs to simulate, as the command line has them."""

    seeds: int
    command: str
    duration: float | None  # s
    hide: list[str]


class CampaignRequest(NamedTuple):
    """A campaign, as the command line has it."""

    source: SimulationRequest | Sequence[str]  # paths, patterns, addresses
    do: str
    method: str
    tau: tuple[float, ...] | Literal["auto"] | None  # s
    out: Path
    differ: tuple[str, ...] = ()  # two units
    report: Path | None = None  # the page on the fleet
    then: str | None = None  # asked of the units that stand out
    scheduler: str | None = None  # address of a Dask cluster

    @property
    def results(self) -> Path:
        """Folder of the results, those of earlier campaigns too."""
        return self.out.with_name(f"{self.out.stem}{RESULTS_SUFFIX}")


def run_campaign(model: Model, request: CampaignRequest, json: str | None) -> Campaign:
    """Run a campaign, or go on with one, write its table, print its summary and return it."""
    out = request.out
    if out.name == request.results.name or not out.stem:
        raise Failure(f"--out must be a file beside the folder {request.results} of the results, but it is that. "
                      "Name a .csv.")  # fmt: skip
    note_resumable(request.results, "the same command goes on from there.")
    with progress("reading") as update:
        result = campaign_result(model, request, update)
    write_csv(out, result)
    check_some_log_usable(result, out)
    print_result(result, json, lambda: print_text(campaign_text(result, out)))
    if request.report is not None:
        from wheelpend.campaigns.fleet_page import write_fleet_page  # imported late: loads Plotly

        write_fleet_page(result, request.report, out, shlex.join(["wheelpend", *sys.argv[1:]]))
    return result


def campaign_result(model: Model, request: CampaignRequest, update: Callable[[str], None]) -> Campaign:
    """Answers of simulated logs, or of measured ones."""
    source, out = request.source, request.out
    question: dict[str, Any] = {
        "do": request.do,
        "method": request.method,
        "tau": request.tau,
        "keep": request.results,
        "scheduler": request.scheduler,
        "progress": update,
    }
    if not isinstance(source, SimulationRequest):
        return campaign(
            model, measured_logs(listed_logs(source), out), differ=request.differ, then=request.then, **question
        )
    experiment: dict[str, Any] = {
        "command": source.command,
        "duration": source.duration,
        "hide": parse_hidden(source.hide),
    }
    return campaign(model, seeds=range(source.seeds), **experiment, **question)


def measured_logs(logs: Sequence[Listed], out: Path) -> list[Listed]:
    """The logs without what earlier campaigns wrote beside them; raises Failure where a log would be written over."""
    tables, kept = list[Path](), list[Listed]()
    for one in logs:
        is_table = isinstance(one.log, Path) and (is_campaign_table(one.log) or is_result_set(one.log))
        tables.append(one.log) if is_table else kept.append(one)
    if tables:
        print_warnings([f"{', '.join(map(str, tables))} is left out: it is what a campaign wrote."])
    if os.path.realpath(out) in {os.path.realpath(one.log) for one in kept if isinstance(one.log, Path)}:
        raise Failure(f"--out must be another file than the logs, but {out} is one of them. Name another.")
    say_what_is_missing([one.log for one in kept])
    return kept


def say_what_is_missing(logs: Sequence[Path | str]) -> None:
    """Warn of files that are not there or cannot be read, before minutes of work; raises Failure where none can be.

    What is behind an address is seen when it is fetched.
    """
    missing = [why for log in logs if isinstance(log, Path) and (why := _why_unreadable(log))]
    if logs and len(missing) == len(logs):
        raise Failure(f"At least one log must be of use, but none of {len(logs)} is. {missing[0]}")
    print_warnings([f"{why} The other logs go on." for why in missing])


def _why_unreadable(log: Path) -> str:
    try:
        check_file(log)
    except Failure as failure:
        return str(failure)
    return ""


def check_some_log_usable(result: Campaign, out: Path) -> None:
    """Raise Failure where no log could be used."""
    if result.summary.failed == result.summary.logs:
        first = result.logs[0]
        raise Failure(f"At least one log must be of use, but none of {len(result.logs)} is; {out} has every message. "
                      f"Of {first.log}: {first.failure}")  # fmt: skip
