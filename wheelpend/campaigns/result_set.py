"""Results of a campaign by log, in a Parquet data set that grows: a log that was asked the same before is known.

A question (the model, the analysis, the code) has a folder ``question=NAME`` in it. There every thousand results make a
file of their own; what came since is in a journal beside them, and logs that failed in the last run are in a file of
theirs, which says why: they are asked again.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, overload

import derive
import wheelpend
from wheelpend.campaigns.addresses import address_version, is_address
from wheelpend.campaigns.journal import Journal, fingerprint_of
from wheelpend.campaigns.manifest import Listed
from wheelpend.campaigns.one_log import CampaignSetting, LogResult, LogSource, empty_result
from wheelpend.campaigns.result_rows import (
    VERSION_COLUMN,
    Row,
    holds_result,
    plain_text,
    read_rows,
    result_of,
    row_of,
    write_rows,
)
from wheelpend.errors import Failure
from wheelpend.files import write_errors
from wheelpend.kernels.cache import derivation_fingerprint
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.model.transaction import held

QUESTION_PREFIX, PART_PATTERN = "question=", "part-[0-9][0-9][0-9][0-9][0-9]-*.parquet"
JOURNAL_NAME, FAILED_NAME = "_journal.partial", "failed.parquet"
PART_ROWS, HELD_PARTS, WINDOW_LOGS = 1000, 2, 2000
MEMORY_KEY, SEED_VERSION = "in memory ", "seed"
SERVER_CONNECTIONS = 32  # over which a server is asked at a time
STATED_COLUMNS = ("unit", "date", "conditions")


class _Place(NamedTuple):
    """Where a result is."""

    version: str
    stated: int  # hash of what the manifest said
    part: int
    row: int


class ResultSet:
    """Results of one question, those of earlier campaigns too.

    Without a folder, and for logs that are in no file, results stay in memory and nothing is written. Raises Failure
    where the folder holds something else.
    """

    def __init__(self, folder: Path | None, question: str) -> None:
        self.folder = folder / f"{QUESTION_PREFIX}{question}" if folder else None
        if self.folder is not None:
            refuse_links(self.folder)
        self._journal = Journal(self.folder / JOURNAL_NAME if self.folder else None, question)
        self._parts: list[Path] = []
        self._places: dict[str, _Place] = {}
        self._outdated: dict[int, set[int]] = {}  # rows of parts in whose place others came
        self._in_memory: dict[str, LogResult] = {}  # of this campaign: failures, and of logs that are in no file
        self._versions: dict[str, str] = {}
        self._held: dict[int, list[Row]] = {}
        self._found: list[tuple[Path, int]] = []  # the parts as they were when their places were found
        self._find_places()

    def _state(self) -> list[tuple[Path, int]]:
        """The parts that are there, and when each was written."""
        parts = sorted(self.folder.glob(PART_PATTERN)) if self.folder else []
        return [(path, path.stat().st_mtime_ns) for path in parts]

    def _find_places(self) -> None:
        """See which results are where; those that wait in the journal only where no part has them."""
        for found in (self._places, self._outdated, self._held):
            found.clear()
        self._found = self._state()
        self._parts = [path for path, _ in self._found]
        for part, path in enumerate(self._parts):
            self._note(part, read_rows(path, ["log", VERSION_COLUMN, *STATED_COLUMNS]))
        waiting = self._journal.results
        for key in [k for k, row in waiting.items() if not holds_result(row, k) or self._holds(k, row[VERSION_COLUMN])]:
            del waiting[key]  # became a part just before its process was killed, or is none

    @contextmanager
    def held(self, is_new: bool) -> Iterator[None]:
        """Keep other campaigns from changing these results, whose folder is made where something ``is_new``.

        Raises Failure where another one is at it, and where the folder cannot be made.
        """
        if self.folder is None:
            yield
            return
        if is_new:
            with write_errors(str(self.folder)):
                self.folder.mkdir(parents=True, exist_ok=True)
        with held(self.folder):
            for path in self.folder.glob(".*.partial*"):  # of a process that was killed
                path.unlink(missing_ok=True)
            if self._state() != self._found:  # another campaign added to them meanwhile
                self._find_places()
            if is_new:
                self._journal.begin()
            yield

    def knows(self, listed: Listed) -> bool:
        """True where a log was analysed before, and is as it was; one that failed is not known."""
        key = key_of(listed.log)
        version = self._version(key, listed.log)
        waiting = self._journal.results.get(key)
        return bool(version) and (
            (waiting is not None and waiting[VERSION_COLUMN] == version) or self._holds(key, version)
        )

    def look_at(self, sources: Sequence[Listed], progress: Callable[[str], object]) -> None:
        """Ask which versions of the logs are there, those behind addresses at once: an answer is waited for."""
        distant = [one.log for one in sources if is_address(one.log)]
        with ThreadPoolExecutor(SERVER_CONNECTIONS) as threads:
            for done, (source, version) in enumerate(zip(distant, threads.map(version_of, distant), strict=True), 1):
                self._versions[key_of(source)] = version
                if not done % SERVER_CONNECTIONS:
                    progress(f"asking after {done} of {len(distant)} logs")

    def _version(self, key: str, source: LogSource) -> str:
        """Version of a log as it was when it was first asked for."""
        if key not in self._versions:
            self._versions[key] = version_of(source)
        return self._versions[key]

    def _holds(self, key: str, version: str) -> bool:
        """True where a part has the result of this version of a log."""
        return key in self._places and self._places[key].version == version

    def add(self, listed: Listed, result: LogResult) -> None:
        """Take one more result, with what is stated of its log."""
        key = key_of(listed.log)
        version, stated = self._version(key, listed.log), with_what_is_listed(result, listed)
        if self.folder is None or isinstance(listed.log, Log) or result.failure is not None:
            self._in_memory[key] = stated
            if version and key in self._places:  # the file is another one now
                self._drop(self._places.pop(key))
            return
        self._journal.add(key, row_of(key, version, stated))
        if len(self._journal.results) >= PART_ROWS:
            self._write_part(self.folder)
            self._journal.begin()

    def results(self, listed: Sequence[Listed]) -> Sequence[LogResult]:
        """The results of these logs, in their order, once all are known; all are in files then, and no journal is."""
        if self.folder is None:
            return tuple(map(self.result, listed))
        if self.folder.is_dir():
            self._write_part(self.folder)
            self._write_failed(self.folder / FAILED_NAME)
            self._rewrite(listed)
            (self.folder / JOURNAL_NAME).unlink(missing_ok=True)
        return StoredResults(self, listed)

    def result(self, listed: Listed) -> LogResult:
        """The result of a log, with its name and what is stated of it."""
        key = key_of(listed.log)
        if (found := self._in_memory.get(key)) is not None:
            return with_what_is_listed(found, listed)
        waiting = self._journal.results.get(key)
        found = result_of(waiting if waiting is not None else self._row(key))
        return replace(with_what_is_listed(found, listed), log=empty_result(listed.log).log)

    def window(self, listed: Sequence[Listed]) -> list[LogResult]:
        """The results of some logs, for which no part is read twice."""
        order = sorted(range(len(listed)), key=lambda k: self._part_of(listed[k]))
        found = {k: self.result(listed[k]) for k in order}
        return [found[k] for k in range(len(listed))]

    def _part_of(self, listed: Listed) -> int:
        place = self._places.get(key_of(listed.log))
        return place.part if place is not None else -1

    def _row(self, key: str) -> Row:
        """The row of a log; another campaign may have moved it since. Raises Failure where it is gone."""
        for _ in range(2):
            place = self._places.get(key)
            rows = self._rows(place.part) if place is not None and self._parts[place.part].exists() else []
            if place is not None and place.row < len(rows) and rows[place.row]["log"] == key:
                return rows[place.row]
            self._find_places()
        raise Failure(f"{self.folder} must hold the result of {key}, but another campaign, or somebody, took it out "
                      "meanwhile. Repeat the command.")  # fmt: skip

    def _rows(self, part: int) -> list[Row]:
        """All rows of a part; those of the last few that were asked for are held."""
        if part not in self._held:
            if len(self._held) >= HELD_PARTS:
                del self._held[next(iter(self._held))]
            self._held[part] = read_rows(self._parts[part])
        return self._held[part]

    def _note(self, part: int, rows: Sequence[Row]) -> None:
        """Remember where the results of a part are, in place of earlier ones of the same logs."""
        for number, row in enumerate(rows):
            if (earlier := self._places.get(row["log"])) is not None:
                self._drop(earlier)
            self._places[row["log"]] = _Place(row[VERSION_COLUMN], _hash_of(row), part, number)

    def _drop(self, place: _Place) -> None:
        """Leave out a row when its part is written anew."""
        self._outdated.setdefault(place.part, set()).add(place.row)

    def _write_part(self, folder: Path) -> None:
        """What waits in the journal becomes a part."""
        if rows := list(self._journal.results.values()):
            mark = fingerprint_of((f"{row['log']} {row[VERSION_COLUMN]}" for row in rows), ())[:8]
            number = max((int(path.name[5:10]) for path in self._parts), default=-1) + 1
            path = folder / f"part-{number:05}-{mark}.parquet"
            write_rows(path, rows)
            self._parts.append(path)
            self._note(len(self._parts) - 1, rows)
            self._journal.results.clear()

    def _write_failed(self, path: Path) -> None:
        """Logs that failed when they were asked last, each with its reason."""
        before = {row["log"]: row for row in (read_rows(path) if path.exists() else [])}
        now = {
            key: row_of(key, "", r)
            for key, r in self._in_memory.items()
            if r.failure and not key.startswith(MEMORY_KEY)
        }
        if rows := {key: row for key, row in {**before, **now}.items() if key not in self._places}:
            write_rows(path, rows.values())
        else:
            path.unlink(missing_ok=True)

    def _rewrite(self, listed: Sequence[Listed]) -> None:
        """Write parts anew of which rows are outdated, or whose logs the manifest now says something else of."""
        restated: dict[int, dict[int, Row]] = {}
        for one in listed:
            place, stated = self._places.get(key_of(one.log)), stated_columns(one)
            if place is not None and place.stated != _hash_of(stated):
                restated.setdefault(place.part, {})[place.row] = stated
        for part in sorted({*restated, *self._outdated}):
            dropped, new = self._outdated.get(part, set()), restated.get(part, {})
            rows = [{**row, **new.get(k, {})} for k, row in enumerate(self._rows(part)) if k not in dropped]
            if rows:
                write_rows(self._parts[part], rows)
            else:
                self._parts[part].unlink(missing_ok=True)
            del self._held[part]
            for number, row in enumerate(rows):
                self._places[row["log"]] = _Place(row[VERSION_COLUMN], _hash_of(row), part, number)
        self._outdated.clear()


class StoredResults(Sequence[LogResult]):
    """Results that are read from their files as they are asked for, so that no more than a few are in memory."""

    def __init__(self, known: ResultSet, listed: Sequence[Listed]) -> None:
        self._known, self._listed = known, listed

    def __len__(self) -> int:
        return len(self._listed)

    def to_json(self) -> list[LogResult]:
        """The results, as a list of JSON."""
        return list(self)

    @overload
    def __getitem__(self, place: int) -> LogResult: ...
    @overload
    def __getitem__(self, place: slice) -> list[LogResult]: ...
    def __getitem__(self, place: int | slice) -> LogResult | list[LogResult]:
        if isinstance(place, slice):
            return [self._known.result(one) for one in self._listed[place]]
        return self._known.result(self._listed[place])

    def __iter__(self) -> Iterator[LogResult]:
        for begin in range(0, len(self._listed), WINDOW_LOGS):
            yield from self._known.window(self._listed[begin : begin + WINDOW_LOGS])


def is_result_set(path: Path) -> bool:
    """True where a folder holds results of campaigns."""
    return path.is_dir() and any(path.glob(f"{QUESTION_PREFIX}*"))


def with_what_is_listed(result: LogResult, listed: Listed) -> LogResult:
    """A log's result with its unit, date and conditions."""
    return replace(result, unit=listed.unit, date=listed.date, conditions=dict(listed.conditions))


def stated_columns(listed: Listed) -> Row:
    """What is stated of a log, as columns of its row."""
    pairs = [{"name": plain_text(n), "value": plain_text(v)} for n, v in listed.conditions.items()]
    return {"unit": plain_text(listed.unit), "date": plain_text(listed.date), "conditions": pairs}


def _hash_of(row: Row) -> int:
    """Hash of what a row states of its log."""
    return hash((row["unit"], row["date"], *((c["name"], c["value"]) for c in row["conditions"])))


def key_of(source: LogSource) -> str:
    """What names a log among others: its absolute path, its address or its seed; of one in no file a number."""
    if isinstance(source, Log):
        return f"{MEMORY_KEY}{id(source)}"
    if isinstance(source, int):
        return empty_result(source).log
    return plain_text(source if is_address(source) else os.path.abspath(source))


def version_of(source: LogSource) -> str:
    """Size and time of a log's file, or what its server says; empty where that is not known, or there is no file."""
    if isinstance(source, Log):
        return ""
    if isinstance(source, int):
        return SEED_VERSION
    if is_address(source):
        return address_version(source)
    try:
        files = sorted(Path(source).rglob("*")) if os.path.isdir(source) else [Path(source)]  # a folder: a bag
        return " ".join(f"{found.st_size} {found.st_mtime_ns}" for found in map(os.stat, files))
    except (OSError, ValueError):
        return ""


def refuse_links(folder: Path) -> None:
    """Raise Failure where results, or their folder, are links: they might be written over what is elsewhere."""
    for path in (folder.parent, folder, *(folder.iterdir() if folder.is_dir() else ())):
        if path.is_symlink():
            raise Failure(
                f"{path} must be of a campaign's results, but it is a link. Remove it, or name another --out."
            )


def question_of(setting: CampaignSetting, model: Model) -> str:
    """The analysis, and a hash of all besides a log that decides its result: the model, the question, and the code."""
    own = sorted(repr(derive.effects.USER_EFFECTS[n]) for n in model.own)
    asked = setting._replace(path=None, plant=None)  # of which the effects and the fingerprint count, wherever they are
    question = repr((asked, own, derive.plants.fingerprint(model.plant)))
    command = Path(setting.played.command) if setting.played else Path()
    files = (command, *sorted(Path(wheelpend.__file__).parent.rglob("*.py")))
    return f"{setting.do}-{fingerprint_of((question, derivation_fingerprint()), filter(Path.is_file, files))[:16]}"
