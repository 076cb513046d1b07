"""What every command keeps to, whatever it is given; the one place that says so.

- The exit code is 0, 1 or 2, and nobody sees a traceback.
- With ``--json -`` standard output is one strict JSON document and nothing else, or nothing where the command line is
  wrong; with exit code 1 it says the failure.
- It ends in time.
- Nothing that it prints steers the terminal.
- A command that fails leaves the workspace as it was, and none leaves it worse: generated code that was up to date is
  so afterwards, and no partial or prepared file is left.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import traceback
import unicodedata
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import monotonic
from types import TracebackType

import click
import typer
from typer.testing import CliRunner

from tests.fuzz.cases import Case
from tests.support import ROOT, app, simulated
from wheelpend import Failure, Model, save_log
from wheelpend.model import workspace

COMMANDS: dict[str, click.Command] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
TIME_LIMIT_S = 20.0  # of processor time, of a command on a tiny log; with kernels that are compiled already
PATIENCE = 10.0  # by how much longer a command may take on a busy machine
WORKSPACE_FILES, GENERATED = ("model.toml", "history.json", "effects.toml"), "generated/"
PASSING_WORDS = (".partial", ".wheelpend-")  # in names of files that no command may leave
STEERING = {"Cc", "Cf", "Cs"}  # categories of characters that a terminal obeys, or that turn text around
HARMLESS = {"\n", "\t", "\u00ad", "\u200c", "\u200d"}  # joiners, and what keeps letters apart, belong to words


class TooLong(BaseException):
    """A command has not ended in time."""


@dataclass(frozen=True)
class Outcome:
    """What came of one command."""

    command: tuple[str, ...]
    code: int
    stdout: str
    stderr: str
    error: BaseException | None  # that got out of the command
    seconds: float


class Broken(AssertionError):
    """An invariant does not hold; ``key`` tells different reasons apart."""

    def __init__(self, key: str, outcome: Outcome, detail: str = "") -> None:
        said = (outcome.stderr or outcome.stdout)[-1500:]
        super().__init__(f"{key}\n  command: {list(outcome.command)}\n  {detail}\n  said: {said!r}")
        self.key = key


@cache
def fresh_files() -> dict[str, bytes]:
    """Files of the workspace in which every case begins: a tiny log lies in it."""
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        workspace.create(folder)
        log = simulated(duration=4.0)
        save_log(folder / "log.csv", log.part(0, 4000))
        lines = (folder / "log.csv").read_text().splitlines(True)
        (folder / "log.csv").write_text("".join([lines[0], *lines[1::20]]))
        return files_of(folder)


def files_of(folder: Path) -> dict[str, bytes]:
    """Every file of a folder by its place in it, however odd its name."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file() and not p.is_symlink()}


def check_case(case: Case, folder: Path, limit_s: float = TIME_LIMIT_S) -> list[int]:
    """Run a case and return the exit codes; raises Broken where an invariant does not hold."""
    with in_workspace(folder, case.files):
        return [check_command(command, folder, limit_s) for command in case.commands]


@contextmanager
def in_workspace(folder: Path, files: dict[str, bytes]) -> Iterator[None]:
    """The current folder made a fresh workspace with these files."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, data in {**fresh_files(), **files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def check_command(command: Sequence[str], folder: Path, limit_s: float) -> int:
    """Run a command in this process and check everything that is promised of it."""
    before, fresh_before = files_of(folder), is_up_to_date(folder)
    outcome = run_command(tuple(command), limit_s)
    check_outcome(outcome)
    after = files_of(folder)
    if left := [n for n in after if n not in before and any(word in n for word in PASSING_WORDS)]:
        raise Broken("a file is left behind", outcome, str(left))
    if outcome.code and of_workspace(before) != of_workspace(after):
        raise Broken("a failed command changed the workspace", outcome)
    if fresh_before and of_workspace(before) != of_workspace(after) and not is_up_to_date(folder):
        raise Broken("the generated code is stale afterwards", outcome)
    return outcome.code


def of_workspace(files: dict[str, bytes]) -> dict[str, bytes]:
    """Those of a folder's files that a workspace consists of."""
    return {name: data for name, data in files.items() if name in WORKSPACE_FILES or name.startswith(GENERATED)}


def is_up_to_date(folder: Path) -> bool:
    """True where `generate --check` has nothing to say."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return workspace.generated_code_diff(Model.open(folder)) == ""
    except (Failure, OSError):
        return False
    except Exception:  # which the command itself meets too
        return False


def run_command(command: tuple[str, ...], limit_s: float) -> Outcome:
    """Run a command line in this process."""
    begin = monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as `wheelpend` has them
        try:
            with time_limit(limit_s):
                result = CliRunner().invoke(app, list(command))
        except TooLong as error:
            return Outcome(command, 0, "", "", error, monotonic() - begin)
    error = None if isinstance(result.exception, SystemExit) else result.exception
    return Outcome(command, result.exit_code, result.stdout, result.stderr, error, monotonic() - begin)


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TooLong in the block once it has taken so much processor time, or far longer."""

    def stop(number, frame):
        raise TooLong(f"{seconds:g} s")

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, seconds), (signal.SIGALRM, signal.ITIMER_REAL, PATIENCE * seconds))
    before = [signal.signal(number, stop) for number, _, _ in timers]
    for _, timer, after in timers:
        signal.setitimer(timer, after)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, handler)


def check_outcome(outcome: Outcome) -> None:
    """Check what a command has said and returned; raises Broken."""
    if outcome.error is not None:
        raise Broken(f"{type(outcome.error).__name__} in {place_of(outcome.error)}", outcome, repr(outcome.error))
    if outcome.code not in (0, 1, 2):
        raise Broken(f"exit code {outcome.code}", outcome)
    if "Traceback (most recent call last)" in outcome.stdout + outcome.stderr:
        raise Broken("a traceback", outcome)
    if outcome.code and not outcome.stderr.strip() and outcome.stdout.strip()[:1] != "{":
        raise Broken("fails without a word", outcome)
    check_json(outcome)
    check_characters(outcome)


def place_of(error: BaseException) -> str:
    """The innermost function of this project in an error's traceback."""
    own = [f for f in frames(error.__traceback__) if Path(f[0]).is_relative_to(ROOT) and "/.venv/" not in f[0]]
    file, name = own[-1] if own else ("?", "?")
    return f"{Path(file).relative_to(ROOT) if own else file}:{name}"


def frames(found: TracebackType | None) -> list[tuple[str, str]]:
    """File and function of every frame of a traceback, without those of these tests."""
    summary = traceback.extract_tb(found)
    return [(f.filename, f.name) for f in summary if "/tests/" not in f.filename]


def check_json(outcome: Outcome) -> None:
    """Check standard output where JSON was asked for there."""
    if not wants_json(outcome.command):
        return
    if outcome.code == 2:
        if outcome.stdout:
            raise Broken("standard output beside a wrong command line", outcome)
        return
    try:
        found = json.loads(outcome.stdout, parse_constant=refuse_constant)
    except ValueError as error:
        raise Broken("standard output is no strict JSON", outcome, str(error)) from None
    if outcome.code == 1 and not found.get("failure"):
        raise Broken("JSON of a failure that says none", outcome)


def wants_json(command: Sequence[str]) -> bool:
    """True where standard output is what a command line gives as ``--json``."""
    if command[:1] and command[0] in COMMANDS and "-" in command:
        try:
            context = COMMANDS[command[0]].make_context(command[0], list(command[1:]), resilient_parsing=True)
        except click.ClickException:
            return "--json" in command
        return context.params.get("json") == "-" and "--help" not in command
    return False


def refuse_constant(name: str) -> None:
    """NaN and infinity are no JSON."""
    raise ValueError(f"{name} is no JSON")


def check_characters(outcome: Outcome) -> None:
    """Check that nothing printed is a character that steers; of a wrong command line it is the user's own."""
    if outcome.code == 2 or wants_json(outcome.command):
        return
    for stream in (outcome.stdout, outcome.stderr):
        if odd := {c for c in stream if unicodedata.category(c) in STEERING and c not in HARMLESS}:
            raise Broken("a character that steers the terminal", outcome, str(sorted(map(ascii, odd))))
