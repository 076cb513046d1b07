"""Record a revision and this checkout on this machine, and compare: python tests/golden/against.py REVISION."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cases import CHAINS
from compare import report
from running import ROOT, record


def main() -> int:
    """Print what differs, bit for bit; exit code 1 if anything does."""
    parser = argparse.ArgumentParser(description="Compare this checkout's results with a revision's, bit for bit.")
    parser.add_argument("revision", help="a commit, a branch or a tag")
    parser.add_argument("--only", nargs="+", metavar="CHAIN", choices=[c.name for c in CHAINS], help="these chains")
    options = parser.parse_args()
    chains = [chain for chain in CHAINS if not options.only or chain.name in options.only]
    with tempfile.TemporaryDirectory(prefix="golden_") as folder, worktree(options.revision, Path(folder)) as before:
        old, new = Path(folder) / "old", Path(folder) / "new"
        record(old, chains, before)
        record(new, chains, ROOT)
        return report(old, new)


@contextmanager
def worktree(revision: str, folder: Path) -> Iterator[Path]:
    """A revision in a folder of its own while inside; raises CalledProcessError where git knows none such."""
    path = folder / "checkout"
    git = ["git", "-C", str(ROOT), "worktree"]
    subprocess.run([*git, "add", "--quiet", "--detach", str(path), revision], check=True)
    try:
        yield path
    finally:
        subprocess.run([*git, "remove", "--force", str(path)], check=True)


if __name__ == "__main__":
    sys.exit(main())
