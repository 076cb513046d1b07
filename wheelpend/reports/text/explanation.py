"""Results of `explain` as text: the error ladder, step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from derive import effects as library
from wheelpend.reports.console import print_line
from wheelpend.reports.numbers import effect_size_text, rms_drive_voltage
from wheelpend.reports.text.diagnosis import evidence_text, print_log_estimates

if TYPE_CHECKING:
    from wheelpend.diagnosis.explain import Explanation, Step
    from wheelpend.reports.text.unexplained import LawRequest


def print_ladder(nominal: float | None, base: float, steps: tuple[Step, ...], floor: float) -> None:
    """Print the error ladder as bars."""
    rungs = ([("nominal parameters", nominal)] if nominal is not None else []) + [("after refitting", base)]
    rungs += [(f"+ {s.effect}", s.error_after) for s in steps]
    top = max(np.log10(max(e / floor, 1.0)) for _, e in rungs) or 1.0
    print_line(f"{'held-out error':>24}   (noise floor {floor:.4g})")
    for name, error in rungs:
        length = round(44 * np.log10(max(error / floor, 1.0)) / top)
        print_line(f"{name:>24} {error:9.4g} {'█' * length}{'▏' if length == 0 else ''}")


def print_explanation(result: Explanation, asked: LawRequest | None = None) -> None:
    """Print an explanation."""
    from wheelpend.reports.text.unexplained import LawRequest, print_unexplained

    print_ladder(result.nominal_error, result.base_error, result.steps, result.noise_floor)
    for step in result.steps:
        effect = library.find(step.effect)
        amount = effect_size_text(
            step.coefficients, step.sigma, step.unit, result.model, rms_drive_voltage(result.problem)
        )
        print_line(f"{step.effect}: {effect.sentence} {amount[:1].upper()}{amount[1:]}. {effect.means}")
        print_line(f"  {evidence_text(step)}")
        print_log_estimates(step)
        if step.equivalent_to:
            print_line(f"  These data cannot tell it from {', '.join(step.equivalent_to)}. {result.experiment or ''}")
    closing = {
        "nothing_missing": "Nothing more is missing.",
        "ambiguous": "Nothing more is missing, but a step was ambiguous.",
        "unexplained": "Something is still missing that no effect of the library accounts for.",
    }
    print_line(closing[result.verdict])
    print_unexplained(result.repeats, result.law, asked or LawRequest(), result.verdict)
