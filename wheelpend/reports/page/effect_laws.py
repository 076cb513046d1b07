"""Axes and lines of an effect's drawing: its law over the range that a log covers, from its row and never by its name.

A force is drawn over the speed or the angle of its port, a change of the voltage over the command, a lag as the answer
to a step, a sensor's reading over the truth, a change of geometry as the force that holds the machine at rest. What is
none of these, or depends on more than one thing, is drawn as what it changes in the readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import sympy as sp

import derive
from derive.effects import Deformation, DryForce, Effect, Force, InputDelay, InputLag, InputMap, SensorMap
from derive.functions import INPUT_SYMBOL, LOAD_SYMBOL, TIME_SYMBOL, symbol
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.model.units import units_of
from wheelpend.reports.page.law_expressions import EffectValues, numeric_law, resistance_law

GRID_POINTS = 241
MAX_SMALL_DIFFERENCE_SHARE = 0.15  # of the range, difference below which in and out are drawn as their difference
SHOWN_DURATION_S = 5.0  # s, of a log along which a law with several arguments is drawn
RANGE_QUANTILES = (0.002, 0.998)  # quantiles of what a log covers
LineFunction = Callable[[EffectValues], dict[str, np.ndarray]]  # (points,) each, by the name of the line


class EffectPlot(NamedTuple):
    """Axes and lines of a drawing."""

    x_label: str  # with its unit
    y_label: str  # with its unit
    x: np.ndarray  # (points,)
    lines: LineFunction
    reference: np.ndarray | None = None  # (points,) line without the effect


def effect_plot(effect: Effect, problem: EstimationProblem, fitted: Fit, number: int = 0) -> EffectPlot:
    """Axes and lines of an effect of a fitted model, over what a training log covers."""
    segments = problem.data.estimation[number]
    match effect.enters:
        case Force() | DryForce():
            plot = _resistance_plot(effect, problem, segments, fitted.of_log(number))
        case InputMap():
            plot = _input_plot(effect, problem, segments, fitted.of_log(number))
        case InputDelay() | InputLag():
            plot = _step_response_plot(effect, fitted)
        case SensorMap():
            plot = _sensor_plot(effect, problem, segments, fitted.of_log(number))
        case Deformation():
            plot = _static_force_plot(effect, problem, fitted, segments)
        case _:
            plot = None
    return plot or _output_change_plot(effect, problem, fitted, number)


# ---- laws


def _resistance_plot(
    effect: Effect, problem: EstimationProblem, segments: Segments, values: EffectValues
) -> EffectPlot | None:
    """A resistance over the one variable that it depends on; over one turn where it repeats with every turn."""
    port = effect.enters.port  # type: ignore[union-attr]
    speed, angle = symbol("speed"), symbol("angle")
    law = resistance_law(effect, angle, speed)
    states, window = measured_states(problem.module, segments.log), _window(segments)
    size, weights, unit = problem.module.NQ, problem.port_weights(port), problem.plant.port(port).unit
    force = problem.plant.force_unit(unit)
    command = segments.log.voltage[window].reshape(states[window].shape[0], -1).mean(axis=1)
    origin = segments.log.measured[np.isfinite(segments.log.measured[:, 0]), 0]
    law = law.subs(symbol("origin"), float(origin[0]) if origin.size else 0.0)
    covered = _motion_signals(problem, segments) | {
        speed: (f"speed at the {port}", f"{unit}/s", states[window, size:] @ weights),
        angle: (f"{'angle' if unit == 'rad' else 'place'} at the {port}", unit, states[window, :size] @ weights),
        LOAD_SYMBOL: ("load", force, command),
        INPUT_SYMBOL: (problem.plant.input_word, problem.plant.input_unit, command),
    }
    if not problem.plant.further:
        covered[symbol(problem.plant.input)] = covered[INPUT_SYMBOL]
    return _law_plot(effect, law, covered, f"resistance at the {port} [{force}]", values)


def _motion_signals(problem: EstimationProblem, segments: Segments) -> dict:
    """Everything else that a law may depend on, along a log: name, unit and values by symbol."""
    states, window = measured_states(problem.module, segments.log), _window(segments)
    units = units_of(problem.plant)
    known = {
        symbol(n): (n, units[n], states[window, k]) for k, n in enumerate(problem.module.STATES[: states.shape[1]])
    }
    time = (segments.log.t - segments.log.t[0])[window]
    return known | {symbol("t"): ("time", "s", time), TIME_SYMBOL: ("time", "s", time)}


def _law_plot(
    effect: Effect,
    law: sp.Expr,
    covered: Mapping,
    y_label: str,
    values: EffectValues,
    subtracted: sp.Symbol | None = None,
) -> EffectPlot | None:
    """A law over its only argument, or along the log where it has several; less one of them if so asked."""
    free = sorted(law.free_symbols - set(effect.symbols.values()), key=str)
    if not set(free) <= set(covered):
        return None
    if len(free) == 1:
        name, unit, signal = covered[free[0]]
        at, x = numeric_law(effect, law, free), _range_grid(signal)
        if unit == "rad" and np.ptp(x) > 2 * np.pi and _is_periodic(at(values, x), at(values, x + 2 * np.pi)):
            x = np.linspace(0.0, 2 * np.pi, 2 * GRID_POINTS)
        return EffectPlot(f"{name} [{unit}]", y_label, x, lambda changed: {"": at(changed, x)})
    time = covered[symbol("t")][2]
    chosen = np.flatnonzero(time - time[0] <= SHOWN_DURATION_S)
    chosen = chosen[:: max(1, len(chosen) // (3 * GRID_POINTS))]
    signals = [covered[s][2][chosen] for s in free]
    along = numeric_law(effect, law - (subtracted or 0), free)
    return EffectPlot("time [s]", y_label, time[chosen], lambda changed: {"": along(changed, *signals)})


def _is_periodic(now: np.ndarray, later: np.ndarray) -> bool:
    return bool(np.abs(later - now).max() < 0.05 * max(float(np.ptp(now)), 1e-300))


def _input_plot(
    effect: Effect, problem: EstimationProblem, segments: Segments, values: EffectValues
) -> EffectPlot | None:
    """The voltage that acts over the commanded one; at both ends of the log where it depends on time."""
    command, time = symbol(problem.plant.input), symbol("t")
    word, unit = problem.plant.input_word, problem.plant.input_unit
    law = effect.enters.law(command, time, **effect.symbols)  # type: ignore[union-attr]
    voltage = segments.log.voltage[_window(segments)].reshape(-1, max(len(problem.module.INPUTS), 1))[:, 0]
    if law.diff(time, 2) != 0 or law.free_symbols - set(effect.symbols.values()) - {command, time}:
        covered = _motion_signals(problem, segments) | {command: (f"commanded {word}", unit, voltage)}
        return _law_plot(effect, law, covered, f"acting − commanded [{unit}]", values, command)
    ends = {f"at {t:.3g} s": float(t) for t in segments.log.t[[0, -1]] - segments.log.t[0]}
    chosen = ends if time in law.free_symbols else {"": 0.0}
    at, x = {n: numeric_law(effect, law.subs(time, t), [command]) for n, t in chosen.items()}, _range_grid(voltage)
    picture = EffectPlot(f"commanded {word} [{unit}]", f"{word} that acts [{unit}]", x,
                      lambda values: {n: f(values, x) for n, f in at.items()}, x)  # fmt: skip
    return _as_difference_if_small(picture, f"acting − commanded [{unit}]", values)


def _as_difference_if_small(picture: EffectPlot, difference: str, values: EffectValues) -> EffectPlot:
    """A map from input to output, or where they hardly differ its difference from the identity."""
    x, lines = picture.x, picture.lines
    if max(np.abs(y - x).max() for y in lines(values).values()) > MAX_SMALL_DIFFERENCE_SHARE * np.ptp(x):
        return picture
    return picture._replace(
        y_label=difference, lines=lambda values: {n: y - x for n, y in lines(values).items()}, reference=None
    )


def _step_response_plot(effect: Effect, fitted: Fit) -> EffectPlot:
    """The share of a step of the command that acts after it."""
    name = effect.full_names[0]
    time = max(float(fitted.of_log(0).get(name, 0.0)), 1e-4)
    x = np.linspace(-time, 5.0 * time, 601)

    def lines(values: EffectValues) -> dict[str, np.ndarray]:
        if isinstance(effect.enters, InputDelay):
            return {"": 1.0 * (x >= values[name])}
        return {"": np.where(x > 0.0, 1.0 - np.exp(-np.maximum(x, 0.0) / max(values[name], 1e-9)), 0.0)}

    return EffectPlot("time after a step of the command [s]", "share of it that acts", x, lines, 1.0 * (x >= 0.0))


def _sensor_plot(
    effect: Effect, problem: EstimationProblem, segments: Segments, values: EffectValues
) -> EffectPlot | None:
    """The reading of a sensor over the true value."""
    enters, reading = effect.enters, symbol("reading")
    channel = problem.plant.channel_of(enters.channel, enters.kind)  # type: ignore[union-attr]
    law = enters.law(reading, **effect.symbols)  # type: ignore[union-attr]
    unit, signal = (
        units_of(problem.plant)[channel],
        segments.log.measured[_window(segments), segments.log.channels.index(channel)],
    )
    if law.free_symbols - set(effect.symbols.values()) - {reading}:
        covered = _motion_signals(problem, segments) | {reading: (f"true {channel}", unit, signal)}
        return _law_plot(effect, law, covered, f"reported − true [{unit}]", values, reading)
    at, x = numeric_law(effect, law, [reading]), _range_grid(signal)
    picture = EffectPlot(
        f"true {channel} [{unit}]", f"reported {channel} [{unit}]", x, lambda values: {"": at(values, x)}, x
    )
    return _as_difference_if_small(picture, f"reported − true [{unit}]", values)


def _static_force_plot(
    effect: Effect, problem: EstimationProblem, fitted: Fit, segments: Segments
) -> EffectPlot | None:
    """The force on each row that a change of geometry makes while the machine rests, over the body's angle."""
    model = problem.model
    with_it, without = (derive.compose(model.plant, model.assumptions, e) for e in ((effect.name,), ()))
    rest = {s: 0 for c in with_it.plant.coordinates for s in (c.dq, c.ddq)}
    along = with_it.plant.coordinates[-1].q
    known = {symbol(n): v for n, v in fitted.of_log(0).items() if n not in effect.full_names}
    laws = [(b - a).subs(rest).subs(known) for a, b in zip(with_it.residual, without.residual, strict=True)]
    if any(law.free_symbols - {along, *effect.symbols.values()} for law in laws) or not any(laws):
        return None
    rows = [(row, law) for row, law in zip(problem.module.ROWS, laws, strict=True) if law != 0]
    at = {f"{row} row": numeric_law(effect, law, [along]) for row, law in rows}
    x = _range_grid(measured_states(problem.module, segments.log)[_window(segments), problem.module.NQ - 1])
    units, force = units_of(problem.plant), problem.plant.input_unit
    return EffectPlot(f"{along} [{units[str(along)]}]", f"force at rest [{force}]", x,
                   lambda values: {n: f(values, x) for n, f in at.items()})  # fmt: skip


# ---- any other effect


def _output_change_plot(effect: Effect, problem: EstimationProblem, fitted: Fit, number: int) -> EffectPlot:
    """Change of the readings by the effect [σ], along the segment on which it is largest."""
    segments, module = problem.data.estimation[number], problem.module
    own = fitted.of_log(number)
    absent = {n: module.ABSENT[module.PARAMETERS.index(n)] for n in effect.full_names}
    first = initial_states(module, segments)
    states, _ = fit_states(problem.simulator, segments, first, kernel_parameters(module, own, segments.log))

    def residual(values: EffectValues, where: Segments, begin: np.ndarray) -> np.ndarray:
        parameters = kernel_parameters(module, {**own, **values}, where.log)
        return np.nan_to_num(problem.simulator.shoot(where, begin, parameters).residual)

    change = residual(absent, segments, states) - residual({}, segments, states)
    changes = [np.nan_to_num(np.nansum(change[a:b] ** 2), posinf=0.0) for a, b in segments.bounds]
    most = int(np.argmax(changes))
    shown = Segments(segments.log, segments.sigma, segments.bounds[most : most + 1])
    window = slice(*shown.bounds[0])
    bare = residual(absent, shown, states[most : most + 1])[window]
    x = segments.log.t[window]

    def lines(values: EffectValues) -> dict[str, np.ndarray]:
        moved = bare - residual(values, shown, states[most : most + 1])[window]
        return {c: moved[:, k] for k, c in enumerate(segments.log.channels)}

    return EffectPlot("time [s]", "change of the readings [σ]", x, lines)


# ---- ranges


def _window(segments: Segments) -> slice:
    return slice(int(segments.bounds[0, 0]), int(segments.bounds[-1, 1]))


def _range_grid(signal: np.ndarray) -> np.ndarray:
    """Points over what a signal covers."""
    low, high = np.quantile(signal[np.isfinite(signal)], RANGE_QUANTILES)
    return np.linspace(low, high if high > low else low + 1.0, GRID_POINTS)
