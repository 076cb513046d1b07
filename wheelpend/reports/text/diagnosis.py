"""Results of `diagnose` as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from derive import effects as library
from wheelpend.reports.console import print_line, print_table
from wheelpend.reports.numbers import effect_size_text, estimate_text, number_text, rms_drive_voltage
from wheelpend.reports.text.comparison import print_force_concentrations

if TYPE_CHECKING:
    from wheelpend.diagnosis.evidence import CandidateFit
    from wheelpend.diagnosis.explain import Step
    from wheelpend.diagnosis.verdict import Diagnosis
    from wheelpend.model.record import Model
    from wheelpend.reports.text.unexplained import LawRequest


def print_diagnosis(result: Diagnosis, model: Model, asked: LawRequest | None = None) -> None:
    """Print a diagnosis."""
    from wheelpend.reports.text.unexplained import LawRequest, print_unexplained

    print_line(verdict_text(result, model))
    if result.candidates:
        rows = [
            (t.effect, effect_size_text(t.coefficients, t.sigma, t.unit, model).replace("; ", "\n"), f"{t.p_value:.1e}",
             t.blocks_agree, number_text(t.error_after), "\n".join(t.equivalent_to), "" if t.physical else "impossible")
            for t in result.candidates
        ]  # fmt: skip
        columns = ("effect", "size", "p", "blocks", "error after", "equivalent to", "physically")
        told = [k for k in range(len(columns)) if any(row[k] for row in rows)]  # a column of blanks tells nothing
        print_table(f"Candidates (held-out error now {result.error:.4g})",
              [columns[k] for k in told], [[row[k] for k in told] for row in rows])  # fmt: skip
        for tried in result.candidates:
            print_log_estimates(tried)
    if result.experiment:
        print_line(result.experiment)
    print_force_concentrations(result.where, model, result)
    print_unexplained(result.repeats, result.law, asked or LawRequest(), result.verdict)
    if result.detectable:
        print_table("It would have shown", ("effect", "from a size of"), [
            (n, ", ".join(f"{p} {v:.2g}" for p, v in sizes.items())) for n, sizes in result.detectable.items()
        ])  # fmt: skip
    for name, why in result.not_judged.items():
        print_line(f"{name} was not judged: it {why}.")


def verdict_text(result: Diagnosis, model: Model) -> str:
    """The verdict in a sentence or two."""
    if result.verdict == "nothing_missing":
        return (f"Nothing is missing: error {result.error:.4g}, noise floor {result.noise_floor:.4g}, and no "
                "effect of the library is worth naming.")  # fmt: skip
    if result.verdict == "unexplained":
        return (f"Something is missing (error {result.error:.4g}, noise floor {result.noise_floor:.4g}), and "
                f"no effect of the library accounts for it.{partial_explanation_text(result)}")  # fmt: skip
    return best_candidate_text(result.candidates[0], result, model)


def partial_explanation_text(result: Diagnosis) -> str:
    """What the first candidate explains where none explains all, as a sentence to follow another."""
    if not result.named:
        return ""
    best = result.named[0]
    return (f" {best.effect} explains most: with it the held-out error falls to {best.error_after:.4g}. It may be a "
            "part of what is missing, or only resemble it.")  # fmt: skip


def best_candidate_text(best: CandidateFit, result: Diagnosis, model: Model) -> str:
    """What the first candidate is and what it means for the machine."""
    effect = library.find(best.effect)
    rest = ("" if best.error_after <= 1.1 * result.noise_floor else
            " Further effects explain the rest: add it and diagnose again, or use `wheelpend explain`.")  # fmt: skip
    certain = "is missing" if result.verdict == "effect_missing" else f"or {', '.join(best.equivalent_to)} is missing"
    amount = effect_size_text(best.coefficients, best.sigma, best.unit, model, rms_drive_voltage(result.problem))
    return (f"{best.effect} {certain}: {effect.sentence} {amount[:1].upper()}{amount[1:]}. {effect.means} "
            f"With it the held-out error falls from {result.error:.4g} to {best.error_after:.4g} "
            f"(noise floor {result.noise_floor:.4g}).{rest}")  # fmt: skip


def evidence_text(step: Step) -> str:
    """How sure an effect is, and how much it matters."""
    fall = f"the held-out error falls by {100 * (1 - step.error_after / step.error_before):.3g} %"
    sure = "" if step.p_value is None else f"p = {step.p_value:.1e}"
    agree = "" if step.blocks_agree is None else f"lower in {step.blocks_agree} blocks"
    return "; ".join(filter(None, (sure, fall, agree))) + "."


def print_log_estimates(found: CandidateFit | Step) -> None:
    """Print what an effect is in each of several logs, where they have their own sizes."""
    for own in found.per_log:
        sizes = ", ".join(f"{n} {estimate_text(v, own.sigma[n], found.unit[n])}" for n, v in own.coefficients.items())
        print_line(f"  {found.effect} in {own.log}: {sizes}")
