"""``python -m wheelpend.benchmarks.hidden_effects.alarms``: false alarms on complete models, coverage of intervals.

Logs are simulated in which nothing is hidden, but whose sensors and clock are not ideal. Counted are how often an
effect is named, how often the verdict is anything but ``nothing_missing``, how many true parameters lie in their 95 %
intervals, and how small the probabilities come out that single effects get by chance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, NamedTuple, TypeVar

import numpy as np
import typer

from wheelpend.api import diagnose
from wheelpend.benchmarks.hidden_effects.nonideal_sensors import SENSOR_KINDS, complete_log
from wheelpend.benchmarks.hidden_effects.page import rate_text
from wheelpend.benchmarks.hidden_effects.summary import NORMAL_QUANTILE_95
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.diagnosis.evidence import deviation_from_absence, wald_p_value
from wheelpend.diagnosis.refit import SHORT_HORIZON_SHARE, refit, short_score_tests, significance_fit, starts_for
from wheelpend.diagnosis.score_test import size_names
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameter_table import standard_error
from wheelpend.estimation.problem import extended_effects
from wheelpend.estimation.profiled_starts import null_values, profile_grids
from wheelpend.estimation.starts import best_start
from wheelpend.model.record import Model
from wheelpend.parallel import results_as_completed
from wheelpend.proportion import proportion_of
from wheelpend.reports.console import err, exit_on_failure, print_line
from wheelpend.simulation.hidden import machine_values, parse_hidden

FIRST_SEED = 7000
T = TypeVar("T")


@dataclass(frozen=True)
class FalseAlarmTrial:
    """Verdict and estimates of a diagnosis of a log in which nothing is hidden."""

    kind: str
    seed: int
    verdict: str
    named: tuple[str, ...]
    error: float  # held out [σ]
    floor: float  # of the noise [σ]
    deviations: tuple[float, ...]  # of every parameter from its true value, in standard errors


class EffectPValue(NamedTuple):
    """Wald p-value of one effect on a log in which nothing is hidden."""

    kind: str
    effect: str
    p_value: float  # not corrected for the choice among starts
    trials: int  # independent starts, by which a diagnosis multiplies it


def diagnose_log(kind: str, seed: int, **options) -> FalseAlarmTrial:
    """Diagnose one log; options are those of complete_log."""
    model, log = complete_log(kind, seed, **options)
    found = diagnose(model, [log])
    named = tuple(t.effect for t in found.named)
    return FalseAlarmTrial(kind, seed, found.verdict, named, found.error, found.noise_floor, deviations(model, found))


def deviations(model: Model, found: Diagnosis) -> tuple[float, ...]:
    """(estimate − truth) / standard error of every parameter of the model."""
    truth = machine_values(model, {})
    return tuple(
        (found.fit.values[n] - truth[n]) / standard_error(found.problem, found.fit, n) for n in found.problem.base
    )


def effect_p_values(kind: str, seed: int, effects: Sequence[str] = (), **options) -> list[EffectPValue]:
    """P-values of effects, refitted as a diagnosis does, but without its selection by the score test.

    Without names: of the effects whose null hypothesis is not regular, because they have profiled parameters or a grid
    of sizes.
    """
    model, log = complete_log(kind, seed, **options)
    problem, start = best_start(prepare(model, [log]))
    free = free_names(problem, model.effects)
    short = fit_model(problem, start, free, horizons=(SHORT_HORIZON_SHARE,))
    tested = [e for e in problem.candidates() if (e.name in effects if effects else e.profiled or e.parameters[0].grid)]
    score_tests = short_score_tests(problem, short, start, profile_grids(problem, short, tested), corrupted=False)
    found = []
    for effect in tested:
        starts = starts_for(score_tests, effect.name)
        started = refit(problem, short, starts)
        fitted = fit_model(
            problem, started.values, free_names(problem, extended_effects(model, effect.name)), horizons=(1.0,)
        )
        evidence = significance_fit(problem, fitted)
        sizes = [p for p in evidence.free if p.name in size_names(effect)]
        p_value = wald_p_value(evidence, sizes, deviation_from_absence(evidence, sizes, null_values(problem, effect)))
        found.append(EffectPValue(kind, effect.name, p_value, starts[0][1].trials))
    return found


def alarm_table(alarms: Sequence[FalseAlarmTrial]) -> str:
    """Rates by kind of sensors, as Markdown."""
    rows = []
    for kind in dict.fromkeys(a.kind for a in alarms):
        mine = [a for a in alarms if a.kind == kind]
        named = proportion_of(bool(a.named) for a in mine)
        alarmed = proportion_of(a.verdict != "nothing_missing" for a in mine)
        inside = proportion_of(abs(d) < NORMAL_QUANTILE_95 for a in mine for d in a.deviations)
        error = float(np.mean([a.error / a.floor for a in mine]))
        rows.append((kind, rate_text(named), rate_text(alarmed), f"{error:.2f}", rate_text(inside)))
    head = ("sensors", "an effect named", "verdict not nothing_missing", "error over floor", "true values in intervals")
    return markdown_table(head, rows)


def named_table(alarms: Sequence[FalseAlarmTrial]) -> str:
    """Counts of the first answers where something is hidden, by kind of sensors, as Markdown."""
    rows = []
    for kind in dict.fromkeys(a.kind for a in alarms):
        answers = Counter(a.named[0] if a.named else a.verdict for a in alarms if a.kind == kind)
        rows.append((kind, ", ".join(f"{n} {count}" for n, count in answers.most_common())))
    return markdown_table(("sensors", "named first"), rows)


def p_value_table(found: Iterable[EffectPValue]) -> str:
    """Rates of p-values below 0.05 and 0.01, and below 0.05 once multiplied by the trials, by effect, as Markdown."""
    found, rows = list(found), []
    for effect in dict.fromkeys(c.effect for c in found):
        mine = [c for c in found if c.effect == effect]
        alone = [proportion_of(c.p_value < level for c in mine) for level in (0.05, 0.01)]
        times = proportion_of(c.p_value * c.trials < 0.05 for c in mine)
        trials = f"{np.mean([c.trials for c in mine]):.3g}"
        rows.append((effect, *map(rate_text, alone), trials, rate_text(times)))
    return markdown_table(("effect", "p < 0.05", "p < 0.01", "trials", "p times trials < 0.05"), rows)


def main(
    logs: Annotated[int, typer.Option(help="Logs of each kind of sensors.")] = 16,
    duration: Annotated[float, typer.Option(help="Length of each log [s].")] = 10.0,
    kinds: Annotated[list[str] | None, typer.Option("--kind", help="Sensors; repeat for several.")] = None,
    effects: Annotated[list[str] | None, typer.Option("--effect", help="Effect whose chances are counted.")] = None,
    hide: Annotated[list[str] | None, typer.Option(help="Hide an effect, and say only what is named.")] = None,
    only: Annotated[str, typer.Option(help="alarms, chances or both.")] = "both",
) -> None:
    """Count false alarms and the chances of single effects, and print both tables."""
    with exit_on_failure():
        asked = [(k, FIRST_SEED + n) for k in kinds or SENSOR_KINDS for n in range(logs)]
        if hide:
            hidden = parse_hidden(hide)
            print_line(
                named_table(
                    _run_with_progress([partial(diagnose_log, *a, duration=duration, hide=hidden) for a in asked])
                )
            )
            return
        if only != "chances":
            print_line(
                alarm_table(_run_with_progress([partial(diagnose_log, *a, duration=duration) for a in asked])) + "\n"
            )
        if only != "alarms":
            found = _run_with_progress([partial(effect_p_values, *a, effects or (), duration=duration) for a in asked])
            print_line(p_value_table([c for one in found for c in one]))


def _run_with_progress(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Results in order, with a line of progress for each."""
    found: dict[int, T] = {}
    for number, result in results_as_completed(jobs):
        found[number] = result
        err.print(f"{len(found)} of {len(jobs)}")
    return [found[number] for number in sorted(found)]


if __name__ == "__main__":
    typer.run(main)
