"""Normal equations of the shooting problem: initial states eliminated (Schur complement), scaled, solved, inverted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.parameters import FreeParameter, ParameterLayout
from wheelpend.estimation.shooting import ShootingLinearisation

MIN_EIGENVALUE_RATIO = 1e-9  # eigenvalue of the scaled information matrix below which a direction is not identifiable


def solve_damped(normal: np.ndarray, right: np.ndarray, damping: np.ndarray | float) -> np.ndarray:
    """Solve every segment's normal equations (segments, n, n), scaled to a unit diagonal and damped.

    right is (segments, n, k), and so is the solution: zeros for a segment that is not finite.
    """
    finite = np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    normal = np.where(finite[:, None, None], normal, np.eye(normal.shape[1]))
    right = np.where(finite[:, None, None], right, 0.0)
    scale = np.sqrt(np.einsum("sii->si", normal)) + 1e-300
    scaled = normal / scale[:, :, None] / scale[:, None, :]
    scaled += (1e-10 + np.broadcast_to(damping, (len(normal),)))[:, None, None] * np.eye(normal.shape[1])
    return np.linalg.solve(scaled, right / scale[:, :, None]) / scale[:, :, None]


class ReducedNormalEquations(NamedTuple):
    """The normal equations of θ alone, the segments' initial states eliminated."""

    information: np.ndarray  # (free, free)
    score: np.ndarray  # (free,)
    scores: np.ndarray  # (segments of all logs, free), whose sum is the score
    steps: tuple[tuple[np.ndarray, np.ndarray], ...]  # per log: the states' own step (segments, NX), and their response
    # to the columns of θ (segments, columns, NX)


@np.errstate(over="ignore", invalid="ignore")  # what cannot be simulated gives infinities, and is rejected
def eliminate_initial_states(
    linearisations: Sequence[ShootingLinearisation], nx: int, layout: ParameterLayout, damping: float = 0.0
) -> ReducedNormalEquations:
    """Eliminate the initial states (nx each) of every segment of all logs (Schur complement)."""
    size = len(layout.elements)
    information, scores, steps = np.zeros((size, size)), [], []
    for linearisation, places in zip(linearisations, layout.places, strict=True):
        gram = linearisation.gram
        normal, mixed, own = gram[:, :nx, :nx], gram[:, nx:-1, :nx], gram[:, nx:-1, -1]
        solved = solve_damped(normal, gram[:, :nx, nx:], damping)  # the states' response to θ, and their own step
        response, step = solved[:, :, :-1].transpose(0, 2, 1), solved[:, :, -1]
        block = (gram[:, nx:-1, nx:-1] - np.einsum("skx,slx->skl", mixed, response)).sum(axis=0)
        information[np.ix_(places, places)] += 0.5 * (block + block.T)
        row = np.zeros((len(normal), size))
        row[:, places] = own - np.einsum("skx,sx->sk", mixed, step)
        scores.append(row)
        steps.append((step, response))
    stacked = np.concatenate(scores)
    return ReducedNormalEquations(information, stacked.sum(axis=0), stacked, tuple(steps))


def predicted_decrease(
    linearisations: Sequence[ShootingLinearisation], reduced: ReducedNormalEquations, nx: int, layout: ParameterLayout
) -> float:
    """Decrease of the sum of squares in the next step, were the residual linear and nothing damped."""
    pairs = zip(linearisations, reduced.steps, strict=True)
    states = sum(float(np.einsum("sx,sx->", s.gram[:, :nx, -1], own)) for s, (own, _) in pairs)
    if not layout.elements:
        return states
    return states + float(reduced.score @ solve_scaled(reduced.information, reduced.score))


def solve_scaled(information: np.ndarray, score: np.ndarray, damping: float = 0.0) -> np.ndarray:
    """Solve the normal equations of θ, scaled to a unit diagonal; zero along directions that are not identifiable."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(scale > 0.0, scale, np.inf)  # a parameter without any influence does not move
    eigenvalues, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = eigenvalues > MIN_EIGENVALUE_RATIO * eigenvalues[-1]
    inverse = np.where(kept, 1.0 / (np.where(kept, eigenvalues, 1.0) + damping), 0.0)
    return vectors @ (inverse * (vectors.T @ (score / scale))) / scale


def bounded_step(
    information: np.ndarray, score: np.ndarray, damping: float, lowest: np.ndarray, highest: np.ndarray
) -> np.ndarray:
    """Damped Gauss-Newton step within bounds on it, by an active set: elements beyond them are fixed there."""
    step = np.zeros(len(score))
    free = np.ones(len(score), dtype=bool)
    for _ in range(len(score) + 1):
        rest = score - information[:, ~free] @ step[~free]
        step[free] = solve_scaled(information[np.ix_(free, free)], rest[free], damping) if free.any() else 0.0
        outside = free & ((step < lowest) | (step > highest))
        if not outside.any():
            break
        step[outside] = np.clip(step[outside], lowest[outside], highest[outside])
        free &= ~outside
    return step


def segment_informations(
    linearisations: Sequence[ShootingLinearisation], nx: int, layout: ParameterLayout, reduced: ReducedNormalEquations
) -> np.ndarray:
    """Information of each segment of all logs about the free parameters (segments, free, free)."""
    found = []
    for linearisation, places, (_, response) in zip(linearisations, layout.places, reduced.steps, strict=True):
        gram = linearisation.gram
        information = np.zeros((len(gram), len(layout.elements), len(layout.elements)))
        own = gram[:, nx:-1, nx:-1] - np.einsum("skx,slx->skl", gram[:, nx:-1, :nx], response)
        information[:, places[:, None], places[None, :]] = 0.5 * (own + own.transpose(0, 2, 1))
        found.append(information)
    return np.concatenate(found)


def covariance_of(
    information: np.ndarray, parameters: Sequence[FreeParameter]
) -> tuple[np.ndarray, float, tuple[FreeParameter, ...]]:
    """Inverse of an information matrix, its scaled condition number, and the parameters that are not identifiable."""
    if not len(parameters):
        return np.zeros((0, 0)), 1.0, ()
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    silent = scale <= 1e-150
    scale = np.where(silent, 1.0, scale)
    eigenvalues, vectors = np.linalg.eigh(information / np.outer(scale, scale) + np.diag(silent * 1.0))
    kept = eigenvalues > MIN_EIGENVALUE_RATIO * eigenvalues[-1]
    inverse = vectors[:, kept] / eigenvalues[kept] @ vectors[:, kept].T / np.outer(scale, scale)
    lost = (vectors[:, ~kept] ** 2).sum(axis=1)
    flat = tuple(p for p, s, w in zip(parameters, silent, lost, strict=True) if s or w > 1e-3)
    return inverse, float(eigenvalues[-1] / max(eigenvalues[0], 1e-300)), flat
