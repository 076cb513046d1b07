"""Files that a command is to write, refused where they hold what is to be kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.errors import Failure
from wheelpend.files import check_writable

_given: list[Path] = []  # every path of the command line that runs, those of outputs among them


def note_given(paths: Sequence[str]) -> None:
    """Note the paths of a command line that begins, those of its outputs among them."""
    _given[:] = map(Path, paths)


def check_output(path: Path, *, may_be_given: bool = False) -> None:
    """Raise Failure where a file cannot be written, is another one that the command was given, or a workspace's own."""
    check_writable(path)
    place = path.resolve()
    if not may_be_given and [p.resolve() for p in _given].count(place) > 1:
        raise Failure(f"What a command writes must be another file than those it is given, but {path} is named twice. "
                      "Name another.")  # fmt: skip
    if _is_workspace_file(place):
        raise Failure(f"What a command writes must not replace a file of a workspace, but {path} is one. Name another.")


def _is_workspace_file(place: Path) -> bool:
    # imported late: the list of commands needs none of it
    from wheelpend.model.toml_file import MODEL_FILE, USER_EFFECTS_FILE
    from wheelpend.model.transaction import GENERATED_FOLDER
    from wheelpend.model.workspace import HISTORY_FILE

    generated = place.parent.name == GENERATED_FOLDER and (place.parent.parent / MODEL_FILE).exists()
    return generated or place.name in (MODEL_FILE, USER_EFFECTS_FILE, HISTORY_FILE)
