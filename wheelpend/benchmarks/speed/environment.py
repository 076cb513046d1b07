"""Other packages, timed in an environment of their own by the script peers.py."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from wheelpend.benchmarks.speed.record import NotMeasurableError
from wheelpend.benchmarks.speed.timing import Contender
from wheelpend.isolation import python_command

PEERS_SCRIPT_PATH = Path(__file__).with_name("peers.py")
OWN_ENVIRONMENT_PATH = Path(sys.prefix)  # the environment of this process, which has sympy


@contextmanager
def peer(environment: Path, name: str, **problem: np.ndarray) -> Iterator[tuple[Contender, np.ndarray]]:
    """A contender of peers.py after its first round, and its result; raises NotMeasurableError where it cannot work."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problem.npz"
        np.savez(file, **problem)  # type: ignore[arg-type]
        python = str(interpreter(environment))
        command = python_command(str(PEERS_SCRIPT_PATH), name, str(file), executable=python)  # without our modules
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as process:
            questions, answers = process.stdin, process.stdout
            assert questions and answers
            try:
                ready = _answer(name, answers)
                yield lambda: _round(name, questions, answers)["seconds"], np.array(ready["result"])
            finally:
                process.kill()


def interpreter(environment: Path) -> Path:
    """The interpreter of an environment; raises NotMeasurableError where there is none."""
    path = Path(sys.executable) if environment == OWN_ENVIRONMENT_PATH else environment / "bin" / "python"
    if not path.exists():
        raise NotMeasurableError(f"no environment with other packages at {environment}; `make bench` makes one")
    return path


def _round(name: str, questions: IO[str], answers: IO[str]) -> dict[str, Any]:
    try:
        questions.write("\n")
        questions.flush()
    except OSError:
        raise NotMeasurableError(f"{name} ended before its work was done") from None
    return _answer(name, answers)


def _answer(name: str, answers: IO[str]) -> dict[str, Any]:
    line = answers.readline()
    if not line:
        raise NotMeasurableError(f"{name} ended without an answer")
    found = json.loads(line)
    if "failure" in found:
        raise NotMeasurableError(found["failure"])
    return found
