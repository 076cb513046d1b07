"""A process that compiles kernels into the cache and tells when it has: `python -c` with `serve`.

Requests come on its standard input, answers go to its standard output. It ends with the process that asks.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from types import ModuleType
from typing import Any, BinaryIO, NamedTuple

from wheelpend.isolation import import_configured
from wheelpend.kernels.every_kernel import call_every_kernel
from wheelpend.kernels.generated_text import import_text


class CompileRequest(NamedTuple):
    """What is to be compiled: a kernel of a generated module for a signature, or every kernel as the tool calls it."""

    module: str  # its name
    path: str  # its file in the cache
    kernel: str = ""  # every one where it is empty
    signature: Any = None  # types of its arguments


def serve() -> None:
    """Compile what is asked for, one request after the other, until the process that asks has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks, and that ends this one
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what is printed here is no answer
    import_configured("numba")
    requests: BinaryIO = sys.stdin.buffer
    waiting: SimpleQueue[CompileRequest] = SimpleQueue()
    Thread(target=_wait_for_requests, args=(requests, waiting), daemon=True).start()
    while True:
        pickle.dump(answer_to(waiting.get()), answers)
        answers.flush()


def _wait_for_requests(stream: BinaryIO, waiting: SimpleQueue[CompileRequest]) -> None:
    """Put requests in a queue; end this process, in the midst of one too, where the one that asks has ended."""
    try:
        while True:
            waiting.put(pickle.load(stream))
    finally:  # also where it was killed in the midst of a request
        os._exit(0)


def answer_to(request: CompileRequest) -> bool | None:
    """Compile what a request asks for, which numba then keeps in its cache.

    Returns whether anything had to be compiled; None where that failed: whoever calls the kernel then compiles it
    itself, and shows what is wrong.
    """
    import_configured("numba")
    from numba.core.event import install_recorder  # imported late: numba is slow to load

    try:
        module = _module_of(request)
        with install_recorder("numba:compile") as compiled:
            if request.kernel:
                getattr(module, request.kernel).compile(request.signature)
            else:
                call_every_kernel(module)  # type: ignore[arg-type]  # a generated module, which offers these kernels
    except Exception:
        return None
    return bool(compiled.buffer)


def _module_of(request: CompileRequest) -> ModuleType:
    """A generated module, imported from its file under its name."""
    if request.module not in sys.modules:
        from wheelpend.kernels.kernel_files import SealedCache, install_cache  # imported late: as above

        path = Path(request.path)
        install_cache(import_text(request.module, path, path.read_bytes()), SealedCache)
    return sys.modules[request.module]
