"""A campaign's logs on Dask: the same answers, whatever dies."""

import io
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice

import psutil
import pytest

from tests.support import run
from wheelpend import Failure, Model, campaign, parallel
from wheelpend.campaigns import cluster
from wheelpend.campaigns.one_log import LogResult

WHEELPEND = (sys.executable, "-P", "-m", "wheelpend")
PATIENCE_S = 120


@pytest.fixture()
def two_cores(monkeypatch):
    monkeypatch.setattr(cluster, "cores", lambda: 2)


def answers(logs, scheduler=None, say=print):
    return dict(cluster.analyses_as_completed(None, dict(enumerate(logs)), scheduler, say))


def until(holds, what):
    begin = time.monotonic()
    while not holds():
        assert time.monotonic() < begin + PATIENCE_S, what
        time.sleep(0.1)


def children(process):
    with suppress(psutil.NoSuchProcess):
        return psutil.Process(process.pid).children(recursive=True)
    return []


@contextmanager
def scheduler_at(port, *workers):
    """A scheduler and its workers, each a process of its own."""
    address = f"tcp://127.0.0.1:{port}"
    started = [start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")]
    for name in workers:
        started.append(
            start("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard", "--name", name)
        )
    try:
        yield address
    finally:
        for process in [p for one in started for p in (*children(one), psutil.Process(one.pid))]:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        for one in started:
            one.wait()


def start(module, *arguments):
    command = [sys.executable, "-P", "-m", module, *arguments]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def test_workers_listen_on_this_machine_alone_encrypted_and_do_not_import_from_the_current_folder(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "multiprocessing.py").write_text("raise SystemExit('of the current folder')")
    with cluster.local_client(2) as client:
        info = client.scheduler_info(n_workers=-1)
        paths = client.run(lambda: __import__("sys").path)
        variables = client.run(lambda: __import__("os").environ["OMP_NUM_THREADS"])
        listening = [
            c.laddr.ip
            for process in (psutil.Process(), *psutil.Process().children(recursive=True))
            for c in process.net_connections("tcp")
            if c.status == psutil.CONN_LISTEN
        ]
    assert all(address.startswith("tls://127.0.0.1:") for address in (info["address"], *info["workers"]))
    assert len(paths) == 2 and set(variables.values()) == {"1"}
    assert not any(folder in ("", str(tmp_path)) for path in paths.values() for folder in path)
    assert listening and set(listening) == {"127.0.0.1"}


@pytest.mark.slow
def test_answers_of_a_cluster_are_those_of_this_process(monkeypatch):
    asked = {"seeds": range(3), "duration": 3.0, "method": "inverse"}
    monkeypatch.setattr(cluster, "cores", lambda: 1)
    here = campaign(Model.default(), **asked)
    monkeypatch.setattr(cluster, "cores", lambda: 2)
    assert campaign(Model.default(), **asked).logs == here.logs


@pytest.mark.slow
def test_a_log_that_takes_every_worker_with_it_fails_alone(two_cores, monkeypatch):
    def deadly(setting, source):
        if source == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        return LogResult(str(source))

    monkeypatch.setattr(cluster, "analyse_log", deadly)
    found = answers([0, 1, 2, 3])
    assert [found[k].log for k in (0, 2, 3)] == ["0", "2", "3"]
    assert found[1].log == "seed 1" and "ended from outside" in found[1].failure


def test_a_worker_that_dies_is_replaced_and_loses_no_log(two_cores, monkeypatch, tmp_path):
    once = str(tmp_path / "died")

    def mortal(setting, source):
        if source == 0 and not os.path.exists(once):
            open(once, "w").close()
            os.kill(os.getpid(), signal.SIGKILL)
        return LogResult(str(source))

    monkeypatch.setattr(cluster, "analyse_log", mortal)
    found = answers(range(6))
    assert os.path.exists(once)
    assert {k: r.log for k, r in found.items()} == {k: str(k) for k in range(6)}


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_the_campaign_however_that_ends(number, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")
    command = [*WHEELPEND, "campaign", "--simulate", "--seeds", "60", "--duration", "10", "--method", "inverse"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=default_interrupt
    )

    def journal():
        return next((tmp_path / "campaign.results").glob("*/_journal.partial"), None)

    until(lambda: journal() and len(journal().read_text().splitlines()) > 1, "the first result")
    workers = children(process)
    assert len(workers) >= min(2, parallel.cores())
    process.send_signal(number)
    said, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == (130 if number == signal.SIGINT else -number), said
    assert "Traceback" not in said
    until(lambda: not any(w.is_running() and w.status() != psutil.STATUS_ZOMBIE for w in workers), "the workers' end")
    assert len(journal().read_text().splitlines()) > 1, "what is done is kept"


def test_connections_that_break_as_a_cluster_ends_say_nothing_and_its_own_log_level_returns(monkeypatch):
    from distributed.utils import LoopRunner

    log, stop, shown = logging.getLogger("distributed.batched"), LoopRunner.stop, io.StringIO()
    monkeypatch.setattr(logging.getLogger("distributed"), "handlers", [logging.StreamHandler(shown)])

    def stop_noisily(runner):
        log.error("a connection closed while it was written to")
        return stop(runner)

    monkeypatch.setattr(LoopRunner, "stop", stop_noisily)
    with cluster.local_client(1):
        pass
    assert "a connection closed" not in shown.getvalue()
    log.error("said outside of any cluster")
    assert "said outside of any cluster" in shown.getvalue()


def default_interrupt():
    signal.signal(signal.SIGINT, signal.default_int_handler)


def test_an_address_where_nobody_answers_is_said_at_once():
    for address in (f"tcp://127.0.0.1:{free_port()}", "somewhere", "http://127.0.0.1:1"):
        with pytest.raises(Failure, match="address of a Dask scheduler"):
            answers([0], address)


@pytest.mark.slow
def test_a_scheduler_that_restarts_loses_no_log(monkeypatch):
    def slowly(setting, source):
        __import__("time").sleep(0.2)
        return LogResult(str(source))

    monkeypatch.setattr(cluster, "analyse_log", slowly)
    monkeypatch.setattr(cluster, "RECONNECT_INTERVAL_S", 0.2)
    monkeypatch.setattr(cluster, "WAIT_FOR_SCHEDULER_S", 60.0)
    port, said, found = free_port(), [], {}
    with ExitStack() as second:
        with scheduler_at(port, "a", "b") as address:
            results = cluster.analyses_as_completed(None, dict(enumerate(range(40))), connected(address), said.append)
            found.update((number, result.log) for number, result in islice(results, 5))
        second.enter_context(scheduler_at(port, "c"))
        found.update((number, result.log) for number, result in results)
    assert found == {k: str(k) for k in range(40)}
    assert any("is gone" in text for text in said)


def connected(address):
    """The address, once its scheduler answers."""
    from distributed import Client

    until(lambda: _answers(Client, address), "the scheduler")
    return address


def _answers(client, address):
    with suppress(OSError, TimeoutError), client(address, set_as_default=False, timeout="2s"):
        return True
    return False


@pytest.mark.slow
def test_a_campaign_runs_on_a_cluster_that_is_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")
    question = ("campaign", "--simulate", "--seeds", "3", "--duration", "3", "--method", "inverse", "--json", "-")
    with scheduler_at(free_port(), "a") as address:
        there = json.loads(run(*question, "--scheduler", connected(address)).stdout)
    assert there["logs"] == json.loads(run(*question).stdout)["logs"]
