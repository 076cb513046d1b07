"""The benchmark's findings as a page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.benchmarks.hidden_effects.summary import Summary
from wheelpend.proportion import Proportion

PAGE_HEADER = """# The hidden-effect benchmark

    make benchmark                # a stratified sample, 30 minutes on two cores
    make benchmark FULL=1         # all of it; an interrupted run goes on where it stopped

Effects are hidden in simulated logs of 20 s, and `explain` is asked what is missing. A third of the logs come from \
MuJoCo, a rigid-body engine that shares no code with this project. There free play is two stops for a rotor of its \
own, an elastic shaft a spring, slosh a pendulum hung in the body (its `damping` is the ratio ζ); a payload is a mass \
at the body's centre of mass; dry friction is sharp, or engages over \
10 ms, which no law of the library does. Sizes are 0.1 to 3 times typical ones; where the robot would fall, they are \
made smaller until it stands. In brackets: 95 % confidence intervals.

Three of the engine's logs are [shipped](../data/README.md), to be tried at once:

| command | hidden | answer |
| --- | --- | --- |
| `wheelpend explain data/engine_friction_slope.csv` | coulomb_drive 0.3 V, slope 0.03 rad | coulomb_drive, slope |
| `wheelpend explain data/engine_cogging.csv` | cogging 0.3 and 0.15 V, 4 periods per turn | cogging |
| `wheelpend explain data/engine_inductance.csv` | winding_inductance 10 ms | winding_inductance |

This page is written by the command.
"""


def page_text(summary: Summary, planned: int) -> str:
    """Markdown; ``planned`` is how many logs the whole benchmark has."""
    s = summary
    every = Proportion(sum(r.hits for r in s.singles.values()), sum(r.of for r in s.singles.values()))
    rows = [
        (
            "first answer right or declared equivalent, one effect that costs at least 5 % of error",
            rate_text(every),
            "≥ 98 %",
        ),
        *((f"… logs from the {source}", rate_text(r), "") for source, r in s.singles.items()),
        ("… dry friction that engages slowly", rate_text(s.soft), ""),
        ("mean number of declared equivalents", number_text(s.equivalents, 2), ""),
        ("both effects of a pair found, each costing at least 5 % beside the other", rate_text(s.pairs), "≥ 95 %"),
        ("… pairs of which one costs less", rate_text(s.faint), ""),
        ("all three of a triple found", rate_text(s.triples), ""),
        ("false alarms on complete models", rate_text(s.false_alarms), "≤ 2 of 200"),
        ("guilty effect left out: unexplained, or a stand-in that reaches the noise", rate_text(s.left_out), "≥ 95 %"),
        ("… confident name whose error stays above 1.1 times the floor", str(s.overconfident), "0"),
        ("error after at most 1.05 times the true model's", rate_text(s.near_truth), "all"),
        ("… largest ratio", number_text(s.worst, 3), "≤ 1.05"),
        ("true values inside 95 % intervals", rate_text(s.coverage), "92 to 98 %"),
        (
            f"largest spread of a parameter's estimates over the predicted one, complete models ({s.estimated} logs)",
            number_text(max(s.spread.values(), default=float("nan")), 2),
            "≤ 1.15",
        ),
        ("dry friction that truly sticks, sampled at 1 kHz: first answer right", rate_text(s.stick_slip), "≥ 98 %"),
        ("… largest error of the true model", number_text(s.sticking, 3), "≤ 1.05"),
    ]
    parts = [
        PAGE_HEADER.rstrip(),
        f"## Findings\n\n{s.cases} of {planned} logs"
        + (f", {len(s.failures)} could not be used." if s.failures else "."),
        markdown_table(("", "measured", "goal"), rows),
        "## Hit rate against size\n\nThe size is what a likelihood-ratio test that knows the effect sees, in standard "
        "deviations. An effect is named only when it also lowers the held-out error by 0.5 %, so that certain but "
        "unimportant effects are not.",
        markdown_table(
            ("size", "first answer right"),
            [
                (f"{low:g} to {high:g}" if high < 1e9 else f"above {low:g}", rate_text(r))
                for low, high, r in s.by_size
                if r.of
            ],
        ),
        "## Estimates against their predicted deviations\n\nNothing is hidden and nothing is missing; `identify` has "
        "the whole log. Root mean square of (estimate − truth) / σ: 1 where the standard errors are right.",
        markdown_table(("parameter", "spread"), [(name, f"{value:.2f}") for name, value in s.spread.items()]),
        "## First answers",
        markdown_table(
            ("hidden", "right", "answers"),
            [
                (e, rate_text(s.by_effect[e]), ", ".join(f"{n} {k}" for n, k in answers.most_common()))
                for e, answers in s.confusion.items()
            ],
        ),
    ]
    if s.redrawn:
        parts += ["## Logs made with smaller effects than planned, because the robot fell",
                  "\n".join(f"- {r}" for r in s.redrawn)]  # fmt: skip
    if s.failures:
        parts += ["## Logs that could not be used", "\n".join(f"- {f}" for f in s.failures)]
    return "\n\n".join(parts) + "\n"


def rate_text(rate: Proportion) -> str:
    """A rate in words."""
    if not rate.of:
        return "not tried"
    low, high = rate.interval
    return f"{rate.hits} of {rate.of}, {100 * rate.share:.1f} % ({100 * low:.0f}–{100 * high:.0f})"


def number_text(value: float, decimals: int) -> str:
    """A number, or that there is none."""
    return f"{value:.{decimals}f}" if np.isfinite(value) else "not tried"


def markdown_table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
