"""Multiple shooting: the maximum-likelihood fit of a model to measured logs.

A log is cut into segments; each is simulated from its own initial state with the measured voltage. Gauss-Newton with
Levenberg-Marquardt damping moves parameters and initial states together; the states are eliminated segment by segment
(Schur complement), so that only the parameters' equations remain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from types import ModuleType

import numpy as np

import derive
from derive.effects import InnerForce, PathForce
from wheelpend.logs import Log, segment_bounds, side_by_side
from wheelpend.processes import company, threads
from wheelpend.reading import states_from

EVERYWHERE = np.iinfo(np.int64).max
FEW = 3  # rounds up to which initial states are only brought up to date, from one start


@dataclass(frozen=True)
class Part:
    """Segments of a log on which a model is fitted or judged."""

    log: Log
    sigma: np.ndarray  # (channels,)
    bounds: np.ndarray  # (segments, 2) half-open sample ranges
    weights: np.ndarray | None = None  # (segments,) how much the squares of each count; all alike without

    @property
    def values(self) -> int:
        """Number of measured values in the segments."""
        return int(sum(np.isfinite(self.log.measured[a:b]).sum() for a, b in self.bounds))


@dataclass(frozen=True)
class Shot:
    """A least-squares problem, linearised at a point."""

    gram: np.ndarray  # (segments, n + 1, n + 1), [J r]ᵀ[J r], states first, residual last
    residual: np.ndarray  # (N, channels) in units of σ, NaN outside the segments; (0, channels) where it is not kept

    @property
    def cost(self) -> float:
        """Sum of squared residuals; infinite where the simulation left the finite numbers."""
        total = float(self.gram[:, -1, -1].sum())
        return total if np.isfinite(total) else np.inf


@dataclass(frozen=True)
class Fit:
    """A fitted model."""

    values: dict[str, float]  # shared parameters
    per_log: tuple[dict[str, float], ...]  # parameters of each log alone
    free: tuple[str, ...]  # names of the fitted parameters, per-log ones as name@log
    covariance: np.ndarray  # (free, free) from the information matrix
    robust: np.ndarray  # (free, free) from the scatter of blocks of segments
    states: tuple[np.ndarray, ...]  # (segments, NX) each log
    cost: float
    count: int  # measured values
    condition: float  # of the scaled information matrix
    unidentifiable: tuple[str, ...]
    converged: bool
    blocks: int = 0  # whose scatter robust tells
    coloured: bool = False  # whether the residual is correlated from sample to sample

    @property
    def error(self) -> float:
        """Root mean square of the residual in units of σ, the fitted states discounted."""
        states = sum(s.size for s in self.states)
        return float(np.sqrt(self.cost / max(self.count - states, 1)))

    def sigma(self, name: str, robust: bool = False, log: int = 0) -> float:
        """Standard error of a parameter; of a per-log parameter that of one log."""
        key = name if name in self.free else f"{name}@{log}"
        matrix = self.robust if robust else self.covariance
        return float(np.sqrt(max(matrix[self.free.index(key), self.free.index(key)], 0.0)))

    @property
    def names(self) -> list[str]:
        """Names of the fitted parameters, per-log ones once."""
        return list(dict.fromkeys(label.split("@")[0] for label in self.free))

    def of_log(self, number: int) -> dict[str, float]:
        """All parameter values of one log."""
        return {**self.values, **(self.per_log[number] if number < len(self.per_log) else {})}


def vector(module: ModuleType, values: Mapping[str, float], log: Log) -> np.ndarray:
    """The parameter vector of a module: named values, the log's origin, and where none is given that of absence.

    A constant that is not known is 1; what needs it has no influence while its own parameter is zero.
    """
    pairs = zip(module.PARAMETERS, module.ABSENT, strict=True)
    parameters = np.array([float(values.get(n, absent)) for n, absent in pairs])
    if module.ORIGIN >= 0:
        first = log.measured[np.isfinite(log.measured[:, 0]), 0]
        parameters[module.ORIGIN] = first[0] if first.size else 0.0
    return parameters


def shoot(
    module: ModuleType,
    part: Part,
    states: np.ndarray,
    parameters: np.ndarray,
    columns: Sequence[int] = (),
    window: np.ndarray | None = None,
    max_step: float = 0.002,
    keep: bool = True,
) -> Shot:
    """Simulate a part's segments and linearise the residual in the states and the parameters of columns.

    Without ``keep`` the residual is not stored, only its squares: a long log needs no memory beyond its own.
    """
    chosen = np.array(columns, dtype=np.int64)
    if window is None:
        window = np.tile(np.array([0, EVERYWHERE], dtype=np.int64), (chosen.size, 1))
    size = module.NX + chosen.size + 1
    gram = np.zeros((len(part.bounds), size, size))
    residual = np.full(part.log.measured.shape if keep else (0, module.NY), np.nan)
    log, weight = part.log, 1.0 / part.sigma

    def some(a: int, b: int) -> None:
        """Segments a to b; those of another thread are others, and so are their samples."""
        module.shoot(
            log.t, log.voltage, log.measured, weight, part.bounds[a:b], states[a:b], parameters,
            chosen, window, max_step, gram[a:b], residual,
        )  # fmt: skip

    count, workers = len(part.bounds), _workers(module, part, parameters)
    edges = [count * k // workers for k in range(workers + 1)]
    try:
        if workers == 1:
            some(0, count)
        else:
            list(_pool().map(some, edges[:-1], edges[1:]))
    except ZeroDivisionError:  # a machine without inertia, at the bounds of its parameters, cannot be simulated
        gram[:] = np.nan
    if part.weights is not None:
        gram *= part.weights[:, None, None]
    return Shot(gram, residual)


def _workers(module: ModuleType, part: Part, parameters: np.ndarray) -> int:
    """Threads among which segments are shared: one where they hang together, or are few."""
    return 1 if len(part.bounds) < 8 or carries_on(module, parameters) else company.share()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=threads())


def initial_states(module: ModuleType, part: Part) -> np.ndarray:
    """First guess of the segments' initial states (segments, NX), from the measured channels alone.

    Angles and rates come from short parabolas through what follows, or what the points allow.
    """
    log, first = part.log, part.bounds[:, :1]
    places = first + np.arange(max(6, round(0.03 / log.dt)))
    beyond = places >= part.bounds[:, 1:]
    places = np.minimum(places, len(log) - 1)
    t, measured = log.t[places] - log.t[first], np.where(beyond[:, :, None], np.nan, log.measured[places])
    curves = np.stack([polynomials(t, measured[:, :, c]) for c in range(module.NY)], axis=2)
    return states_from(module, curves[:, 0], curves[:, 1])


def polynomials(t: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """Value and slope at time 0 (segments, 2) of least-squares parabolas through signals (segments, samples) at t.

    Through two points goes a line, through one a constant; NaN where there is none.
    """
    good = np.isfinite(signals)
    scale = np.maximum(np.max(np.where(good, t, 0.0), axis=1), 1e-9)
    count = good.sum(axis=1)
    powers = (t / scale[:, None])[:, :, None] ** np.arange(3) * (
        good[:, :, None] & (np.arange(3) < count[:, None, None])
    )
    normal = np.einsum("sij,sik->sjk", powers, powers)
    right = np.einsum("sij,si->sj", powers, np.where(good, signals, 0.0))
    fitted = np.einsum("sjk,sk->sj", np.linalg.pinv(normal, hermitian=True), right)[:, :2]
    return np.where(count[:, None] > 0, fitted / np.column_stack([np.ones_like(scale), scale]), np.nan)


@np.errstate(over="ignore", invalid="ignore")  # a segment that runs away gives infinities, and is not kept
def fit_states(
    module: ModuleType,
    part: Part,
    states: np.ndarray,
    parameters: np.ndarray,
    max_step: float = 0.002,
    rounds: int = 8,
    keep: bool = True,
) -> tuple[np.ndarray, Shot]:
    """Fit only the initial states; every segment has its own damping and keeps its best."""
    if carries_on(module, parameters):
        states = in_turn(module, part, states, parameters, max_step, rounds)
        return states, shoot(module, part, states, parameters, max_step=max_step, keep=keep)
    states = states.copy()
    shot = shoot(module, part, states, parameters, max_step=max_step, keep=keep)
    damping = np.full(len(states), 1e-4)
    for _ in range(rounds):
        step = solve_damped(shot.gram[:, :-1, :-1], shot.gram[:, :-1, -1:], damping)[:, :, 0]
        trial = shoot(module, part, states + step, parameters, max_step=max_step, keep=keep)
        old, new = (np.nan_to_num(x.gram[:, -1, -1], nan=np.inf) for x in (shot, trial))
        better = new < old
        gain = np.where(better & np.isfinite(old), old - new, 0.0)
        states[better] += step[better]
        damping = np.where(better, damping * 0.1, damping * 10.0)
        shot = _merge(shot, trial, part, better)
        if np.all(gain <= 1e-4 * (1.0 + np.where(np.isfinite(old), old, 0.0)) / 10.0):
            break
    return states, shot


def in_turn(
    module: ModuleType, part: Part, states: np.ndarray, parameters: np.ndarray, max_step: float, rounds: int
) -> np.ndarray:
    """Initial states of segments each of which begins with what the one before hands on, fitted one after the other."""
    log, found = part.log, states.copy()
    try:
        module.settle(
            log.t, log.voltage, log.measured, 1.0 / part.sigma, part.bounds, found, parameters, max_step, rounds,
            rounds > FEW,  # then also from where the one before ended, which no missed contact has led astray
        )  # fmt: skip
    except ZeroDivisionError:  # as in shoot
        return states
    return found


def carries_on(module: ModuleType, parameters: np.ndarray) -> bool:
    """Whether a segment depends on the one before: something moves inside the machine, or has a memory."""
    remembering = [e.full_names[0] for e in derive.effects.LIBRARY.values() if isinstance(e.enters, PathForce)]
    there = [module.PARAMETERS.index(n) for n in remembering if n in module.PARAMETERS]
    return module.NA > module.NQ or bool(np.any(parameters[there] != 0.0))


def _merge(old: Shot, new: Shot, part: Part, better: np.ndarray) -> Shot:
    gram, residual = old.gram.copy(), old.residual.copy()
    gram[better] = new.gram[better]
    for a, b in part.bounds[better] if len(residual) else ():
        residual[a:b] = new.residual[a:b]
    return Shot(gram, residual)


def solve_damped(normal: np.ndarray, right: np.ndarray, damping: np.ndarray | float) -> np.ndarray:
    """Solve every segment's normal equations (segments, n, n), scaled to a unit diagonal and damped.

    right is (segments, n, k). A segment that is not finite does not move.
    """
    finite = np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    normal = np.where(finite[:, None, None], normal, np.eye(normal.shape[1]))
    right = np.where(finite[:, None, None], right, 0.0)
    scale = np.sqrt(np.einsum("sii->si", normal)) + 1e-300
    scaled = normal / scale[:, :, None] / scale[:, None, :]
    scaled += (1e-10 + np.broadcast_to(damping, (len(normal),)))[:, None, None] * np.eye(normal.shape[1])
    return np.linalg.solve(scaled, right / scale[:, :, None]) / scale[:, :, None]


def prediction_error(
    module: ModuleType, part: Part, values: Mapping[str, float], max_step: float = 0.002, lead: int = 0
) -> tuple[float, np.ndarray]:
    """The error of a model on a part: only the initial states are fitted. Also returns the residual (N, channels).

    What carries on from segment to segment is followed through ``lead`` segments before the first.
    """
    longer, before = led_in(part, lead)
    states = initial_states(module, longer)
    states, shot = fit_states(module, longer, states, vector(module, values, part.log), max_step)
    residual = shot.residual.copy()
    residual[: part.bounds[0, 0]] = np.nan
    return part_error(part, Shot(shot.gram[before:], residual)), residual


def led_in(part: Part, lead: int) -> tuple[Part, int]:
    """A part with up to ``lead`` segments before its first, as many as the log has, and how many they are."""
    first, length = int(part.bounds[0, 0]), int(part.bounds[0, 1] - part.bounds[0, 0])
    if not (lead and first):
        return part, 0
    horizon = float(part.log.t[first + length - 1] - part.log.t[first]) + part.log.dt
    before = segment_bounds(part.log, horizon, max(first - lead * length, 0), first)
    return replace(part, bounds=np.vstack([*before, part.bounds])), len(before)


def part_error(part: Part, shot: Shot) -> float:
    """Root mean square of a shot's residual in units of σ, the fitted states discounted."""
    states = len(part.bounds) * (shot.gram.shape[1] - 1)
    return float(np.sqrt(shot.cost / max(part.values - states, 1)))


def stable_step(module: ModuleType, values: Mapping[str, float], log: Log) -> float:
    """A step that the integrator resolves the model's fastest motion with [s]; of effects what moves inside counts."""
    inside = {e.name for e in derive.effects.LIBRARY.values() if isinstance(e.enters, InnerForce)}
    kept = {n: v for n, v in values.items() if "." not in n or n.partition(".")[0] in inside}
    parameters, rates = vector(module, kept, log), np.array(module.RATES)
    angles = np.array([module.VARIABLES.index(module.VARIABLES[r].removeprefix("d")) for r in rates])
    order = np.concatenate([angles, rates])
    still, size = np.zeros(module.NV), len(rates)
    still[rates] = 1e-6
    nothing = side_by_side([np.zeros(1)] * len(module.INPUTS), 1)[0]
    base = module.acceleration(0.0, still, nothing, parameters)
    matrix = np.zeros((2 * size, 2 * size))
    matrix[:size, size:] = np.eye(size)
    for k, place in enumerate(order):
        moved = still.copy()
        moved[place] += 1e-3
        matrix[size:, k] = (module.acceleration(0.0, moved, nothing, parameters) - base) / 1e-3
    fastest = float(np.max(np.abs(np.linalg.eigvals(matrix)))) if np.all(np.isfinite(matrix)) else 100.0
    return float(np.clip(0.25 / max(fastest, 1e-9), 1e-4, 0.01))
