"""Notices that something is derived or compiled, which takes long and happens once per machine.

Numba compiles a function where its cache holds no machine code of it, whatever the reason: the text, the processor,
numba's version, NUMBA_CACHE_DIR.
"""

from __future__ import annotations

import sys
from functools import lru_cache

COMPILING_NOTICE = (
    "Compiling kernels of this model, once per machine: it may take a minute or two. Later runs find them compiled; "
    "`wheelpend warm` compiles all of them ahead of time."
)


class FirstUseNotice:
    """Prints each notice once in a process."""

    def __init__(self) -> None:
        self.printed: set[str] = set()

    def print_once(self, sentence: str) -> None:
        """Print a sentence on standard error, once."""
        if sentence not in self.printed:
            self.printed.add(sentence)
            print(sentence, file=sys.stderr, flush=True)


@lru_cache
def first_use_notice() -> FirstUseNotice:
    """The process's one notice of what is derived or compiled for later runs to find."""
    return FirstUseNotice()
