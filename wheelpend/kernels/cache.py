"""Cache of derived texts: files under names that carry a hash of everything that decides their content."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import derive
from derive.files import DERIVE_FOLDER, TEMPLATE_FOLDER
from wheelpend.kernels.cache_folder import cache_folder
from wheelpend.kernels.sealed_files import read_sealed, write_sealed

_texts_in_memory: dict[Path, str] = {}  # by file, those that this process has read or made


@lru_cache
def derivation_fingerprint() -> str:
    """Hash of everything that decides what the derivation produces: its sources, its templates, sympy and Jinja."""
    from importlib.metadata import version

    digest = hashlib.sha256((version("sympy") + version("jinja2")).encode())
    for path in sorted({*DERIVE_FOLDER.rglob("*.py"), *TEMPLATE_FOLDER.rglob("*.j2"), *TEMPLATE_FOLDER.rglob("*.py")}):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cached_text(kind: str, plant: str, depends_on: object, make: Callable[[], str]) -> str:
    """A text of a plant from the cache, made and kept where no text of these sources and ``depends_on`` is there."""
    key = repr((plant, derive.plants.fingerprint(plant), depends_on, derivation_fingerprint()))
    path = cache_folder() / f"{kind}_{hashlib.sha256(key.encode()).hexdigest()[:24]}.text"
    if path not in _texts_in_memory:
        kept = read_sealed(path)
        text = make() if kept is None else kept.decode()
        if kept is None:
            write_sealed(path, text.encode())
        _texts_in_memory[path] = text
    return _texts_in_memory[path]
