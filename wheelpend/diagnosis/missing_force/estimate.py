"""The generalised force that the model lacks, on each row and over time, with a confidence band.

Inside every segment the missing force is piecewise constant with a Gaussian prior whose size is found by maximum
likelihood. The segment's initial state is free, so only what the motion inside the segment shows is taken for a force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.state_reconstruction import input_table, measured_states, slips

PIECES = 10  # of each segment
BINS = 12


class MissingForce(NamedTuple):
    """Missing force per row at the middle of each piece."""

    t: np.ndarray  # (n,) s
    force: np.ndarray  # (n, rows) V
    sigma: np.ndarray  # (n, rows) V, one standard deviation
    variables: dict[str, np.ndarray]  # states and input at the same times
    log: str


class Place(NamedTuple):
    """Where a row's missing force is concentrated."""

    row: str
    state: str
    low: float
    high: float
    share: float  # of the missing force's sum of squares that is found there


def find_missing_force(study: Study, fitted: Fit) -> MissingForce:
    """Estimate the missing force along the first training log, at a fit to the study's training parts."""
    part = study.training[0]
    names = [n for n in study.module.PARAMETERS if n.startswith("missing.")]
    gram, centres = _linearised(study, fitted, part, names)
    nx = study.module.NX
    responses, answers = [], []
    for g in gram:
        scale = np.sqrt(np.maximum(np.diag(g)[:nx], 1e-300))
        states = g[:nx, :nx] / np.outer(scale, scale) + 1e-9 * np.eye(nx)
        mixed = g[:nx, nx:] / scale[:, None]
        reduced = g[nx:, nx:] - mixed.T @ np.linalg.solve(states, mixed)
        responses.append(0.5 * (reduced[:-1, :-1] + reduced[:-1, :-1].T))
        answers.append(reduced[:-1, -1])
    sizes = _prior_sizes(responses, answers, len(names))
    force, sigma = [], []
    for information, score in zip(responses, answers, strict=True):
        prior = np.tile(1.0 / sizes**2, PIECES)
        covariance = np.linalg.inv(information + np.diag(prior))
        force.append((covariance @ score).reshape(PIECES, -1))
        sigma.append(np.sqrt(np.diag(covariance)).reshape(PIECES, -1))
    force_, sigma_ = np.concatenate(force), np.concatenate(sigma)
    return MissingForce(part.log.t[centres], force_, sigma_, _variables(study, part, centres), part.log.name)


def _linearised(study: Study, fitted: Fit, part: Part, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrices of the segments in states and force pieces, and the samples in the middle of the pieces."""
    parameters = vector(study.module, fitted.of_log(0), part.log)
    length = int(np.max(part.bounds[:, 1] - part.bounds[:, 0]))
    edges = np.linspace(0, length, PIECES + 1).astype(np.int64)
    columns = [study.module.PARAMETERS.index(n) for _ in range(PIECES) for n in names]
    window = np.array([[edges[k], edges[k + 1]] for k in range(PIECES) for _ in names], dtype=np.int64)
    shot = shoot(study.module, part, fitted.states[0], parameters, columns, window, study.max_step, keep=False)
    middle = (edges[:-1] + edges[1:]) // 2
    centres = np.minimum(part.bounds[:, :1] + middle[None, :], part.bounds[:, 1:] - 1).ravel()
    return shot.gram, centres


def _prior_sizes(responses: list[np.ndarray], answers: list[np.ndarray], rows: int) -> np.ndarray:
    """Standard deviation of each row's missing force by maximum likelihood on a grid, row after row."""
    sizes = np.full(rows, 0.1)
    for _ in range(2):
        for row in range(rows):
            trials = np.geomspace(1e-3, 30.0, 19)
            likelihood = []
            for trial in trials:
                guess = sizes.copy()
                guess[row] = trial
                likelihood.append(sum(_evidence(i, s, guess) for i, s in zip(responses, answers, strict=True)))
            sizes[row] = trials[int(np.argmax(likelihood))]
    return sizes


def _evidence(information: np.ndarray, score: np.ndarray, sizes: np.ndarray) -> float:
    """Logarithm of the likelihood of a segment with forces of these sizes, up to a constant."""
    scale = np.tile(sizes, PIECES)
    whitened = np.eye(len(scale)) + scale[:, None] * information * scale[None, :]
    factor = np.linalg.cholesky(whitened)
    half = np.linalg.solve(factor, scale * score)
    return float(0.5 * half @ half - np.log(np.diag(factor)).sum())


def _variables(study: Study, part: Part, centres: np.ndarray) -> dict[str, np.ndarray]:
    """States, slip speed, input and time at the pieces."""
    states = measured_states(study.module, part.log)
    table = {name: states[centres, k] for k, name in enumerate(study.module.STATES)}
    width = max(1, round(0.01 / part.log.dt))
    smooth = np.ones(2 * width + 1) / (2 * width + 1)
    for x in study.module.UNMEASURED:  # a difference of readings, hidden in their noise
        states[:, x] = np.convolve(states[:, x], smooth, mode="same")
        table[study.module.STATES[x]] = states[centres, x]
    for name, weights in slips(study.module).items():
        if not weights[: study.module.NQ].any():
            table[name] = states[centres] @ weights
    table |= input_table(study.module, part.log.voltage[centres])
    table["t"] = part.log.t[centres]
    return table


def concentrations(study: Study, missing: MissingForce, most: int = 4) -> tuple[Place, ...]:
    """The ranges of states and input in which the missing force is most concentrated, strongest first.

    A range is named when its share of the force's sum of squares exceeds its share of the samples by a third of the
    rest, or when the variable predicts the force.
    """
    found = []
    for row, name in enumerate(study.module.ROWS):
        force, band = missing.force[:, row], missing.sigma[:, row]
        if np.mean(force**2) < 0.25 * np.mean(band**2):
            continue
        for variable, values in missing.variables.items():
            place = _strongest(force, values)
            if place is not None:
                low, high, share, excess = place
                found.append((excess, Place(name, variable, low, high, share)))
    found.sort(key=lambda pair: -pair[0])
    return tuple(place for _, place in found[:most])


def _strongest(force: np.ndarray, values: np.ndarray) -> tuple[float, float, float, float] | None:
    """The run of quantile bins whose share of the sum of squares exceeds its share of the samples most."""
    edges = np.quantile(values, np.linspace(0, 1, BINS + 1))
    if not np.all(np.diff(edges) > 0):
        return None
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, BINS - 1)
    means = np.array([force[bins == b].mean() if (bins == b).any() else 0.0 for b in range(BINS)])
    counts = np.bincount(bins, minlength=BINS) / len(values)
    explained = counts * means**2
    total = float(np.mean(force**2)) + 1e-300
    predictable = float(explained.sum()) / total
    best = None
    for a in range(BINS):
        for b in range(a + 1, BINS + 1):
            share = float(np.sum(force[(bins >= a) & (bins < b)] ** 2)) / (len(force) * total)
            excess = share - float(counts[a:b].sum())
            if best is None or excess > best[3]:
                best = (float(edges[a]), float(edges[b]), share, excess)
    assert best is not None
    weight = best[3] + predictable
    return (best[0], best[1], best[2], weight) if weight > 0.15 else None
