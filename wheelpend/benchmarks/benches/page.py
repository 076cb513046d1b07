"""The study as a page of the docs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.benchmarks.benches.cases import DEFAULT_COUNT, MACHINE_KINDS, NOISE_RAD
from wheelpend.benchmarks.benches.robot_cases import PITCH_NOISE_RAD, RATE_NOISE, WHEEL_COUNTS
from wheelpend.benchmarks.benches.trial import MAX_SIGMAS, Outcome
from wheelpend.benchmarks.hidden_effects.page import rate_text
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.files import write_text
from wheelpend.proportion import proportion_of

COMMAND_LINE = "python -m wheelpend.benchmarks.benches --out docs/benches.md"
PAGE_HEAD = f"""# Benches: machines that no code of this tool simulates

*This page is written by `{COMMAND_LINE}`; the figures in it are what that command measured.*

Links that swing freely, motors on a bench, pendulums that a motor drives and robots that balance, drawn at random, all
with dry friction that may hold. They move in steps of 4 µs, robots of 20 µs, apart from the tool's own simulator. But
for the robots, the logs are of 4 to 15 s at 50 to 500 Hz, from an encoder of 400 to 4096 counts a turn or with noise
of {1e3 * NOISE_RAD:g} mrad. A swing has some of: viscous, dry and quadratic friction and an encoder's zero; the
others some of: dry friction, a delay of one to three rows, a limit of the supply, drag or an encoder's zero. A
coasting motor has a driver that opens in the pauses of its pulses. Sizes are not chosen to be visible: a limit that
the command hardly reaches is hidden too. The swings begin at 0.1 to 1.8 rad and often end at rest in the midst of the
log.

Robots stand up to places that they are sent to, by a loop of their own at 100 or 200 Hz, for 10 or 20 s: an encoder of
{min(WHEEL_COUNTS)} to {max(WHEEL_COUNTS)} counts a turn between wheels and body, a pitch with
{1e3 * PITCH_NOISE_RAD:g} mrad of noise and a gyro with {1e3 * RATE_NOISE:g} mrad/s. Both have a zero of their own;
some have sticking gears, a delay of one row, or a pitch that a complementary filter makes of gyro and accelerometer;
two of three run over rough ground, a random force of 1 or 3 % of the supply.

`explain` is given the log and a plain model. An effect counts as found where it is a step, or is said to be hard to
tell from one; a step counts as wrong where neither it nor what is said to be hard to tell from it is there.
"""


def page_text(outcomes: Sequence[Outcome]) -> str:
    """The study in Markdown: counts by kind of machine, and every log on which something is wrong."""
    used = [o for o in outcomes if not o.failure]
    kinds = [(kind, [o for o in used if o.key.endswith(f" {kind}")]) for kind in MACHINE_KINDS]
    columns = ("machine", "logs", "all found", "a wrong step", "all found, no wrong step, and `unexplained`")
    rows = [
        (kind, len(own), *(rate_text(proportion_of(hits)) for hits in counts_of(own)))
        for kind, own in [*kinds, ("all", used)]
    ]
    sizes = [abs(v - o.hidden[n]) <= MAX_SIGMAS * s for o in used for n, (v, s) in o.sizes.items()]
    failed = "" if len(used) == len(outcomes) else f" {len(outcomes) - len(used)} more could not be explained."
    parts = [
        PAGE_HEAD,
        f"{len(used)} of {DEFAULT_COUNT} planned logs.{failed}",
        markdown_table(columns, rows),
        f"Of the sizes that were found, {rate_text(proportion_of(sizes))} lie within {MAX_SIGMAS:g} standard errors of "
        "the truth.",
        "## Where something is wrong or missing",
        markdown_table(("log", "hidden", "steps", "verdict"), [_row(o) for o in used if o.missed or o.wrong]),
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def counts_of(outcomes: Sequence[Outcome]) -> tuple[list[bool], list[bool], list[bool]]:
    """Of each outcome: all is found, a step is wrong, and it is right but said to be unexplained."""
    right = [not o.missed and not o.wrong for o in outcomes]
    unexplained = [o.verdict == "unexplained" for o, is_right in zip(outcomes, right, strict=True) if is_right]
    return [not o.missed for o in outcomes], [bool(o.wrong) for o in outcomes], unexplained


def _row(outcome: Outcome) -> tuple[str, str, str, str]:
    hidden = ", ".join(f"`{n}` {v:.3g}" for n, v in outcome.hidden.items()) or "–"
    steps = ", ".join(f"`{e}`" for e, _ in outcome.steps) or "–"
    return outcome.key, hidden, steps, f"`{outcome.verdict}`"


def write(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Write the page."""
    write_text(path, page_text(outcomes))
