"""The filter-error method: maximum likelihood with sensor noise, random forces and random errors of sensors.

An extended Kalman filter runs along each log; its innovations are white and independent where the model is right, and
the likelihood is theirs. Output-error with free initial states is the special case without a force and with a filter
that starts anew in every segment.
Source: Maine and Iliff, Formulation and implementation of a practical algorithm (1981); Jategaonkar (2015), chapter 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import Sources, mixing_matrix, noise_array
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.states import initial_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

NO_STEPS = -1  # of a filter are stored, nor its innovations
START_SPREAD_RANGES = 10.0  # ranges of a state within a log, its standard deviation where the filter starts: unknown
INTERNAL_SPREAD_RAD = 1.0  # the same of what moves inside the machine: where it may swing, a wider one is not linear


class FilterTrack(NamedTuple):
    """Every step of a filter along a log: E of them, over states and forces."""

    means: np.ndarray  # (E, 2, variables) predicted, then filtered
    covariances: np.ndarray  # (E, 2, variables, variables)
    transitions: np.ndarray  # (E, variables, variables) from the step before
    samples: np.ndarray  # (E,) sample at or after which the step ends

    @classmethod
    def empty(cls, steps: int, size: int) -> FilterTrack:
        """Zeros in place of so many steps, over so many variables."""
        return cls(
            np.zeros((steps, 2, size)), np.zeros((steps, 2, size, size)), np.zeros((steps, size, size)),
            np.zeros(steps, dtype=np.int64),
        )  # fmt: skip


class FilterRun(NamedTuple):
    """The whitened innovations of a log, linearised in θ at the filter's gains."""

    gram: np.ndarray  # (segments, columns + 1, columns + 1) of derivatives and, last, innovations
    log_det: np.ndarray  # (segments,) sums of the logarithms of their variances [σ²]
    innovation: np.ndarray  # (samples inside, NY, 2) whitened, and logarithms of the variances [σ²]; NaN where none is

    @property
    def deviance(self) -> np.ndarray:
        """−2 log-likelihood of each segment (segments,), without the constant that the sensors' σ alone decide."""
        return self.gram[:, -1, -1] + self.log_det


@dataclass(frozen=True)
class FilterProblem:
    """Logs through which filters run, with the kernels of a model and the space of its free parameters."""

    module: KernelModule  # with an unknown force on every row
    segments: Sequence[Segments]  # of each log; those that go on where one ended share a filter
    space: ParameterSpace
    max_step: float  # s
    parts: int = 1  # Gaussian parts, at most, while a surface may stick: five come close to a particle filter

    @cached_property
    def columns(self) -> np.ndarray:
        """Places of the free parameters in the kernels' parameter vector."""
        return self.places_of([p.name for p in self.space.layout.columns])

    @cached_property
    def force_columns(self) -> np.ndarray:
        """Places of the rows' unknown forces there."""
        return self.places_of(self.module.MISSING_FORCES)

    def places_of(self, names: Sequence[str]) -> np.ndarray:
        """Places of parameters in the kernels' parameter vector (names,)."""
        return np.array([self.module.PARAMETERS.index(n) for n in names], dtype=np.int64)

    @cached_property
    def starts(self) -> list[np.ndarray]:
        """Per log: states (segments, NX) in which a filter may start."""
        return [np.nan_to_num(initial_states(self.module, s)) for s in self.segments]

    @cached_property
    def spreads(self) -> list[np.ndarray]:
        """Per log: standard deviations (NS,) of where it starts, so wide that nothing is known of it."""
        return [start_spread(self.module, s.log, x) for s, x in zip(self.segments, self.starts, strict=True)]

    @property
    def count(self) -> int:
        """Number of measured values."""
        return sum(s.values for s in self.segments)

    def on_part(self, samples: int) -> FilterProblem:
        """The same problem on so many samples of all logs together: the beginning and the middle of each."""
        return replace(self, segments=[_part(s, samples // len(self.segments)) for s in self.segments])

    def on_beginning(self, samples: int) -> FilterProblem:
        """The same problem on so many samples, or a few more, from the first of each log on."""
        return replace(self, segments=[_beginning(s, samples) for s in self.segments])

    def run(self, theta: np.ndarray, sources: Sequence[Sources]) -> list[FilterRun]:
        """Run the filters with each log's random sources, and linearise their innovations, in the segments, in θ."""
        return [self._run_log(k, theta, own, self.columns, 0)[0] for k, own in enumerate(sources)]

    def inside_innovations(self, theta: np.ndarray, sources: Sequence[Sources]) -> list[np.ndarray]:
        """The innovations of each log (samples, NY, 2) in its segments, as run has them."""
        return [self._run_log(k, theta, own, self.columns[:0], 0)[0].innovation for k, own in enumerate(sources)]

    @cached_property
    def _inside(self) -> list[np.ndarray]:
        """Per log: the samples of its segments."""
        return [np.concatenate([np.arange(*own) for own in s.bounds]) for s in self.segments]

    def deviances(self, theta: np.ndarray, sources: Sequence[Sources]) -> np.ndarray:
        """−2 log-likelihood of each log (logs,); infinite where a filter left the finite numbers."""
        runs = [self._run_log(k, theta, own, self.columns[:0], NO_STEPS)[0] for k, own in enumerate(sources)]
        found = np.array([run.deviance.sum() for run in runs])
        return np.where(np.isfinite(found), found, np.inf)

    def innovations(self, theta: np.ndarray, sources: Sequence[Sources]) -> list[np.ndarray]:
        """Whitened innovations of each log and the logarithms of their variances [σ²] (N, NY, 2), NaN where none is."""
        found = [np.full((len(s.log), self.module.NY, 2), np.nan) for s in self.segments]
        for whole, inside, own in zip(found, self.inside_innovations(theta, sources), self._inside, strict=True):
            whole[own] = inside
        return found

    def track(self, number: int, theta: np.ndarray, sources: Sources) -> FilterTrack:
        """Every step of the filter along a log."""
        bounds = self.segments[number].bounds
        steps = 2 * int(np.diff(bounds).sum()) + len(bounds)  # a sample has one of its own, and one of late sensors
        return self._run_log(number, theta, sources, self.columns[:0], steps)[1]

    @np.errstate(over="ignore", invalid="ignore")  # what runs away gives infinities, and is rejected
    def _run_log(
        self, number: int, theta: np.ndarray, sources: Sources, columns: np.ndarray, steps: int
    ) -> tuple[FilterRun, FilterTrack]:
        """Run the filter along one log; its innovations are stored unless there are NO_STEPS, and so many steps."""
        module, segments = self.module, self.segments[number]
        log, parts, size = segments.log, len(segments.bounds), len(self.spreads[number]) + len(sources)
        inside = self._inside[number] if steps != NO_STEPS else np.zeros(0, dtype=np.int64)
        innovation = np.empty((len(log) if len(inside) else 0, module.NY, 2))  # of which most may never be touched
        run = FilterRun(np.zeros((parts, columns.size + 1, columns.size + 1)), np.zeros(parts), innovation)
        track = FilterTrack.empty(max(steps, 0), size)
        parameters = kernel_parameters(module, self.space.values_of_log(theta, number), log)
        try:
            done = module.filter_error(
                log.t, log.voltage, log.measured, 1.0 / segments.sigma, segments.bounds, self.starts[number],
                self.spreads[number], parameters, columns, self.force_columns,
                mixing_matrix([s.rows for s in sources], module.NQ),
                mixing_matrix([s.readings for s in sources], module.NY), noise_array(sources), self.max_step,
                self.parts, *run, *track,
            )  # fmt: skip
        except ZeroDivisionError:  # a machine without inertia, at the bounds of its parameters, cannot be simulated
            run.gram[:], innovation[inside], done = np.nan, np.nan, 0
        return run._replace(innovation=innovation[inside]), FilterTrack(*(part[:done] for part in track))

    @np.errstate(over="ignore", invalid="ignore")  # as above
    def equations(self, runs: Sequence[FilterRun]) -> NormalEquations:
        """Normal equations of θ from all logs and segments, each a part of its own."""
        layout = self.space.layout
        logs = [NormalEquations(layout, r.gram[:, :-1, :-1], r.gram[:, :-1, -1], r.gram[:, -1, -1]) for r in runs]
        return NormalEquations.of_logs(layout, logs)


def total_deviance(runs: Sequence[FilterRun]) -> float:
    """−2 log-likelihood of all logs; infinite where a filter left the finite numbers."""
    total = float(sum(run.deviance.sum() for run in runs))
    return total if np.isfinite(total) else np.inf


def parted(segments: Segments) -> Segments:
    """The segments without the last sample before a gap, at which a filter that goes from sample to sample ends."""
    bounds, begins = segments.bounds.copy(), [stretch.begin for stretch in segments.log.stretches]
    bounds[:-1, 1] -= (bounds[:-1, 1] == bounds[1:, 0]) & np.isin(bounds[1:, 0], begins)
    return replace(segments, bounds=bounds)


def filtered_segments(problem: EstimationProblem) -> list[Segments]:
    """Segments of a problem's logs as a filter takes them: parted at gaps."""
    return [parted(s) for s in problem.data.estimation]


def _part(segments: Segments, samples: int) -> Segments:
    """Segments of about so many samples: half of them from the first on, half from the middle on."""
    lengths = np.diff(segments.bounds, axis=1)[:, 0]
    count = max(2, int(np.ceil(samples / max(float(lengths.mean()), 1.0))))
    if count >= len(lengths):
        return segments
    chosen = np.unique(np.r_[: count // 2, len(lengths) // 2 : len(lengths) // 2 + count - count // 2])
    return replace(segments, bounds=segments.bounds[chosen[chosen < len(lengths)]], weights=None)


def _beginning(segments: Segments, samples: int) -> Segments:
    """The first segments, up to the one with which they have so many samples."""
    before = np.cumsum(np.diff(segments.bounds, axis=1)[:, 0]) - np.diff(segments.bounds, axis=1)[:, 0]
    return replace(segments, bounds=segments.bounds[before < samples], weights=None)


def start_spread(module: KernelModule, log: Log, starts: np.ndarray) -> np.ndarray:
    """Standard deviations (NS,) of a state of which nothing is known, far beyond what the log covers."""
    half = module.NX // 2
    finite = np.nan_to_num(log.measured)
    reach = max(float(np.ptp(finite, axis=0).max()), float(np.abs(starts[:, :half]).max(initial=0.0)), 1e-6)
    spread = np.zeros(module.NV + (module.LAG >= 0))
    spread[:half] = START_SPREAD_RANGES * reach
    spread[half : module.NX] = START_SPREAD_RANGES * reach / max(10.0 * log.dt, 1e-3)
    inside = np.array(module.RATES[module.NQ :], dtype=np.int64)  # rates of internal coordinates, these before them
    spread[inside - 1] = INTERNAL_SPREAD_RAD
    spread[inside] = float(np.abs(starts[:, half : module.NX]).max(initial=1.0))
    if module.LAG >= 0:
        spread[-1] = START_SPREAD_RANGES * float(np.nanmax(np.abs(log.inputs), initial=0.0))
    return spread
