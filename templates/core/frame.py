"""Names that the functions beside this file take from the module in which their text stands: its model's layout and kernels.

A generated module has its own of all these: decorators and numbers from ``constants.py.j2``, functions from the other
templates. Here they say which names there are and of which kind, for readers, linter and type checker. The numbers are
those of a machine with one coordinate and two sensors, which neither rubs, lags nor remembers.
"""

from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numba import njit

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """A function that Python may call too."""
    return cast(Function, njit(function))


internal = compiled  # for compiled callers only
inlined = compiled  # the same, in the text of its callers

NQ, NX, NY, NP = 1, 2, 2, 3  # coordinates; these and their rates; outputs; parameters
NA, NV, NS = 1, 2, 2  # moving coordinates; variables; these and a lagging input
NR = 2  # variables that readings depend on
RATES = (1,)
FITTED, LINEAR = 3, ("X1", "X2", "X3")
DELAY, LAG, SENSOR_DELAY, ORIGIN = -1, -1, -1, -1
DOUBLINGS, BISECTIONS = 20, 40
EVENT_TIMES = np.zeros(0, dtype=np.int64)
DELAYED = (False, False)
SURFACES, SLIP_MATRIX, IN_DRY_LAW = 0, np.zeros((0, NA)), np.zeros(NP, dtype=np.bool_)
RATE, BEFORE, FORCE, UPPER, LOWER, DIRECTION = range(6)
AT_REST, LAG_MEMORY, SERIES_RANGE, ROUNDING = 1e-9, 40.0, 0.125, 6755399441055744.0
FIRST_SAMPLE = np.int64(0)
RARE, ALIKE, KNOWN_SLIP, MIN_PART, REST_ATTEMPTS, REST_MARGIN, CERTAIN_SIGMAS = 1e-4, 0.1, 1e-4, 1e-3, 3, 4.0, 8.5
WEIGHT, VOLUME = 0, 1
TRIAL, FACTOR, FLOOR = np.int64(-3), np.int64(-2), np.int64(-1)
BY_VARIABLE, PUSH, ON_SLIP = range(3)

LANES, HYSTERESES, DERIVATIVE_ROWS = 8, 0, 1
MEMORY, EXCESS = 6, 96

SIGNALS, FEATURES = 3, 3
DERIVATIVES, HELD_INPUT, UNMEASURED = np.array([2, 1, 0]), np.array([False] * 3), np.array([1])
Z1, Z2, OLD, NEW, STATE = range(5)
MIXING = np.zeros((NQ, FEATURES + 1, FEATURES))
BLOCK_SIZE, PARTIAL_SUMS, INTERVAL_TOLERANCE = 64, 16, 1e-6
FREE_DECAY, FEATURE = 864, 1056

BATCH_SIZE, STATE_ROW, INTEGRAL, GAINS, BATCH_ROWS = 64, 0, 7, 8, 16


def _driven(t: float, voltage: float, parameters: np.ndarray) -> float:
    raise NotImplementedError


def _first_row(t: float, state: np.ndarray, voltage: float, parameters: np.ndarray) -> float:
    raise NotImplementedError


def _drive_jacobian(t: float, voltage: float, parameters: np.ndarray, by_parameter: np.ndarray) -> None:
    raise NotImplementedError


def _acting(t: float, h: float, state: np.ndarray, voltage: float, parameters: np.ndarray) -> float:
    raise NotImplementedError


def _rate(t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, dry: np.ndarray) -> None:
    raise NotImplementedError


def _runge_kutta(
    t: float,
    h: float,
    state: np.ndarray,
    voltage: float,
    parameters: np.ndarray,
    new_state: np.ndarray,
    dry: np.ndarray,
    smooth: bool,
    linearise: bool,
    stages: np.ndarray,
    by_parameter: np.ndarray,
) -> None:
    raise NotImplementedError


def _friction_limits(t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, dry: np.ndarray) -> None:
    raise NotImplementedError


def _is_frictionless(parameters: np.ndarray) -> bool:
    raise NotImplementedError


def _stick_and_slip(
    t: float,
    h: float,
    state: np.ndarray,
    sens: np.ndarray,
    voltage: float,
    parameters: np.ndarray,
    columns: np.ndarray,
    new_state: np.ndarray,
    stages: np.ndarray,
    by_parameter: np.ndarray,
    lanes: np.ndarray,
    dry: np.ndarray,
) -> None:
    raise NotImplementedError


def read_sensors(t: float, state: np.ndarray, parameters: np.ndarray, output: np.ndarray) -> None:
    """Readings of the sensors."""
    raise NotImplementedError


def _sensor_jacobian(
    t: float, state: np.ndarray, parameters: np.ndarray, by_state: np.ndarray, by_parameter: np.ndarray
) -> None:
    raise NotImplementedError


def _state_derivative(
    t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, dry: np.ndarray, slope: np.ndarray
) -> None:
    raise NotImplementedError


def _slopes(
    t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, dry: np.ndarray, slope: np.ndarray
) -> None:
    raise NotImplementedError


def simulate(
    t: np.ndarray, voltage: np.ndarray, state: np.ndarray, parameters: np.ndarray, max_step: float
) -> np.ndarray:
    """States at the samples."""
    raise NotImplementedError


def shoot(t, voltage, measured, weight, bounds, states, parameters, columns, window, max_step, gram, residual) -> None:
    """Least-squares problem of all segments."""
    raise NotImplementedError


def _signals_at(t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, signal: np.ndarray) -> None:
    raise NotImplementedError


def _signal_rates(t: float, state: np.ndarray, voltage: float, parameters: np.ndarray, speed: np.ndarray) -> None:
    raise NotImplementedError


def _assemble(signal: np.ndarray, tau: np.ndarray, phi: np.ndarray) -> None:
    raise NotImplementedError


def _filter_block(k, h, t, states, voltage, parameters, weights, first_order_hold, memory, lanes, products) -> None:
    raise NotImplementedError


def _control(t: float, h: float, reference: float, reference_rate: float, lanes: np.ndarray) -> None:
    raise NotImplementedError


def _batch_step(t: float, h: float, lanes: np.ndarray) -> None:
    raise NotImplementedError
