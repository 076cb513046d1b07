"""``python -m wheelpend.benchmarks.fleets.overhead``: what a log costs beside its analysis, in time and in memory."""

from __future__ import annotations

import resource
from collections.abc import Mapping
from functools import partial
from time import perf_counter, process_time
from typing import Annotated

import typer

from wheelpend.campaigns.cluster import local_client, results_of
from wheelpend.campaigns.one_log import CampaignSetting, LogResult, LogSource, empty_result
from wheelpend.model.record import Model
from wheelpend.reports.console import print_line

MEASURED_WORKERS, MEASURED_LOGS, FIRST_LOGS = (1, 2, 8), (10, 100, 1000, 10_000), 20
BYTES_PER_KILOBYTE = 1024  # of Linux, as getrusage counts


def analyse_nothing(setting: CampaignSetting, source: LogSource) -> LogResult:
    """The result of a log that takes no time."""
    return empty_result(source)


def main(longest: Annotated[int, typer.Option(min=1, help="Logs of the longest campaign.")] = 10_000) -> None:
    """A table: workers, logs, time by the clock and of the client's processor per log, the client's peak of memory."""
    model = Model.default()
    analyse = partial(analyse_nothing, CampaignSetting(model.text, model.path, None, "identify"))
    print_line("| workers | logs | a log [ms] | of it the client's [ms] | the client's memory at most [MB] |")
    print_line("|---|---|---|---|---|")
    for workers in MEASURED_WORKERS:
        with local_client(workers) as client:
            for _ in results_of(client, analyse, logs(FIRST_LOGS)):  # connections are made
                pass
            for count in (n for n in MEASURED_LOGS if n <= longest):
                begin, begin_process = perf_counter(), process_time()
                for _ in results_of(client, analyse, logs(count)):
                    pass
                each, own = (
                    (t - b) / count * 1e3 for t, b in ((perf_counter(), begin), (process_time(), begin_process))
                )
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / BYTES_PER_KILOBYTE
                print_line(f"| {workers} | {count:,} | {each:.1f} | {own:.1f} | {peak:.0f} |")


def logs(count: int) -> Mapping[int, LogSource]:
    """So many logs, which nobody reads."""
    return {k: k for k in range(count)}


if __name__ == "__main__":
    typer.run(main)
