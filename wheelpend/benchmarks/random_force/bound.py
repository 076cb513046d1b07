"""The Cramér-Rao bound of a complete record, and the estimate that attains it, without a filter.

A record is cut into segments, each linearised at the true parameters from its own true state, so that an unstable plant
has no time to run away. That one segment begins where the one before ends is a linear equation between their states
and the parameters. The bound is the covariance of the least-squares problem under these equations; its solution for the
sensors' true errors is how far an efficient estimate is off on this very record.

Eliminating the states forward would multiply transition matrices to the size of the instability over the whole record,
e^(2.3 · 20) on the paper's robot; the KKT matrix would hold squares. Instead the equations' null space is taken, an
orthonormal basis by QR, and the rows are projected onto it, again by QR: nothing is ever squared, and the growing
direction of a state is held by the segments behind it, as the shrinking one is by those before.
Source: Björck, Numerical Methods for Least Squares Problems (1996), section 5.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr, solve_triangular

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model
from wheelpend.simulation.closed_loop import ClosedLoop
from wheelpend.simulation.hidden import base_parameter_names, machine_values
from wheelpend.simulation.simulate import noise_levels, sensor_errors

SEGMENT_DURATION_S = 0.25  # s, in which the paper's robot falls away by a factor of two
OVERLAP_DURATION_S = 0.05  # s into the next segment, in which the readings tell all states: the rates too


class Record(NamedTuple):
    """A simulated log with what only a simulation knows."""

    log: Log
    module: KernelModule
    states: np.ndarray  # (N, NX) true ones
    parameters: np.ndarray  # (NP,) true ones
    sigma: np.ndarray  # (NY,) standard deviations of the sensors' errors


class Efficient(NamedTuple):
    """The most precise unbiased estimate of a parameter, on one record."""

    sigma: float  # the Cramér-Rao bound of its standard deviation
    error: float  # estimate - truth, to first order


class SegmentRows(NamedTuple):
    """A segment linearised in its initial state and the parameters."""

    rows: np.ndarray  # (rows, NX + k + 1) triangular, in units of σ; the sensors' errors last
    own: np.ndarray  # (2 NY, NX + k) readings at its beginning and an overlap later
    next: np.ndarray  # (2 NY, NX + k) the same readings of the segment after it; without rows in the last one


def true_record(model: Model, log: Log, seed: int | None) -> Record:
    """The simulation of a log by its seed, played again for its states."""
    assert log.reference is not None
    module, values = library_module_of(model), machine_values(model, {})
    parameters = kernel_parameters(module, values, log)
    errors, quantum = sensor_errors(model, module.OUTPUTS, len(log), seed)
    begin = np.array([(model.simulation or {}).get(name, 0.0) for name in module.STATES])
    run = ClosedLoop.of(model, module, log.dt).replay(log, begin, parameters, errors, quantum)
    if not np.array_equal(run.measured, log.measured):
        raise ValueError(f"{log.name} must be the simulation of seed {seed}, but it has other readings.")
    return Record(log, module, run.states, parameters, sensor_sigma(model, module))


def sensor_sigma(model: Model, module: KernelModule) -> np.ndarray:
    """Standard deviations (NY,) of the sensors' true errors: their noise, and rounding to a step."""
    steps = [model.sensors.step_of(model.plant_signature.channel(name)) or 0.0 for name in module.OUTPUTS]
    return np.hypot(noise_levels(model, module.OUTPUTS), np.array(steps) / np.sqrt(12.0))


def efficient_estimates(model: Model, log: Log, seed: int, segment: float = SEGMENT_DURATION_S) -> dict[str, Efficient]:
    """Cramér-Rao bound and efficient estimate of each of the plant's own parameters, by name, on a simulated log."""
    names = base_parameter_names(model)
    sigma, error = efficient_solution(true_record(model, log, seed), names, segment)
    return {n: Efficient(float(s), float(e)) for n, s, e in zip(names, sigma, error, strict=True)}


def efficient_solution(record: Record, names: Sequence[str], segment: float) -> tuple[np.ndarray, np.ndarray]:
    """Bound (k,) and error of the efficient estimate (k,), from segments of so many seconds; the states are unknown."""
    columns = np.array([record.module.PARAMETERS.index(n) for n in names], dtype=np.int64)
    length = max(round(segment / record.log.dt), 1)
    overlap = max(min(round(OVERLAP_DURATION_S / record.log.dt), length // 2), 1)
    starts = range(0, max(len(record.log) - length // 2, 1), length)
    ends = [*starts[1:], len(record.log)]
    parts = [linearised(record, columns, a, b, overlap) for a, b in zip(starts, ends, strict=True)]
    scale = np.maximum(np.abs(record.parameters[columns]), 1e-12)
    sigma, error = tied_solution(parts, record.module.NX, scale)
    return scale * sigma, scale * error


def linearised(record: Record, columns: np.ndarray, first: int, last: int, overlap: int) -> SegmentRows:
    """Samples first to last - 1 linearised from the true state at the first."""
    log, module = record.log, record.module
    until = min(last + overlap + 1, len(log))
    _, readings, derivative = module.sensitivities(
        log.t[first:until], log.voltage[first:until], record.states[first], record.parameters, columns, log.dt
    )
    size = derivative.shape[-1]
    error = (log.measured[first:until] - readings)[..., None]
    weighted = np.concatenate([derivative, error], axis=-1)[: last - first] / record.sigma[:, None]
    triangular = qr(weighted.reshape(-1, size + 1), mode="r", check_finite=False)[0][: size + 1]
    both = np.array([0, overlap])
    following = derivative[both + last - first].reshape(-1, size) if last < len(log) else derivative[:0, 0]
    return SegmentRows(triangular, derivative[both].reshape(-1, size), following)


def tied_solution(parts: Sequence[SegmentRows], states: int, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations and errors (k,) of parameters in units of ``scale`` (k,), the segments tied to each other."""
    count, k = len(parts), scale.size
    unit = np.max([np.abs(p.rows[:, :states]).max(axis=0) for p in parts], axis=0)  # of states: their precision
    stretch = np.concatenate([1.0 / np.maximum(unit, 1e-300), scale])
    size = count * states + k
    rows, ties = [], np.zeros(((count - 1) * states, size))
    for number, part in enumerate(parts):
        placed = np.zeros((len(part.rows), size + 1))
        placed[:, np.r_[number * states : (number + 1) * states, count * states : size]] = part.rows[:, :-1] * stretch
        placed[:, -1] = part.rows[:, -1]
        rows.append(placed)
        if number + 1 < count:
            tie(ties[number * states : (number + 1) * states], part, parts[number + 1], number, states)
    free = null_space(ties * np.concatenate([np.tile(stretch[:states], count), scale]))
    whole = np.concatenate(rows)
    triangular = qr(np.column_stack([whole[:, :-1] @ free, whole[:, -1]]), mode="r")[0][: free.shape[1]]
    half = solve_triangular(triangular[:, :-1], free[count * states : size].T, trans="T")  # R⁻ᵀ Zᵀ
    return np.linalg.norm(half, axis=0), half.T @ triangular[:, -1]


def tie(target: np.ndarray, part: SegmentRows, after: SegmentRows, number: int, states: int) -> None:
    """Write x_next − Φ x − Γ θ = 0 into rows (NX, all); Φ and Γ from the readings that both segments foresee."""
    ahead = np.concatenate([part.next[:, :states], part.next[:, states:] - after.own[:, states:]], axis=1)
    transition = np.linalg.lstsq(after.own[:, :states], ahead, rcond=None)[0]
    target[:, number * states : (number + 1) * states] = -transition[:, :states]
    target[:, (number + 1) * states : (number + 2) * states] = np.eye(states)
    target[:, target.shape[1] - (transition.shape[1] - states) :] = -transition[:, states:]


def null_space(equations: np.ndarray) -> np.ndarray:
    """Orthonormal basis (unknowns, free) of what satisfies independent equations (equations, unknowns)."""
    if not len(equations):
        return np.eye(equations.shape[1])
    lengths = np.linalg.norm(equations, axis=1, keepdims=True)
    return qr((equations / lengths).T)[0][:, len(equations) :]
