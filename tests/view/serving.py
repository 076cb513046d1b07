"""A workbench that runs, as its user starts it."""

import os
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

needs_nicegui = pytest.mark.skipif(find_spec("nicegui") is None, reason="NiceGUI, of the extra view, is not installed")
START_TIME_LIMIT_S = 120
PYTEST_VARIABLE = "PYTEST_CURRENT_TEST"  # which would make NiceGUI take the server for a test of its own


@contextmanager
def serving(folder, *arguments):
    """The address of a workbench in a folder, and its process; it is killed in the end, unless it has ended."""
    environment = {name: value for name, value in os.environ.items() if name != PYTEST_VARIABLE}
    command = [sys.executable, "-P", "-m", "wheelpend", "view", "--no-browser", *map(str, arguments)]
    process = subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        yield address_said_by(process), process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def address_said_by(process):
    """The address on the terminal."""
    said = ""
    for line in process.stdout:
        said += line
        if found := re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line):
            return found[0]
    raise AssertionError(said)


def end_by_interrupt(process):
    """The exit code and what the terminal shows after Ctrl-C."""
    process.send_signal(signal.SIGINT)
    said = process.stdout.read()
    return process.wait(timeout=30), said


def answer(address, **headers):
    """Status, headers and text of an answer."""
    request = urllib.request.Request(address, headers={name.replace("_", "-"): v for name, v in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=30) as response:
            return response.status, response.headers, response.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers, error.read().decode()
