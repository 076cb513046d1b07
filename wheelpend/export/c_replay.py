"""A log replayed by the exported C code, compiled with this machine's compiler."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from wheelpend.export.c_target import SOURCE_FILE, c_files, c_replay_text
from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.replay import Replay, as_numbers, from_numbers
from wheelpend.export.running import C_COMPILERS, COMPILER_FLAGS, found_program, run_program


def replay_in_c(exported: ExportedModel, replay: Replay, single: bool = False) -> tuple[float | None, str]:
    """Error [σ] of the exported code on logs, in double or single precision, and how it was compiled, or why not."""
    compiler = found_program(C_COMPILERS, "CC")
    if not compiler:
        return None, "no C compiler is installed here"
    with tempfile.TemporaryDirectory(prefix="wheelpend-export-") as name:
        folder = Path(name)
        for path, text in (c_files(exported) | {"replay.c": c_replay_text(exported)}).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        flags = [*COMPILER_FLAGS, *(["-DWP_SINGLE"] if single else [])]
        command = [compiler, *flags, "-Isrc", f"src/{SOURCE_FILE}", "replay.c", "-o", "replay", "-lm"]
        if wrong := run_program(command, folder)[1]:
            return None, wrong
        numbers = "\n".join(map(repr, as_numbers(exported, replay)))
        shown, wrong = run_program([str(folder / "replay")], folder, numbers)
    if wrong:
        return None, wrong
    predicted = from_numbers(replay, np.array(shown.split(), dtype=float))
    return replay.error_of(
        predicted
    ), f"compiled with {Path(compiler).name}, in {'single' if single else 'double'} precision"
