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
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from selectors import EVENT_READ, DefaultSelector
from threading import Lock

from wheelpend.isolation import can_start_python, python_command, python_environment, trusted_path
from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.parallel import threads, without_interruption

SERVING_CODE = """import sys
sys.path[:] = {path!r}
from wheelpend.kernels.compile_worker import serve
serve()
"""


class Compiler:
    """A process that compiles what it is asked for, one request after the other; it ends with this one."""

    def __init__(self) -> None:
        command, environment = python_command("-c", SERVING_CODE.format(path=trusted_path())), python_environment()
        with without_interruption():  # Ctrl-C ends it, but by this process
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=os.sep, env=environment
            )

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
        except Exception:  # it has ended, or something else was printed there
            return None

    @property
    def is_running(self) -> bool:
        """True until the process has ended."""
        return self._process.poll() is None

    def end(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.wait()
        for stream in filter(None, (self._process.stdin, self._process.stdout)):
            with suppress(OSError):  # what was not sent any more
                stream.close()


class _OneCompiler:
    """The process that compiles single kernels for this one, started when the first is wanted."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.current: Compiler | None = None
        self.is_usable = can_start_python()

    def compile(self, request: CompileRequest) -> bool:
        """Have a kernel compiled; False where that is not possible, and from then on. An interrupted one is ended."""
        with self.lock:
            if not self.is_usable:
                return False
            try:
                self.current = self.current or Compiler()
                self.current.begin(request)
                done = self.current.answer() is not None
            except Exception:  # it could not be started, or has ended
                done = self.is_usable = False
            except BaseException:
                self.end()
                raise
            if not done:
                self.is_usable = self.is_usable and self.current is not None and self.current.is_running
                self.end()
            return done

    def end(self) -> None:
        """End the process, if there is one."""
        if self.current:
            self.current.end()
        self.current = None


@lru_cache
def one_compiler() -> _OneCompiler:
    """This process's own; a forked one has another."""
    found = _OneCompiler()
    atexit.register(found.end)
    return found


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=one_compiler.cache_clear)


def compile_elsewhere(request: CompileRequest) -> bool:
    """Have a kernel compiled by another process; False where that is not possible."""
    return one_compiler().compile(request)


def compile_at_once(requests: Iterable[CompileRequest]) -> Iterator[tuple[CompileRequest, bool | None]]:
    """Have requests fulfilled by as many processes as this one may use threads; gives each with its answer as it comes.

    An answer says whether anything had to be compiled, None that it failed. A request is taken only once a process is
    free for it. Where this is interrupted the processes are ended.
    """
    idle: list[Compiler] = []
    busy: dict[Compiler, CompileRequest] = {}
    try:
        for request in requests:
            while len(busy) >= threads():
                yield from _answered(busy, idle)
            if (compiler := _asked(request, idle)) is None:
                yield request, None
            else:
                busy[compiler] = request
        while busy:
            yield from _answered(busy, idle)
    finally:
        for compiler in (*idle, *busy):
            compiler.end()


def _asked(request: CompileRequest, idle: list[Compiler]) -> Compiler | None:
    """An idle compiler or a new one, asked for something; None where none can be started, or it has ended."""
    if not idle and not can_start_python():
        return None
    try:
        compiler = idle.pop() if idle else Compiler()
    except OSError:
        return None
    try:
        compiler.begin(request)
    except OSError:
        compiler.end()
        return None
    return compiler


def _answered(busy: dict[Compiler, CompileRequest], idle: list[Compiler]) -> list[tuple[CompileRequest, bool | None]]:
    """Wait for answers; returns them with their requests. Compilers that gave one are idle, those that failed ended."""
    done = []
    with DefaultSelector() as selector:
        for compiler in busy:
            selector.register(compiler, EVENT_READ, compiler)
        ready = [key.data for key, _ in selector.select()]
    for compiler in ready:
        answer = compiler.answer()
        done.append((busy.pop(compiler), answer))
        if answer is None:
            compiler.end()
        else:
            idle.append(compiler)
    return done
