"""Every state in which a command can leave a folder when it is killed, from one run of it.

A process that is killed before it changes a file leaves the folder as it then is. So one run that looks at the folder
before every change, as the interpreter announces them, sees what a kill at each of them would leave. A file that did
not get its contents by a renaming is also seen empty and half written.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

State = dict[str, bytes]  # contents of every file by its place in the folder
CHANGES = (
    "open",
    "os.rename",
    "os.remove",
    "os.rmdir",
    "os.mkdir",
    "os.truncate",
    "os.link",
    "os.symlink",
    "shutil.rmtree",
)
WRITING = os.O_WRONLY | os.O_RDWR


def read_state(folder: Path) -> State:
    """A folder as it is."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def write_state(folder: Path, state: State) -> None:
    """A folder as it was."""
    for name, data in state.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


class _Watch:
    """States of a folder before each change."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.states, self.events = folder, [], []  # type: ignore[var-annotated]
        self.is_looking = False

    def announce(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.is_looking or event not in CHANGES or not self.concerns(event, arguments):
            return
        self.look((event, *arguments))

    def concerns(self, event: str, arguments: tuple[Any, ...]) -> bool:
        if event == "open" and not (isinstance(arguments[2], int) and arguments[2] & WRITING):
            return False
        paths = [a for a in arguments[:2] if isinstance(a, str | os.PathLike)]
        return any(Path(os.path.abspath(p)).is_relative_to(self.folder) for p in paths)

    def look(self, event: tuple[Any, ...]) -> None:
        self.is_looking = True
        try:
            self.states.append(read_state(self.folder))
            self.events.append(event)
        finally:
            self.is_looking = False


_watches: list[_Watch] = []  # at most one, which the interpreter's hook, that cannot be removed, tells
_hooked: list[bool] = []


@contextmanager
def watched(folder: Path) -> Iterator[_Watch]:
    """Look at a folder before every change of the block, and at its end."""
    if not _hooked:
        sys.addaudithook(lambda event, arguments: [w.announce(event, arguments) for w in _watches] and None)
        _hooked.append(True)
    watch = _Watch(Path(os.path.realpath(folder)))
    watch.look(("begin",))
    _watches.append(watch)
    try:
        yield watch
    finally:
        _watches.remove(watch)
        watch.look(("end",))


def states_of_kills(folder: Path, work: Callable[[], object]) -> list[State]:
    """Every different state in which a kill during some work can leave a folder; the last is that of its end."""
    with watched(folder) as watch:
        work()
    found: list[State] = []
    for k, state in enumerate(watch.states):
        if k:
            found += half_written(watch.states[k - 1], state, watch.events[k - 1])
        found.append(state)
    distinct = {tuple(sorted(state.items())): state for state in found}
    return [*(s for s in distinct.values() if s != watch.states[-1]), watch.states[-1]]


def half_written(before: State, after: State, event: tuple[Any, ...]) -> Iterator[State]:
    """States between two looks: files that one change was writing, empty and by half."""
    if event[0] == "os.rename":
        return
    appended = event[0] == "open" and "a" in str(event[2])
    for name, data in after.items():
        old = before.get(name, b"")
        if data == old:
            continue
        kept = len(old) if appended and data.startswith(old) else 0
        for length in {kept, kept + (len(data) - kept) // 2}:
            yield {**before, name: data[:length]}
