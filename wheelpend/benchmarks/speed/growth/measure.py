"""One size of a kind of work, measured in a process of its own, so that its peak of memory is that of this work."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from time import perf_counter

from wheelpend.benchmarks.speed.growth.curve import ScalingPoint
from wheelpend.benchmarks.speed.growth.work import WORK_FACTORIES
from wheelpend.isolation import python_command, python_environment
from wheelpend.parallel import BLAS_THREAD_VARIABLES


def measure_in_process(kind: str, size: int, folder: Path) -> ScalingPoint:
    """Measure in a new process; ends this one with that one's error where it fails."""
    environment = python_environment() | dict.fromkeys(BLAS_THREAD_VARIABLES, "1")
    done = subprocess.run(
        python_command("-m", "wheelpend.benchmarks.speed.growth", "--one", f"{kind}:{size}:{folder}"),
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(done.stderr)
    _, seconds, megabytes = json.loads(done.stdout.splitlines()[-1])
    return ScalingPoint(size, float(seconds), float(megabytes))


def measure_once(label: str) -> ScalingPoint:
    """Measure the work of a label KIND:SIZE:FOLDER in this process, after its warm-up."""
    kind, size, folder = label.split(":")
    work = WORK_FACTORIES[kind](int(size), Path(folder))
    work.warm_up()
    before = peak_memory_mb()
    begin = perf_counter()
    work.run()
    return ScalingPoint(int(size), perf_counter() - begin, peak_memory_mb() - before)


def peak_memory_mb() -> float:
    """Peak resident memory of this process so far [MB]."""
    line = next(x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmHWM"))
    return float(line.split()[1]) / 1024.0  # getrusage would count what the parent process had
