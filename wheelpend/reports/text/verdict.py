"""What is missing, in words: verdicts, headline, title, evidence and equivalents."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from derive import effects as library
from wheelpend.diagnosis.criteria import MAX_EQUIVALENT_ERROR_DIFFERENCE
from wheelpend.diagnosis.structures import is_nothing_improbable, probability_outside
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.identification.remainder_warnings import is_mostly_chance
from wheelpend.model.units import PlantUnits
from wheelpend.reports.numbers import (
    digits_text,
    error_text,
    is_number,
    p_value_text,
    prediction_error_text,
    share_text,
    time_text,
)
from wheelpend.reports.text.effect_sizes import effect_size_text, rms_input, step_size_text
from wheelpend.reports.text.remainder import NEGLIGIBLE_SHARE, leaves_a_force

if TYPE_CHECKING:
    from derive.plant_signature import PlantSignature, PortSpec
    from wheelpend.diagnosis.evidence import CandidateFit
    from wheelpend.diagnosis.explain import Ladder, Step
    from wheelpend.diagnosis.likelihood.remaining import ImpossibleLaw
    from wheelpend.diagnosis.likelihood.slow_sources import SlowSource
    from wheelpend.diagnosis.verdict import Diagnosis
    from wheelpend.identification.remainder import Remainder
    from wheelpend.model.record import Model

CHANCE_SENTENCE = "what remains is left to chance: no law of these signals predicts it."
CHANCE_OR_LAW_SENTENCE = "what remains may be chance or a law: these logs do not tell."
SLOW_CHANCE_SENTENCE = "what remains is so slow that these logs do not tell chance from a law: record a longer one."
MOSTLY_CHANCE_SENTENCE = (
    "What is left to chance has half the weight of all that is modelled, or more. No law of these signals is "
    "certain to predict it; on so short or so odd a log that says little."
)
PROBABLY_MISSING_SENTENCE = "Something is probably still missing."
UNCERTAIN_SENTENCE = (
    "That nothing is missing is improbable, but these data make no effect certain: the probabilities say which ones "
    "are likely, and a longer log with more motion will tell."
)
DOUBTFUL_SENTENCE = (
    "No effect is certain to be missing, but it is likelier that one is than that none is: the probabilities say which "
    "ones, and a longer log with more motion will tell."
)
UNKNOWN_LAW_SENTENCE = (
    "What is left is rather a law of these signals than chance, but no function of them is certain to be it: a longer "
    "log with more motion will tell."
)
HELD_OUT_SENTENCE = (
    "What was fitted needs no random force, but what is held out is missed by more than noise: it shows something that "
    "the fitted part does not. Hold out another stretch (wheelpend split), or record more."
)
SURPRISE_SENTENCE = (
    "What is held out is further off than what was fitted lets expect: it shows something that the fitted part does "
    "not. Hold out another stretch (wheelpend split), or record more."
)
CANNOT_BE_TOLD = "What is missing cannot be told"
NOTHING_DETERMINED_SENTENCE = (
    "These logs determine no parameter of the machine, so that they judge no model: record larger or other motion."
)
MAX_PART_SHARE = 0.995  # of a force's mean square, above which a function of it is no part
MIN_LIKELY_FALL = 0.2  # relative, of the held-out error, with which an effect that is not certain is worth a word
MIN_LIKELY_PROBABILITY = 0.5  # of all of the library's, with which such an effect is missing, to be the one to try
MIN_TOLD_PROBABILITY = 0.1  # with which it is missing at least
CLOSING_SENTENCES = {
    "nothing_missing": "Nothing more is missing.",
    "ambiguous": "Nothing more is missing, but a step was ambiguous.",
    "unexplained": "Something is still missing that no effect of the library accounts for.",
}


# ---- a diagnosis


def verdict_text(result: Diagnosis, model: Model) -> str:
    """The verdict of a diagnosis in a sentence or two."""
    error, floor = prediction_error_text(result.error), digits_text(result.noise_floor)
    if result.determines_nothing or (result.by_likelihood and not result.named):
        return verdict_beside_force_text(result)
    if result.verdict == "nothing_missing":
        return (f"Nothing is missing: error {error}, noise floor {floor}, and no effect of the library is worth "
                "naming.")  # fmt: skip
    if result.verdict == "unexplained" and is_at_noise(result):
        return f"Error {error}, noise floor {floor}. {UNCERTAIN_SENTENCE} {probable_text(result)}".strip()
    if result.verdict == "unexplained":
        return (f"Something is missing (error {error}, noise floor {floor}), and no single effect of the library "
                f"accounts for it.{partial_explanation_text(result)}")  # fmt: skip
    return best_candidate_text(result.candidates[0], result, model)


def verdict_beside_force_text(result: Diagnosis) -> str:
    """The verdict of a diagnosis with a random force in the likelihood, where no effect is worth naming."""
    error, floor = prediction_error_text(result.error), digits_text(result.noise_floor)
    if result.verdict == "nothing_missing" and result.is_doubtful:
        return f"Error {error}, noise floor {floor}. {DOUBTFUL_SENTENCE} {probable_text(result)}".strip()
    if result.verdict == "nothing_missing":
        left = chance_sentence(result.remainder) if leaves_a_force(result.remainder) else "no random force is left."
        return (f"Nothing that repeats is missing: the error is {error} (noise floor {floor}), no effect of the "
                f"library is worth naming, and {left}")  # fmt: skip
    what = "Something that repeats is missing"
    if result.determines_nothing:
        what = CANNOT_BE_TOLD
    elif not has_repeating(result.remainder):
        what = "Most of the motion is left to chance" if is_mostly_chance(result.remainder) else "Something is missing"
    return (f"{what} (error {error}, noise floor {floor}), and no effect of the library accounts for it. "
            f"{rest_beside_force_text(result)}").strip()  # fmt: skip


def rest_beside_force_text(result: Diagnosis) -> str:
    """What is known of something that no effect accounts for beside a random force, in sentences."""
    if result.determines_nothing:
        rest = NOTHING_DETERMINED_SENTENCE
    elif has_repeating(result.remainder):
        rest = repeating_text(result.remainder, result.problem.plant)
    elif result.remainder is not None and result.remainder.is_nothing and not is_at_noise(result):
        rest = HELD_OUT_SENTENCE
    elif is_mostly_chance(result.remainder):
        rest = MOSTLY_CHANCE_SENTENCE
    elif result.leaves_unknown:
        rest = UNKNOWN_LAW_SENTENCE
    elif is_nothing_improbable(result.structures, result.problem.model.effects, result.replaces):
        rest = UNCERTAIN_SENTENCE
    else:
        rest = SURPRISE_SENTENCE
    return " ".join(filter(None, (rest, likely_text(result))))


def probable_text(result: Diagnosis) -> str:
    """The effect that is probably missing though it is not certain, in a sentence; or nothing."""
    able = [c.effect for c in result.refitted if c.is_possible and c.effect not in result.problem.model.effects]
    known = {effect: sum(s.probability for s in result.structures if effect in s.effects) for effect in able}
    best = max(known, key=lambda effect: known[effect], default="")
    library_share = 1.0 - probability_outside(result.structures)
    if not best or known[best] < MIN_TOLD_PROBABILITY or known[best] <= MIN_LIKELY_PROBABILITY * library_share:
        return ""
    within = "" if known[best] > MIN_LIKELY_PROBABILITY else f" of {100 * library_share:.0f} % for all of the library"
    return (f"The likeliest is {best} ({100 * known[best]:.0f} %{within}, alone and with others), which is not "
            f"certain: record more, or try it: `wheelpend add {best} LOG`.")  # fmt: skip


def likely_text(result: Diagnosis) -> str:
    """The effect to try though it is not certain, in a sentence; or nothing.

    It is the one that is probably missing, or else the one with which held-out data are predicted best; of equally good
    ones the simplest, in the order of the library.
    """
    tried = [c for c in result.refitted if c.is_possible and is_number(c.error_after)]
    if probable := probable_text(result):
        return probable
    lowest = min((c.error_after for c in tried), default=math.inf)
    if not is_number(result.error) or lowest > (1.0 - MIN_LIKELY_FALL) * result.error:
        return ""
    order = [e.name for e in library.all_with(result.problem.model.own)]
    near = [c for c in tried if c.error_after <= (1.0 + MAX_EQUIVALENT_ERROR_DIFFERENCE) * lowest]
    best = min(near, key=lambda c: (len(c.coefficients), order.index(c.effect)))
    return (f"With {best.effect} {fall_text(result.error, best.error_after)} over {digits_text(result.horizon_s)} s; "
            "behind this random force it is not certain, so record more, or try it: "
            f"`wheelpend add {best.effect} LOG`.")  # fmt: skip


def has_repeating(left: Remainder | None) -> bool:
    """True where a part of what is left to chance is known to repeat."""
    return left is None or bool(left.what_repeats)


def repeating_text(left: Remainder | None, plant: PlantSignature) -> str:
    """The part of what is left to chance that repeats, and the signals that predict it, in a sentence."""
    if left is None:
        return ""
    ports = plant.couplings
    repeating, slow, rings = ([f for f in kind if f.repeats] for kind in (left.repeating, left.slow, left.resonances))
    if slow and not repeating:
        return slow_text(slow[0], ports)
    if not repeating and rings:
        return f"It rings at {digits_text(rings[0].frequency_hz, 3)} Hz."
    if not repeating:
        return impossible_text(left.impossible[0]) if left.impossible else ""
    first = repeating[0]
    what = f"A function of {' and '.join(first.depends_on)}" if first.depends_on else "A constant"
    if first.is_in_reading:
        return (f"{what}, as an offset of the reading {first.row}, predicts a part of it on stretches that it was "
                "not made from: look at that sensor first.")  # fmt: skip
    part = "it" if first.share > MAX_PART_SHARE else f"a part of it, {share_text(first.share)} of its mean square,"
    return (f"{what}, as a force {force_place_text(first.row, ports)}, predicts {part} on stretches that it was not "
            "made from.")  # fmt: skip


def slow_text(source: SlowSource, ports: Mapping[str, PortSpec]) -> str:
    """A random force or error of a sensor that is likelier the slower it may be, in a sentence."""
    force = f"The force left to chance {force_place_text(source.place, ports)}"
    what = force if source.is_force else f"The error of {source.place} that is left to chance"
    where = "" if source.is_force else ": look at that sensor first"
    return (f"{what} is likelier the slower it may be ({time_text(source.correlation_time_s)} and more): no chance, "
            f"but an offset, a drift or a slow law that is missing{where}.")  # fmt: skip


def impossible_text(law: ImpossibleLaw) -> str:
    """A law that data follow with a size that nothing has, in a sentence."""
    sizes = ", ".join(f"{name} {digits_text(value, 3)}" for name, value in law.coefficients.items())
    return (f"Data follow the law of {law.effect}, but with a size that nothing has ({sizes}): something else that "
            "goes with the same signals is missing.")  # fmt: skip


def force_place_text(place: str, ports: Mapping[str, PortSpec]) -> str:
    """Where a force acts: between two parts, or on a row of the model."""
    return ports[place].place if place in ports else f"on the {place} row"


def closing_sentence(result: Ladder) -> str:
    """What a ladder ends with, in a sentence or two."""
    if result.last.determines_nothing or (result.last.by_likelihood and not result.last.named):
        doubtful = result.last.is_doubtful and not result.last.determines_nothing
        if result.verdict in ("nothing_missing", "ambiguous") and doubtful:
            return f"{DOUBTFUL_SENTENCE} {probable_text(result.last)}".strip()
        if result.verdict in ("nothing_missing", "ambiguous"):
            step = ", but a step was ambiguous" if result.verdict == "ambiguous" else ""
            if not leaves_a_force(result.last.remainder):
                return f"Nothing more is missing{step}."
            return f"Nothing more that repeats is missing{step}; {chance_sentence(result.last.remainder)}"
        chance = not has_repeating(result.last.remainder) and is_mostly_chance(result.last.remainder)
        what = "Most of the motion is still left to chance." if chance else CLOSING_SENTENCES[result.verdict]
        rest = rest_beside_force_text(result.last)
        what = PROBABLY_MISSING_SENTENCE if rest.startswith((UNCERTAIN_SENTENCE, HELD_OUT_SENTENCE)) else what
        what = f"{CANNOT_BE_TOLD}." if result.last.determines_nothing else what
        return f"{what} {rest}".strip()
    if result.verdict == "unexplained" and not result.last.named and is_at_noise(result.last):
        return f"{UNCERTAIN_SENTENCE} {probable_text(result.last)}".strip()
    return CLOSING_SENTENCES[result.verdict]


def is_at_noise(result: Diagnosis) -> bool:
    """True of a model that predicts as well as the sensors' noise allows."""
    return is_number(result.error) and result.error <= MAX_EXPLAINED_ERROR_RATIO * result.noise_floor


def chance_sentence(left: Remainder | None) -> str:
    """What is left to chance, to follow another sentence: it may be as slow as a law on so short a log, or be one."""
    strongest = left.strongest if left is not None else None
    slow = strongest is not None and strongest.at_bound and strongest.share >= NEGLIGIBLE_SHARE
    if slow:
        return SLOW_CHANCE_SENTENCE
    return CHANCE_OR_LAW_SENTENCE if left is not None and left.instead else CHANCE_SENTENCE


def partial_explanation_text(result: Diagnosis) -> str:
    """What the first candidate explains where none explains all, as a sentence to follow another."""
    if not result.named:
        return ""
    best = result.named[0]
    error = prediction_error_text(best.error_after)
    direction = direction_text(result.error, best.error_after)
    first = f" {best.effect} explains most: with it the held-out error {direction} to {error}."
    if len(result.steps) < 2:
        return f"{first} It may be a part of what is missing, or only resemble it."
    left = prediction_error_text(result.error_with_steps or result.error)
    together = f"{names_text(result.steps[:-1])} and {result.steps[-1]}"
    return (f"{first} Added in turn, {together} leave {left}: each is likely a part of what is missing. "
            "`wheelpend explain` adds them step by step.")  # fmt: skip


def best_candidate_text(best: CandidateFit, result: Diagnosis, model: Model) -> str:
    """The first candidate with its size, its meaning for the machine, and the error with it."""
    rest = ("" if best.error_after <= MAX_EXPLAINED_ERROR_RATIO * result.noise_floor else
            " Further effects explain the rest: add it and diagnose again, or use `wheelpend explain`.")  # fmt: skip
    if result.by_likelihood:
        rest = (" Whether more repeats shows with it in the model: add it and diagnose again, or use "
                "`wheelpend explain`.")  # fmt: skip
    certain = "is missing" if result.verdict == "effect_missing" else f"or {names_text(best.equivalent_to)} is missing"
    meaning = effect_meaning_text(best, model, rms_input(result.problem))
    return (f"{best.effect} {certain}: {meaning} "
            f"With it {fall_text(result.error, best.error_after)} "
            f"(noise floor {digits_text(result.noise_floor)}).{rest}")  # fmt: skip


def plain_effect_text(name: str, plant: PlantSignature) -> str:
    """What an effect is in plain words, as a title or a sentence goes on with them."""
    return library.in_plant_units(library.find(name), plant).sentence.rstrip(".")


def effect_meaning_text(found: CandidateFit | Step, model: Model, drive_v: float) -> str:
    """An effect's sentence, its size and its meaning for the machine."""
    effect = library.in_plant_units(library.find(found.effect), model.plant_signature)
    size = effect_size_text(found, model, drive_v)
    return f"{effect.sentence} {size[:1].upper()}{size[1:]}. {effect.means}".rstrip()


def fall_text(before: float, after: float) -> str:
    """A held-out error before and after a change; one that was not finite diverged."""
    if not is_number(before):
        return f"the held-out prediction no longer diverges: its error is {prediction_error_text(after)}"
    direction = direction_text(before, after)
    return f"the held-out error {direction} from {digits_text(before)} to {prediction_error_text(after)}"


def direction_text(before: float, after: float) -> str:
    """Whether an error falls or rises, as it may beside a random force by chance; one that diverges rises."""
    return "rises" if is_number(before) and not (is_number(after) and after <= before) else "falls"


def relative_fall_text(before: float, after: float) -> str:
    """The fall, or rise, of a held-out error in percent, as far as both are finite."""
    if is_number(before) and is_number(after) and after > before:
        return f"the held-out error rises by {digits_text(100 * (after / before - 1), 3)} %"
    if not (is_number(before) and is_number(after)):
        return fall_text(before, after)
    return f"the held-out error falls by {digits_text(100 * (1 - after / before), 3)} %"


# ---- a step of an explanation


def evidence_text(step: Step) -> str:
    """Evidence for an effect: p-value, fall of the held-out error, blocks that agree."""
    fall = relative_fall_text(step.error_before, step.error_after)
    p_value = "" if step.p_value is None else f"p = {p_value_text(step.p_value)}"
    agreement = "" if step.blocks_agree is None else f"{step.blocks_agree} blocks agree"
    told = "; ".join(filter(None, (p_value, fall, agreement))) + "."
    rises = is_number(step.error_before) and direction_text(step.error_before, step.error_after) == "rises"
    if not rises or not step.held_out_gain or step.held_out_gain <= 0.0:
        return told
    return (f"{told} It is kept because what is held out is likelier with it from row to row, by "
            f"{digits_text(step.held_out_gain, 3)} nats: over the horizon, where a random force adds up, that need not "
            "show.")  # fmt: skip


def force_change_text(before: float, after: float, plant: PlantSignature) -> str:
    """What a step did to the random force, as shares of the drive."""
    of_all = plant.drive_words
    return f"The random force that is left goes from {share_text(before)} to {share_text(after)} of {of_all}."


def equivalents_text(step: Step, subject: str) -> str:
    """The effects that the data do not tell from a step's."""
    return f"These data cannot tell {subject} from {names_text(step.equivalent_to)}."


def names_text(names: tuple[str, ...]) -> str:
    """Names in a row."""
    return ", ".join(names)


# ---- an explanation on the page


def ambiguity_sentences(explanation: Ladder) -> list[str]:
    """The equivalents of every step that has some."""
    return [equivalents_text(s, s.effect) for s in explanation.steps if s.equivalent_to]


def short_verdict_text(explanation: Ladder) -> str:
    """The verdict in a few words."""
    more = "more " if explanation.steps else ""
    known = {"nothing_missing": f"nothing {more}is missing", "unexplained": "something is unexplained"}
    return known.get(explanation.verdict, explanation.verdict)


def headline_sentences(explanation: Ladder, quantities: PlantUnits) -> list[str]:
    """Every added effect with its size, and what they did to the held-out error."""
    before, after, floor = map(error_text, (explanation.base_error, explanation.error, explanation.noise_floor))
    kind = "held-out" if explanation.problem.data.validation else "training"
    if not explanation.steps:
        return [f"With its own parameters refitted, the model has a {kind} error of {before} "
                f"(noise floor {floor}); no effect of the library is worth adding."]  # fmt: skip
    return [*(_step_sentence(step, explanation, quantities) for step in explanation.steps),
            f"The {kind} error {direction_text(explanation.base_error, explanation.error)} from {before} to {after}; "
            f"the noise floor is {floor}."]  # fmt: skip


def _step_sentence(step: Step, explanation: Ladder, quantities: PlantUnits) -> str:
    sentence = plain_effect_text(step.effect, explanation.problem.plant)
    size = step_size_text(step, explanation, quantities)
    several = is_number(step.error_before) and is_number(step.error_after) and len(explanation.steps) > 1
    fall = f"; error from {error_text(step.error_before)} to {error_text(step.error_after)}" if several else ""
    return f"{sentence} ({step.effect}): {size}{fall}."
