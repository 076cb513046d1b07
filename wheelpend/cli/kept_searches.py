"""A search whose model, logs and program are as they were is not made again: its answer is taken up.

So `report` needs no search after `explain`, and neither does `explain --save` after `explain`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from hashlib import file_digest, sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import derive
from wheelpend.errors import Failure
from wheelpend.kernels.cache import derivation_fingerprint
from wheelpend.kernels.kept_records import keep_record, kept_record
from wheelpend.model.record import Model
from wheelpend.reports.console import print_note

Found = TypeVar("Found")

KEPT_VARIABLE = "WHEELPEND_KEPT_SEARCHES"  # so many of each kind are kept; none at 0
MANY_SEARCHES = 16
PACKAGE_FOLDER = Path(__file__).parents[1]
DECIDING_PACKAGES = ("numpy", "scipy", "numba", "polars")  # beside those that the derivation depends on
KEPT_SENTENCE = "Nothing was searched again: model, logs and program are as they were in an earlier search."


def searched(
    kind: str,
    search: Callable[..., Found],
    model: Model,
    files: tuple[Sequence[Path], Sequence[Path]],
    options: Mapping[str, Any],
    progress: Callable[[str], None],
) -> Found:
    """What a search of a model on logs finds, or found earlier: then that is said, and nothing is searched.

    ``files`` are the logs and those held out, ``options`` whatever else decides the answer. Raises what the search
    raises, and Failure where a number of searches to keep is stated that is none.
    """
    most = searches_to_keep()
    key = _fingerprint(model, files, options)
    found = kept_record(kind, key) if most else None
    if found is not None:
        print_note(KEPT_SENTENCE)
        return found
    found = search(model, *files, **options, progress=progress)
    if most and _fingerprint(model, files, options) == key:  # else a log was written to while it was searched
        with suppress(OSError):  # a full disk, say: the answer is there all the same
            keep_record(kind, key, found, most)
    return found


def searches_to_keep() -> int:
    """How many searches of a kind are kept; raises Failure where what is stated is no number of them."""
    stated = os.environ.get(KEPT_VARIABLE, str(MANY_SEARCHES))
    if not stated.isdecimal():
        raise Failure(f"{KEPT_VARIABLE} must be how many searches are kept, 0 for none, not '{stated}'.")
    return int(stated)


def _fingerprint(model: Model, files: tuple[Sequence[Path], Sequence[Path]], options: Mapping[str, Any]) -> str:
    """Hash of everything that decides what a search finds."""
    own_effects = [repr(derive.effects.USER_EFFECTS[name]) for name in model.own]
    logs = [[(str(path), _content_hash(path)) for path in paths] for paths in files]
    asked = (str(model.path), model.text, derive.plants.fingerprint(model.plant), own_effects, logs)
    return sha256(repr((asked, sorted(options.items()), _program_fingerprint())).encode()).hexdigest()[:32]


@lru_cache
def _program_fingerprint() -> str:
    """Hash of the derivation, of the package's sources and of the libraries that compute with them."""
    digest = sha256(repr((sys.version, *map(version, DECIDING_PACKAGES), derivation_fingerprint())).encode())
    for path in sorted(PACKAGE_FOLDER.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _content_hash(path: Path) -> str:
    """Hash of a file; of a folder, as of a bag, names, sizes and times of its files; of what is neither nothing."""
    if path.is_dir():
        found = ((part.name, part.stat()) for part in sorted(path.iterdir()) if part.is_file())
        return repr([(name, of.st_size, of.st_mtime_ns) for name, of in found])
    if not path.is_file():
        return ""  # that it cannot be read, reading it will say
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
