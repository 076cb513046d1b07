"""Logs behind addresses like ``s3://bucket/run.csv``, through fsspec: which are there, their versions, copies."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeGuard

from wheelpend.errors import Failure

if TYPE_CHECKING:
    from fsspec import AbstractFileSystem

ADDRESS_BEGINNING = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
VERSION_KEYS = (
    "size", "ETag", "etag", "Content-MD5", "content_md5", "Digest", "md5Hash", "sha", "generation",
    "Last-Modified", "LastModified", "last_modified", "updated", "mtime", "modified", "modify", "created",
)  # fmt: skip
CHAIN_MARK = "::"  # of fsspec: an address within another


def is_address(source: Any) -> TypeGuard[str]:
    """True of a text that names a protocol, as in ``https://``."""
    return isinstance(source, str) and ADDRESS_BEGINNING.match(source) is not None


def folder_of(address: str) -> str:
    """The address without its last part."""
    return address.rpartition("/")[0]


def name_of(address: str) -> str:
    """The name of the file, without what is asked of a server."""
    name = re.split(r"[?#]", address)[0].rpartition("/")[2]
    return name if name.strip(".") else "log"


def matching(pattern: str) -> list[str]:
    """Addresses of the files that fit a pattern, sorted; raises Failure where none does, or they cannot be listed."""
    with _saying(pattern, "listed"):
        system, path = _place_of(pattern)
        found = [system.unstrip_protocol(name) for name in system.glob(path)]
    if not found:
        raise Failure(f"A pattern must fit some file, but none fits {pattern}.")
    return sorted(map(str, found))


def address_version(address: str) -> str:
    """What a server says of a file that tells it from a later one: size, tag, time; empty where it says nothing."""
    try:
        with _saying(address, "found"):
            system, path = _place_of(address)
            said = system.info(path)
    except Failure:
        return ""  # what is wrong with it its analysis says
    return " ".join(str(said[key]) for key in VERSION_KEYS if said.get(key) is not None)


def head_of(address: str, size: int) -> bytes:
    """The first bytes of a file, at most so many; raises Failure where it cannot be read."""
    with _saying(address, "read"):
        system, path = _place_of(address)
        return bytes(system.cat_file(path, start=0, end=size))[:size]


@contextmanager
def fetched(address: str) -> Iterator[Path]:
    """A copy of a file, which is there during the block; raises Failure where it cannot be had."""
    with TemporaryDirectory(prefix="wheelpend-", ignore_cleanup_errors=True) as folder:
        copy = Path(folder) / name_of(address)
        with _saying(address, "fetched"):
            system, path = _place_of(address)
            system.get_file(path, str(copy))
        yield copy


def _place_of(address: str) -> tuple[AbstractFileSystem, str]:
    """The file system behind an address, as fsspec and its libraries are configured, and the path there."""
    from fsspec.core import url_to_fs  # imported late: local logs need none of it

    if CHAIN_MARK in address:
        raise Failure(f"An address must name one protocol, but {address} names several. Name the file itself.")
    system, path = url_to_fs(address)
    system.invalidate_cache()  # files may have come, or changed, since it was asked
    return system, path


@contextmanager
def _saying(address: str, what: str) -> Iterator[None]:
    """Turn whatever fsspec and its libraries raise over an address into a Failure."""
    try:
        yield
    except Failure:
        raise
    except ImportError as error:
        raise Failure(f"{address} needs a library that is not installed: {error}. Extras of wheelpend are `http` and "
                      "`s3`.") from error  # fmt: skip
    except FileNotFoundError as error:
        raise Failure(f"{address} must exist, but there is no such file.") from error
    except Exception as error:
        said = " ".join(str(error).split())
        raise Failure(f"{address} cannot be {what}: {type(error).__name__}{f': {said}' if said else ''}. It must be an "
                      "address that fsspec knows, of a file that may be read.") from error  # fmt: skip
