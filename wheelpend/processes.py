"""Jobs on all cores, each process with one thread for linear algebra."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context, parent_process
from threading import Thread
from time import monotonic
from typing import TypeVar

T = TypeVar("T")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run_all(jobs: Sequence[Callable[[], T]], progress: Callable[[int, float], None]) -> list[T]:
    """Results of jobs that can be pickled, in order; ``progress`` gets how many are done and the seconds left."""
    found: dict[int, T] = {}
    begin = monotonic()
    for number, result in as_they_end(jobs):
        found[number] = result
        progress(len(found), (monotonic() - begin) / len(found) * (len(jobs) - len(found)))
    return [found[number] for number in range(len(jobs))]


def as_they_end(jobs: Sequence[Callable[[], T]], seconds: float = float("inf")) -> Iterator[tuple[int, T]]:
    """Number and result of each job as it ends; after so many seconds none begins, and those begun are waited for."""
    workers, deadline, waiting = min(cores(), len(jobs)), monotonic() + seconds, iter(enumerate(jobs))
    if cores() == 1 or not jobs:
        yield from ((number, job()) for number, job in waiting if monotonic() < deadline)
        return
    spawn = get_context("spawn")
    with single_threaded(), ProcessPoolExecutor(workers, mp_context=spawn, initializer=end_with_parent) as pool:
        running = {pool.submit(job): number for number, job in islice(waiting, workers)}
        while running:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number = running.pop(future)
                if monotonic() < deadline:  # one at a time, so that none is begun that would be thrown away
                    running.update((pool.submit(job), place) for place, job in islice(waiting, 1))
                yield number, future.result()


def end_with_parent() -> None:
    """Let this worker end when the process that started it does, however that ends."""
    parent = parent_process()
    assert parent is not None, "only a worker has a parent process"

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """How many threads this process may use: one where every core has a process of its own."""
    return 1 if all(os.environ.get(name) == "1" for name in THREADS) else cores()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes started inside use one thread for linear algebra: the cores are taken by the jobs."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value
