"""What stays unexplained: how much of the missing force repeats, and a free-form law for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from derive.parameter_name import effect_of, short_name
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce
from wheelpend.reports.numbers import digits_text, incomplete_percent_text
from wheelpend.reports.text.verdict import rest_beside_force_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.explain import Ladder
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw
    from wheelpend.diagnosis.verdict import Diagnosis
    from wheelpend.identification.remainder import Remainder

LAW_OPTION_HINT = "`--law` fits a free-form law to it, which you may accept as an effect of your own."


class LawRequest(NamedTuple):
    """What the user asked for besides the diagnosis."""

    law: bool = False
    accepted: bool = False


class LawPart(NamedTuple):
    """A part of a free-form law that acts at one port."""

    effect: str
    port: str
    text: str
    parameters: list[str]  # effect.parameter


def repeatability_sentences(repeats: Sequence[ExplainedForce], left: Remainder | None = None) -> list[str]:
    """On what the missing force depends and how much of it repeats, in two or three sentences.

    None where it depends on nothing, but the filter found that a part of what is ``left`` repeats: that was said.
    """
    if not repeats:
        return []
    best, others = repeats[0], repeats[1:]
    if not best.depends_on and left is not None and left.what_repeats:
        return []
    if not best.depends_on:
        return ["Nothing of the missing force repeats with a state, the input or time: "
                "no smooth function of them predicts it on data that did not make the function."]  # fmt: skip
    lines = [_best_row_sentence(best, left)]
    if others:
        shares = ", ".join(f"{place_text(r)} {incomplete_percent_text(r.repeatable)}" for r in others)
        lines.append(f"As a force elsewhere it would be: {shares}.")
    return lines


def unexplained_sentences(result: Ladder) -> list[str]:
    """What is known of something that stays unexplained behind the last step of a ladder."""
    last, repeating = result.last, repeatability_sentences(result.repeats, result.remainder)
    if result.verdict != "unexplained" or not last.by_likelihood or last.named:
        return repeating
    return [s for s in (rest_beside_force_text(last), *repeating) if s]


def _best_row_sentence(best: ExplainedForce, left: Remainder | None) -> str:
    alone, together = incomplete_percent_text(best.alone), incomplete_percent_text(best.repeatable)
    first = f"{alone} of the missing force repeats with {best.depends_on[0]}"
    if len(best.depends_on) > 1:
        first += f", {together} with it and {' and '.join(best.depends_on[1:])}"
    told = together == incomplete_percent_text(1.0) or (left is not None and left.what_repeats)  # by the filter
    rest = "" if told else "; the rest does not repeat"
    return f"{first}, as a force {place_text(best)}{rest}."


def place_text(force: ExplainedForce) -> str:
    """Where a force acts, in words."""
    return force.between or f"on the {force.row} row alone"


def law_summary_text(law: FreeLaw) -> str:
    """What a law does to the held-out error."""
    before, after, floor = map(digits_text, (law.error_before, law.error_after, law.noise_floor))
    return (
        f"A law explains {incomplete_percent_text(law.explains)} of it: with it, and everything refitted, the held-out "
        f"error falls from {before} to {after} (noise floor {floor}), and {law.blocks_agree} blocks agree. "
        f"{law.tried} terms were tried."
    )


def law_parts(law: FreeLaw) -> list[LawPart]:
    """The parts of a law, each with the parameters that stand in it."""
    return [
        LawPart(effect, law.on[effect], text, [n for n in law.coefficients if effect_of(n) == effect])
        for effect, text in law.laws.items()
    ]


def law_text_lines(law: FreeLaw) -> list[str]:
    """The law in plain letters: where each part acts, and its numbers with standard errors and units."""
    lines = []
    for part in law_parts(law):
        unit = law.problem.plant.force_unit(law.problem.plant.port(part.port).unit)
        lines.append(f"{part.effect}, a resistance at the {part.port} port [{unit}]: {part.text}")
        for name in part.parameters:
            value, sigma = digits_text(law.coefficients[name], 5), digits_text(law.sigma[name], 2)
            lines.append(f"  {short_name(name)} = {value} ± {sigma} {law.unit[name]}")
    return lines


def unexplained_text(found: Diagnosis | Ladder, asked: LawRequest) -> Iterator[str]:
    """What is unexplained, the law for it where one was found, and how to get one."""
    law, verdict = found.law, found.verdict
    yield from repeatability_sentences(found.repeats, found.remainder)
    if law is not None:
        yield law_summary_text(law)
        yield from (f"  {line}" for line in law_text_lines(law))
        if not asked.accepted:
            yield "`--accept NAME` writes it to effects.toml as an effect of your own."
    elif asked.law and verdict == "unexplained":
        yield "No law was found: no term lowers the held-out error by enough."
    elif asked.law:
        yield "No law was looked for: nothing is unexplained."
    elif found.repeats:
        yield LAW_OPTION_HINT
