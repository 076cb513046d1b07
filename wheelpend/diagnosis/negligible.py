"""Effects that are said, not added: what is certain and too small to matter, and what does as well as chance."""

from __future__ import annotations

from collections.abc import Sequence

from wheelpend.diagnosis.criteria import MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.evidence import FAMILYWISE_SIGNIFICANCE_LEVEL, CandidateFit


def is_negligible(candidate: CandidateFit, error_before: float) -> bool:
    """Significant and physically possible, and lowering the validation error, but not by what makes a step."""
    certain = candidate.physical and candidate.p_value < FAMILYWISE_SIGNIFICANCE_LEVEL
    return certain and 1.0 - MIN_RELATIVE_ERROR_DECREASE <= candidate.error_after / error_before < 1.0


def negligible_sentences(candidates: Sequence[CandidateFit], lowered: str = "the error") -> tuple[str, ...]:
    """A sentence on effects of this kind, the best first, with its size; none without any.

    ``lowered`` says what it does not lower.
    """
    if not candidates:
        return ()
    best, *others = candidates
    also = f"; so, alone, is {', '.join(o.effect for o in others)}" if others else ""
    return (
        f"Certain, and too small to matter: {best.effect} ({_sizes(best)}){also}. It lowers {lowered} "
        f"by less than {100.0 * MIN_RELATIVE_ERROR_DECREASE:g} %, so that nothing is added.",
    )


def instead_of_chance_sentences(candidates: Sequence[CandidateFit]) -> tuple[str, ...]:
    """A sentence on effects with which hardly any random force is needed, though none is certain; none without any."""
    if not candidates:
        return ()
    *others, last = [f"{c.effect} ({_sizes(c)})" for c in candidates]
    named = f"{', '.join(others)} or {last}" if others else last
    return (
        f"With {named} hardly any random force is needed, and what was measured is as likely or likelier: it is too "
        "short, or moves too little, to tell a law from chance.",
    )


def _sizes(candidate: CandidateFit) -> str:
    """Parameters with their standard errors and units."""
    return ", ".join(
        f"{name} {e.value:.3g} ± {e.sigma:.1g}" + ("" if e.unit == "1" else f" {e.unit}")
        for name, e in candidate.estimates.items()
    )
