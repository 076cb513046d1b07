"""The finding of an explanation as the title of its page: effects in plain words, and what they do to the error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from derive.parameter_name import effect_of, full_name
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.reports.numbers import error_text, is_number, share_text, typeset_number_text, unit_text
from wheelpend.reports.text.verdict import CANNOT_BE_TOLD, plain_effect_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.explain import Ladder, Step
    from wheelpend.estimation.estimate import Estimate

SHOWN_DIGITS = 3  # of sizes and errors: the page has the others
MIN_MOST_SHARE = 0.5  # of the error above the noise floor, from which on most of it is explained


def title_text(explanation: Ladder) -> str:
    """The added effects in words, with their names, and how far they explain the error."""
    if not explanation.steps:
        return _without_steps(explanation)
    first, *others = (_found_text(step, explanation) for step in explanation.steps)
    found = "; ".join([first, *(other[:1].lower() + other[1:] for other in others)])
    verb = "together they explain" if others else "that explains"
    if force := _explained_force_text(explanation):
        return f"{found}: {verb} {force}"
    before, after = (error_text(e, SHOWN_DIGITS) for e in (explanation.base_error, explanation.error))
    return f"{found}: {verb} {_explained_text(explanation)}, {before} → {after} σ"


def _explained_force_text(explanation: Ladder) -> str:
    """Which part of the random force the effects explain, where they explain most of it and not the error."""
    before, after = explanation.steps[0].force_before, explanation.steps[-1].force_after
    falls = not is_number(explanation.base_error) or explanation.error < explanation.base_error
    if falls or before is None or after is None or not is_number(before) or not after <= MIN_MOST_SHARE * before:
        return ""
    rest = ", and something is still missing" if explanation.verdict == "unexplained" else ""
    shares = f"{share_text(before)} → {share_text(after)} of {explanation.problem.plant.drive_words}"
    return f"most of what was left to chance{rest}, {shares}"


def _without_steps(explanation: Ladder) -> str:
    """The finding that no effect is to be added, and which the model already has."""
    if explanation.last.determines_nothing:
        return f"{CANNOT_BE_TOLD}: these logs determine no parameter of the machine"
    if explanation.verdict == "unexplained":
        return "Something is missing that the library does not hold"
    known = [
        _named_text(e, [e], [v for n, v in explanation.parameters.items() if effect_of(n) == e], explanation)
        for e in explanation.effects
    ]
    left = explanation.remainder
    if left is not None and left.instead:
        beside = f" beside {'; '.join(k[:1].lower() + k[1:] for k in known)}" if known else ""
        return f"What remains{beside} may be chance or {' or '.join(left.instead)}: these logs do not tell"
    return f"Nothing more is missing in this model: {'; '.join(known)}" if known else (
        "Nothing is missing in this model")  # fmt: skip


def _found_text(step: Step, explanation: Ladder) -> str:
    """An effect in words, its name and those of its equivalents, and its size where one number tells it."""
    sizes = [explanation.parameters.get(full_name(step.effect, n), e) for n, e in step.estimates.items()]
    return _named_text(step.effect, (step.effect, *step.equivalent_to), sizes, explanation)


def _named_text(effect: str, names: Sequence[str], sizes: Sequence[Estimate], explanation: Ladder) -> str:
    size = "" if len(sizes) != 1 or sizes[0].per_log or not is_number(sizes[0].value) else (
        f", {typeset_number_text(sizes[0].value, SHOWN_DIGITS)} {unit_text(sizes[0].unit)}".rstrip())  # fmt: skip
    return f"{plain_effect_text(effect, explanation.problem.plant)} ({' or '.join(names)}){size}"


def _explained_text(explanation: Ladder) -> str:
    """Which part of the held-out error the added effects explain."""
    before, after, floor = explanation.base_error, explanation.error, explanation.noise_floor
    rest = ", and something is still missing" if explanation.verdict == "unexplained" else ""
    if is_number(floor) and is_number(after) and after <= MAX_EXPLAINED_ERROR_RATIO * floor:
        return f"the error down to the noise{rest}"
    if is_number(before) and not after < before:
        return f"forces that a larger error hides{rest}"
    above = before - floor if is_number(floor) else before
    most = not is_number(before) or before - after >= MIN_MOST_SHARE * above
    return f"{'most' if most else 'a part'} of the error{rest}"
