"""A model and its logs, made ready for fitting: kernels, sensor noise, training segments and held-out segments."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import Effect, EffectParameter
from derive.nameplate import Nameplate
from wheelpend import kernels, regression
from wheelpend.failures import Failure, did_you_mean
from wheelpend.fitting import fit
from wheelpend.logs import Log, load_log, segment_bounds
from wheelpend.model import Model
from wheelpend.sensors import Noise, sensor_noise
from wheelpend.shooting import Fit, Part, fit_states, initial_states, part_error, prediction_error, stable_step, vector

HORIZON = 0.5  # s, over which a prediction is judged
FAR = 3.0  # an error this many times the noise floor may be that of a wrong start
EXPLAINED = 1.1  # error over noise floor above which something is still missing
ALIKE = 1e-3  # of the error, by which two fits of the same segments may differ that ended in the same place
VISIBLE = 1.02  # error over noise floor up to which a fit lies in the noise: what is missing, if anything, is small
NEAR = 0.05  # of the horizon, within which something that happens beside a segment may have happened in it
RUN = 10  # short segments in a row where something carries on from one to the next
LEAD = 10  # segments before the first that is judged, through which what carries on is followed
ALL_LENGTHS = (0.1, 0.3, 1.0)  # of the segments that a fit goes through, in horizons
ENOUGH = 200_000  # samples of a log that give a start
START_TIMES = (0.03, 0.14, 0.6, 2.5)  # filter time constants tried for a start without nominal values [s]


@dataclass(frozen=True)
class Held:
    """Held-out segments: of a training log, or of a log of its own with a first third for its per-log parameters."""

    part: Part
    training: int | None  # index of the training log it belongs to
    calibration: Part | None


@dataclass(frozen=True)
class Study:
    """Everything a fit needs."""

    model: Model
    module: ModuleType  # the library's kernels, or the model's own
    training: tuple[Part, ...]
    held: tuple[Held, ...]
    noise: tuple[Noise, ...]  # of each log, training logs first
    horizon: float  # s
    max_step: float  # s
    warnings: tuple[str, ...]
    origins: tuple[dict[str, float], ...] = ()  # starts before any fit: nominal values or the slowest filters
    without: tuple[str, ...] = ()  # effects that are not tried, on request
    needless: tuple[str, ...] = ()  # nor these, which others have made needless
    carries: bool = False  # whether something in the model carries on from one segment to the next

    @property
    def floor(self) -> float:
        """Expected error of the true model."""
        return float(np.mean([n.floor for n in self.noise]))

    @property
    def plant(self) -> Nameplate:
        """What the plant has under the model's assumptions."""
        return self.model.nameplate

    def effect(self, name: str) -> Effect:
        """A row of the library as it reads on this plant."""
        return derive.effects.suited(derive.effects.find(name), self.plant)

    @property
    def base(self) -> tuple[str, ...]:
        """Names of the model's own parameters."""
        return tuple(n for n in self.module.PARAMETERS[: self.module.FITTED] if "." not in n)

    @property
    def logs(self) -> tuple[Log, ...]:
        """Training logs."""
        return tuple(p.log for p in self.training)

    def effects(self) -> tuple[Effect, ...]:
        """Library effects that the plant, its assumptions and the known constants allow."""
        rows = derive.effects.possible_on(self.plant, self.model.own)
        return tuple(derive.effects.suited(e, self.plant) for e in rows if not self.lacking(e))

    def missable(self) -> tuple[Effect, ...]:
        """Those of them that the model may be missing: neither in it nor contained in one that is."""
        within = {s for e in self.model.effects for s in self.module.CONTAINS.get(e, {})}
        return tuple(e for e in self.effects() if e.name not in self.model.effects and e.name not in within)

    def replaced(self, effect: str) -> tuple[str, ...]:
        """Effects of the model whose place one takes that contains them."""
        return tuple(s for s in self.module.CONTAINS.get(effect, {}) if s in self.model.effects)

    def able(self, *effects: str) -> Study:
        """The study with kernels that have these effects besides its model's, and steps that they can be taken in."""
        module = kernels.library_of(self.model, effects)
        carries = any(derive.effects.find(e).carries for e in (*self.model.effects, *effects))
        return replace(self, module=module, carries=carries)

    def having(self, effects: Sequence[str]) -> Study:
        """The study of a model with these effects instead."""
        return replace(self, model=self.model.with_effects(list(effects))).able()

    def lacking(self, effect: Effect) -> str:
        """Why an effect cannot be judged, or an empty string."""
        if effect.name in self.without:
            return "was left out on request"
        if effect.name in self.needless:
            return "lowers the error, but not beside the effects that explain the rest"
        free = kernels.freed_by(self.model.effects)
        if effect.frees and free and effect.frees not in free:
            return f"frees a second give inside the machine, beside {', '.join(free)}"
        return lacking(
            effect, self.model, kernels.library_of(self.model, [effect.name]) if effect.frees else self.module
        )


def lacking(effect: Effect, model: Model, module: ModuleType) -> str:
    """Why an effect cannot be judged with a model and its library's kernels, or an empty string."""
    if own := module.ABSORBED.get(effect.full_names[0]):
        return f"is part of {', '.join(own)} on this plant"
    if effect.full_names[0] not in module.PARAMETERS:
        return "cannot be written under these assumptions"
    absent = [c for c in needed_constants(model, effect.name) if c not in model.constants]
    return f"needs {', '.join(absent)} in [constants]" if absent else ""


def needed_constants(model: Model, effect: str) -> tuple[str, ...]:
    """Known constants that an effect's equations contain."""
    module = kernels.library_of(model, [effect])
    names = derive.effects.find(effect).full_names
    return tuple(dict.fromkeys(c for n in names for c in module.NEEDS.get(n, ())))


def read_logs(paths: Sequence[str | Path | Log], model: Model) -> tuple[Log, ...]:
    """Load logs as the model's [columns] say; a Log is taken as it is."""
    return tuple(p if isinstance(p, Log) else load_log(p, model.columns, model.table) for p in paths)


def noise_of(log: Log, model: Model) -> Noise:
    """Sensor noise as [sensors] states it, or from the log."""
    stated = {c: model.sensors.noise_of(c) for c in log.channels}
    return sensor_noise(log.excerpt(), stated, {c: model.sensors.step_of(c) for c in log.channels})


def prepare(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    horizon: float = HORIZON,
    use_all: bool = False,
    without: Sequence[str] = (),
    lean: bool = False,
) -> Study:
    """Cut logs into training and held-out segments.

    Without hold-out logs the last third of each log is held out; with ``use_all`` nothing is. Effects named in
    ``without`` are not tried. ``lean`` takes the model's own kernels, which know no other effects and are several times
    faster. Raises Failure where a log stands on both sides or yields no segments.
    """
    known = [e.name for e in derive.effects.all_with(model.own)]
    for name in without:
        if name not in known:
            raise Failure(f"No effect named '{name}' can be left out.{did_you_mean(name, known)}")
    _no_log_twice(logs, holdout)
    module = kernels.lean(model.plant, model.assumptions, model.effects) if lean else kernels.library_of(model)
    loaded, held_logs = read_logs(logs, model), read_logs(holdout, model)
    _no_effect_without_meaning(model)
    noise = tuple(noise_of(log, model) for log in (*loaded, *held_logs))
    training, held = [], []
    for number, (log, own) in enumerate(zip(loaded, noise, strict=False)):
        split = len(log) if use_all or held_logs else len(log) * 2 // 3
        training.append(_part(log, own, horizon, 0, split))
        if split < len(log):
            held.append(Held(_part(log, own, horizon, split, len(log)), number, None))
    for log, own in zip(held_logs, noise[len(loaded) :], strict=True):
        third = len(log) // 3
        rest = _part(log, own, horizon, third, len(log))
        held.append(Held(rest, None, _part(log, own, horizon, 0, third)))
    warnings = tuple(f"{log.name}: {w}" for log in (*loaded, *held_logs) for w in log.warnings)
    step = 0.002  # s, until a start tells how fast the machine is
    found = Study(model, module, tuple(training), tuple(held), noise, horizon, step, warnings, without=tuple(without))
    if any(derive.effects.find(e).event for e in model.effects):
        values = known_values(model)
        found = interleaved(found, [values[n] for e in model.effects for n in moments_of(e) if n in values])
    return replace(found, carries=any(derive.effects.find(e).carries for e in model.effects))


def _no_log_twice(logs: Sequence, holdout: Sequence) -> None:
    both = {str(Path(p).resolve()) for p in logs if not isinstance(p, Log)} & {
        str(Path(p).resolve()) for p in holdout if not isinstance(p, Log)
    }
    if both:
        raise Failure(f"A log must not be on both sides, but {', '.join(sorted(both))} is given to fit and to hold "
                      "out. Leave it out of one.")  # fmt: skip


def _no_effect_without_meaning(model: Model) -> None:
    for name in model.effects:
        if why := lacking(derive.effects.find(name), model, kernels.library_of(model)):
            raise Failure(f"Every effect of the model must be one that data can tell, but {name} {why}. "
                          "Remove it from effects.")  # fmt: skip


def enlarged(model: Model, effect: str) -> list[str]:
    """A model's effects with one more, which takes the place of those that it contains."""
    within = kernels.library_of(model).CONTAINS.get(effect, {})
    return [*(e for e in model.effects if e not in within), effect]


def refuse_meaningless(effect: Effect, model: Model) -> None:
    """Raise Failure where an effect that is to be added is one that no data can tell."""
    if why := lacking(effect, model, kernels.library_of(model, [effect.name])):
        raise Failure(f"An effect that is added must be one that data can tell, but {effect.name} {why}. "
                      "Nothing was changed.")  # fmt: skip


def _part(log: Log, noise: Noise, horizon: float, start: int, stop: int) -> Part:
    bounds = segment_bounds(log, horizon, start, stop)
    if not len(bounds):
        raise Failure(f"{log.name} must hold at least one uninterrupted stretch of 5 samples in which the robot "
                      f"stands, but none was found between {log.t[start]:.2f} s and {log.t[stop - 1]:.2f} s. "
                      "Check `wheelpend inspect`.")  # fmt: skip
    return Part(log, noise.sigma, np.ascontiguousarray(bounds, dtype=np.int64))


def shortened(study: Study, horizon: float, most: int = 120) -> tuple[Part, ...]:
    """Training parts cut into shorter segments, thinned evenly to about ``most``: they only prepare."""
    found = []
    for part in study.training:
        bounds = np.concatenate([segment_bounds(part.log, horizon, a, b) for a, b in runs(part.bounds)])
        thin, run = max(1, len(bounds) // most), RUN if study.carries else 1
        kept = np.arange(len(bounds)) // run % thin == 0
        found.append(replace(part, bounds=np.ascontiguousarray(bounds[kept])))
    return tuple(found)


def interleaved(study: Study, moments: Sequence[float] = ()) -> Study:
    """The study with every second segment of its training logs held out, over their whole length.

    Segments that hold one of the moments [s], or nearly so, are not: nothing else says when something happened.
    """
    training, held = [], []
    for number, part in enumerate(study.training):
        bounds, t, near = segment_bounds(part.log, study.horizon), part.log.t, NEAR * study.horizon
        kept = np.arange(len(bounds)) % 2 == 0
        for moment in moments:
            kept |= (t[bounds[:, 0]] - near <= moment) & (moment <= t[bounds[:, 1] - 1] + near)
        training.append(replace(part, bounds=np.ascontiguousarray(bounds[kept])))
        if not kept.all():
            held.append(Held(replace(part, bounds=np.ascontiguousarray(bounds[~kept])), number, None))
    return replace(study, training=tuple(training), held=tuple(held))


def without_others(study: Study, values: Mapping[str, float]) -> dict[str, float]:
    """Values without those of effects that are not in the study's model."""
    return {n: v for n, v in values.items() if n.rpartition(".")[0] in (*study.model.effects, "")}


def moments_of(effect: str) -> list[str]:
    """Full names of the times at which an event begins and ends."""
    return [f"{effect}.{p.name}" for p in derive.effects.find(effect).parameters if p.moment]


def runs(bounds: np.ndarray) -> list[tuple[int, int]]:
    """Ranges of samples that consecutive segments cover without a gap."""
    breaks = np.flatnonzero(bounds[1:, 0] != bounds[:-1, 1])
    begins, ends = bounds[np.r_[0, breaks + 1], 0], bounds[np.r_[breaks, len(bounds) - 1], 1]
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True)]


def steadied(study: Study, values: Mapping[str, float]) -> Study:
    """A study with a step in which what moves inside the machine is stable, as stiff as its effects may be."""
    if study.module.NA == study.module.NQ:
        return study
    known = study.module.PARAMETERS
    rows = [study.effect(e.name) for e in derive.effects.LIBRARY.values() if e.frees and e.full_names[0] in known]
    stiffest = {f"{e.name}.{p.name}": p.maximum for e in rows for p in e.parameters if math.isinf(p.absent)}
    within = {n: v for n, v in stiffest.items() if math.isfinite(v)}
    step = 2.0 * stable_step(study.module, {**values, **within}, study.training[0].log)  # 0.5 over the fastest rate
    return replace(study, max_step=min(study.max_step, step))


def known_values(model: Model) -> dict[str, float]:
    """Constants and whatever the model says of its parameters; effects that are only named start as absent."""
    values = dict(model.constants)
    names = [*model.parameters, *(n for e in model.effects for n in derive.effects.find(e).full_names)]
    return values | {n: v for n in names if (v := model.value(n)) is not None}


def starts(study: Study) -> list[dict[str, float]]:
    """Possible starts for the base parameters: the model's values, and filtered regressions of the first log.

    The parameters are sums of positive physical constants, so a regression that makes one negative is repeated with
    non-negative least squares.
    """
    complete = _known_start(study)
    known, found = complete or _known(study), [complete] if complete else []
    plain = kernels.lean(study.model.plant, study.model.assumptions, ())
    log = study.training[0].log
    log = log.part(0, min(len(log), ENOUGH))
    for time in START_TIMES:
        if 4 * log.dt < time < log.duration / 4:
            tau = (time, 1.3 * time)
            found.append({**known, **regression.positive(plain, log, vector(plain, known, log), tau)})
    if not found:
        raise Failure(f"{log.name} must last at least {4 * START_TIMES[0]} s to start without nominal values; "
                      f"it lasts {log.duration:.3f} s. Give nominal values in [parameters].")  # fmt: skip
    return found


def _known(study: Study) -> dict[str, float]:
    """What the model says of its parameters, and what a log says of those that cannot start as absent."""
    from wheelpend.shapes import first_settings  # imported late: it needs a study

    settings = first_settings(study) if study.model.effects else {}
    return {**settings, **known_values(study.model)}


def _known_start(study: Study) -> dict[str, float] | None:
    """The same where it says all; else None."""
    known = _known(study)
    return known if all(n in known for n in study.base) else None


def best_start(study: Study) -> tuple[Study, dict[str, float]]:
    """The start from which short segments are fitted best, and the study with a step that suits it."""
    parts = shortened(study, study.horizon / 5, most=40)
    known = _known_start(study)
    if known is not None:
        values, fitted = _few_rounds(study, parts, known)
        if fitted.error < EXPLAINED * study.floor:  # in the noise: there is none better
            return replace(study, max_step=_step_at(study, values), origins=(known,)), values
    found = starts(study)
    ranked = sorted(found, key=lambda v: _start_cost(study, parts[0], v))[:3]
    best, lowest = None, np.inf
    for start in ranked:
        values, fitted = _few_rounds(study, parts, start)
        if fitted.cost < lowest:
            best, lowest = values, fitted.cost
        if fitted.error < EXPLAINED * study.floor:
            break
    if best is None:
        raise Failure(f"{study.training[0].log.name}: no start was found from which the model can be simulated. "
                      "Check `wheelpend inspect`, or give nominal values in [parameters].")  # fmt: skip
    return replace(study, max_step=_step_at(study, best), origins=(found[0], *found[:0:-1][:2])), best


def _few_rounds(study: Study, parts: Sequence[Part], start: Mapping[str, float]) -> tuple[dict[str, float], Fit]:
    """Values after a few rounds from a start, and their fit, with a step that suits the start."""
    suited = replace(study, max_step=_step_at(study, start))
    fitted = fit_parts(suited, parts, start, study.base, rounds=8)
    return {**start, **fitted.values}, fitted


def _step_at(study: Study, values: Mapping[str, float]) -> float:
    """A step that resolves the machine's fastest motion at some values [s]."""
    return stable_step(study.module, values, study.training[0].log)


def _start_cost(study: Study, part: Part, values: Mapping[str, float]) -> float:
    module = kernels_for(study, (), values)
    parameters = vector(module, values, part.log)
    shot = fit_states(module, part, initial_states(module, part), parameters, rounds=3, keep=False)[1]
    return part_error(part, shot)


def limits_of(
    names: Sequence[str], plant: Nameplate | None = None, signed: Collection[str] = ()
) -> dict[str, tuple[float, float]]:
    """Bounds that a simulation needs: a delay cannot be early, and the plant's own parameters are sums of positive
    constants, ``signed`` ones apart, without which a corrupted fit leaves everything that can be simulated.
    """
    limits = {name: (0.0, np.inf) for name in names if "." not in name and name not in signed}
    bounded = {n: p for n in names if (p := effect_parameter(n, plant)) and p.bounded}
    return limits | {n: (p.minimum, p.maximum) for n, p in bounded.items()}


def effect_parameter(name: str, plant: Nameplate | None = None) -> EffectParameter | None:
    """The library's row of effect.parameter, as it reads on a plant where one is given.

    None for the plant's own parameters and for missing forces.
    """
    effect, _, parameter = name.partition(".")
    if not parameter or effect.startswith("missing"):
        return None
    row = derive.effects.find(effect)
    rows = (derive.effects.suited(row, plant) if plant else row).parameters
    return next((p for p in rows if p.name == parameter), None)


def per_log_names(names: Sequence[str]) -> list[str]:
    """Those names that get a value of their own in every log: per-log ones, and those of an event in one of them."""
    return [n for n in names if (p := effect_parameter(n)) and p.scope in ("per log", "event")]


def phased_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Sines and cosines among names whose amplitude is the machine's and whose phase is each log's own."""
    effects = dict.fromkeys(n.partition(".")[0] for n in names if "." in n and not n.startswith("missing"))
    rows = [(e, derive.effects.find(e).phased) for e in effects]
    pairs = [(f"{e}.{row[0]}", f"{e}.{row[1]}") for e, row in rows if row]
    return [p for p in pairs if set(p) <= set(names)]


def fit_parts(
    study: Study,
    parts: Sequence[Part],
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    start_per_log: Sequence[Mapping[str, float]] = (),
    rounds: int = 15,
) -> Fit:
    """Fit free parameters to some parts with the study's kernels, scopes and bounds.

    Ripples are first fitted in every log by itself, which finds the phases; then their amplitudes are made one.
    """
    found = _fitted(study, parts, start, free, start_per_log, rounds)
    pairs = phased_pairs(free)
    if len(parts) == 1 or not pairs or not rounds:
        return found
    return _fitted(study, parts, found.values, free, found.per_log, rounds, states=found.states, phased=pairs)


def _fitted(study: Study, parts, start, free, start_per_log, rounds: int, **ties) -> Fit:
    return fit(
        kernels_for(study, free, start, start_per_log),
        parts,
        start,
        free,
        per_log=per_log_names(free),
        limits=limits_of(free, study.plant, study.module.SIGNED),
        start_per_log=start_per_log,
        max_step=study.max_step,
        rounds=rounds,
        **ties,
    )


def kernels_for(study: Study, free: Sequence[str], *values: Mapping[str, float] | Sequence[Mapping[str, float]]):
    """The study's kernels, or those of the bare plant, several times faster, where no effect is fitted or given."""
    given = [v for found in values for v in ([found] if isinstance(found, Mapping) else found)]
    named = {n for v in given for n, x in v.items() if "." in n and n in study.module.PARAMETERS
             and x != study.module.ABSENT[study.module.PARAMETERS.index(n)]}  # fmt: skip
    if study.model.effects or named or any("." in n for n in free):
        return study.module
    return kernels.lean(study.model.plant, study.model.assumptions, ())


def calibrated(study: Study, part: Part, values: Mapping[str, float], names: Sequence[str]) -> dict[str, float]:
    """Values with a log's own parameters among the names estimated on a part of it, the machine's as they are.

    Of a ripple the phase is the log's own, the amplitude the machine's.
    """
    own = per_log_names(list(dict.fromkeys(names)))
    if not own:
        return dict(values)
    found = _fitted(study, [part], values, own, (), 10)
    turned = found.of_log(0)
    if pairs := phased_pairs(own):
        turned = with_amplitude(turned, values, pairs)
        turned = _fitted(study, [part], turned, own, (), 10, phased=pairs, amplitude_known=True).of_log(0)
    return turned


def with_amplitude(turned: Mapping[str, float], values: Mapping[str, float], pairs) -> dict[str, float]:
    """The phases of some values with the amplitudes of others."""
    found = dict(turned)
    for pair in pairs:
        length = math.hypot(turned[pair[0]], turned[pair[1]])
        wanted = math.hypot(values[pair[0]], values[pair[1]])
        found |= {n: float(turned[n] * wanted / length) if length else values[n] for n in pair}
    return found


class Begun(NamedTuple):
    """Where fits to short segments lead."""

    values: dict[str, float]
    per_log: tuple[Mapping[str, float], ...]
    errors: tuple[float, ...]  # of each length


def fit_model(
    study: Study,
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    horizons: Sequence[float] = ALL_LENGTHS,
    start_per_log: Sequence[Mapping[str, float]] = (),
) -> Fit:
    """Fit the free parameters to the training parts, from short to long segments, given as shares of the horizon.

    Where that ends far from the noise, underway or nowhere, the starts from before any fit get their chance too: a
    model that lacks an effect can be bent, on short segments, into one that cannot be simulated over long ones. Where
    it ends underway in the noise or near it, it goes on with fresh states.
    Raises Failure where no start leads to a model that can.
    """
    first = _prepared(study, start, free, horizons[:-1], start_per_log)
    best, begun = _at_length(study, first.values, free, first.per_log, horizons[-1]), [first]
    if best.error < VISIBLE * study.floor:  # in the noise no other start leads further than going on does
        on = best if best.converged else _at_length(study, best.values, free, best.per_log, horizons[-1])
        return min(best, on, key=lambda f: f.cost)
    if horizons[-1] == 1.0 and not best.converged and best.error < FAR * study.floor:
        again = _prepared(study, best.values, free, ALL_LENGTHS[:-1], best.per_log)  # with fresh states
        other = _at_length(study, again.values, free, again.per_log, 1.0)
        best = other if other.cost < best.cost else best
    for number, origin in enumerate(study.origins):
        arrived = best.converged and best.error < FAR * study.floor
        if np.isfinite(best.cost) and (number > 0 or arrived):
            break
        again = _prepared(study, {**start, **origin}, free, horizons[:-1], start_per_log)
        if any(_alike(again, earlier) for earlier in begun):
            continue  # from there it would go the same way again
        begun.append(again)
        other = _at_length(study, again.values, free, again.per_log, horizons[-1])
        best = other if not best.cost <= other.cost else best
    if not np.isfinite(best.cost):
        raise Failure(f"{study.training[0].log.name}: the model must be one that can be simulated over "
                      f"{study.horizon} s, but no start led to one. Check `wheelpend inspect`, or give nominal values "
                      "in [parameters].")  # fmt: skip
    return best


def _prepared(
    study: Study,
    start: Mapping[str, float],
    free: Sequence[str],
    shares: Sequence[float],
    start_per_log: Sequence[Mapping[str, float]],
) -> Begun:
    """Values, and those of each log, after fits to short segments that grow, until one lies in the noise.

    Each length starts from fresh initial states: states fitted to a wrong model can trap the next fit.
    """
    begun = Begun(dict(start), tuple(start_per_log), ())
    for share in shares:
        result = _at_length(study, begun.values, free, begun.per_log, share)
        begun = Begun(result.values, result.per_log, (*begun.errors, result.error))
        if result.converged and result.error < EXPLAINED * study.floor:
            break
    return begun


def _at_length(study: Study, values: Mapping[str, float], free: Sequence[str], own, share: float) -> Fit:
    """Fit to segments that are a share of the horizon long."""
    parts = study.training if share == 1.0 else shortened(study, share * study.horizon)
    return fit_parts(study, parts, values, free, start_per_log=own, rounds=25 if share == 1.0 else 15)


def _alike(one: Begun, other: Begun) -> bool:
    """Whether two ways through short segments ended at the same error, and so in the same place as it seems."""
    same = bool(one.errors) and len(one.errors) == len(other.errors)
    return same and abs(one.errors[-1] - other.errors[-1]) < ALIKE * one.errors[-1]


def held_residuals(study: Study, fitted: Fit) -> tuple[float, list[np.ndarray]]:
    """Error of a fitted model on the held-out segments, and their residuals [σ].

    A hold-out log's own parameters are estimated on its first third.
    """
    squares, count, residuals = 0.0, 0, []
    for held in study.held:
        values = _held_values(study, fitted, held)
        lead = LEAD if study.carries else 0
        module = kernels_for(study, (), values)
        _, residual = prediction_error(module, held.part, values, study.max_step, lead)
        squares += (
            float(np.nansum(residual**2))
            if np.isfinite(residual[np.isfinite(held.part.log.measured)]).any()
            else np.inf
        )
        count += held.part.values - 2 * study.module.NQ * len(held.part.bounds)
        residuals.append(residual)
    if not study.held:
        return fitted.error, residuals
    error = float(np.sqrt(squares / max(count, 1)))
    return (error if np.isfinite(error) else float("inf")), residuals


def _held_values(study: Study, fitted: Fit, held: Held) -> dict[str, float]:
    if held.training is not None:
        return fitted.of_log(held.training)
    if held.calibration is None:
        return dict(fitted.values)
    names = [*fitted.names, *free_names(study, study.model.effects)]
    return calibrated(study, held.calibration, fitted.of_log(0), names)


def free_names(study: Study, effects: Sequence[str]) -> list[str]:
    """Names of everything that a model with these effects fits."""
    return [*study.base, *(n for e in effects for n in derive.effects.find(e).full_names)]
