"""A log replayed by the exported JavaScript, with this machine's Node."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.javascript_target import REPLAY_FILE, javascript_files, javascript_replay_text
from wheelpend.export.replay import Replay, as_numbers, from_numbers
from wheelpend.export.running import found_program, run_program


def replay_in_javascript(exported: ExportedModel, replay: Replay) -> tuple[float | None, str]:
    """Error [σ] of the exported code on logs, and with what it ran, or why not."""
    node = found_program(("node", "nodejs"))
    if not node:
        return None, "Node.js is not installed here"
    with tempfile.TemporaryDirectory(prefix="wheelpend-export-") as name:
        folder = Path(name)
        files = javascript_files(exported) | {REPLAY_FILE: javascript_replay_text(exported)}
        for path, text in files.items():
            (folder / path).write_text(text, encoding="utf-8")
        shown, wrong = run_program([node, REPLAY_FILE], folder, "\n".join(map(repr, as_numbers(exported, replay))))
    if wrong:
        return None, wrong
    return replay.error_of(from_numbers(replay, np.array(shown.split(), dtype=float))), "run by Node.js"
