"""A campaign's logs on Dask: on a cluster of this machine's cores, or on one that is there already.

A log is a task of its own. A worker that dies is replaced and its log tried again; a log that took several workers with
it, alone at last, has a failure, and the others go on. A scheduler that is gone is waited for, and asked again for what
it owes.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from itertools import islice
from multiprocessing import active_children
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

import wheelpend
from wheelpend.campaigns.one_log import CampaignSetting, LogResult, LogSource, analyse_log, empty_result
from wheelpend.errors import Failure
from wheelpend.isolation import import_configured, starting_workers
from wheelpend.kernels.cache import derivation_fingerprint
from wheelpend.parallel import (
    BLAS_THREAD_VARIABLES,
    SINGLE_THREAD_VARIABLE,
    cores,
    single_threaded,
    without_interruption,
)

if TYPE_CHECKING:
    from distributed import Client

LOCALHOST_ADDRESS = "127.0.0.1"
LOGS_AHEAD = 2  # tasks per worker that are with the scheduler: it never waits, and holds few
MAX_LOST_WORKERS = 1  # that a log was with, before it is tried alone
NO_WORKER_OUTLIVED = (
    "a process that analyses a log must live to its end, but each one that had this log was ended from outside; "
    "was there too little memory? The same command tries this log again."
)
WAIT_FOR_WORKERS_S = 60.0
WAIT_FOR_SCHEDULER_S = 600.0
RECONNECT_INTERVAL_S = 2.0
CONNECT_TIMEOUT_S = 10.0
SILENT_LEVEL = 60  # above every level of `logging`: what goes wrong is said by the results
LOCAL_CONFIGURATION = {
    "distributed.scheduler.http.routes": [],  # no pages
    "distributed.worker.http.routes": [],
    "distributed.scheduler.allowed-failures": MAX_LOST_WORKERS,
    "distributed.worker.daemon": False,
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.profile.enabled": False,
}

Say = Callable[[str], None]
Analyse = Callable[[LogSource], LogResult]


def analyses_as_completed(
    setting: CampaignSetting, sources: Mapping[int, LogSource], scheduler: str | None, say: Say
) -> Generator[tuple[int, LogResult], None, None]:
    """Number and result of each log as it ends, on a local cluster or that of a ``scheduler`` (its address).

    A single log, or a single core, needs no cluster. Raises Failure where the scheduler cannot be reached, or its
    workers do not have this code.
    """
    analyse, workers = partial(analyse_log, setting), min(cores(), len(sources))
    if scheduler is not None:
        yield from _results_of_scheduler(scheduler, analyse, dict(sources), say)
    elif workers > 1:
        with local_client(workers) as client:
            yield from results_of(client, analyse, sources)
    else:
        yield from ((number, analyse(source)) for number, source in sources.items())


@contextmanager
def local_client(workers: int) -> Iterator[Client]:
    """A client of a cluster of so many processes, each with one thread, that ends with this process.

    They listen on this machine alone, encrypted, with certificates of their own; there are no web pages. Nothing of the
    current folder is on their path. Where the caller is interrupted they are ended at once, and what their connections
    say of that is not shown: the cluster itself is silent only until it begins to close its loop.
    """
    distributed, dask = import_configured("distributed"), import_configured("dask")
    from distributed.utils import silence_logging_cmgr

    others = set(active_children())
    variables = dict.fromkeys((*BLAS_THREAD_VARIABLES, SINGLE_THREAD_VARIABLE), "1")
    with (
        TemporaryDirectory(prefix="wheelpend-", ignore_cleanup_errors=True) as folder,
        dask.config.set(LOCAL_CONFIGURATION),
        silence_logging_cmgr(SILENT_LEVEL),
        single_threaded(),
        starting_workers(),  # also while it runs: who is replaced starts in the same way
    ):
        variables["TMPDIR"] = folder  # what a worker that is killed had fetched goes with the folder
        with without_interruption():
            cluster = distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, memory_limit=0, env=variables,
                host=LOCALHOST_ADDRESS, protocol="tls://", security=distributed.Security.temporary(),
                dashboard_address=None, scheduler_kwargs={"dashboard_address": f"{LOCALHOST_ADDRESS}:0"},
                local_directory=folder, silence_logs=SILENT_LEVEL,
            )  # fmt: skip
        try:
            with cluster, distributed.Client(cluster, set_as_default=False) as client:
                try:
                    yield client
                except BaseException:
                    _end_at_once(cluster, set(active_children()) - others)
                    raise
        finally:
            for worker in set(active_children()) - others:
                worker.terminate()


def _end_at_once(cluster: Any, workers: set[Any]) -> None:
    """End the workers of a cluster in the middle of their work."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
    for worker in workers:
        worker.kill()


def _results_of_scheduler(
    address: str, analyse: Analyse, left: dict[int, LogSource], say: Say
) -> Generator[tuple[int, LogResult], None, None]:
    """Results from the cluster at an address; where its scheduler restarts, it is asked again for what is left."""
    patience = 0.0  # of the first connection: an address at which nobody answers is a mistake
    while left:
        with _client_of(address, patience) as client:
            check_workers(client, address)
            try:
                for number, result in results_of(client, analyse, left):
                    del left[number]
                    yield number, result
            except (CancelledError, OSError, TimeoutError):
                say(f"the scheduler at {address} is gone: waiting up to {WAIT_FOR_SCHEDULER_S / 60:g} min for it")
        patience = WAIT_FOR_SCHEDULER_S


@contextmanager
def _client_of(address: str, patience: float) -> Iterator[Client]:
    """A client of a scheduler, which is waited for up to so many seconds; raises Failure where it does not answer."""
    distributed = import_configured("distributed")
    deadline = monotonic() + patience
    while True:
        try:
            reach(address)  # a client that reaches nobody would keep its thread
            client = distributed.Client(address, set_as_default=False, timeout=f"{CONNECT_TIMEOUT_S:g}s")
            break
        except (OSError, TimeoutError, TypeError, ValueError) as error:
            if monotonic() > deadline or isinstance(error, (TypeError, ValueError)):
                raise Failure(f"--scheduler must be the address of a Dask scheduler, like tcp://host:8786, but "
                              f"{address} is not, or does not answer: {error}") from None  # fmt: skip
            sleep(RECONNECT_INTERVAL_S)
    try:
        yield client
    finally:
        with suppress(CancelledError, OSError, TimeoutError):
            client.close()


def reach(address: str) -> None:
    """Raise OSError where nobody listens at an address, and ValueError where it is none."""
    from distributed.comm.addressing import parse_address, parse_host_port

    scheme, place = parse_address(address, strict=True)
    if scheme not in ("tcp", "tls"):
        raise ValueError(f"it begins with {scheme}://")
    socket.create_connection(parse_host_port(place), timeout=CONNECT_TIMEOUT_S).close()


def check_workers(client: Client, address: str) -> None:
    """Raise Failure unless the scheduler has workers, and every one of them has this code."""
    try:
        client.wait_for_workers(1, timeout=WAIT_FOR_WORKERS_S)
        there = client.run(code_version, on_error="return")
    except TimeoutError:
        raise Failure(f"The scheduler must have workers, but {address} has none. Start some beside it.") from None
    own = code_version()
    if other := next((name for name, found in there.items() if found != own), None):
        raise Failure(f"Every worker must have this wheelpend, {own}, but the one at {other} has: {there[other]}. "
                      "Install the same there.")  # fmt: skip


def code_version() -> str:
    """Version of this package, and of what it derives kernels by."""
    return f"{wheelpend.__version__} {derivation_fingerprint()[:12]}"


def results_of(
    client: Client, analyse: Analyse, sources: Mapping[int, LogSource]
) -> Generator[tuple[int, LogResult], None, None]:
    """Number and result of each log as it ends; only a few are with the scheduler at a time."""
    from distributed import as_completed

    waiting, running, futures = iter(list(sources.items())), {}, as_completed(loop=client.loop)
    suspects = {}  # were with a worker that died: because of one of them, or of a neighbour

    def submit(count: int) -> None:
        for number, source in islice(waiting, count):
            future = client.submit(analyse, source, pure=False)
            running[future.key] = number, source
            futures.add(future)

    submit(LOGS_AHEAD * len(client.scheduler_info(n_workers=-1)["workers"]))
    for future in futures:
        number, source = running.pop(future.key)
        if (result := _result_or_none(future)) is None:
            suspects[number] = source
        else:
            yield number, result
        submit(1)
    for number, source in suspects.items():
        alone = client.submit(analyse, source, pure=False)
        yield number, _result_or_none(alone) or replace(empty_result(source), failure=NO_WORKER_OUTLIVED)


def _result_or_none(future: Any) -> LogResult | None:
    """The result of a task, or None where workers died that had it."""
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except KilledWorker:
        return None
    finally:
        future.release()
