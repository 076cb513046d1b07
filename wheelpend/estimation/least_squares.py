"""Least squares on the regressor: the paper's two methods, and a start for shooting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from wheelpend.estimation.state_reconstruction import fill_gaps, measured_states
from wheelpend.logs.log import Log

CHUNK_SAMPLES = 200_000  # samples of a long log that are worked on at once
CHUNK_MARGIN_SAMPLES = 50  # samples around a piece, from which missing readings are filled and slopes taken
FILTER_DECAY_TIME_CONSTANTS = 40.0  # time constants after which nothing is left of the filters' start
QR_BLOCK_ROWS = 8192  # of which a QR decomposition is taken at once
MAX_NORMAL_EQUATIONS_CONDITION = 1e10  # condition of the scaled normal equations up to which they keep six digits


@dataclass(frozen=True)
class LinearFit:
    """Parameters by linear least squares."""

    names: tuple[str, ...]
    estimate: np.ndarray  # (n,)
    sigma: np.ndarray  # (n,) standard errors, as if the regressor were free of noise
    condition: float  # of the column-scaled regressor, squared (of its Gram matrix)
    rows: int
    unidentifiable: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return dict(zip(self.names, map(float, self.estimate), strict=True))


def acting_input(module: ModuleType, log: Log, parameters: np.ndarray) -> np.ndarray:
    """The input (N,) that acts in the mean from each sample to the next: the commanded one unless the motor lags."""
    inputs = [fill_gaps(log.t, c) for c in log.inputs]
    voltage = inputs[0] if log.voltage.ndim == 1 else np.column_stack(inputs)
    if module.LAG < 0:
        return voltage
    acting = module.acting_voltage(log.t, voltage, parameters)
    return np.append(0.5 * (acting[:-1] + acting[1:]), acting[-1:])


def differentiation_least_squares(module: ModuleType, log: Log, parameters: np.ndarray) -> LinearFit:
    """Least squares with accelerations from numerical differences (paper eqs. 16, 17, 24)."""
    states = measured_states(module, log)
    rates = np.gradient(states[:, module.NQ :], log.t, axis=0)
    voltage = acting_input(module, log, parameters)
    return solve_least_squares(module, *equations_at(module, log.t, states, rates, voltage, parameters))


def equations_at(
    module: ModuleType,
    t: np.ndarray,
    states: np.ndarray,
    rates: np.ndarray,
    voltage: np.ndarray,
    parameters: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Left sides (N, NQ) and regressors (N, NQ, n) at states and accelerations (paper eqs. 21-23)."""
    pairs = [module.regressor(*row, parameters) for row in zip(t, states, rates, voltage, strict=True)]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def filtered_least_squares(
    module: ModuleType,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    first_order_hold: bool = True,
    start: np.ndarray | None = None,
) -> LinearFit:
    """Least squares on the filtered, acceleration-free regressor (paper eqs. 39-43).

    ``start`` (4,) is the state from which the filters' initial conditions (42) are made. Without it what a wrong start
    would add, the filters' free decay, is fitted along and thrown away: half a degree there can cost 90 % of X1.
    """
    if len(log) > CHUNK_SAMPLES:
        return _chunked_least_squares(module, log, parameters, tau, first_order_hold, start)
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    begin = states[0] if start is None else start
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, first_order_hold, begin)
    return solve_least_squares(
        module, sides, regressors, None if start is not None else free_decay(log.t, tau, module.NQ)
    )


def _chunked_least_squares(module: ModuleType, log: Log, parameters, tau, first_order_hold: bool, start) -> LinearFit:
    """The same piece by piece: no memory beyond the log's but for one piece.

    While the filters still decay from their start the rows are formed, and what they cannot help is taken out. After
    that only the normal equations are; where these lose too many digits, a QR decomposition takes their place.
    """
    voltage, count = acting_input(module, log, parameters), len(module.LINEAR)
    own = (parameters, *tau, first_order_hold)
    head = min(
        max(int(np.searchsorted(log.t, log.t[0] + FILTER_DECAY_TIME_CONSTANTS * max(tau))), CHUNK_SAMPLES // 8),
        len(log),
    )
    states = states_of_range(module, log, 0, head)
    begin = states[0] if start is None else start
    first = module.filter_regressor(log.t[:head], states, voltage[:head], *own, begin)
    rows = np.concatenate([first[1], first[0][:, :, None]], axis=2).reshape(-1, count + 1)
    if start is None:
        rows = project_out(free_decay(log.t[:head], tau, module.NQ).reshape(len(rows), -1), rows)[0]
    weights, memory = module.filter_weights(log.dt, *tau), module.filter_memory()
    module.filter_start(log.t[0], begin, voltage[0], parameters, weights, memory)
    module.filtered_gram(log.t[:head], states, voltage[:head], *own, memory, np.zeros((count + 1, count + 1)))
    kept, gram = memory.copy(), rows.T @ rows
    for part, states in chunks_from(module, log, head):
        module.filtered_gram(log.t[part], states, voltage[part], *own, memory, gram)
    if condition_of(gram[:-1, :-1]) < MAX_NORMAL_EQUATIONS_CONDITION:
        root = gram_square_root(gram)
    else:
        root = triangular_factor(rows)
        for part, states in chunks_from(module, log, head):
            sides, phi = module.filter_onward(log.t[part], states, voltage[part], *own, kept)
            more = np.concatenate([phi, sides[:, :, None]], axis=2).reshape(-1, count + 1)
            root = triangular_factor(more, root)
    found = solve_least_squares(module, root[:, None, -1], root[:, None, :-1])
    degrees = (len(root) - count) / (module.NQ * len(log) - count)
    return replace(found, sigma=found.sigma * np.sqrt(max(degrees, 0.0)), rows=module.NQ * len(log))


def chunks_from(module: ModuleType, log: Log, first: int) -> Iterator[tuple[slice, np.ndarray]]:
    """Ranges of samples from one on, each with the sample before it, and their states."""
    for a in range(first, len(log), CHUNK_SAMPLES):
        b = min(a + CHUNK_SAMPLES, len(log))
        yield slice(a - 1, b), states_of_range(module, log, a - 1, b)


def states_of_range(module: ModuleType, log: Log, first: int, last: int) -> np.ndarray:
    """Measured states (last - first, NX) of some samples; those around them tell the slopes at the ends."""
    a, b = max(first - CHUNK_MARGIN_SAMPLES, 0), min(last + CHUNK_MARGIN_SAMPLES, len(log))
    return measured_states(module, log.part(a, b))[first - a : last - a]


def _column_norms(gram: np.ndarray) -> np.ndarray:
    """Lengths of the columns of which this is the Gram matrix; 1 for one of zeros."""
    squares = np.diag(gram)
    return np.sqrt(np.where(squares > 0.0, squares, 1.0))


def condition_of(gram: np.ndarray) -> float:
    """Condition number of a Gram matrix, scaled to a unit diagonal."""
    scale = _column_norms(gram)
    values = np.linalg.eigvalsh(gram / np.outer(scale, scale))
    return float(values[-1] / max(values[0], 1e-300))


def gram_square_root(gram: np.ndarray) -> np.ndarray:
    """Rows whose Gram matrix is this one."""
    scale = _column_norms(gram)
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * scale


def triangular_factor(rows: np.ndarray, root: np.ndarray | None = None) -> np.ndarray:
    """Upper triangle R of the QR decomposition of some rows, below those of an earlier one where it is given.

    It is taken of some rows at a time, so that no second matrix of their size is needed.
    """
    root = np.zeros((0, rows.shape[1])) if root is None else root
    for first in range(0, len(rows), QR_BLOCK_ROWS):
        root = np.asarray(np.linalg.qr(np.vstack([root, rows[first : first + QR_BLOCK_ROWS]]), mode="r"))
    return root


def project_out(nuisance: np.ndarray, *arrays: np.ndarray) -> list[np.ndarray]:
    """What the columns of ``nuisance`` (rows, m) cannot explain of some arrays (rows, ...)."""
    basis = np.linalg.qr(nuisance)[0]
    return [a - basis @ (basis.T @ a) for a in arrays]


def free_decay(t: np.ndarray, tau: tuple[float, float], rows: int) -> np.ndarray:
    """Both free responses of the filters on each row, (N, rows, 2 rows)."""
    slow, rest = np.exp(-(t - t[0]) / tau[1]), t - t[0]
    if abs(tau[0] - tau[1]) > 1e-3 * tau[0]:
        coupled = (np.exp(-rest / tau[0]) - slow) * tau[0] / (tau[0] - tau[1])
    else:
        coupled = slow * rest / tau[1]
    pair = np.column_stack([slow, coupled])
    return np.einsum("kc,rs->krsc", pair, np.eye(rows)).reshape(len(t), rows, 2 * rows)


def nonnegative_least_squares(
    module: ModuleType, log: Log, parameters: np.ndarray, tau: tuple[float, float]
) -> dict[str, float]:
    """Filtered least squares with no parameter negative: a start for a fit, when effects may be missing.

    A constant on each row, dry friction in the slip of the first port and the filters' own start are fitted along and
    thrown away, so that a slope, an offset or a sticking gearbox corrupts the start less. A parameter that comes out at
    zero gets a thousandth of the largest share.
    """
    from scipy.optimize import nnls  # imported late: it takes long to load, and known values need no such start

    states = measured_states(module, log)
    voltage = acting_input(module, log, parameters)
    slip = states[:, module.NQ :] @ np.array(next(iter(module.PORTS.values())))
    rubbing = (np.ones_like(voltage).T * np.tanh(slip / (0.05 * slip.std() + 1e-300))).T  # in place of every input
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, True, states[0])
    count, signed = len(module.LINEAR), np.isin(module.LINEAR, module.SIGNED)
    either, drags = [free_decay(log.t, tau, module.NQ), regressors[:, :, signed]], np.zeros((*sides.shape, 0))
    if module.INPUTS:  # what takes their place behind the filters is a force
        dry, constant = (
            module.filter_regressor(log.t, states, u, parameters, *tau, True, states[0])[0]
            for u in (rubbing, np.ones_like(voltage))
        )
        either.append(np.stack([constant * (np.arange(module.NQ) == k) for k in range(module.NQ)], axis=2))
        drags = dry[:, :, None]
    both = np.concatenate(either, axis=2)
    nuisance = np.concatenate([drags, both, -both], axis=2)
    matrix = np.concatenate([regressors, nuisance, sides[:, :, None]], axis=2)
    root = triangular_factor(matrix.reshape(-1, matrix.shape[2]))
    scale = np.linalg.norm(root[:, :-1], axis=0) + 1e-300
    weights = nnls(root[:, :-1] / scale, root[:, -1])[0]
    first = len(scale) - both.shape[2] + either[0].shape[2]  # of the turned columns of signed parameters
    estimate = weights[:count]
    estimate[signed] -= weights[first : first + int(signed.sum())]
    estimate = np.where(signed, estimate, np.maximum(estimate, 1e-3 * estimate.max()))
    return dict(zip(module.LINEAR, map(float, estimate / scale[:count]), strict=True))


def solve_least_squares(
    module: ModuleType, sides: np.ndarray, regressors: np.ndarray, nuisance: np.ndarray | None = None
) -> LinearFit:
    """Least squares by SVD of the column-scaled regressor (paper eq. 17); flat directions stay at zero.

    ``nuisance`` (N, rows, m) is projected out of both sides first.
    """
    count = len(module.LINEAR)
    matrix, right = regressors.reshape(-1, count), sides.ravel()
    if nuisance is not None:
        matrix, right = project_out(nuisance.reshape(len(right), -1), matrix, right)
    scale = np.linalg.norm(matrix, axis=0)
    silent = scale == 0.0
    scale = np.where(silent, 1.0, scale)
    u, s, v = np.linalg.svd(matrix / scale, full_matrices=False)
    kept = s > 1e-9 * s[0]
    estimate = (v[kept].T @ ((u[:, kept].T @ right) / s[kept])) / scale
    residual = right - matrix @ estimate
    variance = residual @ residual / max(right.size - count, 1)
    sigma = np.sqrt(variance * ((v[kept] / s[kept, None]) ** 2).sum(axis=0)) / scale
    lost = (v[~kept] ** 2).sum(axis=0)
    flat = tuple(n for n, q, w in zip(module.LINEAR, silent, lost, strict=True) if q or w > 1e-3)
    condition = float((s[0] / max(s[-1], 1e-300)) ** 2)
    return LinearFit(tuple(module.LINEAR), estimate, sigma, condition, right.size, flat)
