"""The period of a ripple: the residual of the filtered equations against sines of a port's angle.

How many independent trials the grid of periods amounts to is calibrated by surrogates whose blocks have random signs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.long_logs import filtered_residual
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.regressor import acting_input
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.numerics import decimated

MAX_PERIODS_PER_TURN = 60.0  # of the grid
MAX_GRID_STEP = 0.5  # periods per turn; less where a log spans many radians
NEGLIGIBLE_RESPONSE_SHARE = 1e-12  # of its peak, below which nothing is left of a filter's impulse response
PERIOD_INTERPOLATION_STEP = 0.4  # periods per turn within which the norm of a filtered wave hardly changes
SURROGATE_BLOCK_COUNT = 40  # blocks of a log, whose signs are drawn for a surrogate
SURROGATE_COUNT = 200
FILTER_TIME_CONSTANT_RATIO = 1.3  # of the second filter's to the first's
MIN_FILTER_SAMPLES = 4  # least time constant, in samples of the log
MAX_SEARCHED_SAMPLES = 20_000  # of a log's residual, in which a period is sought
MAX_SEARCHED_SPAN = 1000.0  # rad, of the port there: the periods that can be told apart are as many
SHARPENED_STEPS = 2.0  # of a grid on either side of its best period, among which a longer stretch decides
SAMPLES_PER_TIME_CONSTANT = 5  # behind the filters, to which the residual is decimated


@dataclass(frozen=True)
class RippleResidual:
    """Residual of a log's filtered equations, and the waves that it is compared with."""

    missing: np.ndarray  # (samples,) force, in units of its noise
    angle: np.ndarray  # (before + samples,) of the port [rad]
    before: int  # samples before the first of the residual
    decays: tuple[float, ...]  # of the filters in series, over a sample

    @cached_property
    def response(self) -> np.ndarray:
        """Response of the filters to a wave, by frequency."""
        return lag_frequency_response(len(self.angle), self.decays)

    @property
    def span(self) -> float:
        """How far the port turns [rad]."""
        return float(np.ptp(self.angle))

    def length(self, wave: np.ndarray) -> float:
        """Euclidean norm of a wave behind the filters of the equations, over the residual's samples."""
        spectrum = np.fft.fft(wave, len(self.response)) * self.response
        return float(np.linalg.norm(np.fft.ifft(spectrum)[self.before : self.before + len(self.missing)]))

    def weights(self, blocks: int) -> list[tuple[slice, np.ndarray]]:
        """Samples of an unfiltered wave and weights on them that give its filtered product with the residual, by block.

        The filters' adjoint is applied once, to the residual, and not to every wave. So the samples of a block are its
        own, and those before it within the filters' memory.
        """
        size, found = len(self.missing) // blocks, []
        if not size:
            return [(slice(0, 0), np.zeros(0))] * blocks
        reversed_impulse = self._impulse[: len(self.angle)][::-1]
        for first in range(0, blocks * size, size):
            adjoint = np.convolve(self.missing[first : first + size], reversed_impulse)
            end = self.before + first + size
            begin = max(end - len(adjoint), 0)
            found.append((slice(begin, end), adjoint[begin - end :].astype(complex)))
        return found

    @cached_property
    def _impulse(self) -> np.ndarray:
        """Response of the filters to a wave of one sample, as long as anything is left of it."""
        samples = math.ceil(math.log(NEGLIGIBLE_RESPONSE_SHARE**1.5) / math.log(max(self.decays)))
        impulse = np.fft.ifft(lag_frequency_response(samples, self.decays)).real
        left = np.flatnonzero(np.abs(impulse) > NEGLIGIBLE_RESPONSE_SHARE * np.abs(impulse).max())
        return impulse[: int(left[-1]) + 1]

    def part(self, begin: int, end: int) -> RippleResidual:
        """Some samples of the residual, and before them what the filters remember."""
        first = self.before + begin
        before = min(first, len(self._impulse))
        return replace(
            self, missing=self.missing[begin:end], angle=self.angle[first - before : self.before + end], before=before
        )

    def busiest(self) -> tuple[int, int]:
        """Begin and end of the stretch in which the port travels furthest, of those that are not too long to search."""
        angle = self.angle[self.before :]
        travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(angle)))])
        begin, end, length = 0, len(angle), min(len(angle), MAX_SEARCHED_SAMPLES)
        while True:
            begin += int(np.argmax(travel[begin + length - 1 : end] - travel[begin : end - length + 1]))
            end = begin + length
            if length <= 1 or np.ptp(angle[begin:end]) <= MAX_SEARCHED_SPAN:
                return begin, end
            length //= 2


def strongest_ripple(
    problem: EstimationProblem, fitted: Fit, port: str, tau: float, seed: int = 0
) -> tuple[float, int]:
    """Periods per turn of the strongest ripple in a port's missing force, and the number of independent trials.

    Of long logs it is sought in the busiest stretch, and followed from there into the rest. A log whose port turns too
    far from sample to sample shows none; where no log shows any the answer is one period, of one trial.
    """
    records = [ripple_residual(problem, fitted, port, k, tau) for k in range(len(problem.data.estimation))]
    able = [(r, s) for r in records if np.ptp(s := r.busiest()) >= SURROGATE_BLOCK_COUNT]
    if not able:
        return 1.0, 1
    records, stretches = [r for r, _ in able], [s for _, s in able]
    parts = [r.part(*s) for r, s in zip(records, stretches, strict=True)]
    grid = np.arange(1.0, MAX_PERIODS_PER_TURN, _grid_step(parts))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(SURROGATE_BLOCK_COUNT, SURROGATE_COUNT))
    power, surrogate = np.zeros(len(grid)), np.zeros((len(grid), SURROGATE_COUNT))
    for part in parts:
        amplitudes = _block_amplitudes(part, grid)
        power += _power(part, amplitudes)
        surrogate += np.abs(amplitudes @ signs) ** 2 / (np.abs(amplitudes) ** 2).sum(axis=1, keepdims=True)
    typical = float(np.median(surrogate.max(axis=0)))
    single = poisson_below(len(records), typical)  # of one period; a sum of as many exponentials as there are logs
    trials = int(np.clip(np.log(0.5) / np.log1p(-single), 1, len(grid)))
    return _followed(records, stretches, parts, float(grid[np.argmax(power)]), trials)


def _followed(
    records: Sequence[RippleResidual],
    stretches: Sequence[tuple[int, int]],
    parts: Sequence[RippleResidual],
    periods: float,
    trials: int,
) -> tuple[float, int]:
    """Periods per turn found in a stretch of each record, sharper by stretches ever longer, and the trials."""
    while any(len(p.missing) < len(r.missing) for p, r in zip(parts, records, strict=True)):
        reach = SHARPENED_STEPS * _grid_step(parts)
        stretches = [_longer(*s, len(r.missing)) for s, r in zip(stretches, records, strict=True)]
        parts = [r.part(*s) for r, s in zip(records, stretches, strict=True)]
        grid = np.arange(periods - reach, periods + reach, _grid_step(parts))
        power = np.sum([_power(p, _block_amplitudes(p, grid)) for p in parts], axis=0)
        periods, trials = float(grid[np.argmax(power)]), trials + len(grid)
    return periods, trials


def _longer(begin: int, end: int, samples: int) -> tuple[int, int]:
    """A stretch that is as much longer at both ends as it was long, as far as there are samples."""
    return max(2 * begin - end, 0), min(2 * end - begin, samples)


def _grid_step(records: Sequence[RippleResidual]) -> float:
    """Periods per turn that these records tell apart."""
    return min(MAX_GRID_STEP, 2.0 / max(1.0, *(r.span for r in records)))


def _power(record: RippleResidual, amplitudes: np.ndarray) -> np.ndarray:
    """Power (periods,) of waves in a residual in units of its own, from amplitudes (periods, blocks)."""
    return np.abs(amplitudes.sum(axis=1)) ** 2 / max(float(np.mean(record.missing**2)), 1e-300)


def _block_amplitudes(record: RippleResidual, grid: np.ndarray) -> np.ndarray:
    """Normalised complex amplitudes (periods, blocks) of waves over a grid of periods per turn in a residual."""
    near = max(1, round(PERIOD_INTERPOLATION_STEP / (grid[1] - grid[0])))
    coarse, fine = grid[::near], grid[:near] - grid[0]  # every wave is one of the former times one of the latter
    amplitudes = np.empty((len(coarse) * len(fine), SURROGATE_BLOCK_COUNT), dtype=complex)
    for block, (samples, weights) in enumerate(record.weights(SURROGATE_BLOCK_COUNT)):
        angle = record.angle[samples]
        waves = np.exp(1j * np.outer(coarse, angle)) * weights
        amplitudes[:, block] = (waves @ np.exp(1j * np.outer(angle, fine))).ravel()
    lengths = [record.length(np.exp(1j * periods * record.angle)) for periods in coarse]
    return amplitudes[: len(grid)] / np.interp(grid, coarse, lengths)[:, None]


def ripple_residual(problem: EstimationProblem, fitted: Fit, port: str, number: int, tau: float) -> RippleResidual:
    """Residual of a training log's equations behind filters of about tau [s], decimated to their bandwidth.

    With the forces of the effects that the fit has: a dry friction that is known must not hide a ripple.
    """
    module = problem.module
    log, bounds = problem.data.estimation[number].log, problem.data.estimation[number].bounds
    values = fitted.of_log(number)
    parameters = kernel_parameters(module, values, log)
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    tau = max(tau, MIN_FILTER_SAMPLES * log.dt)
    taus = (tau, FILTER_TIME_CONSTANT_RATIO * tau)
    thin = max(1, round(tau / (SAMPLES_PER_TIME_CONSTANT * log.dt)))
    first, last = int(bounds[0, 0]), int(bounds[-1, 1])
    filtered = module, log.t[:last], states[:last], voltage[:last], parameters, taus
    rows = filtered_residual(*filtered, np.array([values.get(n, 0.0) for n in module.LINEAR]))
    rows = (decimated(rows, thin) if thin > 1 else rows)[first // thin :]  # noise at higher rates must not fold
    rows = rows - rows.mean(axis=0)
    missing = rows @ (1.0 / rows.var(axis=0))  # the row with less noise has more weight
    displacement = states[:, : problem.module.NQ] @ problem.port_weights(port)
    angle = displacement[:last:thin] / problem.plant.port(port).length_per_radian  # of a length, what counts as one rad
    return RippleResidual(missing, angle, first // thin, tuple(math.exp(-thin * log.dt / tau) for tau in taus))


def lag_frequency_response(samples: int, decays: Iterable[float]) -> np.ndarray:
    """Response of first-order lags in series, each with its decay over a sample, by frequency.

    For twice the samples, so that no end wraps round.
    """
    delay = np.exp(-2j * np.pi * np.fft.fftfreq(1 << (2 * samples - 1).bit_length()))  # of one sample
    return np.prod([(1.0 - k) / (1.0 - k * delay) for k in decays], axis=0)


def poisson_below(count: int, mean: float) -> float:
    """Poisson probability of fewer than count events at a mean: that a sum of count exponentials exceeds it."""
    return math.exp(-mean) * sum(mean**k / math.factorial(k) for k in range(count))
