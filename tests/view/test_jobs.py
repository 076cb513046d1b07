"""Commands as processes: progress, result, end."""

import os
import signal
import time

import pytest

from tests.support import simulated
from wheelpend import Model, save_log
from wheelpend.model.workspace import history
from wheelpend.view import jobs
from wheelpend.view.jobs import Job, command_line


@pytest.fixture
def workspace(tmp_path):
    Model.default().save(tmp_path)
    return tmp_path


@pytest.fixture
def log(tmp_path):
    save_log(tmp_path / "log.csv", simulated(duration=3.0, coulomb_drive__torque=0.3))
    return str(tmp_path / "log.csv")


def ended(job, seconds=240):
    begin = time.monotonic()
    while job.code is None:
        assert time.monotonic() < begin + seconds, job.progress()
        time.sleep(0.05)
    return job


def is_alive(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_result_is_that_of_the_command(workspace):
    job = ended(Job(("add", "coulomb_drive"), workspace))
    assert job.code == 0 and job.result()["effects"] == ["coulomb_drive"] and not job.failure()
    assert job.text()[0].startswith("Added coulomb_drive") and Model.open(workspace).effects == ("coulomb_drive",)
    assert job.line == "wheelpend add coulomb_drive"


def test_a_failure_is_said_in_the_commands_own_words(workspace):
    job = ended(Job(("add", "columb_drive"), workspace))
    assert job.code == 1 and "No effect named 'columb_drive'" in job.failure() and not job.was_cancelled


def test_words_are_quoted_as_a_shell_needs_them():
    assert command_line(("inspect", "a b; rm.csv")) == "wheelpend inspect 'a b; rm.csv'"


def test_a_cancelled_command_ends_with_all_it_started_and_changes_nothing(workspace, log):
    job = Job(("add", "coulomb_drive", log), workspace)
    time.sleep(1.0)
    job.cancel()
    begin = time.monotonic()
    assert ended(job).was_cancelled and time.monotonic() < begin + jobs.GRACE_S + 2.0
    assert not job.failure() and not is_alive(job.process.pid) and Model.open(workspace).effects == ()


def test_a_workbench_that_ignores_interrupts_starts_commands_that_do_not(workspace, log):
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        job = jobs.Job(("diagnose", str(log)), workspace)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        time.sleep(1.0)
        job.cancel()
        begin = time.monotonic()
        assert ended(job).was_cancelled and time.monotonic() < begin + jobs.GRACE_S
    finally:
        signal.signal(signal.SIGINT, before)


def test_one_that_does_not_end_when_it_is_cancelled_is_killed(workspace, log, monkeypatch):
    monkeypatch.setattr(jobs, "GRACE_S", 0.3)
    job = Job(("diagnose", log), workspace)
    monkeypatch.setattr(Job, "_signal", lambda self, number: number == signal.SIGKILL and os.killpg(job.process.pid, 9))
    job.cancel()
    assert ended(job, 10).was_cancelled and job.code == -signal.SIGKILL


def test_a_command_goes_on_where_the_workbench_that_started_it_is_gone(workspace, log):
    pid = os.fork()
    if not pid:
        Job(("add", "coulomb_drive", log), workspace)
        os._exit(0)
    os.waitpid(pid, 0)
    begin = time.monotonic()
    while not history(workspace):
        assert time.monotonic() < begin + 240
        time.sleep(0.1)
    assert history(workspace)[0]["change"] == "add coulomb_drive"
