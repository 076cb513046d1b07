"""Results of `identify` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.reports.console import print_line, print_table
from wheelpend.reports.numbers import estimate_text, number_text

if TYPE_CHECKING:
    from wheelpend.identification.bias_test import BiasTest
    from wheelpend.identification.identify import Identification
    from wheelpend.identification.time_constants import TimeConstantChoice


def print_identification(result: Identification) -> None:
    """Print identified parameters."""
    rows = [
        (n, estimate_text(r["value"], r["sigma"], result.unit.get(n, "")), "" if r["identifiable"] else "not excited")
        for n, r in result.parameters.items()
    ]
    print_table(f"Parameters by {result.method}", ("parameter", "value", ""), rows)
    for n, r in result.parameters.items():
        for own in r.get("per_log", ()):
            print_line(f"  {n} in {own['log']}: {estimate_text(own['value'], own['sigma'], result.unit.get(n, ''))}")
    print_line(f"{result.samples} samples; condition number {result.condition_number:.3g}"
        + (f"; error {result.error:.4g} (noise floor {result.noise_floor:.4g})" if result.error else "")
        + ("; τ = " + ", ".join(f"{t:g}" for t in result.tau) + " s" if result.tau else "")
        + ".")  # fmt: skip
    if result.force_error is not None:
        print_line(f"Inverse dynamics with these values leave {result.force_error:.3g} % of the input unexplained.")
    if result.bias:
        print_bias(result.bias)
    if result.guide:
        print_filter_guide(result.guide)


def print_bias(bias: BiasTest) -> None:
    """Print whether least squares is biased, and by how much."""
    print_table(f"Least squares against {bias.against}, in % of each parameter",
          ("parameter", "difference", "± by chance", "bias predicted", "spread predicted"),
          [(n, *(number_text(column[n]) for column in (bias.difference_percent, bias.sigma_percent,
                                                  bias.predicted_bias_percent, bias.predicted_spread_percent)))
           for n in bias.difference_percent])  # fmt: skip
    print_line(bias.sentence)


def print_filter_guide(guide: TimeConstantChoice) -> None:
    """Print what the time constants do to the estimate, both alike, and why a pair was chosen."""
    rows = [(f"{r.tau1:g}", number_text(r.bias), number_text(r.spread), number_text(r.score)) for r in guide.diagonal]
    print_table(f"Both time constants alike, on {guide.replicas} rehearsals",
          ("τ [s]", "bias [%]", "spread [%]", "error [%]"), rows)  # fmt: skip
    print_line(guide.reason)
