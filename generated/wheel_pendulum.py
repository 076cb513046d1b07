# Made by wheelpend from model.toml with sympy 1.14.0; do not edit, run `wheelpend generate`.
# plant wheel_pendulum; assumptions planar=True, ground_friction_reaction=body, ground_friction=True, rotor_inertia=True, rotor_speed=body, gear_ratio_in_back_emf=once, motor_circuit=static, encoder=absolute; effects none
"""Kernels of the model `wheel_pendulum`.

wheel row: 0 =
    - v_in
    + X1*ddtheta_w
    + X2*ddtheta_w
    + X6*dtheta_w
    - X2*ddtheta_p
    - X7*dtheta_p
    + X3*ddtheta_p*cos(theta_p)
    - X3*dtheta_p**2*sin(theta_p)
body row: 0 =
    + v_in
    + X2*ddtheta_p
    + X4*ddtheta_p
    + X7*dtheta_p
    - X2*ddtheta_w
    - X5*sin(theta_p)
    - X6*dtheta_w
    + X3*ddtheta_w*cos(theta_p)

States theta_w, theta_p, dtheta_w, dtheta_p; voltage is what was commanded, held between samples; parameters as in PARAMETERS.
Angles in rad, times in s from the log's first sample, voltages in V. Every function is compiled by Numba and may be
called from compiled code.
"""

import math

import numpy as np
from numba import njit

STATES = ('theta_w', 'theta_p', 'dtheta_w', 'dtheta_p')
VARIABLES = ('theta_w', 'theta_p', 'dtheta_w', 'dtheta_p')  # the states, then what effects add to them
OUTPUTS = ('theta_w', 'theta_p', 'dtheta_p')
ROWS = ('wheel', 'body')
PARAMETERS = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7')
UNITS = ('V s²/rad', 'V s²/rad', 'V s²/rad', 'V s²/rad', 'V', 'V s/rad', 'V s/rad')
ABSENT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,)  # value of each parameter while its effect is absent; 1 for a constant
ABSORBED = {}  # effects that are part of the plant's own parameters, with weights on these
TWINS = {}  # effects that change every log in the same way
CONTAINS = {}  # effects within others: parameters of the larger by those of the smaller
NEEDS = {}  # constants without which a parameter has no meaning
LINEAR = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7')  # parameters of the regressor, in the order of its columns
SIGNED = ()  # own parameters that may be negative: differences of physical constants
FITTED = 7  # so many of PARAMETERS, from the first, have sensitivities
DELAY = -1  # index of the input delay among PARAMETERS, or -1
LAG = -1  # index of the time constant of the input's lag, or -1
ORIGIN = -1  # index of the first coordinate's value at the log's first sample, or -1
NQ, NX, NY, NP = 2, 4, 3, 7
NA, NV = 2, 4  # moving coordinates; variables: the states, then what effects add to them
NS = NV + (LAG >= 0)  # a lagging input is the last
RATES = (2, 3)  # where the rate of each moving coordinate stands among the variables
LATE = (False, False, False,)  # whether each output is that of an earlier time
SENSOR_DELAY = -1  # index of that delay among PARAMETERS, or -1
DRY = 0  # surfaces with dry friction
SLIPS = np.array(np.zeros((0, 2)), dtype=np.float64)  # slip speeds as weights on the rates
RATE, BEFORE, FORCE, UPPER, LOWER, DIRECTION = range(6)  # rows of the scratch array of dry friction
LANES = 8  # sensitivity columns that are advanced side by side
REMEMBERED = 0  # forces with a memory
GIVEN = NA + REMEMBERED  # rows of the derivatives in the parameters
START, STAGE, END, OWN, DRIVEN, EXCESS = (LANES * row for row in (0, NS, 2 * NS, 3 * NS, 3 * NS + 5 * GIVEN, 3 * NS + 5 * GIVEN + 1))
MOBILITY, SHARE = NA * NS, NA * NS + NA * NA  # where the coefficients of a stage begin
MEMORY, DRIVE = SHARE + 3, 4  # where those of forces with a memory begin; the stage of the driven input's
FIRST = np.int64(0)  # sample; for a literal 0 numba would compile functions once more
CONTROLLED = (1, 2)  # outputs that the controller sees: a value and its rate, -1 for what no sensor reads
READS = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])  # what each output reads of the states while no effect touches the sensors
FALLS = 1  # output that must stay within ±π/2, or -1
PORTS = {'drive': (1.0, -1.0), 'axle': (1.0, -1.0), 'ground': (1.0, 0.0), 'body': (0.0, 1.0), 'outside': (1.0, 0.0)}  # each port's coordinate as weights on the coordinates
INPUTS = ('v_in',)  # columns of the inputs; a machine that swings freely has none
INPUT = "v_in"  # the first of them, or nothing
AT_REST = 1e-9  # slip speed below which a surface may stick [rad/s]
LAG_MEMORY = 40.0  # time constants after which an old command is forgotten
EVENTS = 16  # stick-slip events handled within one step
options = {"cache": True, "nogil": True, "fastmath": {"contract"}, "error_model": "numpy", "no_cfunc_wrapper": True}
compiled = njit(**options)
internal = njit(**options, no_cpython_wrapper=True)  # for compiled callers only, which saves compiling the way in from Python
inlined = njit(**options, no_cpython_wrapper=True, forceinline=True)  # passes scalars in registers


@inlined
def _sign(x):
    """−1.0, 0.0 or 1.0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@inlined
def _step(x):
    """1.0 where x is positive, else 0.0."""
    return 1.0 if x > 0.0 else 0.0


@inlined
def _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters):
    """Accelerations without dry friction, then the inverse mass matrix (NQ, NQ) row by row.

    42 operations.
    """
    X1 = parameters[0]
    X2 = parameters[1]
    X3 = parameters[2]
    X4 = parameters[3]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    c0 = X6*dtheta_w
    c1 = math.sin(theta_p)
    c2 = X7*dtheta_p
    c3 = -X5*c1 - c0 + c2 + v_in
    c4 = math.cos(theta_p)
    c5 = X3*c4
    c6 = 1/(X1*X2 + X1*X4 + X2*X4 + 2*X2*c5 - (X3*X3)*(c4*c4))
    c7 = c6*(X2 - c5)
    c8 = -X3*c1*(dtheta_p*dtheta_p) + c0 - c2 - v_in
    c9 = c6*(X2 + X4)
    c10 = c6*(X1 + X2)
    ddtheta_w = -c3*c7 - c8*c9
    ddtheta_p = -c10*c3 - c7*c8
    mobility_0_0 = c9
    mobility_0_1 = c7
    mobility_1_0 = c7
    mobility_1_1 = c10

    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@inlined
def _residual_jacobian(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, ddtheta_w, ddtheta_p, parameters, stage, by_parameter):
    """Derivatives of inertia − force at given accelerations: in the states, returned row by row, and in the parameters.

    The latter go into by_parameter[stage], where zero entries are not touched.
    27 operations.
    """
    X3 = parameters[2]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    c0 = math.sin(theta_p)
    c1 = X3*c0
    c2 = math.cos(theta_p)
    c3 = (dtheta_p*dtheta_p)
    c4 = ddtheta_p - ddtheta_w
    by_0_0 = 0
    by_0_1 = -X3*c2*c3 - c1*ddtheta_p
    by_0_2 = X6
    by_0_3 = -X7 - 2*c1*dtheta_p
    by_1_0 = 0
    by_1_1 = -X5*c2 - c1*ddtheta_w
    by_1_2 = -X6
    by_1_3 = X7
    by_parameter[stage, 0, 0] = ddtheta_w
    by_parameter[stage, 0, 1] = -c4
    by_parameter[stage, 0, 2] = -c0*c3 + c2*ddtheta_p
    by_parameter[stage, 0, 5] = dtheta_w
    by_parameter[stage, 0, 6] = -dtheta_p
    by_parameter[stage, 1, 1] = c4
    by_parameter[stage, 1, 2] = c2*ddtheta_w
    by_parameter[stage, 1, 3] = ddtheta_p
    by_parameter[stage, 1, 4] = -c0
    by_parameter[stage, 1, 5] = -dtheta_w
    by_parameter[stage, 1, 6] = dtheta_p

    return by_0_0, by_0_1, by_0_2, by_0_3, by_1_0, by_1_1, by_1_2, by_1_3


@compiled
def read_sensors(t, state, parameters, output):
    """What the sensors read in this state, into output (NY,)."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    output[0] = theta_w
    output[1] = theta_p
    output[2] = dtheta_p


@inlined
def _sensor_jacobian(t, state, parameters, by_state, by_parameter):
    """Derivatives of the readings into (NY, NX) and (NY, NP); zero entries are not touched."""
    by_state[0, 0] = 1
    by_state[1, 1] = 1
    by_state[2, 3] = 1


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NA):
        speed += SLIPS[surface, k] * state[RATES[k]]
    return speed


@inlined
def _accelerate(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters):
    """Accelerations with dry friction, mobility, and the forces on the surfaces.

    Directions −1 and +1 slip that way, at 0 a surface sticks: the force there cancels the slip acceleration, and the
    mobility is that of a machine that cannot move in this direction.
    """
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters)
    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@internal
def _rate(t, state, voltage, parameters, dry):
    """Accelerations under the directions dry[DIRECTION], into dry[RATE], and the forces on the surfaces, into dry[FORCE]."""
    (
        dry[RATE, 0], dry[RATE, 1], mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1,
    ) = _accelerate(
        t, state[0], state[1], state[2], state[3], voltage, _frozen(parameters)
    )  # fmt: skip


@inlined
def _keep(dry):
    """Keep the accelerations dry[RATE] in dry[BEFORE]."""
    for k in range(NA):
        dry[BEFORE, k] = dry[RATE, k]


@inlined
def _frozen(parameters):
    """The parameters as a tuple, which no store can change: what follows from them alone is computed once a step."""
    return parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5], parameters[6],


@inlined
def _smooth(parameters):
    """Whether no surface has friction."""
    return True


@inlined
def _follow(state, dry):
    """Let every surface slip the way it moves, into dry[DIRECTION]."""
    for i in range(DRY):
        dry[DIRECTION, i] = 1.0 if _slip(state, i) >= 0.0 else -1.0


@internal
def _settle(t, state, voltage, parameters, dry):
    """Decide which surfaces slip and which stick, into dry[DIRECTION], with the limits of each in dry[UPPER] and dry[LOWER].

    A surface at rest sticks while the force that holds it lies between its limits. One without friction never sticks.
    """
    _follow(state, dry)
    stuck = False
    for i in range(DRY):
        if dry[UPPER, i] > dry[LOWER, i] and abs(_slip(state, i)) <= AT_REST:
            dry[DIRECTION, i] = 0.0
            stuck = True
    for _ in range(DRY + 1):
        if not stuck:
            return
        stuck = False
        _rate(t, state, voltage, parameters, dry)
        for i in range(DRY):
            if dry[DIRECTION, i] == 0.0 and dry[FORCE, i] > dry[UPPER, i]:
                dry[DIRECTION, i] = 1.0
                stuck = True
            elif dry[DIRECTION, i] == 0.0 and dry[FORCE, i] < dry[LOWER, i]:
                dry[DIRECTION, i] = -1.0
                stuck = True


@inlined
def _driven(t, v_in, parameters):
    """What the actuator makes of a command, before it lags."""
    driven = v_in

    return driven


@inlined
def _drive_jacobian(t, v_in, parameters, by_parameter):
    """Derivatives of the driven input into (NP,); zero entries are not touched."""


@internal
def _lag(h, time_constant):
    """What exp(−s/T), the share of an old input that still acts, amounts to over h.

    Returns begin and slope of the straight line in s that has its integral and its first moment, its value at h, and the
    derivatives of the three in T. The line serves the integrator, which a T far below h would leave unstable, and at
    T = 0 it has the derivatives of a pure delay.
    """
    if time_constant <= 0.0:
        return 0.0, 0.0, 0.0, 4.0 / h, -6.0 / (h * h), 0.0
    x = h / time_constant
    end = math.exp(-x)
    if x < 1e-3:  # the closed form cancels
        return (
            1.0 - x * x / 12.0, (0.5 * x * x - x) / h, end,
            x * x / (6.0 * time_constant), (x - x * x) / (h * time_constant), end * x / time_constant,
        )  # fmt: skip
    area, moment = time_constant * (1.0 - end), time_constant * (h - time_constant * (1.0 - end))
    area_by, moment_by = 1.0 - end - x * end, h - 2.0 * time_constant * (1.0 - end) + h * end
    slope, slope_by = 12.0 * (0.5 * area * h - moment) / h**3, 12.0 * (0.5 * area_by * h - moment_by) / h**3
    return area / h - 0.5 * slope * h, slope, end, area_by / h - 0.5 * slope_by * h, slope_by, end * x / time_constant


@inlined
def _lagged(share, share_by, old, excess, driven_by):
    """Sensitivity of driven + share · excess, where old is that of the old input; excess is 0 but for the lag's column."""
    return share * old + (1.0 - share) * driven_by + share_by * excess


@inlined
def _acting(t, h, state, voltage, parameters):
    """The input that acts in the mean over the next h."""
    return voltage


@internal
def _begin(when, t, voltage, acting, start, parameters, columns, state, sens):
    """State (NS,) and sensitivities (NS, n) at a time when command ``acting`` acts, from coordinates and rates (NX,).

    What effects add stays as it is, or is given after those, and does not depend on them. A lagging input follows from the commands before; the first command of a log, or the first after missing ones, counts
    as one that has acted for long.
    """
    for i in range(start.size):
        state[i] = start[i]
    for i in range(NV):
        for c in range(sens.shape[1] if i < NX else min(NX, sens.shape[1])):
            sens[i, c] = 1.0 if c == i else 0.0


@compiled
def acting_voltage(t, voltage, parameters):
    """The input (N,) that acts at each sample just before its command: the commanded one unless the input lags."""
    return voltage.copy()


@internal
def _runge_kutta(t, h, state, v_in, parameters, new_state, dry, linearise, stages, by_parameter):
    """One step of the classical fourth-order method for the state (NS,), also in place.

    The surfaces slip as dry[DIRECTION] says. Where asked to, it linearises the four stages for _propagate.
    """
    theta_w = theta_w_new = theta_w_old = state[0]
    theta_p = theta_p_new = theta_p_old = state[1]
    dtheta_w = dtheta_w_new = dtheta_w_old = state[2]
    dtheta_p = dtheta_p_new = dtheta_p_old = state[3]
    frozen = _frozen(parameters)
    for stage in range(4):
        ahead, weight = _weights(stage, h)
        now = t + (0.0 if stage == 0 else 0.5 * h if stage < 3 else h)
        ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _accelerate(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, frozen)
        if linearise:
            by_0_0, by_0_1, by_0_2, by_0_3, by_1_0, by_1_1, by_1_2, by_1_3 = _residual_jacobian(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, ddtheta_w, ddtheta_p, frozen, stage, by_parameter)
            stages[stage, 0] = -(mobility_0_0 * by_0_0 + mobility_0_1 * by_1_0)
            stages[stage, 1] = -(mobility_0_0 * by_0_1 + mobility_0_1 * by_1_1)
            stages[stage, 2] = -(mobility_0_0 * by_0_2 + mobility_0_1 * by_1_2)
            stages[stage, 3] = -(mobility_0_0 * by_0_3 + mobility_0_1 * by_1_3)
            stages[stage, MOBILITY + 0] = mobility_0_0
            stages[stage, MOBILITY + 1] = mobility_0_1
            stages[stage, 4] = -(mobility_1_0 * by_0_0 + mobility_1_1 * by_1_0)
            stages[stage, 5] = -(mobility_1_0 * by_0_1 + mobility_1_1 * by_1_1)
            stages[stage, 6] = -(mobility_1_0 * by_0_2 + mobility_1_1 * by_1_2)
            stages[stage, 7] = -(mobility_1_0 * by_0_3 + mobility_1_1 * by_1_3)
            stages[stage, MOBILITY + 2] = mobility_1_0
            stages[stage, MOBILITY + 3] = mobility_1_1
        theta_w_new += weight * dtheta_w
        theta_p_new += weight * dtheta_p
        dtheta_w_new += weight * ddtheta_w
        dtheta_p_new += weight * ddtheta_p
        theta_w = theta_w_old + ahead * dtheta_w
        theta_p = theta_p_old + ahead * dtheta_p
        dtheta_w = dtheta_w_old + ahead * ddtheta_w
        dtheta_p = dtheta_p_old + ahead * ddtheta_p
    new_state[0] = theta_w_new
    new_state[1] = theta_p_new
    new_state[2] = dtheta_w_new
    new_state[3] = dtheta_p_new


@inlined
def _weights(stage, h):
    """How far ahead a stage's slope carries to the next stage, and its weight in the step."""
    return (0.5 * h if stage < 2 else h), (h / 6.0 if stage in (0, 3) else h / 3.0)


@internal
def _propagate(h, sens, columns, stages, by_parameter, lanes):
    """Take the sensitivities (NS, n) through the four stages of _runge_kutta, in which they are linear.

    LANES columns at a time, side by side in the rows of one array: at fixed distances the compiler sees that rows do not
    overlap and advances several columns with one instruction. A column FITTED stands for a parameter that is switched off.
    """
    for first in range(0, sens.shape[1], LANES):
        count = min(LANES, sens.shape[1] - first)
        for c in range(count):
            column = columns[first + c - NX] if first + c >= NX else FITTED
            for i in range(NS):
                lanes[START + i * LANES + c] = sens[i, first + c]
            for i in range(4):
                lanes[STAGE + i * LANES + c] = lanes[END + i * LANES + c] = lanes[START + i * LANES + c]
            for stage in range(4):
                for k in range(NA):
                    own = 0.0
                    for m in range(NA):
                        own -= stages[stage, MOBILITY + k * NA + m] * by_parameter[stage, m, column]
                    lanes[OWN + (GIVEN * stage + k) * LANES + c] = own
            for stage in range(5 if REMEMBERED else 0):
                for k in range(NA, GIVEN):
                    lanes[OWN + (GIVEN * stage + k) * LANES + c] = by_parameter[stage, k, column]
        for stage in range(4):
            ahead, weight = _weights(stage, h)
            by_0_0, by_0_1, by_0_2, by_0_3 = stages[stage, 0 + 0], stages[stage, 0 + 1], stages[stage, 0 + 2], stages[stage, 0 + 3]
            by_1_0, by_1_1, by_1_2, by_1_3 = stages[stage, 4 + 0], stages[stage, 4 + 1], stages[stage, 4 + 2], stages[stage, 4 + 3]
            for c in range(LANES):
                theta_w = lanes[STAGE + 0 * LANES + c]
                theta_p = lanes[STAGE + 1 * LANES + c]
                dtheta_w = lanes[STAGE + 2 * LANES + c]
                dtheta_p = lanes[STAGE + 3 * LANES + c]
                ddtheta_w = lanes[OWN + (GIVEN * stage + 0) * LANES + c] + by_0_0 * theta_w + by_0_1 * theta_p + by_0_2 * dtheta_w + by_0_3 * dtheta_p
                ddtheta_p = lanes[OWN + (GIVEN * stage + 1) * LANES + c] + by_1_0 * theta_w + by_1_1 * theta_p + by_1_2 * dtheta_w + by_1_3 * dtheta_p
                lanes[END + 0 * LANES + c] += weight * dtheta_w
                lanes[STAGE + 0 * LANES + c] = lanes[START + 0 * LANES + c] + ahead * dtheta_w
                lanes[END + 1 * LANES + c] += weight * dtheta_p
                lanes[STAGE + 1 * LANES + c] = lanes[START + 1 * LANES + c] + ahead * dtheta_p
                lanes[END + 2 * LANES + c] += weight * ddtheta_w
                lanes[STAGE + 2 * LANES + c] = lanes[START + 2 * LANES + c] + ahead * ddtheta_w
                lanes[END + 3 * LANES + c] += weight * ddtheta_p
                lanes[STAGE + 3 * LANES + c] = lanes[START + 3 * LANES + c] + ahead * ddtheta_p
        for c in range(count):
            for i in range(4):
                sens[i, first + c] = lanes[END + i * LANES + c]


@inlined
def _workspace():
    """Scratch arrays of the integrator.

    The next state; coefficients by stage; derivatives of the residual by stage, row and parameter, the
    last of the driven input; sensitivities side by side; rows for dry friction.
    """
    return (
        np.zeros(NS), np.zeros((5, MEMORY + 2 * REMEMBERED)), np.zeros((5, GIVEN, FITTED + 1)),
        np.zeros(EXCESS + LANES), np.zeros((6, max(NA, DRY))),
    )  # fmt: skip


@internal
def _landing(h, start, start_rate, end, end_rate):
    """When a slip speed that changes its sign within h crosses zero, by bisection of its cubic interpolant."""
    low, high = 0.0, 1.0
    for _ in range(50):
        u = 0.5 * (low + high)
        value = (
            start * (1.0 + 2.0 * u) * (1.0 - u) ** 2
            + h * start_rate * u * (1.0 - u) ** 2
            + end * u * u * (3.0 - 2.0 * u)
            + h * end_rate * u * u * (u - 1.0)
        )
        if value * start > 0.0:
            low = u
        else:
            high = u
    return h * high


@inlined
def _slip_rate(dry, row, surface):
    """Slip acceleration of a surface under the accelerations dry[row]."""
    total = 0.0
    for k in range(NA):
        total += SLIPS[surface, k] * dry[row, k]
    return total


@internal
def _jump(sens, dry, surface):
    """Change the sensitivities at a stick-slip event, from dry[BEFORE] to dry[RATE]: its time depends on them (saltation)."""
    approach = _slip_rate(dry, BEFORE, surface)
    if approach == 0.0:
        return
    for c in range(sens.shape[1]):
        slip = 0.0
        for k in range(NA):
            slip += SLIPS[surface, k] * sens[RATES[k], c]
        for k in range(NA):
            sens[RATES[k], c] -= (dry[BEFORE, k] - dry[RATE, k]) * slip / approach


@internal
def _stick_and_slip(
    t, h, state, sens, voltage, parameters, columns, new_state, stages, by_parameter, lanes, dry
):
    """The same through the events of dry friction."""
    remaining, linearise = h, sens.shape[1] > 0
    for event in range(EVENTS):
        acting = _acting(t, remaining, state, voltage, parameters)
        _settle(t, state, acting, parameters, dry)
        for i in range(DRY):
            if dry[DIRECTION, i] == 0.0 and linearise:  # what would still slip is stopped at once
                dry[DIRECTION, i] = 1.0
                _rate(t, state, acting, parameters, dry)
                _keep(dry)
                dry[DIRECTION, i] = 0.0
                _rate(t, state, acting, parameters, dry)
                _jump(sens, dry, i)
        _runge_kutta(t, remaining, state, voltage, parameters, new_state, dry, linearise, stages, by_parameter)
        first, landing, stepped = -1, remaining, remaining
        if event < EVENTS - 1:
            for i in range(DRY):
                start, end = _slip(state, i), _slip(new_state, i)
                rubs = dry[DIRECTION, i] != 0.0 and dry[UPPER, i] > dry[LOWER, i]
                if rubs and end * dry[DIRECTION, i] < 0.0 and abs(start) > AT_REST:
                    _rate(t, state, acting, parameters, dry)
                    start_rate = _slip_rate(dry, RATE, i)
                    _rate(t + remaining, new_state, acting, parameters, dry)
                    when = _landing(remaining, start, start_rate, end, _slip_rate(dry, RATE, i))
                    if when < landing:
                        first, landing = i, when
        if first >= 0:
            for _ in range(3):  # Newton on the step itself, whose error the interpolant does not see
                _runge_kutta(t, landing, state, voltage, parameters, new_state, dry, linearise, stages, by_parameter)
                stepped = landing
                _rate(t + landing, new_state, acting, parameters, dry)
                _keep(dry)
                approach = _slip_rate(dry, RATE, first)
                if abs(_slip(new_state, first)) <= 1e-13 or approach == 0.0:
                    break
                landing = min(max(landing - _slip(new_state, first) / approach, 0.0), remaining)
        for i in range(NS):
            state[i] = new_state[i]
        if linearise:
            _propagate(stepped, sens, columns, stages, by_parameter, lanes)
        if first < 0:
            return
        t += landing
        remaining -= landing
        _settle(t, state, acting, parameters, dry)
        if dry[DIRECTION, first] != 0.0 and linearise:  # a reversal; sticking is handled where the next step begins
            _rate(t, state, acting, parameters, dry)
            _jump(sens, dry, first)
        if remaining <= 0.0:
            return


@compiled
def acceleration(t, state, voltage, parameters):
    """Accelerations [rad/s²] in a state: (NQ,) of (NX,), or (NA,) where what effects add is given too; friction sticks."""
    dry, now = np.zeros((6, max(NA, DRY))), np.zeros(NS)
    now[: state.size] = state
    acting = voltage
    _settle(t, now, acting, parameters, dry)
    _rate(t, now, acting, parameters, dry)
    return dry[RATE, : NQ if state.size <= NX else NA].copy()


@internal
def _settled_rate(t, state, voltage, parameters, dry):
    """Accelerations once it is decided what sticks, into dry[RATE]."""
    _settle(t, state, voltage, parameters, dry)
    _rate(t, state, voltage, parameters, dry)


@internal
def _switch(sens, state, old, new, t, parameters, columns, dry):
    """A delayed command switches: the later it does, the longer the old one acts."""
    for c in range(columns.size):
        if columns[c] == DELAY:
            _settled_rate(t, state, old, parameters, dry)
            _keep(dry)
            _settled_rate(t, state, new, parameters, dry)
            for k in range(NA):
                sens[RATES[k], NX + c] += dry[BEFORE, k] - dry[RATE, k]


@inlined
def _delay(parameters):
    """How much later a command acts."""
    return parameters[DELAY] if DELAY >= 0 else 0.0


@inlined
def _lateness(parameters):
    """How much earlier than reported that is true which late sensors report."""
    return parameters[SENSOR_DELAY] if SENSOR_DELAY >= 0 else 0.0


@internal
def _acting_at(t, k, when, parameters):
    """The sample whose command still acts just before a time not after sample k."""
    delay = _delay(parameters)
    acting = max(k - 1, 0)
    while acting > 0 and t[acting] + delay > when:
        acting -= 1
    return acting


@internal
def _slope(t, state, voltage, parameters, dry, slope):
    """Time derivative of the coordinates and rates, into slope (NX,)."""
    acting = voltage
    _settled_rate(t, state, acting, parameters, dry)
    for k in range(NQ):
        slope[k], slope[NQ + k] = state[NQ + k], dry[RATE, k]


@compiled
def simulate(t, voltage, state, parameters, max_step):
    """States (N, NX) at the samples t (N,) under the commanded voltage (N,), from an initial state (NX,).

    What effects add to the state begins at rest. Where the initial state gives it too, (NV,), it is returned: (N, NV).
    """
    states = np.empty((t.size, state.size))
    columns = np.empty(0, np.int64)
    now, sens = np.zeros(NS), np.zeros((NS, 0))
    new_state, stages, by_parameter, lanes, dry = _workspace()
    acting = _acting_at(t, FIRST, t[0], parameters)
    _begin(t[0], t, voltage, acting, state, parameters, columns, now, sens)
    states[0] = now[: state.size]
    delay, smooth, linearise = _delay(parameters), _smooth(parameters), False
    now_t = t[0]
    for k in range(t.size - 1):
        goal = t[k + 1]
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
            h = (until - now_t) / steps
            for step in range(steps):
                if smooth:
                    _follow(now, dry)
                    _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, linearise, stages, by_parameter)
                    if linearise:
                        _propagate(h, sens, columns, stages, by_parameter, lanes)
                else:
                    _stick_and_slip(
                        now_t + step * h, h, now, sens, voltage[acting], parameters, columns, new_state, stages, by_parameter,
                        lanes, dry,
                    )  # fmt: skip
            now_t = until
        for i in range(state.size):
            states[k + 1, i] = now[i]
    return states


@compiled
def closed_loop(t, reference, reference_rate, gains, state, parameters, noise, quantum, max_step):
    """The machine under its PID controller: states (N, NX), measured (N, NY) and voltage (N,).

    At each sample the sensors read the state, late ones that of an earlier time; noise (N, NY) is added, channels with a
    quantum > 0 are rounded to it, and the controller computes kp e + ki ∫e + kd ė from gains (3,), with
    e = reference − measured angle and ė = reference rate − measured rate; the voltage is held until the next sample.
    """
    states, measured, voltage = np.empty((t.size, NX)), np.empty((t.size, NY)), np.zeros(t.size)
    columns = np.empty(0, np.int64)
    now, sens, output = np.zeros(NS), np.zeros((NS, 0)), np.zeros(NY)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    now[:NX] = state
    integral, acting = 0.0, _acting_at(t, FIRST, t[0], parameters)
    delay, lateness, smooth, linearise = _delay(parameters), _lateness(parameters), _smooth(parameters), False
    now_t, k, early = t[0], 0, 0
    while k < t.size:
        goal = max(now_t, min(t[k], t[early] - lateness) if early < t.size else t[k])
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
            h = (until - now_t) / steps
            for step in range(steps):
                if smooth:
                    _follow(now, dry)
                    _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, linearise, stages, by_parameter)
                    if linearise:
                        _propagate(h, sens, columns, stages, by_parameter, lanes)
                else:
                    _stick_and_slip(
                        now_t + step * h, h, now, sens, voltage[acting], parameters, columns, new_state, stages, by_parameter,
                        lanes, dry,
                    )  # fmt: skip
            now_t = until
        on_time, ahead = t[k] <= now_t, early < t.size and t[early] - lateness <= now_t
        read_sensors(now_t, now, parameters, output)
        for y in range(NY):
            if ahead if LATE[y] else on_time:
                sample = early if LATE[y] else k
                reading = output[y] + noise[sample, y]
                measured[sample, y] = np.round(reading / quantum[y]) * quantum[y] if quantum[y] > 0.0 else reading
        early += ahead
        if on_time:
            for i in range(NX):
                states[k, i] = now[i]
            error, slope = reference[k] - measured[k, CONTROLLED[0]], 0.0
            if k > 0:
                integral += error * (t[k] - t[k - 1])
            if CONTROLLED[1] >= 0:
                slope = reference_rate[k] - measured[k, CONTROLLED[1]]
            elif k > 0:  # no sensor reads the rate: the last step stands for it
                slope = reference_rate[k] - (measured[k, CONTROLLED[0]] - measured[k - 1, CONTROLLED[0]]) / (t[k] - t[k - 1])
            voltage[k] = gains[0] * error + gains[1] * integral + gains[2] * slope
            if k == 0:
                _begin(t[0], t, voltage, acting, state, parameters, columns, now, sens)
            k += 1
    return states, measured, voltage


@compiled
def sensitivities(t, voltage, state, parameters, columns, max_step):
    """States (N, NX), readings (N, NY) and their derivatives (N, NY, NX + n).

    The derivatives are in the initial state, then in the n parameters whose indices are in columns (n,).
    """
    n = NX + columns.size
    states, readings, derivatives = np.empty((t.size, NX)), np.empty((t.size, NY)), np.empty((t.size, NY, n))
    now, sens, reading, rows, slope = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY), np.zeros((NY, n)), np.zeros(NX)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1))
    acting = _acting_at(t, FIRST, t[0], parameters)
    _begin(t[0], t, voltage, acting, state, parameters, columns, now, sens)
    delay, lateness, smooth, linearise = _delay(parameters), _lateness(parameters), _smooth(parameters), n > 0
    now_t, k, early = t[0], 0, 0
    while k < t.size:
        goal = max(now_t, min(t[k], t[early] - lateness) if early < t.size else t[k])
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
            h = (until - now_t) / steps
            for step in range(steps):
                if smooth:
                    _follow(now, dry)
                    _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, linearise, stages, by_parameter)
                    if linearise:
                        _propagate(h, sens, columns, stages, by_parameter, lanes)
                else:
                    _stick_and_slip(
                        now_t + step * h, h, now, sens, voltage[acting], parameters, columns, new_state, stages, by_parameter,
                        lanes, dry,
                    )  # fmt: skip
            now_t = until
        on_time, ahead = t[k] <= now_t, early < t.size and t[early] - lateness <= now_t
        read_sensors(now_t, now, parameters, reading)
        _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
        _age(now_t, now, voltage[acting], parameters, columns, dry, slope, by_state, reading_by)
        for y in range(NY if SENSOR_DELAY >= 0 and early < t.size and t[early] - lateness < t[0] else 0):
            reading_by[y, SENSOR_DELAY] = 0.0  # what was true before the log began is taken for what it began with
        _chain(sens, by_state, reading_by, columns, rows)
        for y in range(NY):
            if ahead if LATE[y] else on_time:
                sample = early if LATE[y] else k
                readings[sample, y] = reading[y]
                for c in range(n):
                    derivatives[sample, y, c] = rows[y, c]
        early += ahead
        if on_time:
            for i in range(NX):
                states[k, i] = now[i]
            k += 1
    return states, readings, derivatives


@internal
def _age(t, state, voltage, parameters, columns, dry, slope, by_state, by_parameter):
    """Derivatives of the late readings in their delay: the later, the older what they report."""
    for c in range(columns.size):
        if SENSOR_DELAY >= 0 and columns[c] == SENSOR_DELAY:
            _slope(t, state, voltage, parameters, dry, slope)
            for y in range(NY):
                if LATE[y]:
                    by_parameter[y, SENSOR_DELAY] = 0.0
                    for i in range(NX):
                        by_parameter[y, SENSOR_DELAY] -= by_state[y, i] * slope[i]


@inlined
def _chain(sens, by_state, by_parameter, columns, rows):
    """Derivatives of the readings, one row each, from those of the state."""
    for y in range(NY):
        for c in range(sens.shape[1]):
            rows[y, c] = by_parameter[y, columns[c - NX]] if c >= NX else 0.0
        for c in range(sens.shape[1]):
            total = rows[y, c]
            for i in range(NX):
                total += by_state[y, i] * sens[i, c]
            rows[y, c] = total


@compiled
def shoot(t, voltage, measured, weight, bounds, states, parameters, columns, window, max_step, gram, residual):
    """Simulate every segment from its own initial state and gather the weighted least-squares problem.

    measured (N, NY) may hold NaN; weight (NY,) is 1/σ; bounds (S, 2) are half-open sample ranges; states (S, NX).
    gram (S, n+1, n+1) receives [J r]ᵀ[J r] with n = NX + columns.size: derivatives in the initial state, then in the
    parameters of columns. window (columns.size, 2) switches a parameter's derivative on for some samples of each segment.
    residual (N, NY) receives (measured − simulated) · weight. What late sensors report of the time before a segment
    follows from its initial state, backward, in steps as long as each command acted. What effects add to the state carries on from the segment before.
    """
    n = NX + columns.size
    now, sens, reading, slope = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY), np.zeros(NX)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1))
    rows, active = np.zeros((NY, n + 1)), columns.copy()
    delay, lateness, smooth, linearise = _delay(parameters), _lateness(parameters), _smooth(parameters), n > 0
    for s in range(bounds.shape[0]):
        gram[s] = 0.0
        k = early = bounds[s, 0]
        now_t = t[k]
        acting = _acting_at(t, k, now_t, parameters)
        _begin(now_t, t, voltage, acting, states[s], parameters, columns, now, sens)
        carries = NV > NX and s + 1 < bounds.shape[0] and bounds[s + 1, 0] == bounds[s, 1]
        while k < bounds[s, 1] + carries:
            goal = max(now_t, min(t[k], t[early] - lateness) if early < bounds[s, 1] else t[k])
            for c in range(columns.size):
                inside = window[c, 0] <= max(k - 1 - bounds[s, 0], 0) < window[c, 1]
                active[c] = columns[c] if inside else FITTED
            while now_t < goal:
                while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                    if linearise:
                        _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, active, dry)
                    acting += 1
                until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
                steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
                h = (until - now_t) / steps
                for step in range(steps):
                    if smooth:
                        _follow(now, dry)
                        _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, linearise, stages, by_parameter)
                        if linearise:
                            _propagate(h, sens, active, stages, by_parameter, lanes)
                    else:
                        _stick_and_slip(
                            now_t + step * h, h, now, sens, voltage[acting], parameters, active, new_state, stages, by_parameter,
                            lanes, dry,
                        )  # fmt: skip
                now_t = until
            on_time, ahead = t[k] <= now_t, early < bounds[s, 1] and t[early] - lateness <= now_t
            if k < bounds[s, 1]:
                read_sensors(now_t, now, parameters, reading)
                _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
                _age(now_t, now, voltage[acting], parameters, columns, dry, slope, by_state, reading_by)
                for c in range(columns.size):
                    inside = window[c, 0] <= k - bounds[s, 0] < window[c, 1]
                    active[c] = columns[c] if inside else FITTED
                _chain(sens, by_state, reading_by, active, rows)
                for y in range(NY):
                    sample = early if LATE[y] else k
                    missing = not (ahead if LATE[y] else on_time) or np.isnan(measured[min(sample, t.size - 1), y])
                    for c in range(n):
                        rows[y, c] = 0.0 if missing else rows[y, c] * weight[y]
                    rows[y, n] = 0.0
                    if not missing:
                        residual[sample, y] = rows[y, n] = (measured[sample, y] - reading[y]) * weight[y]
                for a in range(n + 1):
                    for b in range(a + 1):
                        total = gram[s, a, b]
                        for y in range(NY):
                            total += rows[y, a] * rows[y, b]
                        gram[s, a, b] = total
            early += ahead
            k += on_time
        for a in range(n + 1):
            for b in range(a):
                gram[s, b, a] = gram[s, a, b]


@compiled
def settle(t, voltage, measured, weight, bounds, states, parameters, max_step, rounds, from_before):
    """Fit the initial states (S, NX) of segments one after the other, each with what the one before hands on, in place.

    Only coordinates and rates are fitted, by Levenberg and Marquardt in at most so many rounds. Where asked to, a segment
    is also begun at the state in which the one before ended, and keeps the better fit.
    """
    residual, gram, trial_gram = np.empty(measured.shape), np.zeros((1, NX + 1, NX + 1)), np.zeros((1, NX + 1, NX + 1))
    normal, step = np.zeros((NX, NX)), np.zeros(NX)
    start, other, arrived, ended = np.zeros((1, NV)), np.zeros((1, NV)), np.zeros(NV), FIRST - 1
    for s in range(bounds.shape[0]):
        segment, last = bounds[s : s + 1], bounds[s, 1]
        start[0, :NX], start[0, NX:] = states[s], arrived[NX:]
        cost = _fit_start(
            t, voltage, measured, weight, segment, start, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
        )
        if from_before and ended == bounds[s, 0] and np.isfinite(arrived).all():
            other[0] = arrived
            if cost > _fit_start(
                t, voltage, measured, weight, segment, other, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
            ):
                start[0] = other[0]
        states[s] = start[0, :NX]
        until = min(last + 1, t.size)
        path = simulate(t[bounds[s, 0] : until], voltage[bounds[s, 0] : until], start[0], parameters, max_step)
        arrived[:], ended = path[-1], last
        for i in range(NX, NV):
            if not np.isfinite(arrived[i]):
                arrived[i] = 0.0


@internal
def _fit_start(
    t, voltage, measured, weight, segment, start, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
):
    """Fit coordinates and rates in start (1, NV), in place; returns the sum of squares that they leave."""
    columns, window, trial, damping = np.empty(0, np.int64), np.empty((0, 2), np.int64), start.copy(), 1e-4
    shoot(t, voltage, measured, weight, segment, start, parameters, columns, window, max_step, gram, residual)
    cost = gram[0, NX, NX] if np.isfinite(gram[0, NX, NX]) else np.inf
    for _ in range(rounds):
        _damped_step(gram[0], damping, normal, step)
        for i in range(NX):
            trial[0, i] = start[0, i] + step[i]
        shoot(t, voltage, measured, weight, segment, trial, parameters, columns, window, max_step, trial_gram, residual)
        gain = cost - trial_gram[0, NX, NX]
        if gain > 0.0:
            start[0], gram[0], cost, damping = trial[0], trial_gram[0], trial_gram[0, NX, NX], 0.1 * damping
            if gain < 1e-5 * (1.0 + cost):
                break
        else:
            damping *= 10.0
            if damping > 1e3 or abs(gain) < 1e-9 * cost:
                break
    return cost


@internal
def _damped_step(gram, damping, normal, step):
    """Solve the states' normal equations, scaled to a unit diagonal and damped, by Cholesky; what is not finite stays."""
    for i in range(NX):
        for j in range(i + 1):
            total = gram[i, j] / math.sqrt(gram[i, i] * gram[j, j] + 1e-300) + (1e-10 + damping if i == j else 0.0)
            for k in range(j):
                total -= normal[i, k] * normal[j, k]
            normal[i, j] = math.sqrt(max(total, 1e-12)) if i == j else total / normal[j, j]
        step[i] = gram[i, NX] / math.sqrt(gram[i, i] + 1e-300)
        for k in range(i):
            step[i] -= normal[i, k] * step[k]
        step[i] /= normal[i, i]
    for i in range(NX - 1, -1, -1):
        for k in range(i + 1, NX):
            step[i] -= normal[k, i] * step[k]
        step[i] /= normal[i, i]
    for i in range(NX):
        step[i] = step[i] / math.sqrt(gram[i, i] + 1e-300)
        if not np.isfinite(step[i]):
            step[:] = 0.0
            break


@compiled
def regressor(t, state, rate, voltage, parameters):
    """Left side (NQ,) [V] and regressor φ (NQ, len(LINEAR)) at given accelerations (paper eqs. 21-23)."""
    tau, phi = np.zeros(NQ), np.zeros((NQ, len(LINEAR)))
    v_in = voltage
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    ddtheta_w = rate[0]
    ddtheta_p = rate[1]
    c0 = -ddtheta_p + ddtheta_w
    c1 = math.cos(theta_p)
    c2 = math.sin(theta_p)
    c3 = -dtheta_p
    tau[0] = v_in
    tau[1] = v_in
    phi[0, 0] = ddtheta_w
    phi[0, 1] = c0
    phi[0, 2] = c1*ddtheta_p - c2*(dtheta_p*dtheta_p)
    phi[0, 5] = dtheta_w
    phi[0, 6] = c3
    phi[1, 1] = c0
    phi[1, 2] = -c1*ddtheta_w
    phi[1, 3] = -ddtheta_p
    phi[1, 4] = c2
    phi[1, 5] = dtheta_w
    phi[1, 6] = c3

    return tau, phi


@compiled
def regressor_parts(t, state, voltage, parameters):
    """φ2, φ1, φ0 (NQ, len(LINEAR)) each, with φ = d²φ2/dt² + dφ1/dt + φ0 (paper eqs. 25, 26)."""
    phi2, phi1, phi0 = np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR)))
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    c0 = -theta_p + theta_w
    c1 = -theta_p
    c2 = math.cos(theta_p)
    c3 = math.sin(theta_p)
    phi2[0, 0] = theta_w
    phi2[0, 1] = c0
    phi2[1, 1] = c0
    phi2[1, 3] = c1
    phi1[0, 2] = c2*dtheta_p
    phi1[0, 5] = theta_w
    phi1[0, 6] = c1
    phi1[1, 2] = -c2*dtheta_w
    phi1[1, 5] = theta_w
    phi1[1, 6] = c1
    phi0[1, 2] = -c3*dtheta_p*dtheta_w
    phi0[1, 4] = c3

    return phi2, phi1, phi0


@compiled
def energy_parts(t, state, voltage, parameters):
    """Energy stored (n,), power taken (n,) and power supplied: supplied = (d stored/dt + taken) · X, n = len(LINEAR).

    The rows times their rates, summed: the energy balance, which holds without accelerations. In V rad, V rad/s.
    """
    stored, taken, supplied = np.zeros(len(LINEAR)), np.zeros(len(LINEAR)), np.zeros(1)
    v_in = voltage
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    c0 = (dtheta_w*dtheta_w)
    c1 = (1/2)*c0
    c2 = dtheta_p*dtheta_w
    c3 = -c2
    c4 = (dtheta_p*dtheta_p)
    c5 = (1/2)*c4
    c6 = math.cos(theta_p)
    stored[0] = c1
    stored[1] = c1 + c3 + c5
    stored[2] = c2*c6
    stored[3] = c5
    stored[4] = c6
    taken[5] = c0 - c2
    taken[6] = c3 + c4
    supplied[0] = -dtheta_p*v_in + dtheta_w*v_in

    return stored, taken, supplied[0]


SIGNALS = 11
DERIVATIVES = np.array([0, 0, 1, 1, 1, 1, 2, 2, 2, 0, 0])  # how often each signal is differentiated
HELD = np.array([False, False, False, False, False, False, False, False, False, True, True])  # whether it is constant between samples
UNMEASURED = np.array([2])  # states that no sensor reads: rates of coordinates
Z1, Z2, OLD, NEW, STATE = 0, 1, 2, 3, 4  # rows of the filters' memory


@internal
def _signals(t, state, voltage, parameters, signal):
    """The distinct quantities that are filtered, into signal (SIGNALS,)."""
    v_in = voltage
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    c0 = math.sin(theta_p)
    c1 = math.cos(theta_p)
    c2 = -theta_p
    signal[0] = -c0*dtheta_p*dtheta_w
    signal[1] = c0
    signal[2] = c1*dtheta_p
    signal[3] = theta_w
    signal[4] = c2
    signal[5] = -c1*dtheta_w
    signal[6] = theta_w
    signal[7] = -theta_p + theta_w
    signal[8] = c2
    signal[9] = v_in
    signal[10] = v_in


@internal
def _signal_rates(t, state, voltage, parameters, speed):
    """How fast those change that are differentiated twice, into speed (SIGNALS,)."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    speed[6] = dtheta_w
    speed[7] = -dtheta_p + dtheta_w
    speed[8] = -dtheta_p


@internal
def _assemble(signal, tau, phi):
    """Filtered left side and regressor from the filtered signals (paper eqs. 39, 40)."""
    signal_0 = signal[0]
    signal_1 = signal[1]
    signal_2 = signal[2]
    signal_3 = signal[3]
    signal_4 = signal[4]
    signal_5 = signal[5]
    signal_6 = signal[6]
    signal_7 = signal[7]
    signal_8 = signal[8]
    signal_9 = signal[9]
    signal_10 = signal[10]
    tau[0] = signal_9
    tau[1] = signal_10
    phi[0, 0] = signal_6
    phi[0, 1] = signal_7
    phi[0, 2] = signal_2
    phi[0, 5] = signal_3
    phi[0, 6] = signal_4
    phi[1, 1] = signal_7
    phi[1, 2] = signal_0 + signal_5
    phi[1, 3] = signal_8
    phi[1, 4] = signal_1
    phi[1, 5] = signal_3
    phi[1, 6] = signal_4


@compiled
def filter_weights(h, tau1, tau2):
    """Exact step of z1' = (u − z1)/τ1, z2' = (z1 − z2)/τ2 over h [s] for u linear between samples, (9,).

    Decay of z1 and of z2, coupling of z1 into z2, weights of the old and the new input in z1 and in z2, τ1, τ2. Equal
    time constants are set a thousandth apart: any pair will do as long as both sides of the equation share it.
    """
    if abs(tau1 - tau2) < 1e-3 * tau1:
        tau2 = tau1 * 1.001
    e1, e2 = math.exp(-h / tau1), math.exp(-h / tau2)
    coupling = tau1 / (tau1 - tau2) * (e1 - e2)
    ramp1, ramp2 = 1.0 - tau1 / h * (1.0 - e1), 1.0 - tau2 / h * (1.0 - e2)
    step1, step2 = 1.0 - e1, (tau1 * (1.0 - e1) - tau2 * (1.0 - e2)) / (tau1 - tau2)
    both = (tau1 * ramp1 - tau2 * ramp2) / (tau1 - tau2)
    return np.array([e1, e2, coupling, step1 - ramp1, ramp1, step2 - both, both, tau1, tau2])


@compiled
def filter_memory():
    """What the filters remember between two samples."""
    return np.zeros((5, max(SIGNALS, NX)))


@compiled
def filter_start(t, state, voltage, parameters, weights, memory):
    """Set the filters' memory at the first sample, from the state (NX,) believed there (the paper's eq. 42)."""
    tau1, tau2 = weights[7], weights[8]
    value, speed = memory[OLD], memory[NEW]
    _signals(t, state, voltage, parameters, value)
    _signal_rates(t, state, voltage, parameters, speed)
    for s in range(SIGNALS):
        memory[Z1, s] = memory[Z2, s] = 0.0
        if DERIVATIVES[s] == 1:
            memory[Z1, s] = memory[Z2, s] = value[s]
        elif DERIVATIVES[s] == 2:
            memory[Z1, s] = value[s] - speed[s] * tau1
            memory[Z2, s] = value[s] - speed[s] * (tau1 + tau2)


@compiled
def filter_advance(t, h, old_state, state, old_voltage, voltage, parameters, weights, first_order_hold, memory):
    """Take the filters' memory from a sample to the next one, h [s] later, where ``state`` and ``voltage`` were measured.

    Between samples a signal is linear (first_order_hold) or constant, the voltage always constant. A rate that no
    sensor reads is the increment of its angle over the interval, which is what the filters integrate.
    """
    now = memory[STATE]
    for x in range(NX):
        now[x] = old_state[x]
    for x in UNMEASURED:
        now[x] = (state[x - NQ] - old_state[x - NQ]) / h
    _signals(t, now, old_voltage, parameters, memory[OLD])
    for x in range(NX):
        now[x] = state[x]
    for x in UNMEASURED:
        now[x] = (state[x - NQ] - old_state[x - NQ]) / h
    _signals(t + h, now, voltage, parameters, memory[NEW])
    for s in range(SIGNALS):
        old = memory[OLD, s]
        end = old if HELD[s] or not first_order_hold else memory[NEW, s]
        memory[Z2, s] = weights[1] * memory[Z2, s] + weights[2] * memory[Z1, s] + weights[5] * old + weights[6] * end
        memory[Z1, s] = weights[0] * memory[Z1, s] + weights[3] * old + weights[4] * end


@compiled
def filter_output(t, state, voltage, parameters, weights, memory, tau, phi):
    """Filtered left side, into tau (NQ,), and regressor, into phi (NQ, len(LINEAR)), at a sample.

    No acceleration is formed: a derivative is taken of the filter's output instead.
    """
    tau1, tau2 = weights[7], weights[8]
    value = memory[NEW]
    _signals(t, state, voltage, parameters, value)
    for s in range(SIGNALS):
        slope = (memory[Z1, s] - memory[Z2, s]) / tau2
        if DERIVATIVES[s] == 0:
            value[s] = memory[Z2, s]
        elif DERIVATIVES[s] == 1:
            value[s] = slope
        else:
            value[s] = ((value[s] - memory[Z1, s]) / tau1 - slope) / tau2
    _assemble(value, tau, phi)


@internal
def _filter_sample(k, t, states, voltage, parameters, taus, first_order_hold, start, weights, memory, tau, phi):
    """Bring the filters from sample k - 1 to sample k of a log and read them; weights[9] is the interval they are for."""
    h = t[k] - t[k - 1] if k else t[1] - t[0]
    if h != weights[9]:
        weights[:9], weights[9] = filter_weights(h, taus[0], taus[1]), h
    if k:
        filter_advance(
            t[k - 1], h, states[k - 1], states[k], voltage[k - 1], voltage[k], parameters, weights, first_order_hold, memory
        )
    else:
        filter_start(t[0], start, voltage[0], parameters, weights, memory)
    filter_output(t[k], states[k], voltage[k], parameters, weights, memory, tau, phi)


@compiled
def filter_regressor(t, states, voltage, parameters, tau1, tau2, first_order_hold, start):
    """Left side (N, NQ) and regressor (N, NQ, len(LINEAR)) behind 1/((τ1 s + 1)(τ2 s + 1)) (paper eqs. 30-42).

    states (N, NX) hold the measured angles and rates; see filter_advance for what is assumed between samples. The
    initial conditions are the paper's (42), formed from the state ``start`` (NX,), usually the first of the states.
    """
    taus, phis = np.zeros((t.size, NQ)), np.zeros((t.size, NQ, len(LINEAR)))
    weights, memory, times = np.zeros(10), filter_memory(), (tau1, tau2)
    for k in range(t.size):
        _filter_sample(
            k, t, states, voltage, parameters, times, first_order_hold, start, weights, memory, taus[k], phis[k]
        )
    return taus, phis


@compiled
def recursive_update(estimate, covariance, phi, tau, forgetting):
    """One recursive least-squares update in place: estimate (n,), covariance (n, n), one row phi (n,), its left side tau."""
    n = estimate.size
    gain = np.empty(n)
    spread, error = forgetting, tau
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += covariance[i, j] * phi[j]
        spread += phi[i] * gain[i]
        error -= phi[i] * estimate[i]
    for i in range(n):
        estimate[i] += gain[i] / spread * error
        for j in range(i + 1):
            covariance[i, j] = (covariance[i, j] - gain[i] * gain[j] / spread) / forgetting
            covariance[j, i] = covariance[i, j]


@compiled
def recursive_identification(
    t, states, voltage, parameters, tau1, tau2, first_order_hold, start, first, forgetting, estimate, covariance, track
):
    """Recursive least squares over a log in constant memory, in place; the mean square of the left side's innovations.

    estimate (n,) and covariance (n, n) start as the caller sets them and are updated from sample ``first`` on, when the
    filters have forgotten their start; ``forgetting`` applies once a sample. The estimate is noted in track (M, n) at M
    samples spread evenly over the log.
    """
    tau, phi, squares, noted = np.zeros(NQ), np.zeros((NQ, len(LINEAR))), 0.0, 0
    weights, memory, times = np.zeros(10), filter_memory(), (tau1, tau2)
    for k in range(t.size):
        _filter_sample(k, t, states, voltage, parameters, times, first_order_hold, start, weights, memory, tau, phi)
        for row in range(NQ if k >= first else 0):
            error = tau[row]
            for i in range(estimate.size):
                error -= phi[row, i] * estimate[i]
            squares += error * error
            recursive_update(estimate, covariance, phi[row], tau[row], forgetting if row == 0 else 1.0)
        while noted < len(track) and (noted + 1) * t.size <= (k + 1) * len(track):
            track[noted] = estimate
            noted += 1
    return squares / (max(t.size - first, 1) * NQ)
