"""Work on all cores ends with whoever asked for it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Barrier, Event

import pytest
from threadpoolctl import OpenBLASController, threadpool_info, threadpool_limits

from tests.support import ROOT
from wheelpend import Failure, Model, add, compare, diagnose, explain, identify, simulate
from wheelpend.parallel import cores, results_as_completed, with_one_blas_thread

ENDLESS = """
import os, time
from functools import partial
from pathlib import Path
from wheelpend.parallel import results_as_completed

def job(folder, number):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(1000)

if __name__ == "__main__":
    list(results_as_completed([partial(job, {folder!r}, k) for k in range(4)]))
"""


def blas_threads() -> set[int]:
    """Numbers of threads that the libraries for linear algebra may use."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def within(seconds: float, holds) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not holds():
        time.sleep(0.1)
    return holds()


@pytest.fixture()
def asked(tmp_path):
    """A process with endless jobs on all cores, and the folder in which each worker leaves its number."""
    workers = tmp_path / "workers"
    workers.mkdir()
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS.format(folder=str(workers)))
    process = subprocess.Popen(
        [sys.executable, script], cwd=ROOT, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # as in a terminal, wherever the tests run
    )  # fmt: skip
    try:
        assert within(60, lambda: len(os.listdir(workers)) >= 2)
        yield process, workers
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(cores() < 2, reason="on one core the jobs run in the process itself")
def test_workers_do_not_outlive_a_process_that_is_killed(asked):
    process, workers = asked
    process.kill()
    process.wait()
    assert within(20, lambda: not any(alive(int(name)) for name in os.listdir(workers)))


@pytest.mark.skipif(cores() < 2, reason="on one core the jobs run in the process itself")
def test_an_interruption_ends_the_workers_at_once_and_without_a_word_of_theirs(asked):
    process, workers = asked
    numbers = [int(name) for name in os.listdir(workers)]
    for number in (*numbers, process.pid):  # as Ctrl-C in a terminal does
        os.kill(number, signal.SIGINT)
    said = process.communicate(timeout=60)[1].decode()
    assert said.count("Traceback") == said.count("\nKeyboardInterrupt") == 1
    assert within(20, lambda: not any(alive(number) for number in numbers))


def test_one_process_is_this_one_and_two_are_others():
    own = os.getpid()
    assert {found for _, found in results_as_completed([os.getpid] * 3, processes=1)} == {own}
    assert own not in {found for _, found in results_as_completed([os.getpid] * 3, processes=2)}


@pytest.mark.parametrize("processes", [1, 2])
def test_no_job_is_started_when_there_is_no_time(processes):
    assert list(results_as_completed([os.getpid] * 3, 0.0, processes)) == []


def test_linear_algebra_has_one_thread_while_a_function_runs_and_the_caller_s_number_after_it():
    @with_one_blas_thread
    def failing(seen: list[set[int]]) -> None:
        seen.append(blas_threads())
        raise Failure("as some do")

    seen: list[set[int]] = []
    with threadpool_limits(2, "blas"):
        with pytest.raises(Failure):
            failing(seen)
        assert (seen, blas_threads()) == ([{1}], {2})


def test_of_functions_side_by_side_the_last_takes_the_limit_away():
    both_run, first_has_ended = Barrier(2), Event()

    @with_one_blas_thread
    def first() -> None:
        both_run.wait(10.0)

    @with_one_blas_thread
    def second() -> set[int]:
        both_run.wait(10.0)
        assert first_has_ended.wait(10.0)
        return blas_threads()

    before = blas_threads()
    OpenBLASController.clear_controlling_thread(force=True)
    with ThreadPoolExecutor(2) as pool:
        threadpool_limits(2, "blas")  # as any other code may
        OpenBLASController.clear_controlling_thread(force=True)
        done, seen = pool.submit(first), pool.submit(second)
        done.result(10.0)
        first_has_ended.set()
        assert (seen.result(10.0), blas_threads()) == ({1}, {2})
    OpenBLASController.clear_controlling_thread(force=True)
    threadpool_limits(next(iter(before)), "blas")


@pytest.mark.parametrize("work", [identify, compare, diagnose, explain, partial(add, effect="coulomb_drive")])
def test_whatever_estimates_does_so_with_one_thread_for_linear_algebra(work: Callable[..., object]):
    seen: list[set[int]] = []

    def stop(text: str) -> None:
        seen.append(blas_threads())
        raise Failure(text)

    log = simulate(Model.default(), duration=3.0)
    with threadpool_limits(2, "blas"), pytest.raises(Failure):
        work(Model.default(), logs=[log], progress=stop)
    assert seen == [{1}]
