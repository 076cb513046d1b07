"""What to draw of an effect: its law over the range that a log covers, made from the effect's row and never by name.

A force is drawn over the speed or the angle of its port, a change of the voltage over the command, a lag as the answer
to a step, a sensor's reading over the truth, a change of geometry as the force that holds the machine at rest. What is
none of these, or depends on more than one thing, is drawn as what it changes in the readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import sympy as sp

import derive
from derive.effects import Deformation, DryForce, Effect, Force, InputDelay, InputLag, InputMap, SensorMap
from derive.functions import LOAD, Magnitude, Ramp, Sign, Step, symbol
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.least_squares import measured_states
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.profiled_starts import port_weights
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.model.units import units_of

POINTS = 241
MAGNIFIED = 0.15  # of the range, difference below which in and out are drawn as their difference
STRETCH = 5.0  # s, of a log along which a law with several arguments is drawn
COVERED = (0.002, 0.998)  # quantiles of what a log covers
NUMERIC = [
    {Sign.__name__: np.sign, Step.__name__: lambda x: 1.0 * (x > 0), Magnitude.__name__: np.abs,
     Ramp.__name__: lambda x: np.maximum(x, 0.0)},
    "numpy",
]  # fmt: skip
Values = Mapping[str, float]  # of an effect's parameters, by effect.parameter
Lines = Callable[[Values], dict[str, np.ndarray]]  # (points,) each, by the name of the line


class Picture(NamedTuple):
    """Axes and lines of a drawing."""

    across: str  # label of the axis
    up: str
    x: np.ndarray  # (points,)
    lines: Lines
    reference: np.ndarray | None = None  # what it would be without the effect


def picture_of(effect: Effect, study: Study, fitted: Fit, number: int = 0) -> Picture:
    """What to draw of an effect of a fitted model, over what a training log covers."""
    part = study.training[number]
    match effect.enters:
        case Force() | DryForce():
            found = _force(effect, study, part, fitted.of_log(number))
        case InputMap():
            found = _input(effect, study, part, fitted.of_log(number))
        case InputDelay() | InputLag():
            found = _step_answer(effect, fitted)
        case SensorMap():
            found = _sensor(effect, study, part, fitted.of_log(number))
        case Deformation():
            found = _at_rest(effect, study, fitted, part)
        case _:
            found = None
    return found or _in_the_readings(effect, study, fitted, number)


# ---- laws


def _force(effect: Effect, study: Study, part: Part, values: Values) -> Picture | None:
    """A resistance over the one thing that it depends on; over one turn where it repeats with every turn."""
    port = effect.enters.port  # type: ignore[union-attr]
    speed, angle = symbol("speed"), symbol("angle")
    if isinstance(effect.enters, DryForce):
        law = effect.enters.law(Sign(speed), speed, **effect.symbols)
    else:
        law = effect.enters.law(angle, speed, **effect.symbols)  # type: ignore[union-attr]
    states, window = measured_states(study.module, part.log), _window(part)
    size, weights, force = study.module.NQ, port_weights(study, port), study.plant.input_unit
    unit = study.plant.port(port).unit
    origin = part.log.measured[np.isfinite(part.log.measured[:, 0]), 0]
    law = law.subs(symbol("origin"), float(origin[0]) if origin.size else 0.0)
    covered = _motion(study, part) | {
        speed: (f"speed at the {port}", f"{unit}/s", states[window, size:] @ weights),
        angle: (f"{'angle' if unit == 'rad' else 'place'} at the {port}", unit, states[window, :size] @ weights),
        LOAD: ("load", force, part.log.voltage[window].reshape(states[window].shape[0], -1).mean(axis=1)),
    }
    return _over_what_it_depends_on(effect, law, covered, f"resistance at the {port} [{force}]", values)


def _motion(study: Study, part: Part) -> dict:
    """Everything else that a law may know, along a part of a log: name, unit and values by its symbol."""
    states, window = measured_states(study.module, part.log), _window(part)
    units = units_of(study.plant)
    known = {symbol(n): (n, units[n], states[window, k]) for k, n in enumerate(study.module.STATES[: states.shape[1]])}
    time = (part.log.t - part.log.t[0])[window]
    return known | {symbol("t"): ("time", "s", time), derive.functions.TIME: ("time", "s", time)}


def _over_what_it_depends_on(
    effect: Effect, law: sp.Expr, covered: Mapping, up: str, values: Values, less: sp.Symbol | None = None
) -> Picture | None:
    """A law over its only argument, or along the log where it has several; less one of them if so asked."""
    free = sorted(law.free_symbols - set(effect.symbols.values()), key=str)
    if not set(free) <= set(covered):
        return None
    if len(free) == 1:
        name, unit, signal = covered[free[0]]
        at, x = _evaluated(effect, law, free), _grid(signal)
        if unit == "rad" and np.ptp(x) > 2 * np.pi and _repeats(at(values, x), at(values, x + 2 * np.pi)):
            x = np.linspace(0.0, 2 * np.pi, 2 * POINTS)
        return Picture(f"{name} [{unit}]", up, x, lambda changed: {"": at(changed, x)})
    time = covered[symbol("t")][2]
    chosen = np.flatnonzero(time - time[0] <= STRETCH)
    chosen = chosen[:: max(1, len(chosen) // (3 * POINTS))]
    signals = [covered[s][2][chosen] for s in free]
    along = _evaluated(effect, law - (less or 0), free)
    return Picture("time [s]", up, time[chosen], lambda changed: {"": along(changed, *signals)})


def _repeats(now: np.ndarray, later: np.ndarray) -> bool:
    return bool(np.abs(later - now).max() < 0.05 * max(float(np.ptp(now)), 1e-300))


def _evaluated(effect: Effect, law: sp.Expr, free: Sequence[sp.Symbol]) -> Callable[..., np.ndarray]:
    """A law as a function of an effect's values and of arrays for its free symbols."""
    names = [p.name for p in effect.parameters]
    numeric = sp.lambdify([*(effect.symbols[n] for n in names), *free], law, NUMERIC)

    def at(values: Values, *x: np.ndarray) -> np.ndarray:
        given = (values[f"{effect.name}.{n}"] for n in names)
        return np.broadcast_to(numeric(*given, *x), x[0].shape).astype(float)

    return at


def _input(effect: Effect, study: Study, part: Part, values: Values) -> Picture | None:
    """The voltage that acts over the commanded one; at the log's two ends where it is another one later on."""
    command, time = symbol(study.plant.input), symbol("t")
    law = effect.enters.law(command, time, **effect.symbols)  # type: ignore[union-attr]
    voltage = part.log.voltage[_window(part)].reshape(-1, max(len(study.module.INPUTS), 1))[:, 0]
    if law.diff(time, 2) != 0 or law.free_symbols - set(effect.symbols.values()) - {command, time}:
        covered = _motion(study, part) | {command: ("commanded voltage", "V", voltage)}
        return _over_what_it_depends_on(effect, law, covered, "acting − commanded [V]", values, command)
    ends = {f"at {t:.3g} s": float(t) for t in part.log.t[[0, -1]] - part.log.t[0]}
    chosen = ends if time in law.free_symbols else {"": 0.0}
    at, x = {n: _evaluated(effect, law.subs(time, t), [command]) for n, t in chosen.items()}, _grid(voltage)
    picture = Picture("commanded voltage [V]", "voltage that acts [V]", x,
                      lambda values: {n: f(values, x) for n, f in at.items()}, x)  # fmt: skip
    return _magnified(picture, "acting − commanded [V]", values)


def _magnified(picture: Picture, difference: str, values: Values) -> Picture:
    """What comes out over what goes in, or where they hardly differ their difference."""
    x, lines = picture.x, picture.lines
    if max(np.abs(y - x).max() for y in lines(values).values()) > MAGNIFIED * np.ptp(x):
        return picture
    return picture._replace(
        up=difference, lines=lambda values: {n: y - x for n, y in lines(values).items()}, reference=None
    )


def _step_answer(effect: Effect, fitted: Fit) -> Picture:
    """What acts after a step of the command at zero."""
    name = effect.full_names[0]
    time = max(float(fitted.of_log(0).get(name, 0.0)), 1e-4)
    x = np.linspace(-time, 5.0 * time, 601)

    def lines(values: Values) -> dict[str, np.ndarray]:
        if isinstance(effect.enters, InputDelay):
            return {"": 1.0 * (x >= values[name])}
        return {"": np.where(x > 0.0, 1.0 - np.exp(-np.maximum(x, 0.0) / max(values[name], 1e-9)), 0.0)}

    return Picture("time after a step of the command [s]", "share of it that acts", x, lines, 1.0 * (x >= 0.0))


def _sensor(effect: Effect, study: Study, part: Part, values: Values) -> Picture | None:
    """What a sensor reports over what it should."""
    channel, reading = effect.enters.channel, symbol("reading")  # type: ignore[union-attr]
    law = effect.enters.law(reading, **effect.symbols)  # type: ignore[union-attr]
    unit, signal = units_of(study.plant)[channel], part.log.measured[_window(part), part.log.channels.index(channel)]
    if law.free_symbols - set(effect.symbols.values()) - {reading}:
        covered = _motion(study, part) | {reading: (f"true {channel}", unit, signal)}
        return _over_what_it_depends_on(effect, law, covered, f"reported − true [{unit}]", values, reading)
    at, x = _evaluated(effect, law, [reading]), _grid(signal)
    picture = Picture(
        f"true {channel} [{unit}]", f"reported {channel} [{unit}]", x, lambda values: {"": at(values, x)}, x
    )
    return _magnified(picture, f"reported − true [{unit}]", values)


def _at_rest(effect: Effect, study: Study, fitted: Fit, part: Part) -> Picture | None:
    """The force on each row that a change of geometry makes while the machine rests, over the body's angle."""
    model = study.model
    with_it, without = (derive.compose(model.plant, model.assumptions, e) for e in ((effect.name,), ()))
    rest = {symbol(f"{p}{c.name}"): 0 for c in with_it.plant.coordinates for p in ("d", "dd")}
    along = with_it.plant.coordinates[-1].q
    known = {symbol(n): v for n, v in fitted.of_log(0).items() if n not in effect.full_names}
    laws = [(b - a).subs(rest).subs(known) for a, b in zip(with_it.residual, without.residual, strict=True)]
    if any(law.free_symbols - {along, *effect.symbols.values()} for law in laws) or not any(laws):
        return None
    rows = [(row, law) for row, law in zip(study.module.ROWS, laws, strict=True) if law != 0]
    at = {f"{row} row": _evaluated(effect, law, [along]) for row, law in rows}
    x = _grid(measured_states(study.module, part.log)[_window(part), study.module.NQ - 1])
    return Picture(f"{along} [{units_of(study.plant)[str(along)]}]", "force at rest [V]", x,
                   lambda values: {n: f(values, x) for n, f in at.items()})  # fmt: skip


# ---- whatever it is


def _in_the_readings(effect: Effect, study: Study, fitted: Fit, number: int) -> Picture:
    """How the readings of a segment differ with the effect from those without it."""
    part, module = study.training[number], study.module
    own = fitted.of_log(number)
    absent = {n: module.ABSENT[module.PARAMETERS.index(n)] for n in effect.full_names}
    first = initial_states(module, part)
    states, _ = fit_states(module, part, first, vector(module, own, part.log), study.max_step)

    def residual(values: Values, where: Part, begin: np.ndarray) -> np.ndarray:
        parameters = vector(module, {**own, **values}, where.log)
        return np.nan_to_num(shoot(module, where, begin, parameters, max_step=study.max_step).residual)

    change = residual(absent, part, states) - residual({}, part, states)
    seen = [np.nan_to_num(np.nansum(change[a:b] ** 2), posinf=0.0) for a, b in part.bounds]
    most = int(np.argmax(seen))
    one = Part(part.log, part.sigma, part.bounds[most : most + 1])
    window = slice(*one.bounds[0])
    bare = residual(absent, one, states[most : most + 1])[window]
    x = part.log.t[window]

    def lines(values: Values) -> dict[str, np.ndarray]:
        moved = bare - residual(values, one, states[most : most + 1])[window]
        return {c: moved[:, k] for k, c in enumerate(part.log.channels)}

    return Picture("time [s]", "change of the readings [σ]", x, lines)


# ---- ranges and names


def _window(part: Part) -> slice:
    return slice(int(part.bounds[0, 0]), int(part.bounds[-1, 1]))


def _grid(signal: np.ndarray) -> np.ndarray:
    """Points over what a signal covers."""
    low, high = np.quantile(signal[np.isfinite(signal)], COVERED)
    return np.linspace(low, high if high > low else low + 1.0, POINTS)
