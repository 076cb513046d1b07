"""The period of a ripple: the residual of the filtered equations against sines of a port's angle.

How many independent trials the grid of periods amounts to is calibrated by surrogates whose blocks have random signs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.regressor import acting_input
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.load import model_module
from wheelpend.numerics import decimated

MAX_PERIODS_PER_TURN = 60.0  # of the grid
MAX_GRID_STEP = 0.5  # periods per turn; less where a log spans many radians
NEGLIGIBLE_RESPONSE_SHARE = 1e-12  # of its peak, below which nothing is left of a filter's impulse response
PERIOD_INTERPOLATION_STEP = 0.4  # periods per turn within which the norm of a filtered wave hardly changes
SURROGATE_BLOCK_COUNT = 40  # blocks of a log, whose signs are drawn for a surrogate
SURROGATE_COUNT = 200
FILTER_TIME_CONSTANT_RATIO = 1.3  # of the second filter's to the first's
MIN_FILTER_SAMPLES = 4  # least time constant, in samples of the log
SAMPLES_PER_TIME_CONSTANT = 5  # behind the filters, to which the residual is decimated


class RippleResidual(NamedTuple):
    """Residual of a log's filtered equations, and the waves that it is compared with."""

    missing: np.ndarray  # (samples,) force, in units of its noise
    angle: np.ndarray  # (samples + before,) of the port [rad], from the log's beginning
    before: int  # samples before the first of the residual
    response: np.ndarray  # of the two filters to a wave, by frequency

    def length(self, wave: np.ndarray) -> float:
        """Euclidean norm of a wave behind the filters of the equations, over the residual's samples."""
        spectrum = np.fft.fft(wave, len(self.response)) * self.response
        return float(np.linalg.norm(np.fft.ifft(spectrum)[self.before : self.before + len(self.missing)]))

    def weights(self, blocks: int) -> list[tuple[slice, np.ndarray]]:
        """Samples of an unfiltered wave and weights on them that give its filtered product with the residual, by block.

        The filters' adjoint is applied once, to the residual, and not to every wave. So the samples of a block are its
        own, and those before it within the filters' memory.
        """
        impulse = np.fft.ifft(self.response).real
        memory = int(np.flatnonzero(np.abs(impulse) > NEGLIGIBLE_RESPONSE_SHARE * np.abs(impulse).max())[-1]) + 1
        reversed_impulse, found = impulse[: min(memory, len(self.angle))][::-1], []
        size = len(self.missing) // blocks
        if not size:
            return [(slice(0, 0), np.zeros(0))] * blocks
        for first in range(0, blocks * size, size):
            adjoint = np.convolve(self.missing[first : first + size], reversed_impulse)
            end = self.before + first + size
            begin = max(end - len(adjoint), 0)
            found.append((slice(begin, end), adjoint[begin - end :].astype(complex)))
        return found


def strongest_ripple(
    problem: EstimationProblem, fitted: Fit, port: str, tau: float, seed: int = 0
) -> tuple[float, int]:
    """Periods per turn of the strongest ripple in a port's missing force, and the number of independent trials."""
    records = [ripple_residual(problem, fitted, port, k, tau) for k in range(len(problem.data.estimation))]
    span = max(1.0, *(float(np.ptp(r.angle)) for r in records))
    grid = np.arange(1.0, MAX_PERIODS_PER_TURN, min(MAX_GRID_STEP, 2.0 / span))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(SURROGATE_BLOCK_COUNT, SURROGATE_COUNT))
    power, surrogate = np.zeros(len(grid)), np.zeros((len(grid), SURROGATE_COUNT))
    for record in records:
        amplitudes = _block_amplitudes(record, grid)
        power += np.abs(amplitudes.sum(axis=1)) ** 2 / max(float(np.mean(record.missing**2)), 1e-300)
        surrogate += np.abs(amplitudes @ signs) ** 2 / (np.abs(amplitudes) ** 2).sum(axis=1, keepdims=True)
    typical = float(np.median(surrogate.max(axis=0)))
    single = poisson_below(len(records), typical)  # of one period; a sum of as many exponentials as there are logs
    trials = int(np.clip(np.log(0.5) / np.log1p(-single), 1, len(grid)))
    return float(grid[np.argmax(power)]), trials


def _block_amplitudes(record: RippleResidual, grid: np.ndarray) -> np.ndarray:
    """Normalised complex amplitudes (periods, blocks) of waves over a grid of periods per turn in a residual."""
    near = max(1, round(PERIOD_INTERPOLATION_STEP / (grid[1] - grid[0])))
    amplitudes, lengths = np.empty((len(grid), SURROGATE_BLOCK_COUNT), dtype=complex), []
    weights = record.weights(SURROGATE_BLOCK_COUNT)
    factors = np.exp(1j * (grid[:near] - grid[0])[:, None] * record.angle)  # from a period to those near it
    for first in range(0, len(grid), near):
        waves = np.exp(1j * grid[first] * record.angle) * factors[: len(grid) - first]
        amplitudes[first : first + near] = np.stack([waves[:, samples] @ w for samples, w in weights], axis=1)
        lengths.append(record.length(waves[0]))
    return amplitudes / np.interp(grid, grid[::near], lengths)[:, None]


def ripple_residual(problem: EstimationProblem, fitted: Fit, port: str, number: int, tau: float) -> RippleResidual:
    """Residual of a training log's equations behind filters of about tau [s], decimated to their bandwidth."""
    plain = model_module(problem.model.plant, problem.model.assumptions, ())
    log, bounds = problem.data.estimation[number].log, problem.data.estimation[number].bounds
    values = fitted.of_log(number)
    parameters = kernel_parameters(plain, values, log)
    states, voltage = measured_states(problem.module, log), acting_input(plain, log, parameters)
    tau = max(tau, MIN_FILTER_SAMPLES * log.dt)
    taus = (tau, FILTER_TIME_CONSTANT_RATIO * tau)
    thin = max(1, round(tau / (SAMPLES_PER_TIME_CONSTANT * log.dt)))
    first, last = int(bounds[0, 0]), int(bounds[-1, 1])
    sides, regressors = plain.filter_regressor(log.t, states, voltage, parameters, *taus, True, states[0])
    rows = (sides - regressors @ np.array([values[n] for n in plain.LINEAR]))[:last]
    rows = (decimated(rows, thin) if thin > 1 else rows)[first // thin :]  # noise at higher rates must not fold
    rows = rows - rows.mean(axis=0)
    missing = rows @ (1.0 / rows.var(axis=0))  # the row with less noise has more weight
    displacement = states[:, : problem.module.NQ] @ problem.port_weights(port)
    angle = displacement[:last:thin] / problem.plant.port(port).length_per_radian  # of a length, what counts as one rad
    return RippleResidual(missing, angle, first // thin, lag_frequency_response(len(angle), thin * log.dt, taus))


def lag_frequency_response(samples: int, dt: float, taus: Iterable[float]) -> np.ndarray:
    """Response of first-order lags in series, by frequency; for twice the samples, so that no end wraps round."""
    delay = np.exp(-2j * np.pi * np.fft.fftfreq(1 << (2 * samples - 1).bit_length()))  # of one sample
    decays = [math.exp(-dt / tau) for tau in taus]
    return np.prod([(1.0 - k) / (1.0 - k * delay) for k in decays], axis=0)


def poisson_below(count: int, mean: float) -> float:
    """Poisson probability of fewer than count events at a mean: that a sum of count exponentials exceeds it."""
    return math.exp(-mean) * sum(mean**k / math.factorial(k) for k in range(count))
