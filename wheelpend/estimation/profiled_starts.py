"""Starting values that only a log can tell: the period of a ripple, a speed or a limit within what the log reaches.

Such a parameter cannot be scored at the effect's absence: there it means nothing, as a number of periods does while the
ripple has no size, or it is infinite, as the limit of a saturation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from derive.effects import INPUT_SIGNAL, Effect, Quantiles, Ripple, Values
from wheelpend.estimation import least_squares
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.kernels import load as kernels
from wheelpend.numerics import decimated

RIPPLE_TIME_CONSTANTS_S = (
    0.01,
    0.03,
)  # s, of the filters behind which a ripple is looked for: noise against what is left of it
NEGLIGIBLE_RESPONSE_SHARE = 1e-12  # share of its peak below which nothing is left of a filter's answer
PERIOD_INTERPOLATION_STEP = 0.4  # periods per turn within which the length of a wave behind the filters hardly changes
SURROGATE_BLOCK_COUNT = 40  # of a log, whose signs are drawn for a surrogate


class ProfileGrid(NamedTuple):
    """What is tried for an effect's parameter that has to be profiled."""

    settings: tuple[dict[str, float], ...]  # by effect.parameter
    trials: int  # how many independent trials they amount to


def profile_grids(problem: EstimationProblem, fitted: Fit, effects: Iterable[Effect]) -> dict[str, ProfileGrid]:
    """Settings of every effect that has a parameter to be profiled, from the logs and a fit to them."""
    found = {}
    for effect in effects:
        parameter = effect.profiled
        if parameter is None or parameter.starts is None or effect.event:
            continue
        if isinstance(parameter.starts, Quantiles):
            values = quantile_starts(problem, parameter)
            trials = len(values)
        elif isinstance(parameter.starts, Values):
            values, trials = list(parameter.starts.at), len(parameter.starts.at)
        elif isinstance(parameter.starts, Ripple):
            found_at = [strongest_ripple(problem, fitted, parameter.starts.of, tau) for tau in RIPPLE_TIME_CONSTANTS_S]
            reach = problem.plant.port(parameter.starts.of).length_per_radian
            values, trials = list(dict.fromkeys(p / reach for p, _ in found_at)), sum(t for _, t in found_at)
        else:
            continue
        found[effect.name] = ProfileGrid(tuple({f"{effect.name}.{parameter.name}": v} for v in values), trials)
    return found


def profiled_start_values(problem: EstimationProblem) -> dict[str, float]:
    """A value from the log for each parameter of the model's effects that cannot be fitted from where it is absent."""
    found: dict[str, float] = {}
    for effect in map(problem.effect, problem.model.effects):
        parameter = effect.profiled
        if parameter is not None and isinstance(parameter.starts, Quantiles | Values):
            quantiles = isinstance(parameter.starts, Quantiles)
            values = quantile_starts(problem, parameter) if quantiles else list(parameter.starts.at)
            found |= {f"{effect.name}.{parameter.name}": v for v in values[len(values) // 2 :][:1]}
    return found


def quantile_starts(problem: EstimationProblem, parameter) -> list[float]:
    """Quantiles of what the parameter is measured against, as far as they are possible values of it."""
    size = magnitude(problem, problem.training[0], parameter.starts.of)
    values = [float(v) for v in np.quantile(size, parameter.starts.at)]
    return list(dict.fromkeys(v for v in values if v > max(parameter.minimum, 0.0)))


def magnitude(problem: EstimationProblem, part: Segments, of: str) -> np.ndarray:
    """Absolute values of the input or of a port's speed in a part of a log."""
    log, window = part.log, slice(int(part.bounds[0, 0]), int(part.bounds[-1, 1]))
    if of == INPUT_SIGNAL:
        signal = log.voltage[window]
    else:
        states = least_squares.measured_states(problem.module, log)[window]
        signal = states[:, problem.module.NQ :] @ port_weights(problem, of)
    return np.abs(signal[np.isfinite(signal)])


def port_weights(problem: EstimationProblem, port: str) -> np.ndarray:
    """A port's coordinate as weights on the generalised coordinates."""
    return np.array(problem.plant.port(port).weights)


def null_values(problem: EstimationProblem, effect: Effect) -> dict[str, float]:
    """Sizes at which an effect does nothing on these logs, by effect.parameter.

    A limit does nothing from the largest value on that the logs reach. A stiffness k does nothing at infinity, and
    1/k is as many standard errors away from zero as k is.
    """
    table = {}
    for p in effect.sizes:
        of = p.starts.of if math.isinf(p.absent) and isinstance(p.starts, Quantiles) else None
        reached = max(float(magnitude(problem, part, of).max(initial=0.0)) for part in problem.training) if of else 0.0
        table[f"{effect.name}.{p.name}"] = reached
    return table


class RippleResidual(NamedTuple):
    """What the filtered equations of a log leave over, and the waves that they are compared with."""

    missing: np.ndarray  # (samples,) in units of its noise
    angle: np.ndarray  # (samples + before,) of the port [rad], from the log's beginning
    before: int  # samples before the first that is judged
    response: np.ndarray  # of the two filters to a wave, by frequency

    def length(self, wave: np.ndarray) -> float:
        """Root of the sum of squares of a wave behind the filters of the equations, where it is judged."""
        spectrum = np.fft.fft(wave, len(self.response)) * self.response
        return float(np.linalg.norm(np.fft.ifft(spectrum)[self.before : self.before + len(self.missing)]))

    def weights(self, blocks: int) -> list[tuple[slice, np.ndarray]]:
        """Weights on some samples of a wave: its product with what is missing, one of each block.

        The filters are turned round: they are taken of what is missing, once, and not of every wave. So the samples of
        a block are its own, and those before it that the filters remember.
        """
        answer = np.fft.ifft(self.response).real  # to an impulse
        memory = int(np.flatnonzero(np.abs(answer) > NEGLIGIBLE_RESPONSE_SHARE * np.abs(answer).max())[-1]) + 1
        reversed_answer, found = answer[: min(memory, len(self.angle))][::-1], []
        size = len(self.missing) // blocks
        if not size:
            return [(slice(0, 0), np.zeros(0))] * blocks
        for first in range(0, blocks * size, size):
            pulled = np.convolve(self.missing[first : first + size], reversed_answer)
            end = self.before + first + size
            begin = max(end - len(pulled), 0)
            found.append((slice(begin, end), pulled[begin - end :].astype(complex)))
        return found


def strongest_ripple(
    problem: EstimationProblem, fitted: Fit, port: str, tau: float, seed: int = 0
) -> tuple[float, int]:
    """Periods per turn of the strongest ripple in a port's missing force, and how many were in effect tried.

    The residual of the equations behind filters is compared with sines of the port's angle behind the same filters,
    over a fine grid of periods. How many independent trials that grid amounts to is calibrated by surrogates whose
    segments have random signs.
    """
    records = [ripple_residual(problem, fitted, port, k, tau) for k in range(len(problem.training))]
    span = max(1.0, *(float(np.ptp(r.angle)) for r in records))
    grid = np.arange(1.0, 60.0, min(0.5, 2.0 / span))
    near = max(1, round(PERIOD_INTERPOLATION_STEP / (grid[1] - grid[0])))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(SURROGATE_BLOCK_COUNT, 200))
    power, surrogate = np.zeros(len(grid)), np.zeros((len(grid), 200))
    for record in records:
        amplitudes, lengths, weights = (
            np.empty((len(grid), SURROGATE_BLOCK_COUNT), dtype=complex),
            [],
            record.weights(SURROGATE_BLOCK_COUNT),
        )
        turns = np.exp(1j * (grid[:near] - grid[0])[:, None] * record.angle)  # from one period of the grid to the next
        for first in range(0, len(grid), near):
            waves = np.exp(1j * grid[first] * record.angle) * turns[: len(grid) - first]
            amplitudes[first : first + near] = np.stack([waves[:, samples] @ w for samples, w in weights], axis=1)
            lengths.append(record.length(waves[0]))
        amplitudes /= np.interp(grid, grid[::near], lengths)[:, None]
        power += np.abs(amplitudes.sum(axis=1)) ** 2 / max(float(np.mean(record.missing**2)), 1e-300)
        surrogate += np.abs(amplitudes @ signs) ** 2 / (np.abs(amplitudes) ** 2).sum(axis=1, keepdims=True)
    typical = float(np.median(surrogate.max(axis=0)))
    single = poisson_below(len(records), typical)  # of one period; a sum of as many exponentials as there are logs
    trials = int(np.clip(np.log(0.5) / np.log1p(-single), 1, len(grid)))
    return float(grid[np.argmax(power)]), trials


def ripple_residual(problem: EstimationProblem, fitted: Fit, port: str, number: int, tau: float) -> RippleResidual:
    """What the equations of a training log leave over behind filters, thinned to what those let through."""
    plain = kernels.model_module(problem.model.plant, problem.model.assumptions, ())
    log, segment = problem.training[number].log, problem.training[number].bounds
    values = fitted.of_log(number)
    parameters = kernel_parameters(plain, values, log)
    states, voltage = (
        least_squares.measured_states(problem.module, log),
        least_squares.acting_input(plain, log, parameters),
    )
    tau = max(tau, 4 * log.dt)
    thin, first, last = max(1, round(tau / (5 * log.dt))), int(segment[0, 0]), int(segment[-1, 1])
    sides, regressors = plain.filter_regressor(log.t, states, voltage, parameters, tau, 1.3 * tau, True, states[0])
    rows = (sides - regressors @ np.array([values[n] for n in plain.LINEAR]))[:last]
    rows = (decimated(rows, thin) if thin > 1 else rows)[first // thin :]  # noise at higher rates must not fold
    rows = rows - rows.mean(axis=0)
    missing = rows @ (1.0 / rows.var(axis=0))  # the row with less noise says more
    along = states[:, : problem.module.NQ] @ port_weights(problem, port)
    angle = along[:last:thin] / problem.plant.port(port).length_per_radian  # along a length in what counts there as one rad
    return RippleResidual(
        missing, angle, first // thin, lag_frequency_response(len(angle), thin * log.dt, (tau, 1.3 * tau))
    )


def lag_frequency_response(samples: int, dt: float, taus: Iterable[float]) -> np.ndarray:
    """What first-order lags in a row make of a wave, by frequency; twice as long, so that no end meets a beginning."""
    turn = np.exp(-2j * np.pi * np.fft.fftfreq(1 << (2 * samples - 1).bit_length()))
    keep = [math.exp(-dt / tau) for tau in taus]
    return np.prod([(1.0 - k) / (1.0 - k * turn) for k in keep], axis=0)


def poisson_below(count: int, mean: float) -> float:
    """Probability of fewer than so many events: of a sum of so many exponentials to exceed that mean."""
    return math.exp(-mean) * sum(mean**k / math.factorial(k) for k in range(count))
