"""The generalised force that the model lacks, on each row and over time, with a confidence band.

Inside every segment the missing force is piecewise constant with a Gaussian prior whose size is found by maximum
likelihood. The segment's initial state is free, so only what the motion inside the segment shows is taken for a force.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from wheelpend.diagnosis.missing_force.piecewise_force import force_equations
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_parameters
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.parameters import ParameterLayout, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.scaled_inverse import positive_semidefinite
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import input_table, measured_states, port_motion

PIECES_PER_SEGMENT = 10
QUANTILE_BIN_COUNT = 12
FORCE_SIZE_GRID_V = np.geomspace(1e-3, 30.0, 19)  # V, standard deviations of the prior that are compared
FIRST_FORCE_SIZE_V = 0.1  # V
MIN_SIGNAL_TO_BAND_RATIO = 0.25  # mean square of the force over that of its standard error, below which it is nowhere
MIN_CONCENTRATION = 0.15  # excess share and predictability, above which a range is named


class MissingForce(NamedTuple):
    """Missing force per row at the middle of each piece."""

    t: np.ndarray  # (n,) s
    force: np.ndarray  # (n, rows) V
    sigma: np.ndarray  # (n, rows) V, one standard deviation
    variables: dict[str, np.ndarray]  # states and input at the same times
    log: str


class ForceConcentration(NamedTuple):
    """Where a row's missing force is concentrated."""

    row: str
    state: str
    low: float
    high: float
    share: float  # of the missing force's sum of squares that is found there

    def to_json(self) -> dict[str, Any]:
        """The range under the keys of JSON."""
        return {"row": self.row, "state": self.state, "from": self.low, "to": self.high, "share": self.share}


def estimate_missing_force(problem: EstimationProblem, fitted: Fit) -> MissingForce:
    """Estimate the missing force along the first training log, at a fit to the problem's training segments."""
    segments = problem.data.estimation[0]
    names = list(problem.module.MISSING_FORCES)
    equations, centres = _linearise(problem, fitted, segments, names)
    sizes = _prior_standard_deviations(equations, len(names))
    force, sigma = [], []
    for information, score in zip(equations.information, equations.score, strict=True):
        prior = np.tile(1.0 / sizes**2, PIECES_PER_SEGMENT)
        scale = 1.0 / np.sqrt(prior)
        within = np.linalg.inv(np.eye(len(scale)) + scale[:, None] * information * scale)  # never singular
        covariance = scale[:, None] * within * scale
        force.append((covariance @ score).reshape(PIECES_PER_SEGMENT, -1))
        sigma.append(np.sqrt(np.diag(covariance)).reshape(PIECES_PER_SEGMENT, -1))
    variables = _variables(problem, segments, centres)
    return MissingForce(
        segments.log.t[centres], np.concatenate(force), np.concatenate(sigma), variables, segments.log.name
    )


def _linearise(
    problem: EstimationProblem, fitted: Fit, segments: Segments, names: list[str]
) -> tuple[NormalEquations, np.ndarray]:
    """Normal equations of the segments in force pieces, and the samples in the middle of the pieces."""
    parameters = kernel_parameters(problem.module, fitted.of_log(0), segments.log)
    length = int(np.max(segments.bounds[:, 1] - segments.bounds[:, 0]))
    edges = np.linspace(0, length, PIECES_PER_SEGMENT + 1).astype(np.int64)
    columns = [problem.module.PARAMETERS.index(n) for _ in range(PIECES_PER_SEGMENT) for n in names]
    window = np.array([[edges[k], edges[k + 1]] for k in range(PIECES_PER_SEGMENT) for _ in names], dtype=np.int64)
    linearisation = problem.simulator.shoot(
        segments, fitted.states[0], parameters, columns, window, keep_residual=False
    )
    middle = (edges[:-1] + edges[1:]) // 2
    centres = np.minimum(segments.bounds[:, :1] + middle[None, :], segments.bounds[:, 1:] - 1).ravel()
    layout = ParameterLayout.of(free_parameters(problem, names * PIECES_PER_SEGMENT), 1)
    equations = force_equations(linearisation.gram, problem.module.NX, layout)
    return replace(equations, information=positive_semidefinite(equations.information),
                   score=np.nan_to_num(equations.score, posinf=0.0, neginf=0.0)), centres  # fmt: skip


def _prior_standard_deviations(equations: NormalEquations, rows: int) -> np.ndarray:
    """Standard deviation (rows,) of each row's missing force [V] by maximum likelihood on a grid, row after row."""
    sizes = np.full(rows, FIRST_FORCE_SIZE_V)
    for _ in range(2):
        for row in range(rows):
            likelihood = []
            for size in FORCE_SIZE_GRID_V:
                trial = sizes.copy()
                trial[row] = size
                pairs = zip(equations.information, equations.score, strict=True)
                likelihood.append(sum(_log_marginal_likelihood(i, s, trial) for i, s in pairs))
            sizes[row] = FORCE_SIZE_GRID_V[int(np.argmax(likelihood))]
    return sizes


def _log_marginal_likelihood(information: np.ndarray, score: np.ndarray, sizes: np.ndarray) -> float:
    """Logarithm of the marginal likelihood of a segment with forces of these sizes, up to a constant."""
    scale = np.tile(sizes, PIECES_PER_SEGMENT)
    whitened = np.eye(len(scale)) + scale[:, None] * information * scale[None, :]
    size, turned = np.linalg.eigh(whitened)  # at least 1: a Cholesky factor fails where rounding makes it less
    size = np.maximum(size, 1.0)
    half = (turned.T @ (scale * score)) / np.sqrt(size)
    return float(0.5 * half @ half - 0.5 * np.log(size).sum())


def _variables(problem: EstimationProblem, segments: Segments, centres: np.ndarray) -> dict[str, np.ndarray]:
    """States, slip speed, input and time at the pieces."""
    states = measured_states(problem.module, segments.log)
    table = {name: states[centres, k] for k, name in enumerate(problem.module.STATES)}
    width = max(1, round(0.01 / segments.log.dt))
    smooth = np.ones(2 * width + 1) / (2 * width + 1)
    for x in problem.module.UNMEASURED:  # a difference of readings, hidden in their noise
        states[:, x] = np.convolve(states[:, x], smooth, mode="same")
        table[problem.module.STATES[x]] = states[centres, x]
    for name, weights in port_motion(problem.module).items():
        if not weights[: problem.module.NQ].any():
            table[name] = states[centres] @ weights
    table |= input_table(problem.module, segments.log.voltage[centres])
    table["t"] = segments.log.t[centres]
    return table


def concentrations(
    problem: EstimationProblem, missing: MissingForce, max_count: int = 4
) -> tuple[ForceConcentration, ...]:
    """The ranges of states and input in which the missing force is most concentrated, strongest first.

    A range is named when its share of the force's sum of squares exceeds its share of the samples by a third of the
    rest, or when the variable predicts the force.
    """
    found = []
    for row, name in enumerate(problem.module.ROWS):
        force, band = missing.force[:, row], missing.sigma[:, row]
        if np.mean(force**2) < MIN_SIGNAL_TO_BAND_RATIO * np.mean(band**2):
            continue
        for variable, values in missing.variables.items():
            strongest = _strongest_concentration(force, values)
            if strongest is not None:
                low, high, share, excess = strongest
                found.append((excess, ForceConcentration(name, variable, low, high, share)))
    found.sort(key=lambda pair: -pair[0])
    return tuple(concentration for _, concentration in found[:max_count])


def _strongest_concentration(force: np.ndarray, values: np.ndarray) -> tuple[float, float, float, float] | None:
    """Low and high end, share and weight of the quantile bins whose share of the squares exceeds their samples most."""
    edges = np.quantile(values, np.linspace(0, 1, QUANTILE_BIN_COUNT + 1))
    if not np.all(np.diff(edges) > 0):
        return None
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, QUANTILE_BIN_COUNT - 1)
    means = np.array([force[bins == b].mean() if (bins == b).any() else 0.0 for b in range(QUANTILE_BIN_COUNT)])
    counts = np.bincount(bins, minlength=QUANTILE_BIN_COUNT) / len(values)
    total = float(np.mean(force**2)) + 1e-300
    predictable = float((counts * means**2).sum()) / total
    best, largest = (0, 0, 0.0), -np.inf
    for a in range(QUANTILE_BIN_COUNT):
        for b in range(a + 1, QUANTILE_BIN_COUNT + 1):
            share = float(np.sum(force[(bins >= a) & (bins < b)] ** 2)) / (len(force) * total)
            excess = share - float(counts[a:b].sum())
            if excess > largest:
                best, largest = (a, b, share), excess
    low, high, share = best
    weight = largest + predictable
    return (float(edges[low]), float(edges[high]), share, weight) if weight > MIN_CONCENTRATION else None
