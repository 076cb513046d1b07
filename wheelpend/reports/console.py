"""The terminal: progress on standard error, results as text or JSON on standard output, failures as exit code 1."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from errno import EPIPE
from pathlib import Path
from time import monotonic
from traceback import walk_tb
from typing import Any

import typer
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from wheelpend.durations import clock_text, duration_text
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.reports.characters import visible
from wheelpend.reports.inputs import check_logs
from wheelpend.reports.outputs import check_output
from wheelpend.reports.text.table import Table as TextTable
from wheelpend.reports.wrapping import column_blocks, folded_cells, wrapped

LONG_WORK_S = 10.0  # from which on it is said how long work took

TRACEBACK_VARIABLE = "WHEELPEND_TRACEBACK"  # set where errors that nobody foresaw are to be raised
PROGRESS_INTERVAL_VARIABLE = "WHEELPEND_PROGRESS_S"  # s between plain lines of progress, for programs that show them
MANY_SECONDS = 10.0  # s between them for people


class PipedConsole(Console):
    """A console whose reader may end before it: that is no failure of the command, which then ends as others do."""

    def on_broken_pipe(self) -> None:
        """Raise BrokenPipeError, where Rich would end the program as failed."""
        raise BrokenPipeError(EPIPE, os.strerror(EPIPE))


out = PipedConsole(highlight=False, soft_wrap=True)
err = PipedConsole(stderr=True, highlight=False, soft_wrap=True)


@contextmanager
def exit_on_failure(json_file: str | None = None, *outputs: Path | None) -> Iterator[None]:
    """Turn whatever goes wrong into a message on standard error, JSON where asked for, and exit code 1.

    That JSON or one of the ``outputs`` cannot be written, or a log cannot be read, is said before anything is done.
    What nobody foresaw is a fault of the program, said with its place; with TRACEBACK_VARIABLE set it is raised.
    """
    failure_file = json_file if json_file == "-" else None  # none before the file is known to be free
    try:
        if json_file is not None and json_file != "-":
            check_output(Path(json_file))
        failure_file = json_file
        for path in filter(None, outputs):
            check_output(path)
        check_logs()
        yield
    except (BrokenPipeError, typer.Exit, typer.Abort, typer.BadParameter):
        raise  # whoever read the output has ended, or all is said
    except (Exception, SystemExit) as error:
        if not isinstance(error, (Failure, OSError, MemoryError)) and os.environ.get(TRACEBACK_VARIABLE):
            raise
        said = [_failure_text(error)]
        if failure_file is not None:
            try:
                emit_json({"schema": 1, "failure": said[0]}, failure_file)
            except (Failure, OSError) as unwritten:
                said.append(_failure_text(unwritten))
        for text in dict.fromkeys(said):
            _print_marked("bold red", "Failure:", text)
        raise typer.Exit(1) from None


def _failure_text(error: BaseException) -> str:
    """What went wrong, where the system says so too: a file that cannot be used, or too little memory."""
    if isinstance(error, Failure):
        return str(error)
    if isinstance(error, MemoryError):
        return f"This needs more memory than there is ({error or 'none is left'}). Take a shorter log, or part of it."
    if isinstance(error, OSError):
        what, why = error.filename or "A file or the output", error.strerror or error
        return f"{what} cannot be used: {why}. Name another, or make it usable."
    return (
        f"A command must end with a result or a reason, but this one came upon {type(error).__name__}: "
        f"{_text_of(error)} ({_place_of(error)}). That is a fault of wheelpend: please report it with the command and "
        f"its files; {TRACEBACK_VARIABLE}=1 shows the whole traceback."
    )


def _text_of(error: BaseException) -> str:
    """The first line of another library's message."""
    return (str(error).strip() or "no message").partition("\n")[0].rstrip(".")[:300]


def _place_of(error: BaseException) -> str:
    """The innermost line of this package from which an error came."""
    lines = [
        f"{Path(frame.f_code.co_filename).name}, line {line}"
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__", "").partition(".")[0] in ("wheelpend", "derive")
    ]
    return lines[-1] if lines else "outside its own code"


def _without_markup(text: str) -> str:
    from rich.markup import escape  # imported late: a start does not need it

    return escape(visible(text))


@contextmanager
def progress(first: str) -> Iterator[Callable[[str], None]]:
    """A line of progress on standard error, with the time since it began; in the end the whole time, if that is long.

    Where that is not a terminal, a plain line every ten seconds at most, without the time.
    """
    if not err.is_terminal:
        yield _progress_lines()
        return
    line = _LiveLine(first)
    with err.status(line):
        yield line.update
    if line.elapsed_s >= LONG_WORK_S:
        err.print(f"Took {duration_text(line.elapsed_s)}.", style="dim")


class _LiveLine:
    """What is being done and for how long so far, as it is drawn again and again."""

    def __init__(self, text: str) -> None:
        self.text, self.begin_s = text, monotonic()

    def update(self, text: str) -> None:
        self.text = text

    @property
    def elapsed_s(self) -> float:
        return monotonic() - self.begin_s

    def __rich__(self) -> Text:
        return Text(f"{clock_text(self.elapsed_s)} {visible(self.text)}", overflow="ellipsis", no_wrap=True)


def _progress_lines() -> Callable[[str], None]:
    interval_s = _progress_interval_s()
    last_s = monotonic()

    def update(text: str) -> None:
        nonlocal last_s
        if monotonic() - last_s >= interval_s:
            last_s = monotonic()
            err.print(_without_markup(text))

    return update


def _progress_interval_s() -> float:
    """Time between two plain lines of progress [s]: as stated, where that is a number."""
    try:
        return float(os.environ.get(PROGRESS_INTERVAL_VARIABLE, MANY_SECONDS))
    except ValueError:
        return MANY_SECONDS


def emit_json(data: dict, json_file: str) -> None:
    """Write JSON to a file, or to standard output for '-'."""
    from wheelpend.serialise import dumps  # imported late: loads NumPy

    text = dumps(data) + "\n"
    if json_file == "-":
        sys.stdout.write(text)
        sys.stdout.flush()  # that it cannot be written is to be known now
        return
    write_text(Path(json_file), text)


def print_result(result: Any, json_file: str | None, text: Callable[[], None]) -> None:
    """Print a result as JSON where asked for, and call ``text`` unless that goes to standard output."""
    if json_file is not None:
        from wheelpend.serialise import to_json  # imported late: loads NumPy

        emit_json(result if isinstance(result, dict) else to_json(result), json_file)
    if json_file != "-":
        text()


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], text_columns: bool = False) -> None:
    """Print a table; its columns but the first hold numbers, or text with ``text_columns``.

    Where its words are too wide for the terminal, it is printed as several, each with the first column.
    """
    for block in column_blocks([columns, *rows], out.width):
        shown = [[row[k] for k in block] for row in rows]
        _print_grid(title if 1 in block or len(columns) == 1 else "", [columns[k] for k in block], shown, text_columns)


def _print_grid(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], text_columns: bool) -> None:
    head, *cells = folded_cells([columns, *rows], out.width)
    grid = Table(title=_without_markup(title), title_justify="left", title_style="bold")
    for column, shown in zip(columns, head, strict=True):
        grid.add_column(
            _without_markup(shown),
            justify="left" if text_columns or column in columns[:1] else "right",
            overflow="fold",
            no_wrap=column in columns[:1],
        )
    for row in cells:
        grid.add_row(*map(_without_markup, row))
    out.print(grid)


def print_text(blocks: Iterable[str | TextTable]) -> None:
    """Print lines and tables of a result as they come."""
    for block in blocks:
        if isinstance(block, TextTable):
            print_table(*block)
        else:
            print_line(block)


def print_line(text: str) -> None:
    """Print a line as it is; on a terminal folded to its width, unless it holds lines of its own, which may be code."""
    out.print(_without_markup(_fitted(text, out)))


def _fitted(text: str, console: Console) -> str:
    return wrapped(text, console.width) if console.is_terminal and "\n" not in text.strip("\n") else text


def print_command_hint(why: str, command: str) -> None:
    """Print what may be done next on standard error; on a terminal too narrow the command has a line of its own.

    No line end stands in the command itself: the terminal folds it, and what is copied is one line.
    """
    fits = not err.is_terminal or cell_len(f"{why} {command}") <= err.width
    err.print(_without_markup(f"{why} {command}" if fits else f"{_fitted(why, err)}\n  {command}"))


def print_note(text: str) -> None:
    """Print on standard error how a result came about."""
    err.print(_without_markup(_fitted(text, err)))


def print_warnings(warnings: Sequence[str], said: Sequence[str] = ()) -> None:
    """Print warnings on standard error, without those that stand in one that was said before."""
    for warning in (w for w in warnings if not any(w in earlier for earlier in said)):
        _print_marked("yellow", "Warning:", warning)


def _print_marked(style: str, mark: str, text: str) -> None:
    """Print a sentence on standard error behind a coloured word."""
    fitted = _without_markup(_fitted(f"{mark} {text}", err))
    err.print(f"[{style}]{mark}[/]{fitted.removeprefix(mark)}")
