"""Modules made from texts that were read, never from the bytecode that lies beside their files."""

from __future__ import annotations

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any


class _CodeLoader(SourceFileLoader):
    """A loader of code that is there already; the file is that of its text, for tracebacks."""

    def __init__(self, name: str, path: str, code: CodeType) -> None:
        super().__init__(name, path)
        self._code = code

    def get_code(self, fullname: str) -> Any:
        """The code, whatever is in the file by now."""
        return self._code


def compiled(text: bytes, path: Path) -> CodeType:
    """Code of a module's text; raises what its syntax raises."""
    return compile(text, str(path), "exec", dont_inherit=True)


def new_module(name: str, path: Path, code: CodeType) -> ModuleType:
    """A module of that code, which has not run; `run` does."""
    spec = spec_from_file_location(name, path, loader=_CodeLoader(name, str(path), code))
    assert spec, "a loader is given"
    return module_from_spec(spec)


def run(module: ModuleType) -> None:
    """Run the code of a new module; raises what it raises."""
    spec = module.__spec__
    assert spec and spec.loader, "it was made by new_module"
    spec.loader.exec_module(module)
