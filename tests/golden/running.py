"""Run chains of commands in fresh workspaces and keep what they give.

A record is a folder with one folder per step, CHAIN/STEP: `call.json` (arguments and exit code), `stdout.txt`,
`stderr.txt`, `answer.json` (of --json) and `files/`.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic

from cases import LOGS, WARM, Chain, Cut, Edit, Step
from normalise import fingerprint, page_text, without_dates, without_paths, without_progress, without_times

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "data"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "WHEELPEND_THREADS")
ANSWER = "answer.json"  # in the workspace as well
SETTING = {"COLUMNS": "100", "NO_COLOR": "1", "PYTHONHASHSEED": "0", "PYTHONUTF8": "1", "TERM": "dumb",
           "WHEELPEND_KEPT_SEARCHES": "0"}  # fmt: skip


def record(out: Path, chains: Sequence[Chain], checkout: Path = ROOT, threads: int = 1, jobs: int = 2) -> None:
    """Run chains with the code of a checkout, some side by side, and write the record."""
    first = [chain for chain in chains if chain == WARM]  # what it compiles is then there for all
    for together in (first, [chain for chain in chains if chain != WARM]):
        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda chain: _timed(out, chain, checkout, threads), together))


def _timed(out: Path, chain: Chain, checkout: Path, threads: int) -> None:
    begin = monotonic()
    run_chain(out / chain.name, chain, checkout, threads)
    print(f"{chain.name}: {monotonic() - begin:.1f} s", file=sys.stderr, flush=True)


def run_chain(out: Path, chain: Chain, checkout: Path = ROOT, threads: int = 1) -> None:
    """Run the steps of a chain in a fresh workspace and write the record of each."""
    with tempfile.TemporaryDirectory(prefix="golden_") as folder:
        workspace = Path(folder)
        write_logs(workspace / "logs", LOGS)
        for step in chain.steps:
            run_step(out / step.name, step, workspace, checkout, threads)


def run_step(out: Path, step: Step, workspace: Path, checkout: Path, threads: int) -> None:
    """Run one command and write its record."""
    if step.edit:
        edit(workspace, step.edit)
    (workspace / ANSWER).unlink(missing_ok=True)
    command = ["-c", step.script] if step.script else ["-m", "wheelpend", *step.arguments]
    done = subprocess.run(
        [sys.executable, *command, *(["--json", ANSWER] if step.json else [])],
        cwd=workspace, env=environment(checkout, threads), capture_output=True, text=True, encoding="utf-8",
        check=False,
    )  # fmt: skip
    folders = {workspace: "<workspace>", checkout: "<checkout>", cache(): "<cache>"}
    call = {"arguments": step.arguments, "exit": done.returncode}
    texts = {
        "call.json": json.dumps(call, indent=1) + "\n",
        "stdout.txt": without_times(done.stdout),
        "stderr.txt": without_progress(done.stderr),
    }
    if (workspace / ANSWER).exists():
        texts[ANSWER] = (workspace / ANSWER).read_text(encoding="utf-8")
    for path in written(workspace, step.files):
        name = path.relative_to(workspace)
        texts[f"files/{name}{'.sha256' if path.suffix == '.png' else ''}"] = file_text(path)
    for place, text in texts.items():
        (out / place).parent.mkdir(parents=True, exist_ok=True)
        (out / place).write_text(without_dates(without_paths(text, folders)), encoding="utf-8")


def written(workspace: Path, patterns: Iterable[str]) -> list[Path]:
    """Files that a step was to write."""
    return sorted(path for pattern in patterns for path in workspace.glob(pattern))


def file_text(path: Path) -> str:
    """A written file as text: a page with its figures' numbers, a picture as its fingerprint."""
    if path.suffix == ".png":
        return fingerprint(path.read_bytes()) + "\n"
    text = path.read_text(encoding="utf-8")
    return page_text(text) if path.suffix == ".html" else text


def environment(checkout: Path, threads: int) -> dict[str, str]:
    """Of every command: the checkout's code, so many threads, a width of the terminal."""
    return {**os.environ, **SETTING, **dict.fromkeys(THREADS, str(threads)), "PYTHONPATH": str(checkout)}


def cache() -> Path:
    """The folder under which texts and machine code are kept, as the commands see it."""
    kept = os.environ.get("WHEELPEND_CACHE") or os.environ.get("XDG_CACHE_HOME")
    return Path(kept) if kept else Path.home() / ".cache"


def edit(workspace: Path, change: Edit) -> None:
    """Change a file as by hand; raises ValueError where there is nothing to change."""
    path = workspace / change.file
    text = path.read_text(encoding="utf-8")
    if change.old not in text:
        raise ValueError(f"{change.file} must hold {change.old!r} to be edited, but it does not.")
    path.write_text(text.replace(change.old, change.new, 1), encoding="utf-8")


def write_logs(folder: Path, logs: dict[str, Cut]) -> None:
    """Cut the logs of a workspace from the shipped ones."""
    folder.mkdir()
    for name, cut in logs.items():
        with (DATA / cut.source).open(encoding="utf-8", newline="") as file:
            header, *rows = list(csv.reader(file))
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *cut_rows(header, rows, cut)])


def cut_rows(header: list[str], rows: list[list[str]], cut: Cut) -> list[list[str]]:
    """Rows of a cut log."""
    kept = [*rows[: min(cut.gap[0], cut.rows)], *rows[cut.gap[1] : cut.rows]]
    if not cut.flipped:
        return kept
    at = header.index(cut.flipped)
    return [[*row[:at], repr(-float(row[at])), *row[at + 1 :]] for row in kept]
