"""Results of `identify` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.reports.console import say, table
from wheelpend.reports.numbers import number, with_sigma

if TYPE_CHECKING:
    from wheelpend.identification.bias_test import Bias
    from wheelpend.identification.identify import Identification
    from wheelpend.identification.time_constants import Guide


def show_identification(result: Identification) -> None:
    """Print identified parameters."""
    rows = [
        (n, with_sigma(r["value"], r["sigma"], result.unit.get(n, "")), "" if r["identifiable"] else "not excited")
        for n, r in result.parameters.items()
    ]
    table(f"Parameters by {result.method}", ("parameter", "value", ""), rows)
    for n, r in result.parameters.items():
        for own in r.get("per_log", ()):
            say(f"  {n} in {own['log']}: {with_sigma(own['value'], own['sigma'], result.unit.get(n, ''))}")
    say(f"{result.samples} samples; condition number {result.condition_number:.3g}"
        + (f"; error {result.error:.4g} (noise floor {result.noise_floor:.4g})" if result.error else "")
        + ("; τ = " + ", ".join(f"{t:g}" for t in result.tau) + " s" if result.tau else "")
        + ".")  # fmt: skip
    if result.force_error is not None:
        say(f"Inverse dynamics with these values leave {result.force_error:.3g} % of the input unexplained.")
    if result.bias:
        show_bias(result.bias)
    if result.guide:
        show_guide(result.guide)


def show_bias(bias: Bias) -> None:
    """Print whether least squares is biased, and by how much."""
    table(f"Least squares against {bias.against}, in % of each parameter",
          ("parameter", "difference", "± by chance", "bias predicted", "spread predicted"),
          [(n, *(number(column[n]) for column in (bias.difference_percent, bias.sigma_percent,
                                                  bias.predicted_bias_percent, bias.predicted_spread_percent)))
           for n in bias.difference_percent])  # fmt: skip
    say(bias.sentence)


def show_guide(guide: Guide) -> None:
    """Print what the time constants do to the estimate, both alike, and why a pair was chosen."""
    rows = [(f"{r.tau1:g}", number(r.bias), number(r.spread), number(r.score)) for r in guide.diagonal]
    table(f"Both time constants alike, on {guide.replicas} rehearsals",
          ("τ [s]", "bias [%]", "spread [%]", "error [%]"), rows)  # fmt: skip
    say(guide.reason)
