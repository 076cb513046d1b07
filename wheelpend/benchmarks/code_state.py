"""The state of the code that a benchmark's results depend on, so that results of two states are never mixed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import wheelpend
from wheelpend.campaigns.journal import fingerprint_of
from wheelpend.kernels.cache import derivation_fingerprint

WITHOUT_INFLUENCE = (
    "campaigns", "cli", "paper", "reports", "reproduction", "benchmarks/markdown.py", "benchmarks/measured",
    "benchmarks/speed", "benchmarks/structure.py", "benchmarks/hidden_effects/page.py",
    "benchmarks/hidden_effects/summary.py",
)  # fmt: skip


def code_fingerprint(aside: Sequence[str] = ()) -> str:
    """Hash of the derivation and of the package's files, without what tells and counts results, and what is aside."""
    package = Path(wheelpend.__file__).parent
    return fingerprint_of([derivation_fingerprint()], _sources(package, (*WITHOUT_INFLUENCE, *aside)))[:12]


def _sources(package: Path, aside: Sequence[str]) -> Iterable[Path]:
    places = [package / place for place in aside]
    return sorted(p for p in package.rglob("*.py") if not any(p.is_relative_to(place) for place in places))
