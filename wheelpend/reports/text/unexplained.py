"""What is unexplained, in words; and a law for it that the user accepts as an effect of their own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from wheelpend.diagnosis.missing_force.repeatability import DRIVE_ROW, ExplainedForce
from wheelpend.reports.console import print_line

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


class LawRequest(NamedTuple):
    """What the user asked for besides the diagnosis."""

    law: bool = False
    accepted: bool = False


LAW_OPTION_HINT = "`--law` fits a free-form law to it, which you may accept as an effect of your own."


def repeatability_sentences(repeats: Sequence[ExplainedForce]) -> list[str]:
    """On what the missing force depends and how much of it repeats, in two or three sentences."""
    if not repeats:
        return []
    best, others = repeats[0], repeats[1:]
    if not best.depends_on:
        return ["Nothing of what the model leaves over repeats with a state, the input or time: "
                "no smooth function of them predicts it on data that did not make the function."]  # fmt: skip
    first = f"{percent_text(best.alone)} of what the model leaves over repeats with {best.depends_on[0]}"
    if len(best.depends_on) > 1:
        first += f", {percent_text(best.repeatable)} with it and {' and '.join(best.depends_on[1:])}"
    rest = "" if percent_text(best.repeatable) == percent_text(1.0) else "; the rest does not repeat"
    lines = [f"{first}, as a force {place_text(best.row)}{rest}."]
    if others:
        shares = ", ".join(f"{place_text(r.row)} {percent_text(r.repeatable)}" for r in others)
        lines.append(f"As a force elsewhere it would be: {shares}.")
    return lines


def place_text(row: str) -> str:
    """Where a force acts, in words."""
    return "between wheel and body" if row == DRIVE_ROW else f"on the {row} row alone"


def percent_text(share: float) -> str:
    """A share in whole percent, and never all where it is not."""
    return f"{min(round(100 * share), 99) if share < 0.9995 else 100} %"


def law_summary_text(law: FreeLaw) -> str:
    """What a law does to the held-out error."""
    return (
        f"A law explains {percent_text(law.explains)} of it: with it, and everything refitted, the held-out error "
        f"falls from {law.error_before:.4g} to {law.error_after:.4g} (noise floor {law.noise_floor:.4g}), in "
        f"{law.blocks_agree} blocks. {law.tried} terms were tried."
    )


def law_text_lines(law: FreeLaw) -> list[str]:
    """The law in plain letters: where each part acts, and its numbers with standard errors and units."""
    lines = []
    for effect, text in law.laws.items():
        lines.append(f"{effect}, a resistance at the {law.on[effect]} port [V]: {text}")
        for name, value in law.coefficients.items():
            if name.partition(".")[0] == effect:
                lines.append(f"  {name.partition('.')[2]} = {value:.5g} ± {law.sigma[name]:.2g} {law.unit[name]}")
    return lines


def print_unexplained(repeats: Sequence[ExplainedForce], law: FreeLaw | None, asked: LawRequest, verdict: str) -> None:
    """Print what is unexplained."""
    wanted, accepted = asked
    for line in repeatability_sentences(repeats):
        print_line(line)
    if law is not None:
        print_line(law_summary_text(law))
        for line in law_text_lines(law):
            print_line(f"  {line}")
        if not accepted:
            print_line("`--accept NAME` writes it to effects.toml as an effect of your own.")
    elif wanted and verdict == "unexplained":
        print_line("No law was found: no term lowers the held-out error by enough.")
    elif wanted:
        print_line("No law was looked for: nothing is unexplained.")
    elif repeats:
        print_line(LAW_OPTION_HINT)
