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
from wheelpend.benchmarks.hidden_effects.imperfect import KINDS, complete_log
from wheelpend.benchmarks.hidden_effects.page import table, told
from wheelpend.diagnosis.evidence import distance, wald
from wheelpend.diagnosis.refit import SHORT, evidence_fit, near_screens, refit, starts_for
from wheelpend.diagnosis.score_test import size_names
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameter_table import standard_error
from wheelpend.estimation.problem import enlarged
from wheelpend.estimation.profiled_starts import nothing, shapes_of
from wheelpend.estimation.starts import best_start
from wheelpend.model.record import Model
from wheelpend.parallel import as_they_end
from wheelpend.proportion import rate
from wheelpend.reports.console import err, failures, say
from wheelpend.simulation.hidden import machine_values, parse_hidden

FIRST_SEED = 7000
T = TypeVar("T")
QUANTILE = 1.96  # standard deviations, of a 95 % interval


@dataclass(frozen=True)
class Alarm:
    """What a diagnosis says of a log in which nothing is hidden."""

    kind: str
    seed: int
    verdict: str
    named: tuple[str, ...]
    error: float
    floor: float
    deviations: tuple[float, ...]  # of every parameter, in standard errors


class Chance(NamedTuple):
    """What a log in which nothing is hidden says of one effect."""

    kind: str
    effect: str
    p_value: float  # not corrected
    trials: int  # by which it is multiplied beside the other effects


def try_log(kind: str, seed: int, **options) -> Alarm:
    """Diagnose one log; options are those of complete_log."""
    model, log = complete_log(kind, seed, **options)
    found = diagnose(model, [log])
    named = tuple(t.effect for t in found.named)
    return Alarm(kind, seed, found.verdict, named, found.error, found.noise_floor, deviations(model, found))


def deviations(model: Model, found: Diagnosis) -> tuple[float, ...]:
    """How far the fitted parameters are from the true ones, in their standard errors."""
    truth = machine_values(model, {})
    return tuple((found.fit.values[n] - truth[n]) / standard_error(found.study, found.fit, n) for n in found.study.base)


def chances(kind: str, seed: int, effects: Sequence[str] = (), **options) -> list[Chance]:
    """Probabilities of effects, refitted as a diagnosis does but whether they promise anything or not.

    Without names those that are not absent at a point where the fit is smooth: they have a grid of sizes or a shape.
    """
    model, log = complete_log(kind, seed, **options)
    study, start = best_start(prepare(model, [log]))
    free = free_names(study, model.effects)
    short = fit_model(study, start, free, horizons=(SHORT,))
    bent = [e for e in study.missable() if (e.name in effects if effects else e.profiled or e.parameters[0].grid)]
    near = near_screens(study, short, start, shapes_of(study, short, bent), corrupted=False)
    found = []
    for effect in bent:
        beginnings = starts_for(near, effect.name)
        begun = refit(study, short, beginnings)
        fitted = fit_model(study, begun.values, free_names(study, enlarged(model, effect.name)), horizons=(1.0,))
        evidence = evidence_fit(study, fitted, begun)
        sized = [n for n in evidence.free if n.split("@")[0] in size_names(effect)]
        p_value = wald(evidence, sized, distance(evidence, sized, nothing(study, effect)))
        found.append(Chance(kind, effect.name, p_value, beginnings[0][1].trials))
    return found


def alarm_table(alarms: Sequence[Alarm]) -> str:
    """Rates by kind of sensors, as Markdown."""
    rows = []
    for kind in dict.fromkeys(a.kind for a in alarms):
        mine = [a for a in alarms if a.kind == kind]
        named = rate(bool(a.named) for a in mine)
        alarmed = rate(a.verdict != "nothing_missing" for a in mine)
        inside = rate(abs(d) < QUANTILE for a in mine for d in a.deviations)
        error = float(np.mean([a.error / a.floor for a in mine]))
        rows.append((kind, told(named), told(alarmed), f"{error:.2f}", told(inside)))
    head = ("sensors", "an effect named", "verdict not nothing_missing", "error over floor", "true values in intervals")
    return table(head, rows)


def named_table(alarms: Sequence[Alarm]) -> str:
    """What is named first where something is hidden, by kind of sensors, as Markdown."""
    rows = []
    for kind in dict.fromkeys(a.kind for a in alarms):
        answers = Counter(a.named[0] if a.named else a.verdict for a in alarms if a.kind == kind)
        rows.append((kind, ", ".join(f"{n} {count}" for n, count in answers.most_common())))
    return table(("sensors", "named first"), rows)


def chance_table(found: Iterable[Chance]) -> str:
    """How often an effect gets a small probability by chance, alone and times its trials, as Markdown."""
    found, rows = list(found), []
    for effect in dict.fromkeys(c.effect for c in found):
        mine = [c for c in found if c.effect == effect]
        alone = [rate(c.p_value < level for c in mine) for level in (0.05, 0.01)]
        times = rate(c.p_value * c.trials < 0.05 for c in mine)
        trials = f"{np.mean([c.trials for c in mine]):.3g}"
        rows.append((effect, *map(told, alone), trials, told(times)))
    return table(("effect", "p < 0.05", "p < 0.01", "trials", "p times trials < 0.05"), rows)


def main(
    logs: Annotated[int, typer.Option(help="Logs of each kind of sensors.")] = 16,
    duration: Annotated[float, typer.Option(help="Length of each log [s].")] = 10.0,
    kinds: Annotated[list[str] | None, typer.Option("--kind", help="Sensors; repeat for several.")] = None,
    effects: Annotated[list[str] | None, typer.Option("--effect", help="Effect whose chances are counted.")] = None,
    hide: Annotated[list[str] | None, typer.Option(help="Hide an effect, and say only what is named.")] = None,
    only: Annotated[str, typer.Option(help="alarms, chances or both.")] = "both",
) -> None:
    """Count false alarms and the chances of single effects, and print both tables."""
    with failures():
        asked = [(k, FIRST_SEED + n) for k in kinds or KINDS for n in range(logs)]
        if hide:
            hidden = parse_hidden(hide)
            say(named_table(_counted([partial(try_log, *a, duration=duration, hide=hidden) for a in asked])))
            return
        if only != "chances":
            say(alarm_table(_counted([partial(try_log, *a, duration=duration) for a in asked])) + "\n")
        if only != "alarms":
            found = _counted([partial(chances, *a, effects or (), duration=duration) for a in asked])
            say(chance_table([c for one in found for c in one]))


def _counted(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Results in order, with a line of progress for each."""
    found: dict[int, T] = {}
    for number, result in as_they_end(jobs):
        found[number] = result
        err.print(f"{len(found)} of {len(jobs)}")
    return [found[number] for number in sorted(found)]


if __name__ == "__main__":
    typer.run(main)
