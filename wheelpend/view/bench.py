"""What all windows share: the workspace, its logs, the commands in turn, and what each of them last found.

Nothing here outlives the workspace: model and history are its files, and what a command found it finds again.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.model.record import Model
from wheelpend.model.toml_file import MODEL_FILE
from wheelpend.model.user_plants import load_plant
from wheelpend.model.workspace import history
from wheelpend.view.jobs import Job, command_line
from wheelpend.view.uploads import LOGS_FOLDER
from wheelpend.view.workspace_watch import WorkspaceWatch

Words = tuple[str, ...]
JUDGING_COMMANDS = ("compare", "diagnose", "predictions", "figures", "sliders")  # results hold for one model and logs


class Found(NamedTuple):
    """What a command found, and for which question."""

    words: Words
    model_digest: str
    result: dict[str, Any]  # as --json gives it
    text: list[str]  # as a terminal shows it
    number: int = 0  # of all that were found, in their order
    series: tuple[np.ndarray, ...] = ()  # of each log: time, then measured and predicted of every channel


class HeldStretch(NamedTuple):
    """A stretch of a log that was held out, of which the rest is a log of its own."""

    source: Path
    held_out: Path
    begin_s: float
    end_s: float


class Bench:
    """A workspace, logs, and commands that run one after another."""

    def __init__(
        self,
        model: Path,
        logs: Sequence[Path] = (),
        holdout: Sequence[Path] = (),
        first_run: bool = False,
        plant_file: Path | None = None,
    ):
        is_file = model.suffix == ".toml"
        self.folder, self.model_name = (model.parent, model.name) if is_file else (model, MODEL_FILE)
        self.folder = self.folder.absolute()
        self.logs, self.holdout = [p.absolute() for p in logs], [p.absolute() for p in holdout]
        self.first_run = first_run  # every click is named
        self.plant_file = plant_file.absolute() if plant_file else None  # of a plant of the user's own
        self.splits: dict[Path, HeldStretch] = {}  # by the rest's file
        self.watch = WorkspaceWatch(self.folder, self.model_name)
        self.job: Job | None = None
        self.waiting: list[Words] = []
        self.found: dict[str, Found] = {}
        self.done: list[str] = []  # command lines, as they were started
        self.failure, self.said = "", ""
        self.version = 0  # grows with every change that a window shows
        self._read_model: tuple[str, Model | None] | None = None  # with the state of its file
        self._started = 0
        self._started_with = self._seen = ""

    @property
    def files(self) -> Words:
        """The logs, as a command takes them."""
        return (
            *map(str, self.logs),
            *(part for p in self.holdout for part in ("--holdout", str(p))),
            *self.model_words,
        )

    @property
    def fitted_files(self) -> Words:
        """The logs that are fitted to, as a command takes them."""
        return (*map(str, self.logs), *self.model_words)

    @property
    def quoted_folder(self) -> str:
        """The workspace's folder as one types it."""
        return shlex.quote(str(self.folder))

    @property
    def can_judge(self) -> bool:
        """True where there are a log and a model, and nothing runs."""
        return bool(self.logs) and not self.is_busy and (self.folder / self.model_name).exists()

    @property
    def view_words(self) -> Words:
        """The command that opens the workbench again, from any folder."""
        return (
            "wheelpend",
            "view",
            *self.files[: len(self.files) - len(self.model_words)],
            "--model",
            str(self.folder / self.model_name),
            *self.plant_words,
        )

    @property
    def model_words(self) -> Words:
        """The model, and the file of its plant, as a command takes them."""
        model = ("--model", self.model_name) if self.model_name != MODEL_FILE else ()
        return (*model, *self.plant_words)

    @property
    def plant_words(self) -> Words:
        """The file of a plant of the user's own, as a command takes it."""
        return ("--plant", str(self.plant_file)) if self.plant_file else ()

    @property
    def is_busy(self) -> bool:
        """True while a command runs or waits."""
        return self.job is not None or bool(self.waiting)

    def model(self) -> Model | None:
        """The model as it stands, or None where there is none that can be read; read anew where it changed."""
        state = self.watch.model_digest()
        if self._read_model is None or self._read_model[0] != state:
            self._read_model = state, self._opened_model()
        return self._read_model[1]

    def _opened_model(self) -> Model | None:
        try:
            if self.plant_file:
                load_plant(self.plant_file)
            return Model.open(self.folder / self.model_name)
        except (Failure, OSError):
            return None

    def history(self) -> list[dict[str, Any]]:
        """Every change of the model, oldest first; none where they cannot be read."""
        try:
            return history(self.folder)
        except Failure:
            return []

    def current(self, command: str) -> Found | None:
        """What a command found, if that is of the model and the logs as they stand."""
        found = self.found.get(command)
        if found is None or (command in JUDGING_COMMANDS and not self._is_current(found)):
            return None
        return found

    def numbers(self, *commands: str) -> tuple[int, ...]:
        """Which results of these commands hold; -1 for one that held once, -2 for none: what a panel shows follows."""
        return tuple(self._number(name) for name in commands)

    def _number(self, command: str) -> int:
        found = self.current(command)
        return found.number if found else -1 if command in self.found else -2

    def _is_current(self, found: Found) -> bool:
        return (
            found.model_digest == self.watch.model_digest()
            and found.words[len(found.words) - len(self.files) :] == self.files
        )

    def open_log(self, path: Path) -> None:
        """Open a log, to be fitted to."""
        if path.absolute() not in (*self.logs, *self.holdout):
            self.logs.append(path.absolute())
            self.version += 1

    def shut(self, path: Path) -> None:
        """Close a log; its file stays."""
        self.logs = [p for p in self.logs if p != path]
        self.holdout = [p for p in self.holdout if p != path]
        self.version += 1

    def move(self, path: Path) -> None:
        """Hold a log out, or fit to one that was."""
        there, here = (self.holdout, self.logs) if path in self.logs else (self.logs, self.holdout)
        here.remove(path)
        there.append(path)
        self.version += 1

    def hold_out_stretch(self, path: Path, begin_s: float, end_s: float) -> None:
        """Split a log, of which a stretch [s] is to judge; one that was split before is split elsewhere."""
        (self.folder / LOGS_FOLDER).mkdir(exist_ok=True)
        source = self.splits[path].source if path in self.splits else path
        stretch = ("--from", f"{begin_s:g}", "--to", f"{end_s:g}", "-o", LOGS_FOLDER)
        self.run(("split", str(source), *stretch, *self.model_words))

    def join(self, path: Path) -> None:
        """Fit to the whole of a log again, of which a stretch was held out."""
        split = self.splits.pop(path)
        self.logs = [split.source if p == path else p for p in self.logs]
        self.holdout = [p for p in self.holdout if p != split.held_out]
        self.version += 1

    def _take_split(self, found: Mapping[str, Any]) -> None:
        """Open the two files that a split wrote in place of its log, and compare anew."""
        source, rest, held_out = (self.folder / str(found[key]) for key in ("log", "rest", "held_out"))
        for path in [p for p, split in self.splits.items() if split.source == source]:
            self.join(path)
        if source not in self.logs:
            return  # it was closed meanwhile
        self.logs = [rest if p == source else p for p in self.logs]
        self.holdout = [*(p for p in self.holdout if p != held_out), held_out]
        self.splits[rest] = HeldStretch(source, held_out, found["from_s"], found["to_s"])
        self.waiting += [(name, *self.files) for name in ("compare", "predictions")]

    def run(self, *commands: Words) -> None:
        """Run commands one after another; each but the first only where the one before it succeeded."""
        if self.is_busy:
            return
        self.failure, self.said = "", ""
        self.waiting = list(commands)
        self._start_next()

    def cancel(self) -> None:
        """End what runs, and start nothing of what waits."""
        self.waiting.clear()
        if self.job is not None:
            self.job.cancel()
        self.version += 1

    def close(self) -> None:
        """End what runs, as Ctrl-C does."""
        self.cancel()
        while self.job is not None:
            self.tick()

    def tick(self) -> None:
        """Take up what ended, start what waits, notice what changed."""
        if self.job is not None and self.job.code is not None:
            self._finish(self.job)
        if self.job is None and self.waiting:
            self._start_next()
        if (state := self.watch.digest()) != self._seen:
            self._seen = state
            self.version += 1

    def _start_next(self) -> None:
        words = self.waiting.pop(0)
        self._started_with = self.watch.model_digest()
        self.job = Job(words, self.folder)
        self._started += 1
        if not self.job.is_own:
            self.done.append(command_line(words))
        self.version += 1

    def _finish(self, job: Job) -> None:
        """Take up what a command found, or why it did not; whatever it left, the next can run."""
        self.job = None
        try:
            if job.code == 0:
                series = tuple(job.series() if job.is_own else ())
                found = Found(job.words, self._started_with, job.result(), job.text(), self._started, series)
                self.found[job.words[0]] = found
                self.said = next(iter(job.text()), "")
                if job.words[0] == "split":
                    self._take_split(found.result)
            else:
                self.waiting.clear()
                self.failure = job.failure()
                self.said = "Cancelled; nothing was changed." if job.was_cancelled else ""
        except (OSError, ValueError, KeyError, TypeError) as error:
            self.waiting.clear()
            self.failure = f"{job.line} must leave a result that can be read, but it did not: {error} Run it once more."
        job.forget()
        self.version += 1
