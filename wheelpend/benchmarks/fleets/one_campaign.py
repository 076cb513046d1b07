"""``python -m wheelpend.benchmarks.fleets.one_campaign``: a campaign of simulated logs in a process of its own, timed.

Prints a line of JSON. The analysis is `identify` of a log of some seconds, or none: then a log costs what a campaign
adds, with a result as large as that of an identification.
"""

from __future__ import annotations

import json
import resource
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Annotated, NamedTuple

import numpy as np
import typer

from wheelpend.campaigns.cluster import Analyse, local_client, results_of
from wheelpend.campaigns.manifest import Listed
from wheelpend.campaigns.one_log import (
    CampaignSetting,
    ErrorCovariance,
    Estimate,
    LogResult,
    LogSource,
    SimulationSpec,
    analyse_log,
    empty_result,
)
from wheelpend.campaigns.result_set import ResultSet
from wheelpend.campaigns.runner import Campaign
from wheelpend.campaigns.summary import summarise
from wheelpend.campaigns.table import write_csv
from wheelpend.model.record import Model
from wheelpend.parallel import single_threaded
from wheelpend.reports.console import print_line

LOG_DURATION_S, FIRST_LOGS_A_WORKER = 4.0, 3
Results = Callable[[dict[int, LogSource]], Iterable[tuple[int, LogResult]]]
BYTES_PER_KILOBYTE, KILOBYTES_PER_MEGABYTE = 1024, 1024
RESULT_PARAMETERS = 9


class CampaignCost(NamedTuple):
    """What a campaign took."""

    workers: int  # 0: this process alone, without a cluster
    logs: int
    seconds: float  # by the clock, from the first log to the last
    client_seconds: float  # of the client's processor in it
    last_seconds: float  # results, summary and table after the last log
    first_seconds: float  # of a first campaign of a few logs, in which kernels and libraries are loaded
    megabytes: float  # by which the client's memory grew after that, at most
    kilobytes_on_disk: float


def analyse_nothing(source: LogSource) -> LogResult:
    """A result of usual size, of made-up numbers, which takes no time."""
    assert isinstance(source, int)
    names = tuple(f"X{k}" for k in range(1, RESULT_PARAMETERS + 1))
    numbers = np.random.default_rng(source).uniform(size=(RESULT_PARAMETERS + 1, RESULT_PARAMETERS))
    matrix = tuple(map(tuple, numbers[1:].tolist()))
    estimates = {n: Estimate(v, 0.1 * v) for n, v in zip(names, numbers[0].tolist(), strict=True)}
    return replace(
        empty_result(source),
        error=1.0,
        noise_floor=1.0,
        parameters=estimates,
        covariance=ErrorCovariance(names, matrix),
    )


def main(
    workers: Annotated[int, typer.Option(min=0, help="Processes; 0 for this one alone.")],
    logs: Annotated[int, typer.Option(min=1, help="How many.")],
    identify: Annotated[bool, typer.Option("--identify", help="Identify each, instead of nothing.")] = False,
) -> None:
    """Time one campaign."""
    model = Model.default()
    played = SimulationSpec("aggressive", LOG_DURATION_S, {})
    setting = CampaignSetting(model.text, model.path, None, "identify", played=played)
    analyse: Analyse = partial(analyse_log, setting) if identify else analyse_nothing
    print_line(json.dumps(campaign_cost(model, played, analyse, workers, logs)._asdict()))


def campaign_cost(model: Model, played: SimulationSpec, analyse: Analyse, workers: int, logs: int) -> CampaignCost:
    """Run a campaign whose results are kept, as the command does, and time its parts."""
    with tempfile.TemporaryDirectory() as folder, _run(analyse, workers) as results:
        begin = perf_counter()
        _keep(
            results, model, played, Path(folder) / "first", FIRST_LOGS_A_WORKER * max(workers, 1)
        )  # kernels, libraries, workers
        first, before = perf_counter() - begin, _peak_megabytes()
        times = _keep(results, model, played, Path(folder) / "whole", logs)
        size = sum(p.stat().st_size for p in (Path(folder) / "whole").rglob("*.parquet")) / BYTES_PER_KILOBYTE
    return CampaignCost(workers, logs, *times, first, _peak_megabytes() - before, size)


def _keep(
    results: Results, model: Model, played: SimulationSpec, folder: Path, logs: int
) -> tuple[float, float, float]:
    """Run a campaign in a folder: seconds of it, of the client's processor in it, and of what follows the last log."""
    begin, begin_client = perf_counter(), process_time()
    known, listed = ResultSet(folder / "c.results", "identify-1"), [Listed(k) for k in range(logs)]
    with known.held(is_new=True):
        for number, result in results({k: k for k in range(logs)}):
            known.add(listed[number], result)
        seconds, client = perf_counter() - begin, process_time() - begin_client
        begin = perf_counter()
        kept = known.results(listed)
    found = Campaign("identify", None, played, kept, summarise(model, played, kept), model)
    write_csv(folder / "campaign.csv", found)
    return seconds, client, perf_counter() - begin


@contextmanager
def _run(analyse: Analyse, workers: int) -> Iterator[Results]:
    """What gives the results of logs as they end."""
    if workers:
        with local_client(workers) as client:
            yield partial(results_of, client, analyse)
    else:
        with single_threaded():
            yield lambda sources: ((number, analyse(source)) for number, source in sources.items())


def _peak_megabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KILOBYTES_PER_MEGABYTE


if __name__ == "__main__":
    typer.run(main)
