"""The inverse of an information matrix without its flat directions, and damped solutions of many small equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MIN_EIGENVALUE_RATIO = 1e-9  # eigenvalue of the scaled matrix below which a direction is not identifiable
MIN_EXPLAINING_RATIO = 1e-11  # the same for columns that only explain others
SILENT_ROOT = 1e-100  # root of an information up to which a parameter has no influence; its variance is no number
STATE_DAMPING = 1e-10  # of the unit diagonal, with which a direction without influence does not move


def unit_diagonal(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A positive semidefinite matrix (n, n) with a unit diagonal, and the scale (n,), infinite where that vanishes."""
    root = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(root > SILENT_ROOT, root, np.inf)  # what has no influence is left without
    return matrix / np.outer(scale, scale), scale


@dataclass(frozen=True)
class ScaledInverse:
    """The inverse of an information matrix, zero along directions that are not identifiable."""

    scale: np.ndarray  # (n,)
    eigenvalues: np.ndarray  # (n,) of the scaled matrix, ascending
    vectors: np.ndarray  # (n, n)
    kept: np.ndarray  # (n,) True for identifiable directions

    @classmethod
    def of(cls, information: np.ndarray, min_ratio: float = MIN_EIGENVALUE_RATIO) -> ScaledInverse:
        """Take the inverse of a matrix (n, n); eigenvalues below a share of the largest count as zero.

        Where it is not finite, as of a machine that runs away, no direction is identifiable.
        """
        scaled, scale = unit_diagonal(information)
        if not np.isfinite(scaled).all():
            size = len(scale)
            return cls(np.full(size, np.inf), np.zeros(size), np.eye(size), np.zeros(size, dtype=bool))
        eigenvalues, vectors = np.linalg.eigh(scaled)
        return cls(scale, eigenvalues, vectors, eigenvalues > min_ratio * eigenvalues[-1:])

    def solve(self, right: np.ndarray, damping: float = 0.0) -> np.ndarray:
        """Solution (n,) or (n, k) for right sides of that shape."""
        across = (slice(None), *(None,) * (right.ndim - 1))
        inverse = np.where(self.kept, 1.0 / (np.where(self.kept, self.eigenvalues, 1.0) + damping), 0.0)
        return self.vectors @ (inverse[across] * (self.vectors.T @ (right / self.scale[across]))) / self.scale[across]

    @property
    def matrix(self) -> np.ndarray:
        """The inverse (n, n)."""
        kept = self.vectors[:, self.kept]
        return kept / self.eigenvalues[self.kept] @ kept.T / np.outer(self.scale, self.scale)

    @property
    def condition(self) -> float:
        """Condition number of the scaled matrix; infinite where nothing is identifiable."""
        if not self.kept.any():
            return float("inf")
        return float(self.eigenvalues[-1] / max(self.eigenvalues[0], 1e-300))

    @property
    def lost(self) -> np.ndarray:
        """Share (n,) of each coordinate in directions that are not identifiable."""
        return (self.vectors[:, ~self.kept] ** 2).sum(axis=1)


def positive_semidefinite(matrices: np.ndarray) -> np.ndarray:
    """Symmetric matrices (..., n, n) without what rounding has put below zero; zeros where one is not finite.

    Eliminating states from the equations of a very quiet sensor leaves differences of large numbers.
    """
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    clean = np.where(finite[..., None, None], matrices, 0.0)
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", clean), 0.0))
    inverse = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
    eigenvalues, vectors = np.linalg.eigh(clean * inverse[..., :, None] * inverse[..., None, :])
    lifted = (vectors * np.maximum(eigenvalues, 0.0)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    lifted = lifted * scale[..., :, None] * scale[..., None, :]
    negative = np.any(eigenvalues < 0.0, axis=-1, keepdims=True)
    return np.where(negative[..., None], lifted, clean)


def solve_damped(normal: np.ndarray, right: np.ndarray, damping: np.ndarray | float = 0.0) -> np.ndarray:
    """Solve many normal equations (..., n, n), scaled to a unit diagonal and damped.

    right is (..., n, k), and so is the solution: zeros where equations are not finite. damping is one number, or (...).
    """
    finite = np.isfinite(normal).all(axis=(-2, -1)) & np.isfinite(right).all(axis=(-2, -1))
    normal = np.where(finite[..., None, None], normal, np.eye(normal.shape[-1]))
    right = np.where(finite[..., None, None], right, 0.0)
    scale = np.sqrt(np.einsum("...ii->...i", normal)) + 1e-300
    scaled = normal / scale[..., :, None] / scale[..., None, :]
    ridge = STATE_DAMPING + np.broadcast_to(damping, normal.shape[:-2])
    scaled += ridge[..., None, None] * np.eye(normal.shape[-1])
    return _solve_small(scaled, right / scale[..., :, None]) / scale[..., :, None]


def _solve_small(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions (..., n, k) of many equations, those of one and of two unknowns in closed form."""
    if not right.size:
        return right
    if matrix.shape[-1] == 1:
        return right / matrix
    if matrix.shape[-1] > 2:
        return np.linalg.solve(matrix, right)
    a, b, c, d = (matrix[..., i, j, None] for i in range(2) for j in range(2))
    e, f = right[..., 0, :], right[..., 1, :]
    return np.stack([d * e - b * f, a * f - c * e], axis=-2) / (a * d - b * c)[..., None, :]
