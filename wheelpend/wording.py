"""Results in words: what the commands print."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from derive import effects as library
from wheelpend.console import say, table
from wheelpend.quantities import Quantities, quantities_of

if TYPE_CHECKING:  # each command needs one of them, and has loaded it
    from wheelpend.bias import Bias
    from wheelpend.comparison import Comparison
    from wheelpend.diagnosis import Diagnosis
    from wheelpend.evidence import Tried
    from wheelpend.explanation import Explanation, Step
    from wheelpend.filter_choice import Guide
    from wheelpend.identification import Identification
    from wheelpend.inspection import Inspection
    from wheelpend.logs import Log
    from wheelpend.missing_force import Place
    from wheelpend.model import Model
    from wheelpend.unexplained import Asked

MOST_BURSTS = 12  # times of bursts that are listed


def number(value: float | None) -> str:
    """Four significant digits."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.4g}"


def with_sigma(value: float, sigma: float | None, unit: str) -> str:
    """A value with its standard error and unit."""
    spread = f" ± {sigma:.2g}" if sigma is not None and np.isfinite(sigma) else ""
    return f"{value:.5g}{spread} {unit if unit != '1' else ''}".rstrip()


def size(coefficients: dict, sigma: dict, unit: dict, model: Model, drive: float | None = None) -> str:
    """Coefficients of an effect, in N·m or N too where a volt's worth is known, and as a share of the drive voltage."""
    parts, quantities = [], quantities_of(model)
    for name, value in coefficients.items():
        text = f"{name} {with_sigma(value, sigma.get(name), unit[name])}"
        if found := quantities.in_physical(value, unit[name]):
            text += f" = {found[0]:.4g} {found[1]}"
        if drive and unit[name] == quantities.force:
            text += f", {100 * abs(value) / drive:.1f} % of the rms drive voltage"
        parts.append(text)
    return "; ".join(parts)


def drive_voltage(study) -> float:
    """Root mean square of the voltage of the training logs [V]."""
    return float(np.sqrt(np.nanmean(np.concatenate([p.log.voltage for p in study.training]) ** 2)))


def place_sentence(place: Place, quantities: Quantities) -> str:
    """Where a row's missing force is concentrated, in words."""
    unit = quantities.unit(place.state)
    return (f"{place.row} row: {100 * place.share:.0f} % of the missing force is found where {place.state} lies "
            f"between {place.low:.3g} and {place.high:.3g} {unit}".rstrip() + ".")  # fmt: skip


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


def show_inspection(log: Log, result: Inspection) -> None:
    """Print what a log is like, what is wrong with it, and the lines for model.toml that say so."""
    say(f"{log.name}: {result.samples} samples over {result.duration_s:.4g} s, {result.rate_hz:.6g} Hz, "
        f"jitter {100 * result.jitter:.2g} % of an interval.")  # fmt: skip
    names = sorted({k for row in result.channels.values() for k in row})
    table("Channels", ("channel", *names), [
        (c, *(number(row.get(k)) for k in names)) for c, row in result.channels.items()
    ])  # fmt: skip
    for finding in result.findings:
        say(f"- {finding.sentence} {finding.cure}")
    for name, times in result.stand_still.items():
        shown = ", ".join(f"{a:.2f}-{b:.2f}" for a, b in times[:MOST_BURSTS])
        say(f"{name} stands still within its noise for {sum(b - a for a, b in times):.3g} s in all: {shown}"
            f"{', …' if len(times) > MOST_BURSTS else ''} s.")  # fmt: skip
    say(f"Put this into model.toml:\n\n{result.proposal}" if result.proposal else "Nothing odd was found.")
    if result.sensors:
        say(f"By this log, the sensors are:\n\n{result.sensors}")


def show_comparison(result: Comparison, model: Model) -> None:
    """Print a comparison."""
    if result.fitted_first:
        say("The model has no parameter values yet: it was fitted to the log first.")
    say(f"Error {result.error:.4g} over {result.horizon_s:g} s (noise floor {result.noise_floor:.4g}): "
        "the model " + ("explains the log down to its noise." if result.error < 1.05 * result.noise_floor
                        else "misses something."))  # fmt: skip
    table(f"Fit per channel over {result.horizon_s:g} s", ("channel", "fit [%]", "rmse"),
          [(c, f"{f:.2f}", number(result.rmse[c])) for c, f in result.fit_percent.items()])  # fmt: skip
    table("Error against horizon", ("seconds", "error"),
          [(f"{h.seconds:.4g}", "diverged" if h.diverged else number(h.error)) for h in result.horizons])  # fmt: skip
    if result.closed_loop:
        loop = result.closed_loop
        say("Closed loop replayed with the model: " + ("it falls over." if loop.diverged else
            ", ".join(f"{c} off by {number(v)} rms" for c, v in loop.rmse.items())
            + f", control input off by {number(loop.rmse_input)} V rms."))  # fmt: skip
    for row in result.per_log:
        say(f"Of its own in {row['log']}: " + ", ".join(f"{n} {v:.4g}" for n, v in row.items() if n != "log") + ".")
    show_forces(result, model)
    show_places(result.where, model, result)


def show_forces(result: Comparison, model: Model) -> None:
    """Print what the equations leave of the input, and where in time they miss far more than usual."""
    known = {n: e for n, e in result.force_error.items() if e is not None}
    for name, left in known.items():
        say(f"{name}: inverse dynamics leave {left:.3g} % of the input unexplained.")
    for name in known:
        found = [b for b in result.bursts if b["log"] == name and not b["at_reversal"]]
        turning = sum(b["log"] == name and b["at_reversal"] for b in result.bursts)
        if found:
            peak, quantities = max(b["peak"] for b in found), quantities_of(model)
            physical = quantities.in_physical(peak, quantities.force)
            size = f"{peak:.3g} {quantities.force}" + (f" = {physical[0]:.3g} {physical[1]}" if physical else "")
            shown = ", ".join(f"{b['from']:.3f}" for b in found[:MOST_BURSTS])
            say(f"{name}: in {len(found)} short stretches the model misses far more force than usual, up to {size}: at "
                f"t = {shown}{', …' if len(found) > MOST_BURSTS else ''} s. Something pushes there, or winds up, that "
                "the model does not have.")  # fmt: skip
        if turning:
            say(f"{name}: so it does at {turning} reversals, where friction is hardest to know.")


def show_places(places: tuple[Place, ...], model: Model, result) -> None:
    """Print where the model fails."""
    if not places:
        return
    quantities = quantities_of(model)
    say("Where it fails:")
    for place in places:
        say(f"  {place_sentence(place, quantities)}")
    missing = result.missing
    if missing is not None:
        unit = "" if quantities.force == "1" else f" {quantities.force}"
        for row, name in enumerate(result.study.module.ROWS):
            rms = float(np.sqrt(np.mean(missing.force[:, row] ** 2)))
            found = quantities.in_physical(rms, quantities.force)
            torque = f" = {found[0]:.3g} {found[1]}" if found else ""
            say(f"  Missing force on the {name} row: {rms:.3g}{unit}{torque} rms, known to "
                f"± {float(np.mean(missing.sigma[:, row])):.2g}{unit}.")  # fmt: skip


def show_diagnosis(result: Diagnosis, model: Model, asked: Asked | None = None) -> None:
    """Print a diagnosis."""
    from wheelpend.unexplained import Asked, tell

    say(headline(result, model))
    if result.candidates:
        rows = [
            (t.effect, size(t.coefficients, t.sigma, t.unit, model).replace("; ", "\n"), f"{t.p_value:.1e}",
             t.blocks_agree, number(t.error_after), "\n".join(t.equivalent_to), "" if t.physical else "impossible")
            for t in result.candidates
        ]  # fmt: skip
        columns = ("effect", "size", "p", "blocks", "error after", "equivalent to", "physically")
        told = [k for k in range(len(columns)) if any(row[k] for row in rows)]  # a column of blanks tells nothing
        table(f"Candidates (held-out error now {result.error:.4g})",
              [columns[k] for k in told], [[row[k] for k in told] for row in rows])  # fmt: skip
        for tried in result.candidates:
            show_each_log(tried)
    if result.experiment:
        say(result.experiment)
    show_places(result.where, model, result)
    tell(result.repeats, result.law, asked or Asked(), result.verdict)
    if result.detectable:
        table("It would have shown", ("effect", "from a size of"), [
            (n, ", ".join(f"{p} {v:.2g}" for p, v in sizes.items())) for n, sizes in result.detectable.items()
        ])  # fmt: skip
    for name, why in result.not_judged.items():
        say(f"{name} was not judged: it {why}.")


def headline(result: Diagnosis, model: Model) -> str:
    """The verdict in a sentence or two."""
    if result.verdict == "nothing_missing":
        return (f"Nothing is missing: error {result.error:.4g}, noise floor {result.noise_floor:.4g}, and no "
                "effect of the library is worth naming.")  # fmt: skip
    if result.verdict == "unexplained":
        return (f"Something is missing (error {result.error:.4g}, noise floor {result.noise_floor:.4g}), and "
                f"no effect of the library accounts for it.{partial(result)}")  # fmt: skip
    return first_sentence(result.candidates[0], result, model)


def partial(result: Diagnosis) -> str:
    """What the first candidate explains where none explains all, as a sentence to follow another."""
    if not result.named:
        return ""
    best = result.named[0]
    return (f" {best.effect} explains most: with it the held-out error falls to {best.error_after:.4g}. It may be a "
            "part of what is missing, or only resemble it.")  # fmt: skip


def first_sentence(best: Tried, result: Diagnosis, model: Model) -> str:
    """What the first candidate is and what it means for the machine."""
    effect = library.find(best.effect)
    rest = ("" if best.error_after <= 1.1 * result.noise_floor else
            " Further effects explain the rest: add it and diagnose again, or use `wheelpend explain`.")  # fmt: skip
    certain = "is missing" if result.verdict == "effect_missing" else f"or {', '.join(best.equivalent_to)} is missing"
    amount = size(best.coefficients, best.sigma, best.unit, model, drive_voltage(result.study))
    return (f"{best.effect} {certain}: {effect.sentence} {amount[:1].upper()}{amount[1:]}. {effect.means} "
            f"With it the held-out error falls from {result.error:.4g} to {best.error_after:.4g} "
            f"(noise floor {result.noise_floor:.4g}).{rest}")  # fmt: skip


def show_ladder(nominal: float | None, base: float, steps: tuple[Step, ...], floor: float) -> None:
    """Print the error ladder as bars."""
    rungs = ([("nominal parameters", nominal)] if nominal is not None else []) + [("after refitting", base)]
    rungs += [(f"+ {s.effect}", s.error_after) for s in steps]
    top = max(np.log10(max(e / floor, 1.0)) for _, e in rungs) or 1.0
    say(f"{'held-out error':>24}   (noise floor {floor:.4g})")
    for name, error in rungs:
        length = round(44 * np.log10(max(error / floor, 1.0)) / top)
        say(f"{name:>24} {error:9.4g} {'█' * length}{'▏' if length == 0 else ''}")


def evidence(step: Step) -> str:
    """How sure an effect is, and how much it matters."""
    fall = f"the held-out error falls by {100 * (1 - step.error_after / step.error_before):.3g} %"
    sure = "" if step.p_value is None else f"p = {step.p_value:.1e}"
    agree = "" if step.blocks_agree is None else f"lower in {step.blocks_agree} blocks"
    return "; ".join(filter(None, (sure, fall, agree))) + "."


def show_each_log(found: Tried | Step) -> None:
    """Print what an effect is in each of several logs, where they have their own sizes."""
    for own in found.per_log:
        sizes = ", ".join(f"{n} {with_sigma(v, own.sigma[n], found.unit[n])}" for n, v in own.coefficients.items())
        say(f"  {found.effect} in {own.log}: {sizes}")


def show_explanation(result: Explanation, asked: Asked | None = None) -> None:
    """Print an explanation."""
    from wheelpend.unexplained import Asked, tell

    show_ladder(result.nominal_error, result.base_error, result.steps, result.noise_floor)
    for step in result.steps:
        effect = library.find(step.effect)
        amount = size(step.coefficients, step.sigma, step.unit, result.model, drive_voltage(result.study))
        say(f"{step.effect}: {effect.sentence} {amount[:1].upper()}{amount[1:]}. {effect.means}")
        say(f"  {evidence(step)}")
        show_each_log(step)
        if step.equivalent_to:
            say(f"  These data cannot tell it from {', '.join(step.equivalent_to)}. {result.experiment or ''}")
    closing = {
        "nothing_missing": "Nothing more is missing.",
        "ambiguous": "Nothing more is missing, but a step was ambiguous.",
        "unexplained": "Something is still missing that no effect of the library accounts for.",
    }
    say(closing[result.verdict])
    tell(result.repeats, result.law, asked or Asked(), result.verdict)
