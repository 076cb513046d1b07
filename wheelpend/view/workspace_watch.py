"""What shows that a workspace changed, by whichever command: a digest of its files."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

from wheelpend.model.toml_file import USER_EFFECTS_FILE
from wheelpend.model.workspace import HISTORY_FILE


class WorkspaceWatch:
    """Digests of a workspace's model and history, each file read only where its time or size changed."""

    def __init__(self, folder: Path, model_name: str) -> None:
        self.folder, self.model_name = folder, model_name
        self._seen: dict[str, tuple[tuple[int, ...], str]] = {}

    def model_digest(self) -> str:
        """Which model it is, with the workspace's own effects; empty where there is none."""
        model = self._digest(self.model_name)
        return f"{model} {self._digest(USER_EFFECTS_FILE)}".strip() if model else ""

    def digest(self) -> str:
        """Which state model and history have."""
        return f"{self.model_digest()} {self._digest(HISTORY_FILE)}"

    def _digest(self, name: str) -> str:
        path = self.folder / name
        with suppress(OSError):
            status = path.stat()
            now = (status.st_mtime_ns, status.st_size, status.st_ino)
            if self._seen.get(name, ((), ""))[0] != now:
                self._seen[name] = now, hashlib.sha256(path.read_bytes()).hexdigest()
            return self._seen[name][1]
        return ""
