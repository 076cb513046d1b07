"""Jobs on all cores, each process with one thread for linear algebra."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from multiprocessing import active_children, get_context, parent_process
from threading import Lock, Thread, current_thread, main_thread
from time import monotonic
from typing import TypeVar

T = TypeVar("T")
BLAS_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SINGLE_THREAD_VARIABLE = "WHEELPEND_THREADS"  # 1 where this process shall use no threads of its own


def run_all(jobs: Sequence[Callable[[], T]], progress: Callable[[int, float], None]) -> list[T]:
    """Results of jobs that can be pickled, in order; ``progress`` gets how many are done and the seconds left."""
    found: dict[int, T] = {}
    begin = monotonic()
    for number, result in results_as_completed(jobs):
        found[number] = result
        progress(len(found), (monotonic() - begin) / len(found) * (len(jobs) - len(found)))
    return [found[number] for number in range(len(jobs))]


def results_as_completed(
    jobs: Sequence[Callable[[], T]], seconds: float = float("inf")
) -> Generator[tuple[int, T], None, None]:
    """Number and result of each job as it ends; after so many seconds none begins, and those begun are waited for.

    Where the caller is interrupted or wants no more, the workers are ended at once.
    """
    workers, deadline, waiting = min(cores(), len(jobs)), monotonic() + seconds, iter(enumerate(jobs))
    if cores() == 1 or not jobs:
        yield from ((number, job()) for number, job in waiting if monotonic() < deadline)
        return
    spawn, others = get_context("spawn"), set(active_children())
    with single_threaded(), ProcessPoolExecutor(workers, mp_context=spawn, initializer=end_with_parent) as pool:
        try:
            running = submit_jobs(pool, islice(waiting, workers))
            while running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    number = running.pop(future)
                    if monotonic() < deadline:  # one at a time, so that none is begun that would be thrown away
                        running.update(submit_jobs(pool, islice(waiting, 1)))
                    yield number, future.result()
        except BaseException:
            for worker in set(active_children()) - others:
                worker.terminate()
            raise


def submit_jobs(pool: ProcessPoolExecutor, jobs: Iterable[tuple[int, Callable[[], T]]]) -> dict[Future[T], int]:
    """Submit numbered jobs. A worker that starts meanwhile never hears Ctrl-C: who asked for it ends it."""
    if current_thread() is not main_thread():  # where no signal arrives, nor may be set aside
        return {pool.submit(job): number for number, job in jobs}
    heard = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        return {pool.submit(job): number for number, job in jobs}
    finally:
        signal.signal(signal.SIGINT, heard)


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
    return 1 if os.environ.get(SINGLE_THREAD_VARIABLE) == "1" else cores()


class ThreadBudget:
    """Threads that each do a work of their own: the cores are theirs, and a work that is left alone gets them all."""

    def __init__(self) -> None:
        self._running_jobs, self._lock = 0, Lock()

    @contextmanager
    def joined(self) -> Iterator[None]:
        """Have a work of one's own while inside."""
        self._change_running_jobs(1)
        try:
            yield
        finally:
            self._change_running_jobs(-1)

    def share(self) -> int:
        """Threads among which a work may be divided now."""
        return max(1, threads() // max(1, self._running_jobs))

    def _change_running_jobs(self, by: int) -> None:
        with self._lock:
            self._running_jobs += by


thread_budget = ThreadBudget()


class KernelPool(ThreadPoolExecutor):
    """Works in threads, as many as this process may use: the kernels release the interpreter's lock."""

    def __init__(self) -> None:
        super().__init__(max_workers=threads())

    def submit(self, work, /, *args, **kwargs):
        """Begin a work as soon as a thread is free for it."""
        return super().submit(run_in_thread_budget, work, *args, **kwargs)


def run_in_thread_budget(job: Callable[..., T], *args, **kwargs) -> T:
    """Do a work as one of the company."""
    with thread_budget.joined():
        return job(*args, **kwargs)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes started inside use one thread, for linear algebra too: the cores are taken by the jobs."""
    before = {name: os.environ.get(name) for name in (*BLAS_THREAD_VARIABLES, SINGLE_THREAD_VARIABLE)}
    os.environ.update(dict.fromkeys(before, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value
