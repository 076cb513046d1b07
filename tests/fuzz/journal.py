"""What a long run has tried and found: counts by kind in one file, a line for each finding in another."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz.cases import Case

FOLDER = Path(__file__).resolve().parents[2] / ".fuzz"


class Journal:
    """Counts of inputs by kind and exit code, the case at hand, and the smallest case of each finding."""

    def __init__(self, folder: Path = FOLDER) -> None:
        folder.mkdir(exist_ok=True)
        self.counts_file, self.findings_file = folder / "counts.json", folder / "findings.json"
        self.current_file = folder / "current.json"
        self.counts: Counter[str] = Counter(self._read(self.counts_file, {}))
        self.findings: dict[str, dict] = self._read(self.findings_file, {})
        self.noted = 0

    @staticmethod
    def _read(path: Path, default):
        return json.loads(path.read_text(encoding="utf-8")) if path.exists() else default

    def begin(self, case: Case) -> None:
        """Keep what is being tried, for a process that does not live to say what became of it."""
        self.current_file.write_text(json.dumps(case.to_json()), encoding="utf-8")

    def count(self, kind: str, codes: Sequence[int]) -> None:
        """Count a case and what its commands returned."""
        self.counts[f"{kind}: {'/'.join(map(str, codes))}"] += 1
        self.noted += 1
        if self.noted % 50 == 0:
            self.save()

    def find(self, key: str, case: Case, said: str) -> None:
        """Keep a finding where it is new, or smaller than the one of its kind."""
        known = self.findings.get(key)
        if known is None or case.size() < Case.of_json(known["case"]).size():
            self.findings[key] = {"said": said, "case": case.to_json()}
            self.save()

    def save(self) -> None:
        """Write both files."""
        for path, data in ((self.counts_file, self.counts), (self.findings_file, self.findings)):
            partial = path.with_suffix(".partial")
            partial.write_text(json.dumps(data, indent=1, sort_keys=True), encoding="utf-8")
            os.replace(partial, path)

    def interrupted_case(self) -> Case | None:
        """What was being tried when a process ended that did not say so."""
        data = self._read(self.current_file, None)
        return Case.of_json(data) if data else None

    def end(self) -> None:
        """Nothing is being tried any more."""
        self.save()
        self.current_file.unlink(missing_ok=True)
