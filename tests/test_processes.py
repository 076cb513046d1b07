"""Work on all cores ends with whoever asked for it."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from wheelpend.processes import cores

ENDLESS = """
import os, time
from functools import partial
from pathlib import Path
from wheelpend.processes import as_they_end

def job(folder, number):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(1000)

if __name__ == "__main__":
    list(as_they_end([partial(job, {folder!r}, k) for k in range(4)]))
"""


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


@pytest.mark.skipif(cores() < 2, reason="on one core the jobs run in the process itself")
def test_workers_do_not_outlive_a_process_that_is_killed(tmp_path):
    workers = tmp_path / "workers"
    workers.mkdir()
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS.format(folder=str(workers)))
    asked = subprocess.Popen([sys.executable, script], cwd=Path(__file__).parents[1])
    try:
        assert within(60, lambda: len(os.listdir(workers)) >= 2)
    finally:
        asked.kill()
        asked.wait()
    assert within(20, lambda: not any(alive(int(name)) for name in os.listdir(workers)))
