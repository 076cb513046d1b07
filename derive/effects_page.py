"""The sections of docs/effects.md, made from the rows of the library: ``python -m derive.effects_page`` writes them.

They stand between two marks on the page; what is before and behind the marks is written by hand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby

from derive.effects import EFFECT_LIBRARY, INPUT_SIGNAL, Effect, EffectParameter, Quantiles, Values
from derive.files import DERIVE_FOLDER, write

PAGE_PATH = DERIVE_FOLDER.parent / "docs" / "effects.md"
PAGE_COMMAND = "python -m derive.effects_page"
FIRST_MARK = f"<!-- Sections: made from the rows of derive/effects/ by `{PAGE_COMMAND}`, which overwrites edits. -->\n"
LAST_MARK = "<!-- End of the sections. -->\n"

FAMILY_HEADINGS = {
    "drive": "Drive: between wheel and body",
    "joint": "Joint: between two links, or cart and pole",
    "ground": "Ground: between wheel and ground",
    "body": "Body",
    "actuator": "Actuator: between command and motor",
    "sensor": "Sensor",
}
FAMILY_INTRODUCTIONS = {
    "joint": "The laws of the drive in a joint: between the two links of a pendulum, or between cart and pole. The "
    "first three act in every joint, the others where a motor turns it. s is the speed of that joint; V stands for "
    "the input's unit (times m where the input pushes along a length)."
}
SCOPE_TEXTS = {"event": "of an event in one log"}
QUANTILE_SOURCES = {INPUT_SIGNAL: "|V|", "drive": "slip speeds"}


def page_text(page: str, effects: Sequence[Effect] = tuple(EFFECT_LIBRARY.values())) -> str:
    """The page with its sections made anew; raises ValueError where a mark is missing."""
    if page.count(FIRST_MARK) != 1 or page.count(LAST_MARK) != 1:
        raise ValueError(f"The page must have each of these lines once:\n{FIRST_MARK}{LAST_MARK}")
    head, tail = page.partition(FIRST_MARK)[0], page.partition(LAST_MARK)[2]
    return f"{head}{FIRST_MARK}\n{sections_text(effects)}\n{LAST_MARK}{tail}"


def sections_text(effects: Sequence[Effect]) -> str:
    """All sections, by family in the order of the library."""
    paragraphs: list[str] = []
    for family in dict.fromkeys(e.family for e in effects):
        paragraphs.append(f"## {FAMILY_HEADINGS[family]}\n")
        if family in FAMILY_INTRODUCTIONS:
            paragraphs.append(f"{FAMILY_INTRODUCTIONS[family]}\n")
        paragraphs += [section_text(e) for e in effects if e.family == family]
    return "\n".join(paragraphs)


def section_text(effect: Effect) -> str:
    """One effect's section."""
    lines = "".join(f"- {line}\n" for line in section_lines(effect))
    return f"### {effect.name}\n\n{effect.sentence} {effect.means}\n\n{lines}"


def section_lines(effect: Effect) -> Iterator[str]:
    """What is listed of an effect: law, parameters, where it shows, what it resembles, and the rest."""
    yield f"Law: {effect.equation}. {effect.law_text}".rstrip()
    yield f"Parameters: {parameters_text(effect)}"
    if effect.residual:
        yield f"Residual: {effect.residual}"
    if effect.resembles:
        yield f"Resembles: {effect.resembles}"
    yield from effect.remarks
    if effect.needs_motor:
        yield "Only where a motor acts."
    yield from (text for p in effect.parameters if (text := starts_text(p)))
    if effect.dissipates:
        yield "Only ever takes energy out."


def parameters_text(effect: Effect) -> str:
    """The parameters with letters, units, scopes and ranges; those with the same of all these share them."""
    groups = groupby(effect.parameters, lambda p: (f"[{p.unit}]", *parameter_properties(effect, p)))
    stated = "; ".join(
        ", ".join(map(parameter_name, together)) + " " + ", ".join(properties) for properties, together in groups
    )
    typical = ", ".join(number_text(p.typical) for p in effect.parameters)
    infinite = " and ".join(f"`{p.name}`" for p in effect.parameters if math.isinf(p.absent))
    return f"{stated}. Typical: {typical}." + (f" Absent at an infinite {infinite}." if infinite else "")


def parameter_name(parameter: EffectParameter) -> str:
    """A parameter's name and its letter in the equation."""
    return f"`{parameter.name}` {parameter.letter}".rstrip()


def parameter_properties(effect: Effect, parameter: EffectParameter) -> Iterator[str]:
    """Scope and range of a parameter, and the one that it never exceeds."""
    letters = [p.letter for p in effect.parameters if p.name in effect.phased]
    if parameter.name in effect.phased:
        amplitude = " + ".join(f"{letter}²" for letter in letters)
        yield f"amplitude √({amplitude}) shared, phase per log"
    else:
        yield SCOPE_TEXTS.get(parameter.scope, parameter.scope)
    if range_stated := range_text(parameter.minimum, parameter.maximum):
        yield range_stated
    if parameter.name in effect.ordered[:-1]:
        yield f"not above `{effect.ordered[effect.ordered.index(parameter.name) + 1]}`"


def range_text(minimum: float, maximum: float) -> str:
    """A physically possible range; empty where anything is possible."""
    if math.isinf(minimum):
        return "" if math.isinf(maximum) else f"at most {number_text(maximum)}"
    if math.isinf(maximum):
        return f"at least {number_text(minimum)}"
    return f"{number_text(minimum)} to {number_text(maximum)}"


def starts_text(parameter: EffectParameter) -> str:
    """Where the diagnosis starts a shape; empty where it starts at no such values."""
    said = parameter.letter or f"`{parameter.name}`"
    match parameter.starts:
        case Values(at=values):
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            return f"The diagnosis starts {said} from {enumeration(values)}{unit}."
        case Quantiles(of=of, at=shares):
            source = QUANTILE_SOURCES.get(of, f"speeds of the {of}")
            return f"The diagnosis starts {said} from quantiles of the log's {source}: {enumeration(shares)}."
    return ""


def enumeration(values: Sequence[float]) -> str:
    """Numbers as in a sentence: 1, 2 and 3."""
    *first, last = map(number_text, values)
    return f"{', '.join(first)} and {last}" if first else last


def number_text(value: float) -> str:
    """A number in few digits, with a minus of the text's type."""
    return f"{value:g}".replace("-", "−")


def main() -> None:
    """Write the sections into docs/effects.md."""
    write(PAGE_PATH.parent, {PAGE_PATH.name: page_text(PAGE_PATH.read_text(encoding="utf-8"))})


if __name__ == "__main__":
    main()
