"""Ctrl-C: a command ends within two seconds, whatever it is doing, and says what became of its files.

Python raises KeyboardInterrupt in the main thread, but only once a compiled loop, LLVM or SciPy has given that back. So
a thread beside it sees the signal at once, and ends the process where the main thread has not within `GRACE_S`.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

EXIT_CODE = 130  # as of a program that Ctrl-C ends
GRACE_S = 1.5  # s that the main thread has to end by itself
SHOW_CURSOR = b"\x1b[?25h"  # which a line of progress hides

_written: dict[str, str] = {}  # files that the command has written, with what they are for where they can be resumed
_started = threading.Event()  # set by the first Ctrl-C
_said: list[bool] = []  # filled by whoever says that the command was interrupted


def begin_command() -> None:
    """Forget what an earlier command of this process has written, and said."""
    _written.clear()
    _said.clear()


def note_written(path: str | os.PathLike) -> None:
    """Remember a file that is now as the command leaves it."""
    _written.setdefault(os.fspath(path), "")


def note_resumable(path: str | os.PathLike, use: str) -> None:
    """Say what a file is for, should the command be interrupted once it is there."""
    _written[os.fspath(path)] = use


def sentence() -> str:
    """What a command says that is interrupted now."""
    kept = {path: use for path, use in _written.items() if os.path.exists(path)}
    if not kept:
        return "Interrupted; nothing was changed."
    files = ", ".join(path for path, use in kept.items() if not use)
    uses = [f"What came so far is in {path}: {use}" for path, use in kept.items() if use]
    return " ".join(["Interrupted.", *([f"Written before that: {files}."] if files else []), *uses])


def say_once(say: Callable[[str], object]) -> None:
    """Say that the command was interrupted, unless that was said."""
    if not _said:
        _said.append(True)
        say(sentence())


def end_process() -> NoReturn:
    """Say that the command was interrupted and end this process at once, whatever its threads are doing."""
    cursor = SHOW_CURSOR if os.isatty(2) else b""
    say_once(lambda text: os.write(2, cursor + f"{text}\n".encode(errors="backslashreplace")))
    _remove_temporary_files()
    _end_children()
    os._exit(EXIT_CODE)


@contextmanager
def deferred() -> Iterator[None]:
    """Interrupt only once the block has ended: what it does is better finished than left to the next command."""
    if threading.current_thread() is not threading.main_thread():  # which alone is interrupted
        yield
        return
    seen: list[tuple[int, FrameType | None]] = []
    handler = signal.signal(signal.SIGINT, lambda number, frame: seen.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if seen and callable(handler):
            handler(*seen[0])


def watch() -> None:
    """From here on Ctrl-C interrupts this process once, and ends it soon; where it ignores Ctrl-C do nothing."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    signal.signal(signal.SIGINT, _interrupt)
    sys.unraisablehook = _report_unraisable
    seen, signalled = os.pipe()
    os.set_blocking(signalled, False)
    signal.set_wakeup_fd(signalled, warn_on_full_buffer=False)
    threading.Thread(target=_end_soon, args=(seen,), name="interruption", daemon=True).start()


def leave_to_main_thread() -> None:
    """From here on Ctrl-C interrupts the main thread alone, which ends in its own time: nothing else ends it."""
    signal.set_wakeup_fd(-1)


def _interrupt(number: int, frame: FrameType | None) -> None:
    if not _started.is_set():  # again and again would only get into the way of what cleans up
        _started.set()
        raise KeyboardInterrupt


def _report_unraisable(what: sys.UnraisableHookArgs) -> None:
    """Stay silent of an interruption that Python drops, as in a finaliser: the thread beside ends the process."""
    if not issubclass(what.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(what)


def _end_soon(seen: int) -> None:
    while signal.SIGINT not in os.read(seen, 1):
        pass
    time.sleep(GRACE_S)
    end_process()


def _remove_temporary_files() -> None:
    for path in list(_loaded("derive.files", "temporary_paths", ())):
        with suppress(OSError):
            shutil.rmtree(path) if Path(path).is_dir() else Path(path).unlink(missing_ok=True)


def _end_children() -> None:
    for child in _loaded("multiprocessing", "active_children", list)():
        with suppress(Exception):
            child.kill()


def _loaded(module: str, name: str, otherwise: Any) -> Any:
    """What a module has under a name, if it is loaded: the main thread may hold the lock of imports for ever."""
    return getattr(sys.modules.get(module), name, otherwise)
