"""Record what every command gives: python tests/golden/record.py OUT_DIR [--checkout DIR]."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path

from brief import write_brief
from cases import CHAINS
from running import ROOT, record


def main() -> int:
    """Record into a new folder; exit code 2 where there is something in it."""
    options = arguments()
    chains = [chain for chain in CHAINS if not options.only or chain.name in options.only]
    if options.out.exists() and any(options.out.iterdir()):
        print(f"{options.out} must be empty or new. Choose another folder, or remove it.", file=sys.stderr)
        return 2
    record(options.out, chains, options.checkout.resolve(), options.threads, options.jobs)
    if options.expected:
        if not options.only:
            shutil.rmtree(options.expected, ignore_errors=True)
        write_brief(options.out, options.expected)
    return 0


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="Record what every command gives.")
    parser.add_argument("out", type=Path, help="folder of the record")
    parser.add_argument("--checkout", type=Path, default=ROOT, help="whose code runs; this checkout's")
    parser.add_argument("--only", nargs="+", metavar="CHAIN", choices=[c.name for c in CHAINS], help="these chains")
    parser.add_argument("--expected", type=Path, metavar="DIR", help="also write what is committed, into this folder")
    parser.add_argument("--threads", type=int, default=1, help="threads of each command; 1, for bit-equal results")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), help="chains side by side")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
