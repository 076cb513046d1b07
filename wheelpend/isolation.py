"""Nothing of the current folder is imported or taken for configuration: it may be that of somebody else's logs.

Every process of Python that this package starts is started by what stands here, and every library that looks for a
configuration in the current folder is imported by it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType

PACKAGE_ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
LIBRARY_FOLDER = os.path.dirname(os.path.realpath(os.__file__))  # of Python's own library
PATH_VARIABLES = ("NUMBA_CACHE_DIR", "MATPLOTLIBRC", "MPLCONFIGDIR")  # a user's own configuration of them
WORKER_VARIABLES = ("PYTHONPATH", "PYTHONSAFEPATH", *PATH_VARIABLES)


def leave_out_current_folder() -> None:
    """Import nothing from the current folder from now on, where nobody said that this process should."""
    sys.path[:] = trusted_path()


def trusted_path() -> list[str]:
    """Where to import from: `sys.path`, absolute, without the current folder.

    Python puts that folder in front of its own library, for `-c`, `-m`, or an empty entry of PYTHONPATH. It stays where
    PYTHONPATH names it, or the running program lies in it; and so does what was installed. The folder of this package
    comes in front of other packages, but behind Python's library.
    """
    current, named = current_folder(), {*map(_real, _stated_folders()), _program_folder()}
    path = [os.path.join(current, folder) for folder in sys.path]
    library = next((k for k, folder in enumerate(path) if _real(folder) == LIBRARY_FOLDER), len(path))
    kept = [p for k, p in enumerate(path) if k >= library or _real(p) != current or current in named]
    if PACKAGE_ROOT not in map(_real, kept):
        packages = (k for k, folder in enumerate(kept) if folder.endswith("-packages"))
        kept.insert(next(packages, len(kept)), PACKAGE_ROOT)
    return kept


def _stated_folders() -> list[str]:
    """Folders that PYTHONPATH names, absolute; an empty entry, which stands for the current folder, names none."""
    return [os.path.join(current_folder(), p) for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p]


def _program_folder() -> str:
    """The folder from which a user's program imports its own files; empty for a prompt, `-c`, and this package."""
    program = sys.modules["__main__"]
    spec, file = getattr(program, "__spec__", None), getattr(program, "__file__", None)
    if not file or (spec and spec.name.partition(".")[0] == __package__):
        return ""
    folder = os.path.dirname(_real(file))
    for _ in range(spec.name.count(".") if spec else 0):
        folder = os.path.dirname(folder)
    return folder


def _real(folder: str) -> str:
    return os.path.realpath(folder) if os.path.isabs(folder) else folder


def current_folder() -> str:
    """The current folder, without links; empty where it was removed."""
    try:
        return os.getcwd()
    except FileNotFoundError:
        return ""


def can_start_python() -> bool:
    """True where this is a Python that can be started again, not a program that has one in it."""
    return os.path.basename(sys.executable or "").lower().startswith(("python", "pypy"))


def python_command(*arguments: str, executable: str = "") -> list[str]:
    """The command that starts Python, this one unless another is given, without the current folder on its path."""
    return [executable or sys.executable, "-P", *arguments]


def python_environment() -> dict[str, str]:
    """Variables of the environment for another process of Python, wherever that runs."""
    stated = {name: os.environ[name] for name in PATH_VARIABLES if os.environ.get(name)}
    absolute = {name: os.path.join(current_folder(), path) for name, path in stated.items()}
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    folders = {"PYTHONPATH": os.pathsep.join(_stated_folders())} if _stated_folders() else {}
    return kept | absolute | folders | {"PYTHONSAFEPATH": "1"}


@contextmanager
def starting_workers() -> Iterator[None]:
    """Workers of multiprocessing that start inside import nothing from the current folder, from their first line on.

    They take over this process's environment and search path.
    """
    path, wanted = sys.path.copy(), python_environment()
    before = {name: os.environ.get(name) for name in WORKER_VARIABLES}
    sys.path[:] = trusted_path()
    _set_variables({name: wanted.get(name) for name in WORKER_VARIABLES})
    try:
        yield
    finally:
        sys.path[:] = path
        _set_variables(before)


def _set_variables(values: Mapping[str, str | None]) -> None:
    for name, value in values.items():
        os.environ.pop(name, None)
        if value is not None:
            os.environ[name] = value


def import_configured(name: str) -> ModuleType:
    """Import a library that takes files of the current folder for its configuration, with none but the user's own.

    It is imported from the root of the file system. The environment may name a configuration.
    """
    if name not in sys.modules:
        os.environ.update({k: v for k, v in python_environment().items() if k in PATH_VARIABLES})
        with _at_root():
            import_module(name)
    return sys.modules[name]


@contextmanager
def _at_root() -> Iterator[None]:
    """The root of the file system is the current folder inside."""
    current = current_folder()  # a folder that was removed holds nothing
    try:
        os.chdir(os.sep)
        yield
    finally:
        if current:
            os.chdir(current)
