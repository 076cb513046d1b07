"""Jobs on all cores, each process with one thread for linear algebra."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from functools import wraps
from itertools import islice
from multiprocessing import active_children, get_context, parent_process
from threading import Lock, Thread, current_thread, main_thread
from time import monotonic
from typing import ParamSpec, TypeVar

from wheelpend.isolation import starting_workers

T = TypeVar("T")
Arguments = ParamSpec("Arguments")
BLAS_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SINGLE_THREAD_VARIABLE = "WHEELPEND_THREADS"  # 1 where this process may start no threads


def run_all(jobs: Sequence[Callable[[], T]], progress: Callable[[int, float], None]) -> list[T]:
    """Results of picklable jobs, in their order; ``progress`` gets the number of finished ones and the seconds left."""
    results: dict[int, T] = {}
    begin = monotonic()
    for number, result in results_as_completed(jobs):
        results[number] = result
        progress(len(results), (monotonic() - begin) / len(results) * (len(jobs) - len(results)))
    return [results[number] for number in range(len(jobs))]


def results_as_completed(
    jobs: Sequence[Callable[[], T]], seconds: float = float("inf"), processes: int | None = None
) -> Generator[tuple[int, T], None, None]:
    """Number and result of each job as it ends; after a time limit [s] none is started, and running ones are awaited.

    On all cores, or in so many ``processes``; one is this process itself. Where the caller is interrupted or stops
    iterating, the workers are terminated at once.
    """
    if not jobs or seconds <= 0.0:
        return
    most = processes or cores()
    workers, deadline, waiting = min(most, len(jobs)), monotonic() + seconds, iter(enumerate(jobs))
    if most == 1:
        yield from ((number, job()) for number, job in waiting if monotonic() < deadline)
        return
    others = set(active_children())
    with single_threaded(), process_pool(workers) as pool:
        try:
            running = submit_jobs(pool, islice(waiting, workers))
            while running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    number = running.pop(future)
                    if monotonic() < deadline:  # one at a time, so that none is started whose result would be dropped
                        running.update(submit_jobs(pool, islice(waiting, 1)))
                    yield number, future.result()
        except BaseException:
            for worker in set(active_children()) - others:
                worker.terminate()
            raise


def process_pool(workers: int) -> ProcessPoolExecutor:
    """An executor whose processes are started afresh and end with this one."""
    with starting_workers():  # a process that tracks shared resources starts now
        return ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=end_with_parent)


def submit_jobs(pool: ProcessPoolExecutor, jobs: Iterable[tuple[int, Callable[[], T]]]) -> dict[Future[T], int]:
    """Submit numbered jobs. Workers that start meanwhile ignore Ctrl-C: the parent process terminates them."""
    with starting_workers(), without_interruption():
        return {pool.submit(job): number for number, job in jobs}


@contextmanager
def without_interruption() -> Iterator[None]:
    """Processes that start inside ignore Ctrl-C, and so does this one meanwhile."""
    if current_thread() is not main_thread():  # only the main thread receives signals and may set handlers
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def end_with_parent() -> None:
    """Make this worker process exit when its parent process does, however that ends."""
    parent = parent_process()
    assert parent is not None, "only a worker has a parent process"

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def cores() -> int:
    """Number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Number of threads that this process may use: one where every core has a process of its own."""
    return 1 if os.environ.get(SINGLE_THREAD_VARIABLE) == "1" else cores()


class ThreadBudget:
    """The threads of this process, divided evenly among its running jobs; a single job gets all of them."""

    def __init__(self) -> None:
        self._running_jobs, self._lock = 0, Lock()

    @contextmanager
    def joined(self) -> Iterator[None]:
        """Count as a running job while inside."""
        self._change_running_jobs(1)
        try:
            yield
        finally:
            self._change_running_jobs(-1)

    def share(self) -> int:
        """Number of threads among which a job may divide its work now."""
        return max(1, threads() // max(1, self._running_jobs))

    def _change_running_jobs(self, by: int) -> None:
        with self._lock:
            self._running_jobs += by


thread_budget = ThreadBudget()


class KernelPool(ThreadPoolExecutor):
    """A pool of as many threads as this process may use: the kernels release the interpreter's lock."""

    def __init__(self) -> None:
        super().__init__(max_workers=threads())

    def submit(self, job, /, *args, **kwargs):
        """Run a job as soon as a thread is free for it."""
        return super().submit(run_in_thread_budget, job, *args, **kwargs)


def run_in_thread_budget(job: Callable[..., T], *args, **kwargs) -> T:
    """Run a job that shares the thread budget with the others."""
    with thread_budget.joined():
        return job(*args, **kwargs)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes started inside use one thread, for linear algebra too: the jobs occupy all cores."""
    before = {name: os.environ.get(name) for name in (*BLAS_THREAD_VARIABLES, SINGLE_THREAD_VARIABLE)}
    os.environ.update(dict.fromkeys(before, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


class BlasLimit:
    """One thread for linear algebra while any of several functions runs, side by side or one in another."""

    def __init__(self) -> None:
        self._running, self._lock, self._limits = 0, Lock(), ExitStack()

    @contextmanager
    def joined(self) -> Iterator[None]:
        """Count as a running function while inside: the first sets the limit, the last takes it away.

        OpenBLAS obeys the thread that limited it, unless that one is cleared.
        """
        from threadpoolctl import OpenBLASController, threadpool_limits  # imported late: 0.02 s

        with self._lock:
            if not self._running:
                self._limits.enter_context(threadpool_limits(1, "blas"))
            self._running += 1
        try:
            yield
        finally:
            with self._lock:
                self._running -= 1
                if not self._running:
                    OpenBLASController.clear_controlling_thread(force=True)
                    self._limits.close()


blas_limit = BlasLimit()


def with_one_blas_thread(work: Callable[Arguments, T]) -> Callable[Arguments, T]:
    """A function during which linear algebra has one thread, whatever the caller's other work may use.

    Its matrices are small. A library's second thread gains nothing there, and waits busily for the first: where
    another process is at work as well, a diagnosis takes four times as long. The command line sets the environment
    instead, before NumPy is loaded.
    """

    @wraps(work)
    def limited(*args: Arguments.args, **kwargs: Arguments.kwargs) -> T:
        with blas_limit.joined():
            return work(*args, **kwargs)

    return limited
