"""Linear least squares: the solution of a regression with its standard errors, and the matrix factors for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.kernels.kernel_module import KernelModule

QR_BLOCK_ROWS = 8192  # rows of which a QR decomposition is taken at once
MIN_SINGULAR_VALUE_RATIO = 1e-9  # of the scaled regressor, below which a direction is not identifiable
MIN_SINGULAR_VALUE = 1e-16  # of the largest, the precision of numbers: a condition number is at most the square of 1e16
BOUND_ROUNDING = 1e-12  # relative distance from a bound that is rounding: the estimate is at it
MAX_UNIDENTIFIABLE_SHARE = 1e-3  # of a parameter's direction, from which its value means nothing


@dataclass(frozen=True)
class LinearFit:
    """Parameters by linear least squares."""

    names: tuple[str, ...]
    estimate: np.ndarray  # (n,)
    sigma: np.ndarray  # (n,) standard errors, as if the regressor were free of noise
    condition: float  # of the column-scaled regressor, squared (of its Gram matrix)
    rows: int
    unidentifiable: tuple[str, ...]
    covariance: np.ndarray  # (n, n), whose diagonal are the squares of sigma
    undefined: tuple[str, ...] = ()  # of these, those whose columns are not finite: left out

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return dict(zip(self.names, map(float, self.estimate), strict=True))


def solve_least_squares(
    module: KernelModule,
    sides: np.ndarray,
    regressors: np.ndarray,
    nuisance: np.ndarray | None = None,
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> LinearFit:
    """Least squares by SVD of the column-scaled regressor (paper eq. 17); zero along unidentifiable directions.

    A column that is not finite, such as that of a law whose speed scale is zero, is left out and named. sides are
    (N, rows), regressors (N, rows, n); nuisance (N, rows, m) is projected out of both first. What fixed parameters
    do is taken from the sides; where an estimate is outside its bounds, the least squares within them are found.
    """
    names = tuple(module.LINEAR)
    if not restrictions.fixed:
        return _solve_free(names, sides, regressors, nuisance, restrictions)
    free, values = restrictions.is_free(names), restrictions.fixed_values(names)
    rest = sides - regressors[..., ~free] @ values[~free]
    found = _solve_free(tuple(restrictions.free(names)), rest, regressors[..., free], nuisance, restrictions)
    return with_fixed(found, names, restrictions)


def with_fixed(found: LinearFit, names: tuple[str, ...], restrictions: Restrictions) -> LinearFit:
    """A fit of the free parameters among some, with those that are fixed, whose standard errors are zero."""
    free, estimate, covariance = (
        restrictions.is_free(names),
        restrictions.fixed_values(names),
        np.zeros((len(names),) * 2),
    )
    estimate[free], covariance[np.ix_(free, free)] = found.estimate, found.covariance
    return replace(found, names=names, estimate=estimate, sigma=np.sqrt(np.diag(covariance)), covariance=covariance)


def _solve_free(
    names: tuple[str, ...],
    sides: np.ndarray,
    regressors: np.ndarray,
    nuisance: np.ndarray | None,
    restrictions: Restrictions,
) -> LinearFit:
    count = len(names)
    undefined = ~np.isfinite(regressors).reshape(-1, count).all(axis=0)
    matrix, right = np.where(undefined, 0.0, regressors).reshape(-1, count), sides.ravel()
    if nuisance is not None:
        matrix, right = project_out(nuisance.reshape(len(right), -1), matrix, right)
    scale = np.linalg.norm(matrix, axis=0)
    silent = scale == 0.0
    scale = np.where(silent, 1.0, scale)
    u, s, v = np.linalg.svd(matrix / scale, full_matrices=False)
    kept = s > MIN_SINGULAR_VALUE_RATIO * s[0]
    estimate = (v[kept].T @ ((u[:, kept].T @ right) / s[kept])) / scale
    estimate = _within_bounds(matrix / scale, right, scale, estimate, restrictions.bounds_of(names))
    residual = right - matrix @ estimate
    variance = residual @ residual / max(right.size - count, 1)
    root = v[kept] / s[kept, None] / scale
    sigma = np.sqrt(variance * ((v[kept] / s[kept, None]) ** 2).sum(axis=0)) / scale
    smallest = s[: count - int(silent.sum())].min(initial=s[0])  # a column of zeros has a singular value of zero
    condition = float((s[0] / max(smallest, MIN_SINGULAR_VALUE * s[0])) ** 2) if s[0] > 0.0 else 1.0
    unidentifiable = unidentifiable_names(names, silent, v[~kept])
    named = tuple(n for n, lost in zip(names, undefined, strict=True) if lost)
    return LinearFit(
        names, estimate, sigma, condition, right.size, unidentifiable, variance * root.T @ root, named
    )  # fmt: skip


def _within_bounds(
    scaled: np.ndarray,
    right: np.ndarray,
    scale: np.ndarray,
    estimate: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """The estimate (n,) where it is within its bounds; else the least squares of the scaled matrix within them."""
    low, high = bounds
    if np.all((low <= estimate) & (estimate <= high)):
        return estimate
    from scipy.optimize import lsq_linear  # imported late: it takes long to load, and hardly any fit needs it

    root = triangular_factor(np.column_stack([scaled, right]))
    found = lsq_linear(root[:, :-1], root[:, -1], (low * scale, high * scale), method="bvls").x / scale
    found = np.clip(found, low, high)
    for bound in bounds:  # to the digit, in spite of the scale
        at_bound = np.isfinite(bound) & (np.abs(found - bound) <= BOUND_ROUNDING * np.abs(bound))
        found = np.where(at_bound, bound, found)
    return found


def unidentifiable_names(names: Sequence[str], silent: np.ndarray, null_directions: np.ndarray) -> tuple[str, ...]:
    """Parameters without influence, or with a share in the null directions (k, n) of the scaled regressor."""
    lost = (null_directions**2).sum(axis=0)
    rows = zip(names, silent, lost, strict=True)
    return tuple(n for n, q, w in rows if q or w > MAX_UNIDENTIFIABLE_SHARE)


def project_out(nuisance: np.ndarray, *arrays: np.ndarray) -> list[np.ndarray]:
    """Residuals of arrays (rows, ...) after their regression on the columns of ``nuisance`` (rows, m)."""
    basis = np.linalg.qr(nuisance)[0]
    return [a - basis @ (basis.T @ a) for a in arrays]


def _column_norms(gram: np.ndarray) -> np.ndarray:
    """Norms of the columns of which this is the Gram matrix; 1 for one of zeros."""
    squares = np.diag(gram)
    return np.sqrt(np.where(squares > 0.0, squares, 1.0))


def condition_of(gram: np.ndarray) -> float:
    """Condition number of a Gram matrix, scaled to a unit diagonal."""
    scale = _column_norms(gram)
    values = np.linalg.eigvalsh(gram / np.outer(scale, scale))
    return float(values[-1] / max(values[0], 1e-300))


def gram_square_root(gram: np.ndarray) -> np.ndarray:
    """Rows (n, n) whose Gram matrix is this one."""
    scale = _column_norms(gram)
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * scale


def triangular_factor(rows: np.ndarray, root: np.ndarray | None = None) -> np.ndarray:
    """Upper triangle R of the QR decomposition of rows (N, n), below those of an earlier R where one is given.

    It is taken in blocks of rows, so that no second matrix of their size is needed.
    """
    root = np.zeros((0, rows.shape[1])) if root is None else root
    for first in range(0, len(rows), QR_BLOCK_ROWS):
        root = np.asarray(np.linalg.qr(np.vstack([root, rows[first : first + QR_BLOCK_ROWS]]), mode="r"))
    return root
