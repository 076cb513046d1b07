"""The long run: ``make fuzz``, for ``MINUTES=60``; goes on where it was.

Hypothesis keeps what it has learnt in .fuzz/examples, the journal counts what was tried and keeps the smallest case of
every finding. A finding does not end the run: others are looked for behind it. Each property runs in a process of its
own, which may hang or die; what it was at is then a finding too. ``--replay`` plays findings again. The exit code is 1
where there are any.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import monotonic

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
MAX_MEMORY_BYTES = 6 * 2**30  # of addresses: a log may ask for as much as it likes
ROUND_S = 120.0  # of one property, before the next has its turn
GRACE_S = 180.0  # for a process that should have ended


def main() -> int:
    """Run all properties in turn until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--property")
    parser.add_argument("--seconds", type=float, default=ROUND_S)
    parser.add_argument("--replay", action="store_true", help="play every finding again, and forget what is mended")
    options = parser.parse_args()
    if options.property:
        search(options.property, options.seconds)
        return 0
    return replay() if options.replay else supervise(options.minutes)


def supervise(minutes: float) -> int:
    """Give each property its turns, each in a process of its own."""
    from tests.fuzz.journal import Journal
    from tests.fuzz.properties import PROPERTIES

    end = monotonic() + 60 * minutes
    while monotonic() < end:
        for name, chosen in PROPERTIES.items():
            seconds = min(6 * ROUND_S * chosen.share, end - monotonic())
            if seconds > 1.0:
                turn(name, seconds)
    journal = Journal()
    print(f"{sum(journal.counts.values())} cases so far; findings: {len(journal.findings)} in {journal.findings_file}")
    for key, found in journal.findings.items():
        print(f"- {key}: {found['case']['commands']}")
    return bool(journal.findings)


def turn(name: str, seconds: float) -> None:
    """A property's turn; that its process hangs or dies is a finding."""
    from tests.fuzz.journal import Journal

    command = [sys.executable, __file__, "--property", name, "--seconds", str(seconds)]
    try:
        code: int | str = subprocess.run(command, cwd=ROOT, timeout=seconds + GRACE_S).returncode
    except subprocess.TimeoutExpired:
        code = "none: it hangs"
    journal = Journal()
    if code and (case := journal.interrupted_case()):
        journal.find(f"the process ends with {code} at {case.commands[0][0]}", case, "")
    journal.end()


def search(name: str, seconds: float) -> None:
    """Draw cases of a property until the time is over, and note what they show."""
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis.database import DirectoryBasedExampleDatabase

    from tests.fuzz.cases import Case
    from tests.fuzz.invariants import Broken, check_case, fresh_files
    from tests.fuzz.journal import FOLDER, Journal
    from tests.fuzz.properties import PROPERTIES

    fresh_files()
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    journal, chosen, end = Journal(), PROPERTIES[name], monotonic() + seconds
    shrinking: set[str] = set()  # keys of this turn: a finding is made smaller, others of its kind are let pass

    with tempfile.TemporaryDirectory() as place:

        @settings(
            max_examples=200, deadline=None, print_blob=False, report_multiple_bugs=False, suppress_health_check=list(HealthCheck),
            database=DirectoryBasedExampleDatabase(FOLDER / "examples" / name),
            phases=[Phase.reuse, Phase.generate, Phase.shrink],
        )  # fmt: skip
        @given(case=chosen.cases)
        def holds(case: Case) -> None:
            if monotonic() > end:
                return
            journal.begin(case)
            try:
                journal.count(case.kind, check_case(case, Path(place) / "a" / "b" / "workspace", chosen.limit_s))
            except Broken as broken:
                journal.count(case.kind, ["broken"])
                journal.find(broken.key, case, str(broken))
                if broken.key not in known:
                    shrinking.add(broken.key)
                    raise

        known: set[str] = set()
        while monotonic() < end:
            try:
                holds()
            except Exception as error:  # Broken, or what Hypothesis makes of it
                print(f"{name}: {str(error).splitlines()[0] if str(error) else type(error).__name__}", flush=True)
            known |= shrinking
    journal.end()


def replay() -> int:
    """Play every finding again; those that do not show any more are forgotten."""
    from tests.fuzz.cases import Case
    from tests.fuzz.invariants import Broken, check_case
    from tests.fuzz.journal import Journal

    journal = Journal()
    with tempfile.TemporaryDirectory() as place:
        for key, found in list(journal.findings.items()):
            try:
                check_case(Case.of_json(found["case"]), Path(place) / "a" / "b" / "workspace", 120.0)
            except Broken as broken:
                print(broken)
            else:
                print(f"mended: {key}")
                del journal.findings[key]
    journal.save()
    return bool(journal.findings)


if __name__ == "__main__":
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "WHEELPEND_THREADS"):
        os.environ.setdefault(variable, "1")
    os.environ["WHEELPEND_TRACEBACK"] = "1"
    os.environ.setdefault("WHEELPEND_CACHE", str(ROOT / ".fuzz" / "cache"))  # odd models are nothing for the user's own
    sys.exit(main())
