"""Generated modules as files of the cache: their text, and its bytecode, which Python would take as it finds it."""

from __future__ import annotations

import hashlib
import marshal
import sys
from importlib.util import MAGIC_NUMBER
from pathlib import Path
from types import CodeType, ModuleType

import derive
from wheelpend.kernels.kernel_module import KERNEL_MODULE_PREFIX
from wheelpend.kernels.sealed_files import read_sealed, say_damaged, write_sealed
from wheelpend.text_modules import compiled, new_module, run


def generated_name(name: str, text: bytes) -> str:
    """The name of the module of a text, with its hash."""
    return f"{KERNEL_MODULE_PREFIX}{name}_{hashlib.sha256(text).hexdigest()[:16]}"


def text_name(module_name: str) -> str:
    """The name under which a module's text was loaded, from that of the module."""
    return module_name.removeprefix(KERNEL_MODULE_PREFIX).rpartition("_")[0]


def write_unless_there(path: Path, text: bytes) -> None:
    """Write a module's text where its file is not there or is not that text; raises OSError where it cannot be."""
    found = path.read_bytes() if path.exists() else None
    if found == text:
        return
    if found is not None:
        say_damaged(path)
    derive.write(path.parent, {path.name: text.decode()})


def import_text(module_name: str, path: Path, text: bytes) -> ModuleType:
    """Import a generated module of this text; raises ValueError where its name carries the hash of another one."""
    if not module_name.endswith(f"_{hashlib.sha256(text).hexdigest()[:16]}"):
        raise ValueError(f"{path} is not the text of {module_name}")
    module = new_module(module_name, path, _code_of(path, text))
    sys.modules[module_name] = module
    run(module)
    return module


def _code_of(path: Path, text: bytes) -> CodeType:
    """Bytecode of a text, which takes a while to make and is kept for this Python."""
    release = f"{sys.implementation.cache_tag}-{int.from_bytes(MAGIC_NUMBER[:2], 'little')}-{sys.flags.optimize}"
    kept = path.with_name(f"{path.stem}.{release}.bytecode")
    content = read_sealed(kept)
    code = None if content is None else marshal.loads(content)
    if code is None or code.co_filename != str(path):  # the folder was moved
        code = compiled(text, path)
        write_sealed(kept, marshal.dumps(code))
    return code
