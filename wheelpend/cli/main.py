"""The `wheelpend` command: its entry point, and what holds for the whole process."""

from __future__ import annotations

import gc
import io
import os
import sys
import warnings

from wheelpend import interruption
from wheelpend.isolation import leave_out_current_folder


def main() -> None:
    """Entry point of the `wheelpend` command."""
    leave_out_current_folder()
    interruption.watch()  # before anything is loaded that takes long
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded; in small problems more are in the way
    silence_warnings()
    print_any_name()
    gc.set_threshold(100_000)  # what modules leave while they load is kept: to look for garbage there costs a tenth
    try:
        from wheelpend.cli.commands import app
    except KeyboardInterrupt:
        interruption.end_process()
    try:
        app()
    finally:
        finish_output()


def finish_output() -> None:
    """Write what is left of the output, and exit with 1 where it cannot be written; where its reader has ended too."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # else Python tries again, and complains
        if not isinstance(error, BrokenPipeError):
            print(f"Failure: Standard output must take the result, but: {error.strerror}.", file=sys.stderr)
        sys.exit(1)


def print_any_name() -> None:
    """Print what the terminal's encoding lacks, as bytes of a file's name may, as escapes."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def silence_warnings() -> None:
    """Keep Python's warnings, which are for whoever writes programs, from users; unless PYTHONWARNINGS or -W asks.

    In processes that are started too, and whatever filters a library sets when it is loaded.
    """
    if not sys.warnoptions:
        os.environ["PYTHONWARNINGS"] = "ignore"
        warnings.showwarning = lambda *args, **kwargs: None
