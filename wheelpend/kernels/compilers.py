"""Processes that compile, so that this one only ever loads machine code.

Code that was just compiled is not bit for bit what is loaded from the cache: numba keeps several copies of the
functions within it, and which of them is called depends on the order in which they came. Fits on measured logs amplify
the last bit. So the first run loads what every later one loads. It also is what makes several modules compile at once.
"""

from __future__ import annotations

import atexit
import os
import pickle
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from threading import Lock

from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.parallel import threads

SERVING_CODE = "import sys; sys.path.insert(0, {root!r}); from wheelpend.kernels.compile_worker import serve; serve()"
PACKAGE_ROOT = Path(__file__).parents[2]


class Compiler:
    """A process that compiles what it is asked for, one request after the other; it ends with this one."""

    def __init__(self) -> None:
        command = [sys.executable, "-P", "-c", SERVING_CODE.format(root=str(PACKAGE_ROOT))]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=os.sep)

    def begin(self, request: CompileRequest) -> None:
        """Ask for something; raises OSError where the process has ended."""
        assert self._process.stdin, "it was started with a pipe"
        pickle.dump(request, self._process.stdin)
        self._process.stdin.flush()

    def fileno(self) -> int:
        """The file that can be read once an answer is there, or the process has ended."""
        assert self._process.stdout, "it was started with a pipe"
        return self._process.stdout.fileno()

    def answer(self) -> bool | None:
        """Wait for the answer: whether anything had to be compiled, None where it failed or the process has ended."""
        assert self._process.stdout, "it was started with a pipe"
        try:
            return pickle.load(self._process.stdout)
        except (EOFError, pickle.UnpicklingError):
            return None

    def end(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.wait()
        for stream in filter(None, (self._process.stdin, self._process.stdout)):
            with suppress(OSError):  # what was not sent any more
                stream.close()


_lock = Lock()


@lru_cache
def _compiler() -> Compiler:
    atexit.register(end_compiler)
    return Compiler()


def compile_elsewhere(request: CompileRequest) -> bool:
    """Have a kernel compiled by another process; False where that is not possible. An interrupted one is ended."""
    if not sys.executable:
        return False
    with _lock:
        try:
            _compiler().begin(request)
            done = _compiler().answer() is not None
        except OSError:  # it could not be started, or has ended
            done = False
        except BaseException:
            end_compiler()
            raise
        if not done:
            end_compiler()
        return done


def end_compiler() -> None:
    """End the process that compiles single kernels, if there is one; the next kernel starts another."""
    if _compiler.cache_info().currsize:
        _compiler().end()
        _compiler.cache_clear()


def compile_at_once(requests: Iterable[CompileRequest]) -> Iterator[tuple[CompileRequest, bool | None]]:
    """Have requests fulfilled by as many processes as this one may use threads; gives each with its answer as it comes.

    An answer says whether anything had to be compiled, None that it failed. A request is taken only once a process is
    free for it. Where this is interrupted the processes are ended.
    """
    idle: list[Compiler] = []
    selector, started = DefaultSelector(), 0
    try:
        for request in requests:
            if not idle and started < threads():
                idle.append(Compiler())
                started += 1
            while not idle:
                yield from _answered(selector, idle)
            compiler = idle.pop()
            with suppress(OSError):  # it has ended: its answer will be that nothing was compiled
                compiler.begin(request)
            selector.register(compiler, EVENT_READ, (compiler, request))
        while selector.get_map():
            yield from _answered(selector, idle)
    finally:
        for compiler in (*idle, *(key.data[0] for key in list(selector.get_map().values()))):
            compiler.end()
        selector.close()


def _answered(selector: DefaultSelector, idle: list[Compiler]) -> list[tuple[CompileRequest, bool | None]]:
    """Wait for answers; returns them with their requests, and adds the compilers that gave them to the idle ones."""
    done = []
    for key, _ in selector.select():
        compiler, request = key.data
        selector.unregister(compiler)
        done.append((request, compiler.answer()))
        idle.append(compiler)
    return done
