"""Put small mistakes into the code, one at a time, and see whether the tests notice: ``python tests/mutation/run.py``.

``mistakes.toml`` lists them: where, what stands there, what is put in its place, and the tests that speak of that code.
Each is tried in a copy of the checkout of its own. What was tried is kept in a journal under a fingerprint of the
mistake, of the code and of its tests, so that an interrupted run goes on where it ended and a new test is tried only on
what it is for.
The exit code is 1 while a mistake passes that is not shown to change nothing, and 2 where the tests fail without one or
a mistake cannot be made as the list has it: then its text has changed, and the list follows.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from queue import SimpleQueue
from time import monotonic

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]
JOURNAL = CHECKOUT / ".mutation" / "journal.jsonl"
KERNEL_CACHE = CHECKOUT / ".mutation" / "cache"  # of compiled kernels, those of mistakes among them
COPIED = (
    *("wheelpend", "derive", "templates", "generated", "tests", "data", "docs"),
    *("model.toml", "pyproject.toml", "README.md", "CHANGELOG.md"),
)
CODE_FOLDERS = ("wheelpend", "derive", "templates")
SHARED_TEST_FILES = ("tests/conftest.py", "tests/support.py")
TIMEOUT_S = 600.0  # of the tests of one mistake; the tests noticed it if they do not end
CHECK_TIMEOUT_S = 3600.0  # of all tests without a mistake, with every kernel compiled anew
QUICK, SLOW = "not slow", "slow"  # tests, the former first
NO_TESTS, NOT_TOLD = 5, -1  # pytest's exit code where it found none; one where tests tell nothing
CAUGHT, PASSED, BROKEN = "caught", "passed", "broken"
MAX_REASON_LENGTH = 160  # characters of the line that says which test failed


@dataclass(frozen=True)
class Mistake:
    """One small mistake."""

    name: str
    file: str
    before: str  # stands in the file exactly once
    after: str
    tests: tuple[str, ...]  # files or single tests that speak of this code, the quickest first
    changes_nothing: str = ""  # why no test can notice it


@dataclass(frozen=True)
class Outcome:
    """What became of a mistake."""

    name: str
    result: str
    seconds: float
    noticed_by: str = ""


# ---- the list


def read_mistakes(path: Path = HERE / "mistakes.toml") -> list[Mistake]:
    """The list; raises ValueError where an entry cannot be tried as it stands."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["mistake"]
    mistakes = [Mistake(**{**row, "tests": tuple(row["tests"])}) for row in rows]
    names = [m.name for m in mistakes]
    wrong = [f"{name}: there twice" for name in sorted({n for n in names if names.count(n) > 1})]
    wrong += [why for m in mistakes if (why := why_not_possible(m))]
    if wrong:
        raise ValueError("Every mistake must be one that can be made:\n" + "\n".join(wrong))
    return mistakes


def why_not_possible(mistake: Mistake) -> str:
    """Reason why a mistake cannot be made, or its tests not be run; empty where they can."""
    path = CHECKOUT / mistake.file
    count = path.read_text(encoding="utf-8").count(mistake.before) if path.is_file() else 0
    if count != 1:
        return f"{mistake.name}: its text must stand in {mistake.file} exactly once, but does {count} times"
    absent = [t for t in mistake.tests if not (CHECKOUT / t.partition("::")[0]).is_file()]
    return f"{mistake.name}: no test file {', '.join(absent)}" if absent or not mistake.tests else ""


# ---- the journal


@cache
def code_digest() -> str:
    """Hash of all code."""
    digest = hashlib.sha256()
    for folder in CODE_FOLDERS:
        for path in sorted((CHECKOUT / folder).rglob("*")):
            if path.suffix in {".py", ".j2", ".html", ".css"}:
                digest.update(path.read_bytes())
    return digest.hexdigest()


def fingerprint(mistake: Mistake) -> str:
    """Hash of the mistake, of all code and of the test files that its outcome depends on."""
    digest = hashlib.sha256(repr(mistake).encode() + code_digest().encode())
    for name in sorted({*SHARED_TEST_FILES, *(t.partition("::")[0] for t in mistake.tests)}):
        digest.update((CHECKOUT / name).read_bytes())
    return digest.hexdigest()[:16]


def known_outcomes(marks: dict[str, str]) -> dict[str, Outcome]:
    """Outcomes of an earlier run that still hold, by name."""
    found = {}
    lines = JOURNAL.read_text(encoding="utf-8").splitlines() if JOURNAL.exists() else []
    for line in lines:
        try:
            data = json.loads(line)
        except json.JSONDecodeError:  # the last line of a run that was killed
            continue
        if marks.get(data["name"]) == data.pop("fingerprint"):
            found[data["name"]] = Outcome(**data)
    return found


def remember(outcome: Outcome, mark: str) -> None:
    """Append an outcome to the journal."""
    JOURNAL.parent.mkdir(exist_ok=True)
    with JOURNAL.open("a", encoding="utf-8") as file:
        file.write(json.dumps({**vars(outcome), "fingerprint": mark}) + "\n")


# ---- one mistake


def copies(count: int, root: Path) -> SimpleQueue[Path]:
    """Copies of the checkout to work in, without what a clone does not have."""
    free: SimpleQueue[Path] = SimpleQueue()
    for number in range(count):
        copy = root / str(number)
        copy.mkdir(parents=True)
        for name in COPIED:
            source = CHECKOUT / name
            if source.is_dir():
                shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, copy / name)
        free.put(copy)
    return free


def run_tests(copy: Path, tests: Iterable[str], which: str = QUICK, timeout_s: float = TIMEOUT_S) -> tuple[int, str]:
    """Exit code and output of pytest in a copy, without the measured logs: a public clone does not have them."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(copy),
        "PYTHONDONTWRITEBYTECODE": "1",  # two texts of one size within a second would share their bytecode
        "WHEELPEND_CACHE": str(KERNEL_CACHE),
        "WHEELPEND_DATA": str(copy / "no-measured-logs"),
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n0", "-p", "no:cacheprovider", "-m", which, *tests]
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        return 1, "FAILED the tests did not end"
    return done.returncode, done.stdout + done.stderr


def attempt(free: SimpleQueue[Path], mistake: Mistake, mark: str) -> Outcome:
    """Make the mistake in a copy, run its tests there, take it back, and note the outcome."""
    copy = free.get()
    path, begin = copy / mistake.file, monotonic()
    text = path.read_text(encoding="utf-8")
    try:
        path.write_text(text.replace(mistake.before, mistake.after), encoding="utf-8")
        code, output = run_tests(copy, mistake.tests)
        if code in (0, NO_TESTS):
            slow = run_tests(copy, mistake.tests, SLOW, CHECK_TIMEOUT_S)
            code, output = slow if slow[0] != NO_TESTS else (code, output)
            path.write_text(text, encoding="utf-8")
            if slow[0] == 1 and run_tests(copy, mistake.tests, SLOW, CHECK_TIMEOUT_S)[0] != 0:
                code, output = NOT_TOLD, "FAILED the slow tests fail without the mistake too"
    finally:
        path.write_text(text, encoding="utf-8")
        free.put(copy)
    failed = next((line for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))), "")
    result = {0: PASSED, 1: CAUGHT}.get(code, BROKEN)  # other codes: pytest found no test, or was not started well
    if result == BROKEN and failed and code != NOT_TOLD:
        result = CAUGHT  # the mistake keeps a test file from being collected
    outcome = Outcome(mistake.name, result, round(monotonic() - begin, 1), failed[:MAX_REASON_LENGTH])
    remember(outcome, mark)
    return outcome


# ---- all of them


def failing_tests(free: SimpleQueue[Path], mistakes: Sequence[Mistake]) -> str:
    """What pytest says where the tests of some mistakes fail without any; empty where they pass."""
    copy = free.get()
    try:
        code, output = run_tests(copy, sorted({t for m in mistakes for t in m.tests}), timeout_s=CHECK_TIMEOUT_S)
    finally:
        free.put(copy)
    return output if code else ""


def outcomes(mistakes: Sequence[Mistake], workers: int, *, check: bool) -> Iterator[Outcome]:
    """Outcomes of mistakes, in their order; what is known already comes at once.

    With ``check`` the tests must pass without a mistake first; raises RuntimeError where they do not.
    """
    marks = {m.name: fingerprint(m) for m in mistakes}
    known = known_outcomes(marks)
    untried = [m for m in mistakes if m.name not in known]
    with tempfile.TemporaryDirectory() as root, ThreadPoolExecutor(workers) as pool:
        free = copies(workers if untried else 0, Path(root))
        if check and untried and (output := failing_tests(free, untried)):
            raise RuntimeError(f"The tests must pass without a mistake, but they fail:\n{output}")
        running = {m.name: pool.submit(partial(attempt, free, m, marks[m.name])) for m in untried}
        try:
            for mistake in mistakes:
                yield known.get(mistake.name) or running[mistake.name].result()
        finally:
            pool.shutdown(cancel_futures=True)


def main() -> int:
    """Try the mistakes; 1 where one passes that is not shown to change nothing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="mistakes whose name or file contains this text")
    parser.add_argument("--workers", type=int, default=2, help="copies to work in side by side")
    parser.add_argument("--no-check", action="store_true", help="do not run the tests without a mistake first")
    arguments = parser.parse_args()
    counts, unexpected = dict.fromkeys((CAUGHT, PASSED, BROKEN), 0), []
    try:
        mistakes = [m for m in read_mistakes() if arguments.only in m.name or arguments.only in m.file]
        silent = {m.name: m.changes_nothing for m in mistakes if m.changes_nothing}
        for number, outcome in enumerate(outcomes(mistakes, arguments.workers, check=not arguments.no_check), 1):
            counts[outcome.result] += 1
            unexpected += [outcome.name] if outcome.result != CAUGHT and outcome.name not in silent else []
            note = silent.get(outcome.name) or outcome.noticed_by
            print(f"{number:4}/{len(mistakes)} {outcome.result:7} {outcome.seconds:6.1f} s  {outcome.name}  {note}",
                  flush=True)  # fmt: skip
    except (ValueError, RuntimeError) as failure:
        print(failure, file=sys.stderr)
        return 2
    print(", ".join(f"{count} {result}" for result, count in counts.items())
          + f"; {len(silent)} of them change nothing.")  # fmt: skip
    print("".join(f"not noticed: {name}\n" for name in unexpected), end="")
    return int(bool(unexpected))


if __name__ == "__main__":
    sys.exit(main())
