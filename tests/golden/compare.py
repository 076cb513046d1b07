"""Compare two records: python tests/golden/compare.py A B [--rtol 1e-6] [--atol 1e-9]; exit code 1 if they differ."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from differences import EXACT, Tolerance, folders_differ


def main() -> int:
    """Print what differs."""
    parser = argparse.ArgumentParser(description="Compare two records, bit for bit unless a tolerance is given.")
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--rtol", type=float, default=0.0, help="relative tolerance of numbers in JSON and in text")
    parser.add_argument("--atol", type=float, default=0.0, help="absolute tolerance beside it")
    options = parser.parse_args()
    for folder in (options.old, options.new):
        if not folder.is_dir():
            parser.error(f"{folder} must be a record's folder; there is none.")
    return report(options.old, options.new, Tolerance(options.rtol, options.atol))


def report(old: Path, new: Path, tolerance: Tolerance = EXACT) -> int:
    """Print the differences between two records and give the exit code."""
    found = list(folders_differ(old, new, tolerance))
    files = sum(path.is_file() for path in old.rglob("*"))
    print("\n".join([*found, f"{len(found)} differences in {files} files." if found else f"{files} files are equal."]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
