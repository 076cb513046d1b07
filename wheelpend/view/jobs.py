"""One command line as a process of its own: started, watched, cancelled, its result read.

What it writes goes into files, so that it ends as it should even where the workbench was killed meanwhile.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import current_thread, main_thread
from time import monotonic, time
from typing import Any

import numpy as np

from wheelpend.isolation import python_command, python_environment
from wheelpend.reports.console import PROGRESS_INTERVAL_VARIABLE

GRACE_S = 4.0  # s that a cancelled command has to end by itself: it clears up what it began
PROGRESS_INTERVAL_S = 0.5  # s between two lines of progress
WITH_JSON = (
    "compare",
    "residuals",
    "diagnose",
    "add",
    "remove",
    "explain",
    "identify",
    "inspect",
    "split",
    "design",
    "predictions",
    "figures",
    "sliders",
    "readings",
)
OWN_MODULES = {  # of what only the workbench asks for, to draw it
    "predictions": "wheelpend.view.predictions",
    "readings": "wheelpend.view.readings",
    "figures": "wheelpend.cli.view_figures",
    "sliders": "wheelpend.cli.view_sliders",
}
PLACE_PREFIX = "wheelpend-job-"  # of a job's folder, then the number of the workbench's process
STALE_AFTER_S = 24 * 3600.0  # s after which no command writes into the folder of a workbench that was killed
RESULT_FILE, OUTPUT_FILE, ERROR_FILE = "result.json", "output.txt", "progress.txt"


class Job:
    """A command of wheelpend that runs, or has ended."""

    def __init__(self, words: Sequence[str], folder: Path) -> None:
        self.words, self.folder = tuple(words), folder
        self.place = Path(tempfile.mkdtemp(prefix=f"{PLACE_PREFIX}{os.getpid()}-"))
        self.begin_s, self.cancelled_s = monotonic(), 0.0
        self.process = self._started()
        self._code: int | None = None

    @property
    def line(self) -> str:
        """The command line that does the same in a terminal, in the workspace's folder."""
        return command_line(self.words)

    @property
    def code(self) -> int | None:
        """The exit code, or None as long as it runs; one that does not end when it is cancelled is killed."""
        if self._code is None:
            self._code = self.process.poll()
        if self._code is None and self.cancelled_s and monotonic() > self.cancelled_s + GRACE_S:
            self.kill()
        return self._code

    @property
    def was_cancelled(self) -> bool:
        """True where the user ended it."""
        return bool(self.cancelled_s) and self.code != 0

    @property
    def elapsed_s(self) -> float:
        """Time since it was started [s]."""
        return monotonic() - self.begin_s

    def progress(self) -> str:
        """The latest line of progress, or nothing."""
        lines = [line.strip() for line in self._text(ERROR_FILE).splitlines()]
        return next((line for line in reversed(lines) if line), "")

    def text(self) -> list[str]:
        """What it printed, line by line."""
        return self._text(OUTPUT_FILE).splitlines()

    def result(self) -> dict[str, Any]:
        """The result as the command writes it with --json; empty where there is none."""
        with suppress(ValueError):
            found = json.loads(self._text(RESULT_FILE) or "{}")
            return found if isinstance(found, dict) else {}
        return {}

    def series(self) -> list[np.ndarray]:
        """The arrays that its result names, as they lie on the disk; they stay readable once its files are removed."""
        logs = [log for log in self.result().get("logs", []) if isinstance(log, dict)]
        names = [log["file"] for log in logs if "file" in log]
        return [np.load(self.place / name, mmap_mode="r") for name in names]

    def failure(self) -> str:
        """Why it failed, in the command's own words; empty where it did not, or runs."""
        if not self.code or self.was_cancelled:
            return ""
        said = self.result().get("failure") or self._text(ERROR_FILE).strip()
        return str(said) or f"{self.line} ended with exit code {self.code} and said nothing. Run it in a terminal."

    def cancel(self) -> None:
        """Interrupt it, as Ctrl-C does in a terminal."""
        if self.code is None and not self.cancelled_s:
            self.cancelled_s = monotonic()
            self._signal(signal.SIGINT)

    def kill(self) -> None:
        """End it and what it started, at once."""
        self._signal(signal.SIGKILL)
        self._code = self.process.wait()

    def forget(self) -> None:
        """Remove its files, once what they say was read."""
        shutil.rmtree(self.place, ignore_errors=True)

    @property
    def is_own(self) -> bool:
        """True for what is no command of wheelpend's."""
        return self.words[0] in OWN_MODULES

    def _started(self) -> subprocess.Popen[bytes]:
        words = [
            *self.words[self.is_own :],
            *(["--json", str(self.place / RESULT_FILE)] if self.words[0] in WITH_JSON else []),
        ]
        environment = python_environment() | {PROGRESS_INTERVAL_VARIABLE: str(PROGRESS_INTERVAL_S)}
        with (
            open(self.place / OUTPUT_FILE, "wb") as output,
            open(self.place / ERROR_FILE, "wb") as errors,
            heeded_interrupts(),
        ):
            return subprocess.Popen(
                python_command("-m", OWN_MODULES.get(self.words[0], "wheelpend"), *words),
                cwd=self.folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                start_new_session=True,  # so that Ctrl-C in the workbench's terminal is its own matter
            )

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, number)

    def _text(self, name: str) -> str:
        with suppress(OSError):
            return (self.place / name).read_text(encoding="utf-8", errors="replace")
        return ""


def clear_stale_places() -> None:
    """Remove the folders of jobs that a killed workbench of this user left, once no command writes there any more."""
    for place in Path(tempfile.gettempdir()).glob(f"{PLACE_PREFIX}*-*"):
        number = place.name.removeprefix(PLACE_PREFIX).partition("-")[0]
        with suppress(OSError, ValueError):
            is_ours = place.stat().st_uid == os.getuid() and not place.is_symlink()
            if is_ours and time() > place.stat().st_mtime + STALE_AFTER_S and not _runs(int(number)):
                shutil.rmtree(place, ignore_errors=True)


def _runs(process: int) -> bool:
    """True where a process of that number runs, whoever's it is."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


@contextmanager
def heeded_interrupts() -> Iterator[None]:
    """Processes that start inside end by an interrupt, also where this one was started to ignore it, as behind an &."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN or current_thread() is not main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def command_line(words: Sequence[str]) -> str:
    """A command of wheelpend as one types it."""
    return shlex.join(["wheelpend", *words])
