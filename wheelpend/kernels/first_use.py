"""Notices that something is derived or compiled, which takes long and happens once per machine.

Numba itself reports when it begins to compile a function because its cache holds no machine code of it, whatever the
reason: the text, the processor, numba's version, NUMBA_CACHE_DIR.
"""

from __future__ import annotations

import sys

from numba.core.event import Event, Listener, register

COMPILING_NOTICE = (
    "Compiling kernels of this model, once per machine: it may take a minute or two. Later runs find them compiled; "
    "`wheelpend warm` compiles all of them ahead of time."
)


class FirstUseNotice(Listener):
    """Prints each notice once in a process, that of compiling as the first kernel is; holds which modules compiled."""

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix  # of the names of modules that hold kernels
        self.compiled: set[str] = set()  # modules of which something was compiled
        self.printed: set[str] = set()
        register("numba:compile", self)

    def on_start(self, event: Event) -> None:
        """Numba begins to compile a function."""
        module = event.data["dispatcher"].__module__
        if module.startswith(self.prefix):
            self.print_once(COMPILING_NOTICE)
            self.compiled.add(module)

    def on_end(self, event: Event) -> None:
        """Numba has compiled a function."""

    def print_once(self, sentence: str) -> None:
        """Print a sentence on standard error, once."""
        if sentence not in self.printed:
            self.printed.add(sentence)
            print(sentence, file=sys.stderr, flush=True)
