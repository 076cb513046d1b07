"""What a known force, or a known offset of readings, would change in a model's whitened innovations.

The filter keeps the gains that it has.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.missing_force.smoothed_force import variables_of
from wheelpend.estimation.filter_error import FilterProblem, FilterTrack
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.random_source import RandomSource, Sources, mixing_matrix
from wheelpend.estimation.scaled_inverse import positive_semidefinite
from wheelpend.estimation.smoother import FILTERED, PREDICTED, stretch_beginnings
from wheelpend.identification.filter_error_method import estimator_at
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

MAX_SAMPLES = 8_000  # of a log, from its first on
PROBE_SHARE, PROBE_TIME_S = 1e-9, 1e3  # of the drive, s: a force that only shows how states move


class DriftResponse(NamedTuple):
    """A filter along one log, linear in known forces and in known offsets of its readings.

    A force moves the states by ``moves``; an offset shows at once, by ``whitens``, and through the states that the
    filter takes from it, by ``gains``.
    """

    whitened: np.ndarray  # (N, NY) innovations, 0 where nothing was read
    log_likelihood: np.ndarray  # (N,) of the readings [nats], without the constant that the sensors' σ alone decide
    motion: Mapping[str, np.ndarray]  # (N,) each, as the filter knew it a step before the reading
    own: np.ndarray  # (N, parameters, rows) forces by which the model's own parameters act, per unit of each
    transitions: np.ndarray  # (N, NS, NS) of the error of the states, a reading taken in and then a step
    moves: np.ndarray  # (N, NS, rows) by a force over the step to the reading
    readings: np.ndarray  # (N, NY, NS) whitened innovations by the error of the states, 0 where nothing was read
    gains: np.ndarray  # (N, NS, NY) of the states in the readings before, and then a step
    whitens: np.ndarray  # (N, NY, NY) whitened innovations by offsets of the readings, 0 where nothing was read
    variance: np.ndarray  # (N, NY) of the innovations, before they are whitened, NaN where nothing was read

    def of(self, forces: np.ndarray) -> np.ndarray:
        """Whitened innovations (N, NY, columns) that forces (N, columns, rows) over the steps would take away."""
        return self._followed(self.moves @ forces.transpose(0, 2, 1))

    def of_readings(self, offsets: np.ndarray) -> np.ndarray:
        """The same of offsets (N, columns, NY) of the readings."""
        shifted = np.concatenate([np.zeros_like(offsets[:1]), offsets[:-1]])
        later = self._followed(-self.gains @ shifted.transpose(0, 2, 1))
        return self.whitens @ offsets.transpose(0, 2, 1) + later

    def _followed(self, moves: np.ndarray) -> np.ndarray:
        """Whitened innovations (N, NY, columns) of errors of the states that grow by moves (N, NS, columns)."""
        found = np.zeros((*self.whitened.shape, moves.shape[2]))
        error = np.zeros(moves.shape[1:])
        for k, (transition, move, reading) in enumerate(zip(self.transitions, moves, self.readings, strict=True)):
            error = transition @ error + move
            found[k] = reading @ error
        return found

    def of_own(self) -> np.ndarray:
        """The same of the model's own parameters."""
        return self.of(self.own)


class OwnParameters(NamedTuple):
    """The free parameters of a model in which its equations of motion are linear."""

    values: np.ndarray  # (NP,) of all parameters
    places: list[int]  # in the regressor

    @classmethod
    def of(cls, model: FilteredModel, number: int) -> OwnParameters:
        """Those of a model in one of its logs."""
        module, log = model.problem.module, model.problem.logs[number]
        free = [k for k, name in enumerate(module.LINEAR) if name in model.names]
        return cls(kernel_parameters(module, model.log_values[number], log), free)


def drift_responses(model: FilteredModel, number: int) -> DriftResponse | None:
    """The filter along the beginning of one of a model's logs; None where it left the finite numbers, or reads late."""
    values = model.log_values
    whole = estimator_at(model.problem, model.problem.module, (), values, lambda: values)
    sources = model.point.sources[number]
    probes = _probes(whole.problem.module, whole.force_scale)
    filters = whole.problem.on_beginning(MAX_SAMPLES)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        track = filters.track(number, np.zeros(0), (*sources, *probes))
        if len(np.unique(track.samples)) != len(track.samples) or not np.isfinite(track.covariances).all():
            return None
        return _response(filters, number, track, sources, OwnParameters.of(model, number))


def _probes(module: KernelModule, scale: float) -> Sources:
    """A force on every row so small that it is none."""
    rows = np.eye(module.NQ)
    return tuple(
        RandomSource(module.ROWS[k], tuple(map(float, rows[k])), (0.0,) * module.NY, PROBE_SHARE * scale, PROBE_TIME_S)
        for k in range(module.NQ)
    )


class _Update(NamedTuple):
    """A filter's readings along a log, and what they do to the error of its states."""

    left: np.ndarray  # (N, kept, kept) of an error, after the readings
    gain: np.ndarray  # (N, kept, NY) of the states in the readings
    shows: np.ndarray  # (N, NY, kept) whitened innovations by an error
    whitens: np.ndarray  # (N, NY, NY) by the innovations; 0 where nothing was read
    variance: np.ndarray  # (N, NY) of the innovations; NaN where nothing was read

    @classmethod
    def of(
        cls, filters: FilterProblem, number: int, track: FilterTrack, sources: Sources, kept: int, read: np.ndarray
    ) -> _Update:
        """Those of one log's track, of which the first states are ``kept`` and some readings (N, NY) were ``read``."""
        module = filters.module
        by = np.zeros((module.NY, kept))
        by[:, : module.NX], by[:, kept - len(sources) :] = (
            module.OUTPUT_MATRIX,
            mixing_matrix([s.readings for s in sources], module.NY),
        )
        by = np.where(read[:, :, None], by, 0.0)
        crossed = track.covariances[:, PREDICTED, :kept, :kept] @ by.transpose(0, 2, 1)
        predicted = positive_semidefinite(by @ crossed)  # behind a huge force rounding exceeds the sensors' noise
        variance = predicted + np.diag(filters.segments[number].sigma ** 2)
        gain = np.linalg.solve(variance, crossed.transpose(0, 2, 1)).transpose(0, 2, 1)
        root = np.linalg.cholesky(variance)
        whitens = np.linalg.solve(root, np.where(read[:, :, None], np.eye(module.NY), 0.0))
        own = np.where(read, np.diagonal(variance, axis1=1, axis2=2), np.nan)
        return cls(np.eye(kept) - gain @ by, gain, np.linalg.solve(root, by), whitens, own)


def _response(
    filters: FilterProblem, number: int, track: FilterTrack, sources: Sources, parameters: OwnParameters
) -> DriftResponse:
    """The response of a filter whose track ends with a probe on every row."""
    module, segments = filters.module, filters.segments[number]
    kept, rows = track.means.shape[2] - module.NQ, slice(track.means.shape[2] - module.NQ, None)
    found = filters.innovations(np.zeros(0), [sources] * len(filters.segments))[number][track.samples]
    innovations, log_likelihood = found[..., 0], -0.5 * np.nansum(found[..., 0] ** 2 + found[..., 1], axis=1)
    update = _Update.of(filters, number, track, sources, kept, np.isfinite(innovations))
    begins = np.isin(track.samples, stretch_beginnings(segments.bounds))
    onward = track.transitions[1:, :kept, :kept]
    transitions, gains = np.zeros_like(update.left), np.zeros_like(update.gain)
    transitions[1:], gains[1:] = onward @ update.left[:-1], onward @ update.gain[:-1]
    moves = track.transitions[:, :kept, rows].copy()
    transitions[begins], gains[begins], moves[begins] = 0.0, 0.0, 0.0
    before = np.arange(len(begins)) - ~begins  # the step before, in the same stretch
    known, samples = track.means[before, FILTERED, :kept], track.samples[before]
    states, acting = known[:, : module.NX], known[:, kept - len(sources) :]
    motion = variables_of(filters, segments.log, samples, states)
    forces = acting @ mixing_matrix([s.rows for s in sources], module.NQ).T
    own = _own_forces(filters, segments.log, samples, states, forces, parameters)
    return DriftResponse(
        whitened=np.nan_to_num(innovations),
        log_likelihood=log_likelihood,
        motion=motion,
        own=own,
        transitions=transitions,
        moves=moves,
        readings=update.shows,
        gains=gains,
        whitens=update.whitens,
        variance=update.variance,
    )


def _own_forces(
    filters: FilterProblem, log: Log, samples: np.ndarray, states: np.ndarray, forces: np.ndarray, own: OwnParameters
) -> np.ndarray:
    """Forces (N, own, NQ) by which a model's own parameters act, per unit of each, beside random forces (N, NQ)."""
    module, parameters = filters.module, own.values.copy()
    found = np.zeros((len(samples), len(own.places), module.NQ))
    for k, (sample, state) in enumerate(zip(samples, states, strict=True)):
        voltage = np.nan_to_num(log.voltage[sample])
        parameters[filters.force_columns] = forces[k]
        acceleration = module.acceleration(log.t[sample], state, voltage, parameters)[: module.NQ]
        phi = module.regressor(log.t[sample], state, acceleration, voltage, parameters)[1]
        found[k] = -phi[:, own.places].T
    return found
