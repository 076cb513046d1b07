"""The generated module of a model as the runtime uses it: its constants and its compiled functions.

Sizes: N samples, S segments, n = len(LINEAR), k columns of parameters; NX, NY, NP, NQ, NA and NV are the module's own.
Arrays are of float64 where nothing else is said. docs/kernels.md explains every argument.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

KERNEL_MODULE_PREFIX = "wheelpend_kernels_"  # of the names of generated modules that the tool loads

Weights = tuple[float, ...]
Array = np.ndarray
Times = np.ndarray  # (N,) s, strictly increasing
Signal = np.ndarray  # (N,)
Inputs = np.ndarray  # (N,) of one input, (N, inputs) of several; at one moment (inputs,)
Readings = np.ndarray  # (N, NY), NaN where there is none
State = np.ndarray  # (NX,)
States = np.ndarray  # (N, NX), or (S, NX) at the beginnings of segments
Vector = np.ndarray  # (NP,) values of PARAMETERS
Indices = np.ndarray  # int64, indices into PARAMETERS
Bounds = np.ndarray  # (S, 2) int64, half-open sample ranges


class ModelConstants(Protocol):
    """Names, sizes and relations of a model."""

    __name__: str
    __file__: str | None

    # -- sizes
    NQ: int  # coordinates
    NX: int  # states: coordinates, then their rates
    NY: int  # readings
    NP: int  # parameters
    NA: int  # moving coordinates: those of the plant, then released internal ones
    NV: int  # variables: the states, then added states

    # -- motion and sensors
    STATES: tuple[str, ...]  # (NX,)
    VARIABLES: tuple[str, ...]  # (NV,)
    OUTPUTS: tuple[str, ...]  # (NY,)
    ROWS: tuple[str, ...]  # (NQ,) equations of motion
    RATES: tuple[int, ...]  # (NA,) where the rate of each moving coordinate stands among VARIABLES
    INPUTS: tuple[str, ...]  # columns of the inputs
    INPUT: str  # the first of them, or ""
    PORTS: Mapping[str, Weights]  # each port's coordinate as weights (NQ,) on the coordinates
    CONTROLLED: tuple[int, int]  # readings that the controller sees: a value and its rate, -1 for none
    OUTPUT_MATRIX: np.ndarray  # (NY, NX): readings = OUTPUT_MATRIX · state while no effect acts on the sensors
    RANGE_OUTPUT: int  # index of the reading that must stay within ±π/2, or -1
    UNMEASURED: np.ndarray  # int64, indices of the rates that no sensor reads

    # -- parameters
    PARAMETERS: tuple[str, ...]  # (NP,)
    UNITS: tuple[str, ...]  # (NP,)
    ABSENT: tuple[float, ...]  # (NP,) value of each while its effect is absent
    OWN_PARAMETERS: int  # so many of PARAMETERS, from the first, are the plant's own
    FITTED: int  # so many, from the first, have sensitivities
    LINEAR: tuple[str, ...]  # (n,) parameters of the regressor
    SIGNED: tuple[str, ...]  # own parameters that may be negative
    MISSING_FORCES: tuple[str, ...]  # unknown forces, one for each row, where there are any
    LAG: int  # index of the time constant of the input's lag, or -1
    DELAY: int  # index of the input's delay, or -1
    SENSOR_DELAY: int  # index of the delay of sensors, or -1
    DELAYED: tuple[bool, ...]  # (NY,) True for each reading that it acts on
    ORIGIN: int  # index of the first coordinate's value at the log's first sample, or -1
    NEEDS: Mapping[str, tuple[str, ...]]  # by parameter: constants without which it has no meaning

    # -- effects
    ABSORBED: Mapping[str, Mapping[str, float]]  # by parameter: own parameters that it is part of, with weights
    TWINS: Mapping[str, tuple[str, ...]]  # by effect: effects that change every log in the same way
    CONTAINS: Mapping[str, Mapping[str, tuple[Weights, ...]]]  # by effect: effects within it, with weights
    CARRYING: tuple[str, ...]  # effects with states that carry over from one segment to the next
    SURFACES: int  # with dry friction
    HYSTERESES: int  # forces with a memory
    HYSTERESIS_SIZES: tuple[int, ...]  # indices of parameters; no force has a memory where these are zero
    INTERNAL: tuple[str, ...]  # parameters of the forces along internal coordinates
    STIFFEST: Mapping[str, float]  # largest values of parameters that are infinite where a coordinate is rigid


class SimulationKernels(Protocol):
    """Simulation, and the linearised shooting problem. Functions take their arguments by position."""

    acceleration: Callable[[float, State, float | Inputs, Vector], Array]
    """t, state, voltage, parameters → accelerations (NQ,); (NA,) where added states (NV,) are given too"""

    acting_voltage: Callable[[Times, Inputs, Vector], Inputs]
    """t, voltage, parameters → the input (N,) that acts at each sample just before its command"""

    read_sensors: Callable[[float, State, Vector, Array], None]
    """t, state, parameters, readings (NY,), which are written"""

    simulate: Callable[[Times, Inputs, State, Vector, float], States]
    """t, voltage, state, parameters, max_step → states (N, NX)"""

    closed_loop: Callable[
        [Times, Signal, Signal, Array, State, Vector, Readings, Array, float], tuple[States, Readings, Inputs]
    ]
    """t, reference, its rate, gains (3,), state, parameters, noise, quantum (NY,), max_step → states, readings,
    input"""

    closed_loop_batch: Callable[[Times, Signal, Signal, Array, States, Array, float, int, Array], None]
    """t, reference, its rate, gains (B, 3), states (B, NX), which move on, parameters (B, NP), max_step, every, and
    record (ceil(N / every), NX + 1, B) of states and input, which is written"""

    sensitivities: Callable[[Times, Inputs, State, Vector, Indices, float], tuple[States, Readings, Array]]
    """t, voltage, state, parameters, columns (k,), max_step → states, readings, their derivatives (N, NY, NX + k)"""

    shoot: Callable[
        [Times, Inputs, Readings, Array, Bounds, States, Vector, Indices, Bounds, float, Array, Array], None
    ]
    """t, voltage, measured, weight (NY,), bounds, states (S, NX), parameters, columns (k,), window (k, 2), max_step;
    written: gram (S, NX + k + 1, NX + k + 1), residual (N, NY) or (0, NY)"""

    filter_error: Callable[
        [
            Times, Inputs, Readings, Array, Bounds, States, Array, Vector, Indices, Indices, Array, Array, Array, float,
            int, Array, Array, Array, Array, Array, Array, Array,
        ],
        int,
    ]  # fmt: skip
    """t, voltage, measured, weight (NY,), bounds, states (S, NX), spread (NS,), parameters, columns (k,), forces
    (rows,), mixing (rows, m), reads (NY, m), noise (m, 3), max_step, parts; written: gram (S, k + 1, k + 1),
    log_det (S,), innovation (N or 0, NY, 2), means (E, 2, NS + m), covariances (E, 2, NS + m, NS + m), transitions
    (E, NS + m, NS + m), samples (E,) → number of steps"""

    fit_initial_states: Callable[[Times, Inputs, Readings, Array, Bounds, States, Vector, float, int, bool], None]
    """t, voltage, measured, weight (NY,), bounds, states (S, NX), which are fitted one after the other, parameters,
    max_step, rounds, whether also from where the segment before ended"""


class RegressionKernels(Protocol):
    """The regressor, plain, as energies, and filtered. Functions take their arguments by position."""

    regressor: Callable[[float, State, Array, float | Inputs, Vector], tuple[Array, Array]]
    """t, state, accelerations (NQ,), voltage, parameters → left side (NQ,), regressor (NQ, n)"""

    regressor_parts: Callable[[float, State, float | Inputs, Vector], tuple[Array, Array, Array]]
    """t, state, voltage, parameters → φ2, φ1, φ0 (NQ, n) each, with φ = d²φ2/dt² + dφ1/dt + φ0"""

    energy_parts: Callable[[float, State, float | Inputs, Vector], tuple[Array, Array, float]]
    """t, state, voltage, parameters → energy stored (n,), power taken (n,), power supplied"""

    filter_regressor: Callable[[Times, States, Inputs, Vector, float, float, bool, State], tuple[Array, Array]]
    """t, states, voltage, parameters, tau1 [s], tau2 [s], first-order hold, state at the start → left sides (N, NQ),
    regressors (N, NQ, n)"""

    filter_onward: Callable[[Times, States, Inputs, Vector, float, float, bool, Array], tuple[Array, Array]]
    """the same of samples 1 to N - 1, from the filters' memory at sample 0, which moves on"""

    filtered_gram: Callable[[Times, States, Inputs, Vector, float, float, bool, Array, Array], None]
    """the same, added to the Gram matrix (n + 1, n + 1) of those rows"""

    filter_weights: Callable[[float, float, float], Array]
    """interval [s], tau1 [s], tau2 [s] → weights (9,) of an exact step of the filters"""

    filter_memory: Callable[[], Array]
    """zeroed memory of the filters"""

    filter_start: Callable[[float, State, float | Inputs, Vector, Array, Array], None]
    """t, state, voltage, parameters, weights, memory, which is set as at the first sample"""

    recursive_update: Callable[[Array, Array, Array, float, float], None]
    """estimate (n,) and covariance (n, n), which are updated, regressor row (n,), left side, forgetting"""

    recursive_identification: Callable[
        [Times, States, Inputs, Vector, float, float, bool, State, int, float, Array, Array, Array], float
    ]
    """t, states, voltage, parameters, tau1 [s], tau2 [s], first-order hold, start, first sample, forgetting, estimate
    (n,), covariance (n, n) and track (M, n), which are written → mean square of the innovations [V²]"""


class KernelModule(ModelConstants, SimulationKernels, RegressionKernels, Protocol):
    """A generated module."""
