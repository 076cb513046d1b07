# Made by wheelpend from model.toml with sympy 1.14.0 and Jinja 3.1.6; do not edit, run `wheelpend generate`.
# plant wheel_pendulum; assumptions planar=True, ground_friction_reaction=body, ground_friction=True, rotor_inertia=True, rotor_speed=body, gear_ratio_in_back_emf=once, motor_circuit=static, range=upright, gyro=True, rate_sensor=False, encoder=absolute; effects none
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
VARIABLES = ('theta_w', 'theta_p', 'dtheta_w', 'dtheta_p')  # the states, then added states
OUTPUTS = ('theta_w', 'theta_p', 'dtheta_p')
ROWS = ('wheel', 'body')
PARAMETERS = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7')
UNITS = ('V s²/rad', 'V s²/rad', 'V s²/rad', 'V s²/rad', 'V', 'V s/rad', 'V s/rad')
ABSENT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,)  # value of each parameter while its effect is absent; of a constant any number
ABSORBED = {}  # effects that are part of the plant's own parameters, with weights on these
TWINS = {}  # effects that change every log in the same way
CONTAINS = {}  # effects within others: parameters of the larger by those of the smaller
NEEDS = {}  # constants without which a parameter has no meaning
LINEAR = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7')  # parameters of the regressor, in the order of its columns
SIGNED = ()  # own parameters that may be negative: differences of physical constants
OWN_PARAMETERS = 7  # so many of PARAMETERS, from the first, are the plant's own
FITTED = 7  # so many of PARAMETERS, from the first, have sensitivities
MISSING_FORCES = ()  # unknown forces among PARAMETERS, one for each row, where there are any
CARRYING = ()  # effects with states that carry over from one fitted segment to the next
HYSTERESIS_SIZES = ()  # indices among PARAMETERS; no force has a memory where these are zero
INTERNAL = ()  # parameters of the forces along internal coordinates
STIFFEST = {}  # largest values of parameters that are infinite where an internal coordinate is rigid
DELAY = -1  # index of the input delay among PARAMETERS, or -1
LAG = -1  # index of the time constant of the input's lag, or -1
ORIGIN = -1  # index of the first coordinate's value at the log's first sample, or -1
NQ, NX, NY, NP = 2, 4, 3, 7
NA, NV = 2, 4  # moving coordinates; variables: the states, then added states
NR = 4  # variables, from the first, that readings depend on: the states, and a sensor's filter where there is one
NS = NV + (LAG >= 0)  # a lagging input is the last
RATES = (2, 3)  # where the rate of each moving coordinate stands among the variables
DELAYED = (False, False, False,)  # True for each output that the sensor delay acts on
SENSOR_DELAY = -1  # index of that delay among PARAMETERS, or -1
SURFACES = 0  # number of surfaces with dry friction
SLIP_MATRIX = np.array(np.zeros((0, 2)), dtype=np.float64)  # (SURFACES, NA): slip speeds as weights on the rates
IN_DRY_LAW = np.isin(np.arange(NP), np.array([], dtype=np.int64))  # (NP,): True for each parameter that dry friction depends on
RATE, BEFORE, FORCE, UPPER, LOWER, DIRECTION = range(6)  # rows of the scratch array of dry friction
LANES = 8  # sensitivity columns that are advanced side by side
HYSTERESES = 0  # number of hysteresis forces
DERIVATIVE_ROWS = NA + HYSTERESES  # rows of the derivatives in the parameters
START, STAGE, END, OWN, DRIVEN, EXCESS = (LANES * row for row in (0, NS, 2 * NS, 3 * NS, 3 * NS + 5 * DERIVATIVE_ROWS, 3 * NS + 5 * DERIVATIVE_ROWS + 1))
MOBILITY, SHARE = NA * NS, NA * NS + NA * NA  # where the coefficients of a stage begin
MEMORY, DRIVE = SHARE + 3, 4  # where those of the hysteresis forces begin; the stage of the driven input's
FIRST_SAMPLE = np.int64(0)  # sample; for a literal 0 numba would compile functions once more
CONTROLLED = (1, 2)  # outputs that the controller sees: a value and its rate, -1 for what no sensor reads
OUTPUT_MATRIX = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])  # (NY, NX): outputs = OUTPUT_MATRIX · state while no effect acts on the sensors
RANGE_OUTPUT = 1  # index of the output that must stay within ±π/2, or -1
PORTS = {'drive': (1.0, -1.0), 'axle': (1.0, -1.0), 'ground': (1.0, 0.0), 'body': (0.0, 1.0), 'outside': (1.0, 0.0)}  # each port's coordinate as weights on the coordinates
INPUTS = ('v_in',)  # columns of the inputs; a machine that swings freely has none
INPUT = "v_in"  # the first of them, or nothing
AT_REST = 1e-9  # slip speed below which a surface may stick [rad/s]
RARE = 1e-4  # probability below which a surface does not stick, and nats per part that a merger may cost
CERTAIN_SIGMAS = 8.5  # standard deviations beyond which a Gaussian variable is not, to the last digit
REST_MARGIN = 4.0  # changes of a slip over a step, as it begins, within which it may come to rest
REST_ATTEMPTS = 3  # at the moment at which a surface is at rest, by the secant rule
MIN_PART = 1e-3  # of a step, shorter than which none is split off
ALIKE = 0.1  # slips closer than that share of what friction stops within a step count as alike
KNOWN_SLIP = 1e-4  # share of it that a slip's standard deviation is taken to be at least
WEIGHT, VOLUME = 0, 1  # of a part of a mixture, in its last column
TRIAL, FACTOR, FLOOR = np.int64(-3), np.int64(-2), np.int64(-1)  # blocks after the parts: a merged covariance, its factors, what adds to every one
BY_VARIABLE, PUSH, ON_SLIP = range(3)  # rows of a slip: its derivatives in the variables, theirs in what friction takes from it, their regression on it
LAG_MEMORY = 40.0  # time constants after which an old command is forgotten
SERIES_RANGE = 0.125  # angle by which a sine is turned by its series: what it leaves out is below the last digit [rad]
BATCH_SIZE = 64  # machines that are advanced side by side
STATE_ROW, INPUT_ROW, OLD_STATE, STAGE_STATE, INTEGRAL, GAINS, ANGLE = 0, NX, NX + 1, 2 * NX + 1, 3 * NX + 1, 3 * NX + 2, 3 * NX + 5  # their rows
START_TRIG, STAGE_TRIG, BATCH_ROWS = ANGLE + 1, ANGLE + 3, ANGLE + 5
ROUNDING = 6755399441055744.0  # added and taken away again, it rounds to a whole number
EVENTS = 16  # stick-slip events handled within one step
options = {"cache": True, "nogil": True, "fastmath": {"contract"}, "error_model": "numpy", "no_cfunc_wrapper": True}
compiled = njit(**options)
internal = njit(**options, no_cpython_wrapper=True)  # for compiled callers only, which saves compiling the way in from Python
inlined = njit(**options, no_cpython_wrapper=True, forceinline=True)  # passes scalars in registers


@inlined
def _sine_pair(x):
    """Sine and cosine to 2e-16 while |x| < 1e6, by their series within an eighth of a turn.

    Arithmetic alone, without calls and branches: several of them go side by side, in one instruction or in its shadow.
    """
    quarters = (x * (2.0 / math.pi) + ROUNDING) - ROUNDING
    rest = ((x - quarters * 1.570796325802803) - quarters * 9.920935791635221e-10) - quarters * 5.170182981794105e-19
    square = rest * rest
    fourth = square * square  # the series in halves that need not wait for each other
    sine = rest + rest * square * (
        (-1.66666666666666324348e-01 + square * 8.33333333332248946124e-03)
        + fourth * (
            (-1.98412698298579493134e-04 + square * 2.75573137070700676789e-06)
            + fourth * (-2.50507602534068634195e-08 + square * 1.58969099521155010221e-10)
        )
    )
    cosine = 1.0 - 0.5 * square + fourth * (
        (4.16666666666666019037e-02 - square * 1.38888888888741095749e-03)
        + fourth * (
            (2.48015872894767294178e-05 - square * 2.75573143513906633035e-07)
            + fourth * (2.08757232129817482790e-09 - square * 1.13596475577881948265e-11)
        )
    )
    turn = quarters - 4.0 * ((0.25 * quarters - 0.375 + ROUNDING) - ROUNDING)  # 0, 1, 2 or 3
    odd = turn == 1.0 or turn == 3.0
    first, second = (cosine, sine) if odd else (sine, cosine)
    return (-first if turn >= 2.0 else first), (-second if turn == 1.0 or turn == 2.0 else second)


@inlined
def _series(x, square):
    """sin x and 1 − cos x for |x| up to SERIES_RANGE."""
    fourth = square * square
    sine = x + x * square * (
        (-1.0 / 6.0 + square / 120.0) + fourth * (-1.0 / 5040.0 + square / 362880.0)
    )
    return sine, square * ((0.5 - square / 24.0) + fourth * (1.0 / 720.0 - square / 40320.0))


@inlined
def _rotated_sines(angle, start, sine, cosine):
    """Sine and cosine of an angle from those of one near it.

    A step takes one pair in full; its other stages turn that pair, which is faster and as accurate.
    """
    turn = angle - start
    square = turn * turn
    if square > SERIES_RANGE * SERIES_RANGE:
        return math.sin(angle), math.cos(angle)
    along, short = _series(turn, square)
    return sine + (cosine * along - sine * short), cosine - (sine * along + cosine * short)


@inlined
def _sign(x):
    """−1.0, 0.0 or 1.0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@inlined
def _step(x):
    """1.0 where x is positive, else 0.0."""
    return 1.0 if x > 0.0 else 0.0


@inlined
def _angles(t, theta_w, theta_p, dtheta_w, dtheta_p, parameters):
    """Arguments of the sines and cosines in the equations of motion."""
    angle_theta_p = theta_p

    return angle_theta_p,


@inlined
def _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters):
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
    c0 = X3*cos_theta_p
    c1 = 1/(X1*X2 + X1*X4 + X2*X4 + 2*X2*c0 - (X3*X3)*(cos_theta_p*cos_theta_p))
    c2 = X2 - c0
    c3 = X6*dtheta_w
    c4 = X7*dtheta_p
    c5 = -X5*sin_theta_p - c3 + c4 + v_in
    c6 = X2 + X4
    c7 = -X3*(dtheta_p*dtheta_p)*sin_theta_p + c3 - c4 - v_in
    c8 = X1 + X2
    c9 = c1*c2
    ddtheta_w = c1*(-c2*c5 - c6*c7)
    ddtheta_p = c1*(-c2*c7 - c5*c8)
    mobility_0_0 = c1*c6
    mobility_0_1 = c9
    mobility_1_0 = c9
    mobility_1_1 = c1*c8

    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@inlined
def _residual_jacobian(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, ddtheta_w, ddtheta_p, parameters, stage, by_parameter):
    """Derivatives of inertia − force at given accelerations: in the states, returned row by row, and in the parameters.

    The latter go into by_parameter[stage], where zero entries are not touched.
    25 operations.
    """
    X3 = parameters[2]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    c0 = X3*sin_theta_p
    c1 = (dtheta_p*dtheta_p)
    c2 = ddtheta_p - ddtheta_w
    by_0_0 = 0
    by_0_1 = -X3*c1*cos_theta_p - c0*ddtheta_p
    by_0_2 = X6
    by_0_3 = -X7 - 2*c0*dtheta_p
    by_1_0 = 0
    by_1_1 = -X5*cos_theta_p - c0*ddtheta_w
    by_1_2 = -X6
    by_1_3 = X7
    by_parameter[stage, 0, 0] = ddtheta_w
    by_parameter[stage, 0, 1] = -c2
    by_parameter[stage, 0, 2] = -c1*sin_theta_p + cos_theta_p*ddtheta_p
    by_parameter[stage, 0, 5] = dtheta_w
    by_parameter[stage, 0, 6] = -dtheta_p
    by_parameter[stage, 1, 1] = c2
    by_parameter[stage, 1, 2] = cos_theta_p*ddtheta_w
    by_parameter[stage, 1, 3] = ddtheta_p
    by_parameter[stage, 1, 4] = -sin_theta_p
    by_parameter[stage, 1, 5] = -dtheta_w
    by_parameter[stage, 1, 6] = dtheta_p

    return by_0_0, by_0_1, by_0_2, by_0_3, by_1_0, by_1_1, by_1_2, by_1_3


@compiled
def read_sensors(t, state, parameters, output):
    """Readings of the sensors in this state, into output (NY,)."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    output[0] = theta_w
    output[1] = theta_p
    output[2] = dtheta_p


@inlined
def _sensor_jacobian(t, state, parameters, by_state, by_parameter):
    """Derivatives of the readings into (NY, NR) and (NY, NP); zero entries are not touched."""
    by_state[0, 0] = 1
    by_state[1, 1] = 1
    by_state[2, 3] = 1


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NA):
        speed += SLIP_MATRIX[surface, k] * state[RATES[k]]
    return speed


@inlined
def _accelerate(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, smooth, parameters):
    """Accelerations with dry friction, mobility, and the forces on the surfaces.

    Directions −1 and +1 slip that way, at 0 a surface sticks: the force there cancels the slip acceleration, and the
    mobility is that of a machine that cannot move in this direction.
    """
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters)
    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@internal
def _rate(t, state, voltage, parameters, dry):
    """Accelerations under the directions dry[DIRECTION], into dry[RATE], and the forces on the surfaces, into dry[FORCE]."""
    angle_theta_p, = _angles(t, state[0], state[1], state[2], state[3], _frozen(parameters))
    sin_theta_p, cos_theta_p = math.sin(angle_theta_p), math.cos(angle_theta_p)
    (
        dry[RATE, 0], dry[RATE, 1], mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1,
    ) = _accelerate(
        t, state[0], state[1], state[2], state[3], voltage, sin_theta_p, cos_theta_p, False, _frozen(parameters)
    )  # fmt: skip


@inlined
def _store_rate(dry):
    """Copy the accelerations dry[RATE] to dry[BEFORE]."""
    for k in range(NA):
        dry[BEFORE, k] = dry[RATE, k]


@inlined
def _frozen(parameters):
    """The parameters as a tuple, which no store can change: what follows from them alone is computed once a step."""
    return parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5], parameters[6],


@inlined
def _is_frictionless(parameters):
    """True where no surface has dry friction."""
    return True


@inlined
def _has_friction(parameters, columns):
    """True where a surface has dry friction, or would have some by a change of the parameters in these columns."""
    found = not _is_frictionless(parameters)
    return found


@inlined
def _slip_directions(state, dry):
    """Directions of slip by the sign of the slip speeds, into dry[DIRECTION]."""
    for i in range(SURFACES):
        dry[DIRECTION, i] = 1.0 if _slip(state, i) >= 0.0 else -1.0


@inlined
def _friction_limits(t, state, voltage, parameters, dry):
    """Friction of each surface as it slips forward, in dry[UPPER], and backward, in dry[LOWER]; sticking, it lies between them."""


@internal
def _stick_or_slip(t, state, voltage, parameters, dry):
    """Set the direction of slip of each surface, 0 where it sticks, in dry[DIRECTION], and its limits in dry[UPPER] and dry[LOWER].

    A surface at rest sticks while the force that holds it lies between its limits. One without friction never sticks.
    """
    _slip_directions(state, dry)
    _friction_limits(t, state, voltage, parameters, dry)
    stuck = False
    for i in range(SURFACES):
        if dry[UPPER, i] > dry[LOWER, i] and abs(_slip(state, i)) <= AT_REST:
            dry[DIRECTION, i] = 0.0
            stuck = True
    for _ in range(SURFACES + 1):
        if not stuck:
            return
        stuck = False
        _rate(t, state, voltage, parameters, dry)
        for i in range(SURFACES):
            if dry[DIRECTION, i] == 0.0 and dry[FORCE, i] > dry[UPPER, i]:
                dry[DIRECTION, i] = 1.0
                stuck = True
            elif dry[DIRECTION, i] == 0.0 and dry[FORCE, i] < dry[LOWER, i]:
                dry[DIRECTION, i] = -1.0
                stuck = True


@inlined
def _driven(t, v_in, parameters):
    """Input map: the command as the actuator passes it on, before its lag."""
    driven = v_in

    return driven


@inlined
def _drive_jacobian(t, v_in, parameters, by_parameter):
    """Derivatives of the driven input into (NP,); zero entries are not touched."""


@internal
def _lag(h, time_constant):
    """Share exp(−s/T) of an old input that still acts, as a straight line in s over a step h.

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
def _initial_state(when, t, voltage, acting, start, parameters, columns, state, sens):
    """State (NS,) and sensitivities (NS, n) at a time when command ``acting`` acts, from coordinates and rates (NX,).

    Added states stay as they are, or are given after those, and do not depend on them. A lagging input follows from the
    commands before; the first command of a log, or the first after missing ones, counts as one that has acted for long.
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
def _runge_kutta(t, h, state, v_in, parameters, new_state, dry, smooth, linearise, stages, by_parameter):
    """One step of the classical fourth-order method for the state (NS,), also in place.

    The surfaces slip as dry[DIRECTION] says; smooth tells that none has friction. Where asked to, it linearises the four stages for _propagate.
    """
    theta_w = theta_w_new = theta_w_old = state[0]
    theta_p = theta_p_new = theta_p_old = state[1]
    dtheta_w = dtheta_w_new = dtheta_w_old = state[2]
    dtheta_p = dtheta_p_new = dtheta_p_old = state[3]
    frozen = _frozen(parameters)
    start_theta_p, = _angles(t, theta_w, theta_p, dtheta_w, dtheta_p, frozen)
    sin_theta_p, cos_theta_p = start_sin_theta_p, start_cos_theta_p = _sine_pair(start_theta_p)
    for stage in range(4):
        ahead, weight = _weights(stage, h)
        now = t + (0.0 if stage == 0 else 0.5 * h if stage < 3 else h)
        if stage > 0:
            angle_theta_p, = _angles(now, theta_w, theta_p, dtheta_w, dtheta_p, frozen)
            sin_theta_p, cos_theta_p = _rotated_sines(angle_theta_p, start_theta_p, start_sin_theta_p, start_cos_theta_p)
        ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _accelerate(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, smooth, frozen)
        if linearise:
            by_0_0, by_0_1, by_0_2, by_0_3, by_1_0, by_1_1, by_1_2, by_1_3 = _residual_jacobian(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, ddtheta_w, ddtheta_p, frozen, stage, by_parameter)
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
    """Step from a Runge-Kutta stage to the next one, and the stage's weight in the whole step."""
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
                    lanes[OWN + (DERIVATIVE_ROWS * stage + k) * LANES + c] = own
            for stage in range(5 if HYSTERESES else 0):
                for k in range(NA, DERIVATIVE_ROWS):
                    lanes[OWN + (DERIVATIVE_ROWS * stage + k) * LANES + c] = by_parameter[stage, k, column]
        for stage in range(4):
            ahead, weight = _weights(stage, h)
            by_0_0, by_0_1, by_0_2, by_0_3 = stages[stage, 0 + 0], stages[stage, 0 + 1], stages[stage, 0 + 2], stages[stage, 0 + 3]
            by_1_0, by_1_1, by_1_2, by_1_3 = stages[stage, 4 + 0], stages[stage, 4 + 1], stages[stage, 4 + 2], stages[stage, 4 + 3]
            for c in range(LANES):
                theta_w = lanes[STAGE + 0 * LANES + c]
                theta_p = lanes[STAGE + 1 * LANES + c]
                dtheta_w = lanes[STAGE + 2 * LANES + c]
                dtheta_p = lanes[STAGE + 3 * LANES + c]
                ddtheta_w = lanes[OWN + (DERIVATIVE_ROWS * stage + 0) * LANES + c] + by_0_0 * theta_w + by_0_1 * theta_p + by_0_2 * dtheta_w + by_0_3 * dtheta_p
                ddtheta_p = lanes[OWN + (DERIVATIVE_ROWS * stage + 1) * LANES + c] + by_1_0 * theta_w + by_1_1 * theta_p + by_1_2 * dtheta_w + by_1_3 * dtheta_p
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
        np.zeros(NS), np.zeros((5, MEMORY + 2 * HYSTERESES)), np.zeros((5, DERIVATIVE_ROWS, FITTED + 1)),
        np.zeros(EXCESS + LANES), np.zeros((6, max(NA, SURFACES))),
    )  # fmt: skip


@internal
def _zero_crossing(h, start, start_rate, end, end_rate):
    """Time within h at which a slip speed crosses zero, by bisection of its cubic Hermite interpolant."""
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
        total += SLIP_MATRIX[surface, k] * dry[row, k]
    return total


@internal
def _saltation(sens, dry, surface):
    """Saltation of the sensitivities at a stick-slip event, from accelerations dry[BEFORE] to dry[RATE]."""
    approach = _slip_rate(dry, BEFORE, surface)
    if approach == 0.0:
        return
    for c in range(sens.shape[1]):
        slip = 0.0
        for k in range(NA):
            slip += SLIP_MATRIX[surface, k] * sens[RATES[k], c]
        for k in range(NA):
            sens[RATES[k], c] -= (dry[BEFORE, k] - dry[RATE, k]) * slip / approach


@internal
def _stick_and_slip(
    t, h, state, sens, voltage, parameters, columns, new_state, stages, by_parameter, lanes, dry
):
    """One step of _runge_kutta and _propagate through the stick-slip events within it."""
    remaining, linearise = h, sens.shape[1] > 0
    for event in range(EVENTS):
        acting = _acting(t, remaining, state, voltage, parameters)
        _stick_or_slip(t, state, acting, parameters, dry)
        for i in range(SURFACES):
            if dry[DIRECTION, i] == 0.0 and linearise:  # what would still slip is stopped at once
                dry[DIRECTION, i] = 1.0
                _rate(t, state, acting, parameters, dry)
                _store_rate(dry)
                dry[DIRECTION, i] = 0.0
                _rate(t, state, acting, parameters, dry)
                _saltation(sens, dry, i)
        _runge_kutta(t, remaining, state, voltage, parameters, new_state, dry, False, linearise, stages, by_parameter)
        first, landing, stepped = -1, remaining, remaining
        if event < EVENTS - 1:
            for i in range(SURFACES):
                start, end = _slip(state, i), _slip(new_state, i)
                rubs = dry[DIRECTION, i] != 0.0 and dry[UPPER, i] > dry[LOWER, i]
                if rubs and end * dry[DIRECTION, i] < 0.0 and abs(start) > AT_REST:
                    _rate(t, state, acting, parameters, dry)
                    start_rate = _slip_rate(dry, RATE, i)
                    _rate(t + remaining, new_state, acting, parameters, dry)
                    when = _zero_crossing(remaining, start, start_rate, end, _slip_rate(dry, RATE, i))
                    if when < landing:
                        first, landing = i, when
        if first >= 0:
            for _ in range(3):  # Newton on the step itself, whose error the interpolant does not see
                _runge_kutta(t, landing, state, voltage, parameters, new_state, dry, False, linearise, stages, by_parameter)
                stepped = landing
                _rate(t + landing, new_state, acting, parameters, dry)
                _store_rate(dry)
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
        _stick_or_slip(t, state, acting, parameters, dry)
        if dry[DIRECTION, first] != 0.0 and linearise:  # a reversal; sticking is handled where the next step begins
            _rate(t, state, acting, parameters, dry)
            _saltation(sens, dry, first)
        if remaining <= 0.0:
            return


@compiled
def acceleration(t, state, voltage, parameters):
    """Accelerations [rad/s²] in a state: (NQ,) of (NX,), or (NA,) where added states are given too; friction sticks where it can."""
    dry, now = np.zeros((6, max(NA, SURFACES))), np.zeros(NS)
    now[: state.size] = state
    acting = voltage
    _stick_or_slip(t, now, acting, parameters, dry)
    _rate(t, now, acting, parameters, dry)
    return dry[RATE, : NQ if state.size <= NX else NA].copy()


@internal
def _stick_slip_rate(t, state, voltage, parameters, dry):
    """Accelerations with the surfaces sticking or slipping as _stick_or_slip finds, into dry[RATE]."""
    _stick_or_slip(t, state, voltage, parameters, dry)
    _rate(t, state, voltage, parameters, dry)


@internal
def _delay_jump(sens, state, old, new, t, parameters, columns, dry):
    """Jump of the sensitivity in the input delay where the command switches from old to new."""
    for c in range(columns.size):
        if columns[c] == DELAY:
            _stick_slip_rate(t, state, old, parameters, dry)
            _store_rate(dry)
            _stick_slip_rate(t, state, new, parameters, dry)
            for k in range(NA):
                sens[RATES[k], NX + c] += dry[BEFORE, k] - dry[RATE, k]


@inlined
def _input_delay(parameters):
    """Input delay [s]: so much later a command acts."""
    return parameters[DELAY] if DELAY >= 0 else 0.0


@inlined
def _sensor_delay(parameters):
    """Sensor delay [s]: so much older than their time stamp are delayed readings."""
    return parameters[SENSOR_DELAY] if SENSOR_DELAY >= 0 else 0.0


@internal
def _acting_sample(t, k, when, parameters):
    """Index of the sample whose command acts just before the time ``when``, which is not after sample k."""
    delay = _input_delay(parameters)
    acting = max(k - 1, 0)
    while acting > 0 and t[acting] + delay > when:
        acting -= 1
    return acting


@internal
def _state_derivative(t, state, voltage, parameters, dry, slope):
    """Time derivative of the coordinates and rates, into slope (NX,)."""
    acting = voltage
    _stick_slip_rate(t, state, acting, parameters, dry)
    for k in range(NQ):
        slope[k], slope[NQ + k] = state[NQ + k], dry[RATE, k]


@inlined
def _plain_step(t, h, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters):
    """One step of the classical fourth-order method from state to state; all its numbers stay in registers."""
    old_theta_w = new_theta_w = theta_w
    old_theta_p = new_theta_p = theta_p
    old_dtheta_w = new_dtheta_w = dtheta_w
    old_dtheta_p = new_dtheta_p = dtheta_p
    start_theta_p, = _angles(t, theta_w, theta_p, dtheta_w, dtheta_p, parameters)
    sin_theta_p, cos_theta_p = start_sin_theta_p, start_cos_theta_p = _sine_pair(start_theta_p)
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters)
    new_theta_w += h / 6.0 * dtheta_w
    new_theta_p += h / 6.0 * dtheta_p
    new_dtheta_w += h / 6.0 * ddtheta_w
    new_dtheta_p += h / 6.0 * ddtheta_p
    theta_w, theta_p, dtheta_w, dtheta_p = old_theta_w + 0.5 * h * dtheta_w, old_theta_p + 0.5 * h * dtheta_p, old_dtheta_w + 0.5 * h * ddtheta_w, old_dtheta_p + 0.5 * h * ddtheta_p
    angle_theta_p, = _angles(t + 0.5 * h, theta_w, theta_p, dtheta_w, dtheta_p, parameters)
    sin_theta_p, cos_theta_p = _rotated_sines(angle_theta_p, start_theta_p, start_sin_theta_p, start_cos_theta_p)
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t + 0.5 * h, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters)
    new_theta_w += h / 3.0 * dtheta_w
    new_theta_p += h / 3.0 * dtheta_p
    new_dtheta_w += h / 3.0 * ddtheta_w
    new_dtheta_p += h / 3.0 * ddtheta_p
    theta_w, theta_p, dtheta_w, dtheta_p = old_theta_w + 0.5 * h * dtheta_w, old_theta_p + 0.5 * h * dtheta_p, old_dtheta_w + 0.5 * h * ddtheta_w, old_dtheta_p + 0.5 * h * ddtheta_p
    angle_theta_p, = _angles(t + 0.5 * h, theta_w, theta_p, dtheta_w, dtheta_p, parameters)
    sin_theta_p, cos_theta_p = _rotated_sines(angle_theta_p, start_theta_p, start_sin_theta_p, start_cos_theta_p)
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t + 0.5 * h, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters)
    new_theta_w += h / 3.0 * dtheta_w
    new_theta_p += h / 3.0 * dtheta_p
    new_dtheta_w += h / 3.0 * ddtheta_w
    new_dtheta_p += h / 3.0 * ddtheta_p
    theta_w, theta_p, dtheta_w, dtheta_p = old_theta_w + h * dtheta_w, old_theta_p + h * dtheta_p, old_dtheta_w + h * ddtheta_w, old_dtheta_p + h * ddtheta_p
    angle_theta_p, = _angles(t + h, theta_w, theta_p, dtheta_w, dtheta_p, parameters)
    sin_theta_p, cos_theta_p = _rotated_sines(angle_theta_p, start_theta_p, start_sin_theta_p, start_cos_theta_p)
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t + h, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters)
    new_theta_w += h / 6.0 * dtheta_w
    new_theta_p += h / 6.0 * dtheta_p
    new_dtheta_w += h / 6.0 * ddtheta_w
    new_dtheta_p += h / 6.0 * ddtheta_p
    return new_theta_w, new_theta_p, new_dtheta_w, new_dtheta_p


@inlined
def _plain_steps(begin, end, max_step, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters):
    """So many equal steps from one time to another, none longer than max_step."""
    steps = max(1, int(math.ceil((end - begin) / max_step - 1e-6)))
    h = (end - begin) / steps
    for step in range(steps):
        theta_w, theta_p, dtheta_w, dtheta_p = _plain_step(begin + step * h, h, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters)
    return theta_w, theta_p, dtheta_w, dtheta_p


@inlined
def _readings(t, theta_w, theta_p, dtheta_w, dtheta_p, parameters):
    """Readings of the sensors in a state."""
    reading_0 = theta_w
    reading_1 = theta_p
    reading_2 = dtheta_p

    return reading_0, reading_1, reading_2,


@compiled
def simulate(t, voltage, state, parameters, max_step):
    """States (N, NX) at the samples t (N,) under the commanded voltage (N,), from an initial state (NX,)."""
    states, frozen = np.empty((t.size, NX)), _frozen(parameters)
    theta_w, theta_p, dtheta_w, dtheta_p = state[0], state[1], state[2], state[3]
    states[0, 0], states[0, 1], states[0, 2], states[0, 3] = theta_w, theta_p, dtheta_w, dtheta_p
    for k in range(t.size - 1):
        theta_w, theta_p, dtheta_w, dtheta_p = _plain_steps(t[k], t[k + 1], max_step, theta_w, theta_p, dtheta_w, dtheta_p, voltage[k], frozen)
        states[k + 1, 0], states[k + 1, 1], states[k + 1, 2], states[k + 1, 3] = theta_w, theta_p, dtheta_w, dtheta_p
    return states


@compiled
def closed_loop(t, reference, reference_rate, gains, state, parameters, noise, quantum, max_step):
    """The machine under its PID controller: states (N, NX), measured (N, NY) and voltage (N,).

    At each sample the sensors read the state; noise (N, NY) is added, channels with a quantum > 0 are rounded to it, and
    the controller computes kp e + ki ∫e + kd ė from gains (3,), with e = reference − measured angle and ė = reference
    rate − measured rate; the voltage is held until the next sample.
    """
    states, measured, voltage = np.empty((t.size, NX)), np.empty((t.size, NY)), np.zeros(t.size)
    frozen, integral = _frozen(parameters), 0.0
    kp, ki, kd = gains[0], gains[1], gains[2]
    theta_w, theta_p, dtheta_w, dtheta_p = state[0], state[1], state[2], state[3]
    for k in range(t.size):
        states[k, 0], states[k, 1], states[k, 2], states[k, 3] = theta_w, theta_p, dtheta_w, dtheta_p
        reading_0, reading_1, reading_2, = _readings(t[k], theta_w, theta_p, dtheta_w, dtheta_p, frozen)
        reading_0 = _rounded(reading_0 + noise[k, 0], quantum[0])
        measured[k, 0] = reading_0
        reading_1 = _rounded(reading_1 + noise[k, 1], quantum[1])
        measured[k, 1] = reading_1
        reading_2 = _rounded(reading_2 + noise[k, 2], quantum[2])
        measured[k, 2] = reading_2
        error = reference[k] - reading_1
        if k > 0:
            integral += error * (t[k] - t[k - 1])
        v_in = kp * error + ki * integral + kd * (reference_rate[k] - reading_2)
        voltage[k] = v_in
        if k + 1 < t.size:
            theta_w, theta_p, dtheta_w, dtheta_p = _plain_steps(t[k], t[k + 1], max_step, theta_w, theta_p, dtheta_w, dtheta_p, v_in, frozen)
    return states, measured, voltage


@inlined
def _rounded(reading, quantum):
    """A reading in whole steps of a quantum, or as it is where that is not positive."""
    return np.round(reading / quantum) * quantum if quantum > 0.0 else reading


@compiled
def sensitivities(t, voltage, state, parameters, columns, max_step):
    """States (N, NX), readings (N, NY) and their derivatives (N, NY, NX + n).

    The derivatives are in the initial state, then in the n parameters whose indices are in columns (n,).
    """
    n = NX + columns.size
    states, readings, derivatives = np.empty((t.size, NX)), np.empty((t.size, NY)), np.empty((t.size, NY, n))
    now, sens, reading, rows, slope = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY), np.zeros((NY, n)), np.zeros(NX)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NR)), np.zeros((NY, FITTED + 1))
    acting = _acting_sample(t, FIRST_SAMPLE, t[0], parameters)
    _initial_state(t[0], t, voltage, acting, state, parameters, columns, now, sens)
    delay, sensor_delay, smooth, linearise = _input_delay(parameters), _sensor_delay(parameters), _is_frictionless(parameters), n > 0
    now_t, k, early = t[0], 0, 0
    while k < t.size:
        goal = max(now_t, min(t[k], t[early] - sensor_delay) if early < t.size else t[k])
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _delay_jump(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
            h = (until - now_t) / steps
            for step in range(steps):
                if smooth:
                    _slip_directions(now, dry)
                    _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, True, linearise, stages, by_parameter)
                    if linearise:
                        _propagate(h, sens, columns, stages, by_parameter, lanes)
                else:
                    _stick_and_slip(
                        now_t + step * h, h, now, sens, voltage[acting], parameters, columns, new_state, stages, by_parameter,
                        lanes, dry,
                    )  # fmt: skip
            now_t = until
        on_time, ahead = t[k] <= now_t, early < t.size and t[early] - sensor_delay <= now_t
        read_sensors(now_t, now, parameters, reading)
        _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
        _sensor_delay_jacobian(now_t, now, voltage[acting], parameters, columns, dry, slope, by_state, reading_by)
        for y in range(NY if SENSOR_DELAY >= 0 and early < t.size and t[early] - sensor_delay < t[0] else 0):
            reading_by[y, SENSOR_DELAY] = 0.0  # what was true before the log began is taken for what it began with
        _reading_jacobian(sens, by_state, reading_by, columns, rows)
        for y in range(NY):
            if ahead if DELAYED[y] else on_time:
                sample = early if DELAYED[y] else k
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
def _sensor_delay_jacobian(t, state, voltage, parameters, columns, dry, slope, by_state, by_parameter):
    """Derivatives of the delayed readings in the sensor delay: minus their time derivatives."""
    for c in range(columns.size):
        if SENSOR_DELAY >= 0 and columns[c] == SENSOR_DELAY:
            _state_derivative(t, state, voltage, parameters, dry, slope)
            for y in range(NY):
                if DELAYED[y]:
                    by_parameter[y, SENSOR_DELAY] = 0.0
                    for i in range(NX):
                        by_parameter[y, SENSOR_DELAY] -= by_state[y, i] * slope[i]


@inlined
def _reading_jacobian(sens, by_state, by_parameter, columns, rows):
    """Derivatives of the readings, one row each, from those of the state."""
    for y in range(NY):
        for c in range(sens.shape[1]):
            rows[y, c] = by_parameter[y, columns[c - NX]] if c >= NX else 0.0
        for i in range(NR):
            by = by_state[y, i]
            for c in range(sens.shape[1] if by != 0.0 else 0):
                rows[y, c] += by * sens[i, c]


@compiled
def shoot(t, voltage, measured, weight, bounds, states, parameters, columns, window, max_step, gram, residual):
    """Simulate every segment from its own initial state and gather the weighted least-squares problem.

    measured (N, NY) may hold NaN; weight (NY,) is 1/σ; bounds (S, 2) are half-open sample ranges; states (S, NX).
    gram (S, n+1, n+1) receives [J r]ᵀ[J r] with n = NX + columns.size: derivatives in the initial state, then in the
    parameters of columns. window (columns.size, 2) switches a parameter's derivative on for some samples of each segment.
    residual (N, NY) receives (measured − simulated) · weight, or nothing where it is (0, NY). Delayed readings of the time before a segment
    follow from its initial state, backward, in steps as long as each command acted. Added states carry over from the segment before.
    """
    n = NX + columns.size
    now, sens, reading, slope = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY), np.zeros(NX)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NR)), np.zeros((NY, FITTED + 1))
    rows, active, keep = np.zeros((NY, n + 1)), columns.copy(), residual.shape[0] > 0
    delay, sensor_delay, smooth, linearise = _input_delay(parameters), _sensor_delay(parameters), _is_frictionless(parameters), n > 0
    for s in range(bounds.shape[0]):
        gram[s] = 0.0
        k = early = bounds[s, 0]
        now_t = t[k]
        acting = _acting_sample(t, k, now_t, parameters)
        _initial_state(now_t, t, voltage, acting, states[s], parameters, columns, now, sens)
        carries = NV > NX and s + 1 < bounds.shape[0] and bounds[s + 1, 0] == bounds[s, 1]
        while k < bounds[s, 1] + carries:
            goal = max(now_t, min(t[k], t[early] - sensor_delay) if early < bounds[s, 1] else t[k])
            for c in range(columns.size):
                inside = window[c, 0] <= max(k - 1 - bounds[s, 0], 0) < window[c, 1]
                active[c] = columns[c] if inside else FITTED
            while now_t < goal:
                while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                    if linearise:
                        _delay_jump(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, active, dry)
                    acting += 1
                until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
                steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
                h = (until - now_t) / steps
                for step in range(steps):
                    if smooth:
                        _slip_directions(now, dry)
                        _runge_kutta(now_t + step * h, h, now, voltage[acting], parameters, now, dry, True, linearise, stages, by_parameter)
                        if linearise:
                            _propagate(h, sens, active, stages, by_parameter, lanes)
                    else:
                        _stick_and_slip(
                            now_t + step * h, h, now, sens, voltage[acting], parameters, active, new_state, stages, by_parameter,
                            lanes, dry,
                        )  # fmt: skip
                now_t = until
            on_time, ahead = t[k] <= now_t, early < bounds[s, 1] and t[early] - sensor_delay <= now_t
            if k < bounds[s, 1]:
                read_sensors(now_t, now, parameters, reading)
                _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
                _sensor_delay_jacobian(now_t, now, voltage[acting], parameters, columns, dry, slope, by_state, reading_by)
                for c in range(columns.size):
                    inside = window[c, 0] <= k - bounds[s, 0] < window[c, 1]
                    active[c] = columns[c] if inside else FITTED
                _reading_jacobian(sens, by_state, reading_by, active, rows)
                for y in range(NY):
                    sample = early if DELAYED[y] else k
                    missing = not (ahead if DELAYED[y] else on_time) or np.isnan(measured[min(sample, t.size - 1), y])
                    for c in range(n):
                        rows[y, c] = 0.0 if missing else rows[y, c] * weight[y]
                    rows[y, n] = 0.0
                    if not missing:
                        rows[y, n] = (measured[sample, y] - reading[y]) * weight[y]
                        if keep:
                            residual[sample, y] = rows[y, n]
                for a in range(n + 1):
                    for b in range(a + 1):
                        gram[s, a, b] += rows[0, a] * rows[0, b] + rows[1, a] * rows[1, b] + rows[2, a] * rows[2, b]
            early += ahead
            k += on_time
        for a in range(n + 1):
            for b in range(a):
                gram[s, b, a] = gram[s, a, b]


@compiled
def fit_initial_states(t, voltage, measured, weight, bounds, states, parameters, max_step, rounds, from_before):
    """Fit the initial states (S, NX) of segments one after the other, in place; added states carry over from one to the next.

    Coordinates and rates are fitted by Levenberg and Marquardt in at most ``rounds`` iterations; where ``from_before`` is
    set also from the state in which the segment before ended, of which the better fit is kept.
    """
    residual, gram, trial_gram = np.empty(measured.shape), np.zeros((1, NX + 1, NX + 1)), np.zeros((1, NX + 1, NX + 1))
    normal, step = np.zeros((NX, NX)), np.zeros(NX)
    start, other, arrived, ended = np.zeros((1, NV)), np.zeros((1, NV)), np.zeros(NV), FIRST_SAMPLE - 1
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
def filter_error(
    t, voltage, measured, weight, bounds, states, spread, parameters, columns, forces, mixing, reads, noise, max_step, parts,
    gram, log_det, innovation, means, covariances, transitions, samples,
):  # fmt: skip
    """Run an extended Kalman filter and gather its whitened innovations as a least-squares problem.

    measured (N, NY) may hold NaN; weight (NY,) is 1/σ; bounds (S, 2) are half-open sample ranges. Where one does not go
    on where the one before ended, the filter starts anew, in states (S, NX) with standard deviations spread (NS,).
    Sources, first-order and zero-mean with rms, correlation time and 1 or 0 noise (m, 3), act on the rows of the unknown
    forces (indices among the parameters) with the weights mixing (rows, m), and on readings with the weights reads
    (NY, m); with 1, as the error of a low-pass filter of this time does. While a surface may stick, the distribution has
    as many Gaussian parts as parts at most; otherwise one.
    gram (S, n + 1, n + 1) receives [J r]ᵀ[J r] of the whitened innovations and their derivatives in the n parameters of
    columns at the gains that the filter has; log_det (S,) the sums of log(variance · weight²). Where they are not
    empty, innovation (N, NY, 2) receives the whitened innovations and the logarithms of their variances [σ²], in these
    ranges alone and NaN where nothing is read; means (E, 2, NS + m), covariances (E, 2, NS + m, NS + m), transitions
    (E, NS + m, NS + m) and samples (E,) receive every step, predicted and then filtered.
    Returns the number of these steps.
    """
    n, m = columns.size, noise.shape[0]
    first, size = NS + forces.size, NS + m
    chosen = np.full(NS - NX + forces.size + n, FITTED, np.int64)
    chosen[NS - NX : first - NX], chosen[first - NX :] = forces, columns
    parameters = parameters.copy()
    now, sens, reading, slope = np.zeros(NS), np.zeros((NS, first + n)), np.zeros(NY), np.zeros(NR)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by, row = np.zeros((NY, NR)), np.zeros((NY, FITTED + 1)), np.zeros(n + 1)
    rubbing, friction, along, row_slope = np.zeros(SURFACES), np.zeros((2, SURFACES, n + 1)), np.zeros(NS), np.zeros(first + n)
    force, force_by, gain, crossed, by = np.zeros(m), np.zeros((m, n)), np.zeros(size), np.zeros(size), np.zeros(size)
    covariance, transition, product, added = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size)), np.zeros((NS, NS))
    before, sens_before, lagging = np.zeros(NS), np.zeros((NS, n)), np.any(noise[:, 2] != 0.0)
    delay, sensor_delay, linearise = _input_delay(parameters), _sensor_delay(parameters), True
    step_count, store, k, early, last, now_t, acting = 0, samples.size > 0, FIRST_SAMPLE, FIRST_SAMPLE, FIRST_SAMPLE, 0.0, FIRST_SAMPLE
    for s in range(bounds.shape[0]):
        gram[s], log_det[s] = 0.0, 0.0
        if s == 0 or bounds[s, 0] != bounds[s - 1, 1]:  # a stretch begins
            last = s
            while last + 1 < bounds.shape[0] and bounds[last + 1, 0] == bounds[last, 1]:
                last += 1
            k = early = bounds[s, 0]
            innovation[k : bounds[last, 1]] = np.nan
            now_t = t[k]
            acting = _acting_sample(t, k, now_t, parameters)
            _initial_state(now_t, t, voltage, acting, states[s], parameters, chosen, now, sens)
            _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
            _start_filter(sens, spread, by_state, reads, noise, force, force_by, covariance, transition)
            while early < bounds[last, 1] and t[early] - sensor_delay < now_t:
                early += 1  # what delayed sensors read of the time before is not known to the filter
        while k < bounds[s, 1]:
            goal = max(now_t, min(t[k], t[early] - sensor_delay) if early < bounds[last, 1] else t[k])
            if store:
                _stand_still(transitions[step_count])
            while now_t < goal:
                while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                    if linearise:
                        _delay_jump(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, chosen, dry)
                    acting += 1
                until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
                steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
                h = (until - now_t) / steps
                begin = now_t
                while begin < until:
                    length = until - begin if until - begin < 1.5 * h else h
                    end = begin + length if length < until - begin else until
                    if lagging:
                        before[:], sens_before[:] = now, sens[:, first:]
                    _hold_forces(sens, force, mixing, forces, rubbing, parameters)
                    for i in range(SURFACES):
                        dry[DIRECTION, i] = 0.0  # friction is one of the held forces
                    _runge_kutta(begin, length, now, voltage[acting], parameters, now, dry, True, True, stages, by_parameter)
                    _propagate(length, sens, chosen, stages, by_parameter, lanes)
                    _move_sources(length, sens, mixing, noise, force, force_by, transition)
                    if lagging:
                        _lag_sensors(length, before, sens_before, now, sens, by_state, reads, noise, force, force_by, transition)
                    _spread(noise, added, covariance, transition, product)
                    if store:
                        _follow(transition, transitions[step_count], product)
                    begin = end
                now_t = until
            on_time, ahead = t[k] <= now_t, early < bounds[last, 1] and t[early] - sensor_delay <= now_t
            if store:
                _store_step(step_count, 0, now, force, covariance, means, covariances)
                samples[step_count] = k
            read_sensors(now_t, now, parameters, reading)
            _sensor_jacobian(now_t, now, parameters, by_state, reading_by)
            _sensor_delay_jacobian(now_t, now, voltage[acting], parameters, chosen, dry, slope, by_state, reading_by)
            for i in range(NR):
                slope[i] = now[i]  # about which the readings are linear
            for y in range(NY):
                sample = early if DELAYED[y] else k
                if not (ahead if DELAYED[y] else on_time) or np.isnan(measured[sample, y]):
                    continue
                error = measured[sample, y] - reading[y]
                for i in range(NR):
                    error -= by_state[y, i] * (now[i] - slope[i])
                for j in range(m):
                    error -= reads[y, j] * force[j]
                for c in range(n):
                    row[c] = reading_by[y, columns[c]]
                    for i in range(NR):
                        row[c] += by_state[y, i] * sens[i, first + c]
                    for j in range(m):
                        row[c] += reads[y, j] * force_by[j, c]
                _reading_direction(y, by_state, reads, by)
                root = _assimilate(error, 1.0 / weight[y] ** 2, by, row, now, sens, force, force_by, covariance, product, gain, crossed)
                white, log_variance = error / root, 2.0 * math.log(root * weight[y])
                log_det[s] += log_variance
                for c in range(n):
                    row[c] /= root
                row[n] = white
                for a in range(n + 1):
                    for b in range(a + 1):
                        gram[s, a, b] += row[a] * row[b]
                if innovation.shape[0] > 0:
                    innovation[sample, y, 0], innovation[sample, y, 1] = row[n], log_variance
            if store:
                _store_step(step_count, 1, now, force, covariance, means, covariances)
            step_count += 1
            early += ahead
            k += on_time
        for a in range(n + 1):
            for b in range(a):
                gram[s, b, a] = gram[s, a, b]
    return step_count


@internal
def _start_filter(sens, spread, by_state, reads, noise, force, force_by, covariance, transition):
    """Start with states of standard deviations spread (NS,) and sources of their own rms, both regardless of parameters.

    What a low-pass filter has of a sensor's past is as unknown as the state.
    """
    sens[:], force[:], force_by[:], covariance[:], transition[:] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(NS):
        covariance[i, i], transition[i, i] = spread[i] ** 2, 1.0
    for j in range(force.size):
        covariance[NS + j, NS + j], transition[NS + j, NS + j] = noise[j, 0] ** 2, 1.0
        for i in range(NR):
            for y in range(NY):
                covariance[NS + j, NS + j] += noise[j, 2] * (reads[y, j] * by_state[y, i] * spread[i]) ** 2


@inlined
def _hold_forces(sens, force, mixing, forces, rubbing, parameters):
    """Let the random forces and friction act on their rows over a step that is linear in the states and in these forces."""
    for r in range(forces.size):
        total = 0.0
        for i in range(SURFACES):
            total -= SLIP_MATRIX[i, r] * rubbing[i]
        for j in range(force.size):
            total += mixing[r, j] * force[j]
        parameters[forces[r]] = total
    for i in range(NS):
        for c in range(NS + forces.size):
            sens[i, c] = 1.0 if i == c else 0.0


@inlined
def _move_sources(elapsed, sens, mixing, noise, force, force_by, transition):
    """Decay the sources over a step, and set the transition of the variables from the sensitivities of the states over it."""
    rows, count = mixing.shape[0], force_by.shape[1]
    for i in range(NS):
        for j in range(NS):
            transition[i, j] = sens[i, j]
        for j in range(force.size):
            total = 0.0
            for r in range(rows):
                total += sens[i, NS + r] * mixing[r, j]
            transition[i, NS + j] = total
            for c in range(count):
                sens[i, NS + rows + c] += total * force_by[j, c]
    for j in range(force.size):
        decay = math.exp(-elapsed / noise[j, 1])
        transition[NS + j, NS + j] = decay
        force[j] *= decay
        for c in range(count):
            force_by[j, c] *= decay


@internal
def _lag_sensors(elapsed, before, sens_before, now, sens, by_state, reads, noise, force, force_by, transition):
    """Move the errors of sensors behind a low-pass filter by what these should read: e' = -e/T - y'."""
    first = sens.shape[1] - force_by.shape[1]
    for j in range(force.size):
        if noise[j, 2] == 0.0:
            continue
        share = noise[j, 1] * (1.0 - transition[NS + j, NS + j]) / elapsed
        for v in range(transition.shape[0]):
            moved = 0.0
            for i in range(NR):
                for y in range(NY):
                    moved += reads[y, j] * by_state[y, i] * (transition[i, v] - (1.0 if i == v else 0.0))
            if v != NS + j:
                transition[NS + j, v] = -share * moved
        for i in range(NR):
            for y in range(NY):
                along = share * reads[y, j] * by_state[y, i]
                force[j] -= along * (now[i] - before[i])
                for c in range(force_by.shape[1]):
                    force_by[j, c] -= along * (sens[i, first + c] - sens_before[i, c])


@inlined
def _spread(noise, added, covariance, transition, product):
    """Covariance of the variables after a step, from their transition, what is added to the states, and the sources' noise.

    What is known exactly, as an added state that its effect does not use is, takes no time.
    """
    size = covariance.shape[0]
    for i in range(size):
        for j in range(size):
            product[i, j] = 0.0
        for k in range(size):
            by = transition[i, k]
            if by != 0.0 and covariance[k, k] != 0.0:
                for j in range(size):
                    product[i, j] += by * covariance[k, j]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(size):
                total += product[i, k] * transition[j, k]
            covariance[i, j] = covariance[j, i] = total
    for i in range(NS):
        for j in range(NS):
            covariance[i, j] += added[i, j]
    for j in range(noise.shape[0]):
        covariance[NS + j, NS + j] += noise[j, 0] ** 2 * (1.0 - transition[NS + j, NS + j] ** 2)


@inlined
def _reading_direction(y, by_state, reads, by):
    """Derivatives of a reading in the variables, into by (variables,): in the states, then in the sources."""
    for i in range(by.size):
        by[i] = by_state[y, i] if i < NR else 0.0 if i < NS else reads[y, i - NS]


@inlined
def _learn(variance, by, covariance, shown, gain, crossed):
    """Update a covariance by a reading, in Joseph's form, which keeps it positive. Returns the variance of the error.

    The gain stands in gain then; crossed and shown (variables,) are scratch.
    """
    total = variance
    for i in range(by.size):
        crossed[i] = shown[i] = 0.0
    for k in range(by.size):
        if by[k] != 0.0:  # a reading shows few of the variables
            for i in range(by.size):
                crossed[i] += by[k] * covariance[k, i]
    for k in range(by.size):
        total += by[k] * crossed[k]
    for i in range(by.size):
        gain[i] = crossed[i] / total
    for k in range(by.size):
        if by[k] != 0.0:
            for i in range(by.size):
                shown[i] += by[k] * (covariance[k, i] - gain[i] * crossed[k])
    for i in range(by.size):
        for j in range(i + 1 if gain[i] != 0.0 else 0):
            left = covariance[i, j] - gain[i] * crossed[j] - shown[i] * gain[j]
            covariance[i, j] = covariance[j, i] = left + gain[i] * variance * gain[j]
    return total


@inlined
def _assimilate(error, variance, by, row, now, sens, force, force_by, covariance, product, gain, crossed):
    """Update by a reading: error and its derivatives row (n,) in the parameters, which both begin to count less.

    Returns the standard deviation of the error.
    """
    rows, count = sens.shape[1] - force_by.shape[1], force_by.shape[1]
    total = _learn(variance, by, covariance, product[0], gain, crossed)
    for i in range(NS):
        now[i] += gain[i] * error
        for c in range(count):
            sens[i, rows + c] -= gain[i] * row[c]
    for j in range(force.size):
        force[j] += gain[NS + j] * error
        for c in range(count):
            force_by[j, c] -= gain[NS + j] * row[c]
    return math.sqrt(total)


@internal
def _stand_still(moved):
    """The transition (variables, variables) over no time at all."""
    moved[:] = 0.0
    for i in range(moved.shape[0]):
        moved[i, i] = 1.0


@internal
def _follow(transition, moved, product):
    """Put a transition after those that moved holds."""
    size = moved.shape[0]
    for i in range(size):
        for j in range(size):
            product[i, j] = 0.0
            for k in range(size):
                product[i, j] += transition[i, k] * moved[k, j]
    moved[:] = product


@internal
def _store_step(number, which, now, force, covariance, means, covariances):
    """Store mean and covariance of a step: predicted (0) or filtered (1)."""
    for i in range(NS):
        means[number, which, i] = now[i]
    for j in range(force.size):
        means[number, which, NS + j] = force[j]
    covariances[number, which] = covariance


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


SIGNALS, FEATURES = 9, 8
DERIVATIVES = np.array([0, 0, 1, 1, 1, 1, 2, 2, 0])  # how often each signal is differentiated
HELD_INPUT = np.array([False, False, False, False, False, False, False, False, True])  # whether it is constant between samples
UNMEASURED = np.array([2])  # states that no sensor reads: rates of coordinates
Z1, Z2, OLD, NEW, STATE = 0, 1, 2, 3, 4  # rows of the filters' memory
MIXING = np.array([((0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)), ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0), (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))], dtype=np.float64)  # weights of the features in [φ τ], by row


@inlined
def _signals(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_p, cos_theta_p, parameters):
    """Distinct quantities that enter the filters."""
    signal_0 = dtheta_p*dtheta_w*sin_theta_p
    signal_1 = sin_theta_p
    signal_2 = cos_theta_p*dtheta_p
    signal_3 = theta_w
    signal_4 = theta_p
    signal_5 = cos_theta_p*dtheta_w
    signal_6 = theta_w
    signal_7 = theta_p
    signal_8 = v_in

    return signal_0, signal_1, signal_2, signal_3, signal_4, signal_5, signal_6, signal_7, signal_8,


@internal
def _signals_at(t, state, voltage, parameters, signal):
    """_signals in a state (NX,), into signal (SIGNALS,)."""
    angle_theta_p, = _angles(t, state[0], state[1], state[2], state[3], _frozen(parameters))
    signal[0], signal[1], signal[2], signal[3], signal[4], signal[5], signal[6], signal[7], signal[8], = _signals(t, state[0], state[1], state[2], state[3], voltage, math.sin(angle_theta_p), math.cos(angle_theta_p), parameters)


@internal
def _signal_rates(t, state, voltage, parameters, speed):
    """Time derivatives of the signals that are differentiated twice, into speed (SIGNALS,)."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    speed[6] = dtheta_w
    speed[7] = dtheta_p


@inlined
def _features(signal_0, signal_1, signal_2, signal_3, signal_4, signal_5, signal_6, signal_7, signal_8):
    """Sums of filtered signals that always come together."""
    feature_0 = -signal_0 - signal_5
    feature_1 = signal_1
    feature_2 = signal_2
    feature_3 = signal_3
    feature_4 = -signal_4
    feature_5 = signal_6
    feature_6 = -signal_7
    feature_7 = signal_8

    return feature_0, feature_1, feature_2, feature_3, feature_4, feature_5, feature_6, feature_7,


@internal
def _assemble(signal, tau, phi):
    """Filtered left side and regressor from the filtered signals (paper eqs. 39, 40)."""
    feature_0, feature_1, feature_2, feature_3, feature_4, feature_5, feature_6, feature_7, = _features(signal[0], signal[1], signal[2], signal[3], signal[4], signal[5], signal[6], signal[7], signal[8])
    c0 = feature_5 + feature_6
    tau[0] = feature_7
    tau[1] = feature_7
    phi[0, 0] = feature_5
    phi[0, 1] = c0
    phi[0, 2] = feature_2
    phi[0, 5] = feature_3
    phi[0, 6] = feature_4
    phi[1, 1] = c0
    phi[1, 2] = feature_0
    phi[1, 3] = feature_6
    phi[1, 4] = feature_1
    phi[1, 5] = feature_3
    phi[1, 6] = feature_4


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
    """Zeroed memory of the filters between two samples, (5, max(SIGNALS, NX))."""
    return np.zeros((5, max(SIGNALS, NX)))


@compiled
def filter_start(t, state, voltage, parameters, weights, memory):
    """Set the filters' memory at the first sample, from the state (NX,) believed there (the paper's eq. 42)."""
    tau1, tau2 = weights[7], weights[8]
    value, speed = memory[OLD], memory[NEW]
    _signals_at(t, state, voltage, parameters, value)
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
    _signals_at(t, now, old_voltage, parameters, memory[OLD])
    for x in range(NX):
        now[x] = state[x]
    for x in UNMEASURED:
        now[x] = (state[x - NQ] - old_state[x - NQ]) / h
    _signals_at(t + h, now, voltage, parameters, memory[NEW])
    for s in range(SIGNALS):
        old = memory[OLD, s]
        end = old if HELD_INPUT[s] or not first_order_hold else memory[NEW, s]
        memory[Z2, s] = weights[1] * memory[Z2, s] + weights[2] * memory[Z1, s] + weights[5] * old + weights[6] * end
        memory[Z1, s] = weights[0] * memory[Z1, s] + weights[3] * old + weights[4] * end


@compiled
def filter_output(t, state, voltage, parameters, weights, memory, tau, phi):
    """Filtered left side, into tau (NQ,), and regressor, into phi (NQ, len(LINEAR)), at a sample.

    No acceleration is formed: a derivative is taken of the filter's output instead.
    """
    tau1, tau2 = weights[7], weights[8]
    value = memory[NEW]
    _signals_at(t, state, voltage, parameters, value)
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
def filter_onward(t, states, voltage, parameters, tau1, tau2, first_order_hold, memory):
    """filter_regressor for samples 1 to N - 1 from the filters' memory at sample 0, which ends at the last: (N - 1, ...)."""
    taus, phis = np.zeros((t.size - 1, NQ)), np.zeros((t.size - 1, NQ, len(LINEAR)))
    weights, times = np.zeros(10), (tau1, tau2)
    for k in range(1, t.size):
        _filter_sample(
            k, t, states, voltage, parameters, times, first_order_hold, states[0], weights, memory, taus[k - 1], phis[k - 1]
        )
    return taus, phis


@compiled
def recursive_update(estimate, covariance, phi, tau, forgetting):
    """One recursive least-squares update in place: estimate (n,), covariance (n, n), one row phi (n,), its left side tau.

    n is len(LINEAR); sizes are not checked.
    Without loops the numbers stay in registers, and sums in halves need not wait for each other. Of the covariance only
    the lower half is read.
    """
    phi_0, phi_1, phi_2, phi_3, phi_4, phi_5, phi_6, = phi[0], phi[1], phi[2], phi[3], phi[4], phi[5], phi[6],
    gain_0 = (covariance[0, 0] * phi_0 + covariance[1, 0] * phi_1 + covariance[2, 0] * phi_2 + covariance[3, 0] * phi_3) + (covariance[4, 0] * phi_4 + covariance[5, 0] * phi_5 + covariance[6, 0] * phi_6)
    gain_1 = (covariance[1, 0] * phi_0 + covariance[1, 1] * phi_1 + covariance[2, 1] * phi_2 + covariance[3, 1] * phi_3) + (covariance[4, 1] * phi_4 + covariance[5, 1] * phi_5 + covariance[6, 1] * phi_6)
    gain_2 = (covariance[2, 0] * phi_0 + covariance[2, 1] * phi_1 + covariance[2, 2] * phi_2 + covariance[3, 2] * phi_3) + (covariance[4, 2] * phi_4 + covariance[5, 2] * phi_5 + covariance[6, 2] * phi_6)
    gain_3 = (covariance[3, 0] * phi_0 + covariance[3, 1] * phi_1 + covariance[3, 2] * phi_2 + covariance[3, 3] * phi_3) + (covariance[4, 3] * phi_4 + covariance[5, 3] * phi_5 + covariance[6, 3] * phi_6)
    gain_4 = (covariance[4, 0] * phi_0 + covariance[4, 1] * phi_1 + covariance[4, 2] * phi_2 + covariance[4, 3] * phi_3) + (covariance[4, 4] * phi_4 + covariance[5, 4] * phi_5 + covariance[6, 4] * phi_6)
    gain_5 = (covariance[5, 0] * phi_0 + covariance[5, 1] * phi_1 + covariance[5, 2] * phi_2 + covariance[5, 3] * phi_3) + (covariance[5, 4] * phi_4 + covariance[5, 5] * phi_5 + covariance[6, 5] * phi_6)
    gain_6 = (covariance[6, 0] * phi_0 + covariance[6, 1] * phi_1 + covariance[6, 2] * phi_2 + covariance[6, 3] * phi_3) + (covariance[6, 4] * phi_4 + covariance[6, 5] * phi_5 + covariance[6, 6] * phi_6)
    spread = (forgetting + phi_0 * gain_0 + phi_1 * gain_1 + phi_2 * gain_2 + phi_3 * gain_3) + (phi_4 * gain_4 + phi_5 * gain_5 + phi_6 * gain_6)
    share = (tau - (phi_0 * estimate[0] + phi_1 * estimate[1] + phi_2 * estimate[2] + phi_3 * estimate[3]) - (phi_4 * estimate[4] + phi_5 * estimate[5] + phi_6 * estimate[6])) / spread
    shrink, grow = 1.0 / (spread * forgetting), 1.0 / forgetting
    estimate[0] += gain_0 * share
    shrunk_0 = gain_0 * shrink
    covariance[0, 0] = covariance[0, 0] * grow - shrunk_0 * gain_0
    estimate[1] += gain_1 * share
    shrunk_1 = gain_1 * shrink
    covariance[1, 0] = covariance[0, 1] = covariance[1, 0] * grow - shrunk_1 * gain_0
    covariance[1, 1] = covariance[1, 1] * grow - shrunk_1 * gain_1
    estimate[2] += gain_2 * share
    shrunk_2 = gain_2 * shrink
    covariance[2, 0] = covariance[0, 2] = covariance[2, 0] * grow - shrunk_2 * gain_0
    covariance[2, 1] = covariance[1, 2] = covariance[2, 1] * grow - shrunk_2 * gain_1
    covariance[2, 2] = covariance[2, 2] * grow - shrunk_2 * gain_2
    estimate[3] += gain_3 * share
    shrunk_3 = gain_3 * shrink
    covariance[3, 0] = covariance[0, 3] = covariance[3, 0] * grow - shrunk_3 * gain_0
    covariance[3, 1] = covariance[1, 3] = covariance[3, 1] * grow - shrunk_3 * gain_1
    covariance[3, 2] = covariance[2, 3] = covariance[3, 2] * grow - shrunk_3 * gain_2
    covariance[3, 3] = covariance[3, 3] * grow - shrunk_3 * gain_3
    estimate[4] += gain_4 * share
    shrunk_4 = gain_4 * shrink
    covariance[4, 0] = covariance[0, 4] = covariance[4, 0] * grow - shrunk_4 * gain_0
    covariance[4, 1] = covariance[1, 4] = covariance[4, 1] * grow - shrunk_4 * gain_1
    covariance[4, 2] = covariance[2, 4] = covariance[4, 2] * grow - shrunk_4 * gain_2
    covariance[4, 3] = covariance[3, 4] = covariance[4, 3] * grow - shrunk_4 * gain_3
    covariance[4, 4] = covariance[4, 4] * grow - shrunk_4 * gain_4
    estimate[5] += gain_5 * share
    shrunk_5 = gain_5 * shrink
    covariance[5, 0] = covariance[0, 5] = covariance[5, 0] * grow - shrunk_5 * gain_0
    covariance[5, 1] = covariance[1, 5] = covariance[5, 1] * grow - shrunk_5 * gain_1
    covariance[5, 2] = covariance[2, 5] = covariance[5, 2] * grow - shrunk_5 * gain_2
    covariance[5, 3] = covariance[3, 5] = covariance[5, 3] * grow - shrunk_5 * gain_3
    covariance[5, 4] = covariance[4, 5] = covariance[5, 4] * grow - shrunk_5 * gain_4
    covariance[5, 5] = covariance[5, 5] * grow - shrunk_5 * gain_5
    estimate[6] += gain_6 * share
    shrunk_6 = gain_6 * shrink
    covariance[6, 0] = covariance[0, 6] = covariance[6, 0] * grow - shrunk_6 * gain_0
    covariance[6, 1] = covariance[1, 6] = covariance[6, 1] * grow - shrunk_6 * gain_1
    covariance[6, 2] = covariance[2, 6] = covariance[6, 2] * grow - shrunk_6 * gain_2
    covariance[6, 3] = covariance[3, 6] = covariance[6, 3] * grow - shrunk_6 * gain_3
    covariance[6, 4] = covariance[4, 6] = covariance[6, 4] * grow - shrunk_6 * gain_4
    covariance[6, 5] = covariance[5, 6] = covariance[6, 5] * grow - shrunk_6 * gain_5
    covariance[6, 6] = covariance[6, 6] * grow - shrunk_6 * gain_6


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


BLOCK_SIZE, PARTIAL_SUMS = 64, 16  # samples that are worked on side by side, and sums that are kept apart: with these all stays in the nearest cache
INTERVAL_TOLERANCE = 1e-6  # by which share the interval may differ within a block
BLOCK_STRIDE = BLOCK_SIZE + 8  # room for the sample before a block
SINES = NX * BLOCK_STRIDE  # rows of the scratch array of a block: states, sines and cosines, what enters the filters and leaves them, features
FIRST_IN = SINES + 2 * BLOCK_STRIDE
FILTERS = 7  # signals that are the same, and differ in their derivatives alone, share one
SECOND_IN, VALUE, FREE_DECAY = FIRST_IN + FILTERS * BLOCK_SIZE, FIRST_IN + 2 * FILTERS * BLOCK_SIZE, FIRST_IN + 3 * FILTERS * BLOCK_SIZE
FEATURE = FREE_DECAY + 3 * BLOCK_SIZE


@compiled
def filtered_gram(t, states, voltage, parameters, tau1, tau2, first_order_hold, memory, gram):
    """Add [φ τ]ᵀ[φ τ] of the filtered rows of samples 1 to N - 1, as of filter_regressor, to gram (n + 1, n + 1), n = len(LINEAR).

    ``memory`` is the filters' at sample 0, as filter_start sets it, and ends at the last: a log may be handed over in
    pieces that share one sample. The square root of the condition of the scaled gram is that of the regressor: above 1e5
    digits are lost that a QR decomposition would keep.
    """
    products, weights = np.zeros((FEATURES, FEATURES, PARTIAL_SUMS)), np.zeros(10)
    lanes, value, tau, phi = np.zeros(FEATURE + FEATURES * BLOCK_SIZE), np.zeros(SIGNALS), np.zeros(NQ), np.zeros((NQ, len(LINEAR)))
    k = 1
    while k < t.size:
        if k + BLOCK_SIZE <= t.size:
            if abs(t[k] - t[k - 1] - weights[9]) > INTERVAL_TOLERANCE * weights[9]:
                weights[9] = t[k] - t[k - 1]
                weights[:9] = filter_weights(weights[9], tau1, tau2)
                _free_decay(weights, lanes)
            ahead, h, uneven = t[k : k + BLOCK_SIZE], weights[9], 0
            for c in range(1, BLOCK_SIZE):
                uneven += abs(ahead[c] - ahead[c - 1] - h) > INTERVAL_TOLERANCE * h
            if uneven == 0:
                _filter_block(k, h, t, states, voltage, parameters, weights, first_order_hold, memory, lanes, products)
                k += BLOCK_SIZE
                continue
        for k in range(k, min(k + BLOCK_SIZE, t.size)):
            _filter_sample(
                k, t, states, voltage, parameters, (tau1, tau2), first_order_hold, states[0], weights, memory, tau, phi
            )
            for row in range(NQ):
                for a in range(len(LINEAR) + 1):
                    for b in range(len(LINEAR) + 1):
                        gram[a, b] += (phi[row, a] if a < len(LINEAR) else tau[row]) * (phi[row, b] if b < len(LINEAR) else tau[row])
        k += 1
    _add_feature_products(products, gram)


@internal
def _free_decay(weights, lanes):
    """Free response of the filters 1, 2, ... samples later: of z1 in z1, of z2 in z2, and of z1 in z2."""
    first, second, coupled = 1.0, 1.0, 0.0
    for c in range(BLOCK_SIZE):
        coupled = weights[1] * coupled + weights[2] * first
        first, second = weights[0] * first, weights[1] * second
        lanes[FREE_DECAY + c], lanes[FREE_DECAY + BLOCK_SIZE + c], lanes[FREE_DECAY + 2 * BLOCK_SIZE + c] = first, second, coupled


@internal
def _filter_block(k, h, t, states, voltage, parameters, weights, first_order_hold, memory, lanes, products):
    """Take the filters over the BLOCK_SIZE samples from k on, at intervals h, and add up the products of the features.

    What samples do not need of each other is done for all of them side by side, one pass after the other; the rows of
    one array at fixed distances are seen not to overlap. Only the filters go sample by sample. Signals that are the same
    quantity, differentiated once and twice, share one; what they began with differs, and that decays by itself.
    """
    frozen = _frozen(parameters)
    w0, w1, w2, w3, w4, w5, w6 = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5], weights[6]
    by1, by2 = 1.0 / weights[7], 1.0 / weights[8]
    ahead = 1.0 if first_order_hold else 0.0
    t, states, voltage = t[k - 1 : k + BLOCK_SIZE], states[k - 1 : k + BLOCK_SIZE], voltage[k - 1 : k + BLOCK_SIZE]  # indices from 0 are seen not to be negative
    for c in range(BLOCK_SIZE + 1):
        lanes[0 * BLOCK_STRIDE + c] = states[c, 0]
        lanes[1 * BLOCK_STRIDE + c] = states[c, 1]
        lanes[2 * BLOCK_STRIDE + c] = states[c, 2]
        lanes[3 * BLOCK_STRIDE + c] = states[c, 3]
    for c in range(BLOCK_SIZE + 1):
        angle_theta_p, = _angles(t[c], lanes[0 * BLOCK_STRIDE + c], lanes[1 * BLOCK_STRIDE + c], lanes[2 * BLOCK_STRIDE + c], lanes[3 * BLOCK_STRIDE + c], frozen)
        lanes[SINES + 0 * BLOCK_STRIDE + c], lanes[SINES + 1 * BLOCK_STRIDE + c] = _sine_pair(angle_theta_p)
    for c in range(BLOCK_SIZE):
        theta_w_old, theta_w = lanes[0 * BLOCK_STRIDE + c], lanes[0 * BLOCK_STRIDE + c + 1]
        theta_p_old, theta_p = lanes[1 * BLOCK_STRIDE + c], lanes[1 * BLOCK_STRIDE + c + 1]
        dtheta_w_old, dtheta_w = lanes[2 * BLOCK_STRIDE + c], lanes[2 * BLOCK_STRIDE + c + 1]
        dtheta_p_old, dtheta_p = lanes[3 * BLOCK_STRIDE + c], lanes[3 * BLOCK_STRIDE + c + 1]
        dtheta_w_old = dtheta_w = (theta_w - theta_w_old) / h
        old_0, old_1, old_2, old_3, old_4, old_5, old_6, old_7, old_8, = _signals(t[c], theta_w_old, theta_p_old, dtheta_w_old, dtheta_p_old, voltage[c], lanes[SINES + 0 * BLOCK_STRIDE + c], lanes[SINES + 1 * BLOCK_STRIDE + c], frozen)
        new_0, new_1, new_2, new_3, new_4, new_5, new_6, new_7, new_8, = _signals(t[c + 1], theta_w, theta_p, dtheta_w, dtheta_p, voltage[c + 1], lanes[SINES + 0 * BLOCK_STRIDE + c + 1], lanes[SINES + 1 * BLOCK_STRIDE + c + 1], frozen)
        end_0 = old_0 + ahead * (new_0 - old_0)
        lanes[FIRST_IN + 0 * BLOCK_SIZE + c] = w3 * old_0 + w4 * end_0
        lanes[SECOND_IN + 0 * BLOCK_SIZE + c] = w5 * old_0 + w6 * end_0
        end_1 = old_1 + ahead * (new_1 - old_1)
        lanes[FIRST_IN + 1 * BLOCK_SIZE + c] = w3 * old_1 + w4 * end_1
        lanes[SECOND_IN + 1 * BLOCK_SIZE + c] = w5 * old_1 + w6 * end_1
        end_2 = old_2 + ahead * (new_2 - old_2)
        lanes[FIRST_IN + 2 * BLOCK_SIZE + c] = w3 * old_2 + w4 * end_2
        lanes[SECOND_IN + 2 * BLOCK_SIZE + c] = w5 * old_2 + w6 * end_2
        end_3 = old_3 + ahead * (new_3 - old_3)
        lanes[FIRST_IN + 3 * BLOCK_SIZE + c] = w3 * old_3 + w4 * end_3
        lanes[SECOND_IN + 3 * BLOCK_SIZE + c] = w5 * old_3 + w6 * end_3
        lanes[VALUE + 3 * BLOCK_SIZE + c] = new_3
        end_4 = old_4 + ahead * (new_4 - old_4)
        lanes[FIRST_IN + 4 * BLOCK_SIZE + c] = w3 * old_4 + w4 * end_4
        lanes[SECOND_IN + 4 * BLOCK_SIZE + c] = w5 * old_4 + w6 * end_4
        lanes[VALUE + 4 * BLOCK_SIZE + c] = new_4
        end_5 = old_5 + ahead * (new_5 - old_5)
        lanes[FIRST_IN + 5 * BLOCK_SIZE + c] = w3 * old_5 + w4 * end_5
        lanes[SECOND_IN + 5 * BLOCK_SIZE + c] = w5 * old_5 + w6 * end_5
        end_8 = old_8
        lanes[FIRST_IN + 6 * BLOCK_SIZE + c] = w3 * old_8 + w4 * end_8
        lanes[SECOND_IN + 6 * BLOCK_SIZE + c] = w5 * old_8 + w6 * end_8
    first_0, second_0 = memory[Z1, 0], memory[Z2, 0]
    first_1, second_1 = memory[Z1, 1], memory[Z2, 1]
    first_2, second_2 = memory[Z1, 2], memory[Z2, 2]
    first_3, second_3 = memory[Z1, 3], memory[Z2, 3]
    apart_6, apart2_6 = memory[Z1, 6] - first_3, memory[Z2, 6] - second_3
    first_4, second_4 = memory[Z1, 4], memory[Z2, 4]
    apart_7, apart2_7 = memory[Z1, 7] - first_4, memory[Z2, 7] - second_4
    first_5, second_5 = memory[Z1, 5], memory[Z2, 5]
    first_8, second_8 = memory[Z1, 8], memory[Z2, 8]
    for c in range(BLOCK_SIZE):
        second_0 = w1 * second_0 + (w2 * first_0 + lanes[SECOND_IN + 0 * BLOCK_SIZE + c])
        first_0 = w0 * first_0 + lanes[FIRST_IN + 0 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 0 * BLOCK_SIZE + c], lanes[SECOND_IN + 0 * BLOCK_SIZE + c] = first_0, second_0
        second_1 = w1 * second_1 + (w2 * first_1 + lanes[SECOND_IN + 1 * BLOCK_SIZE + c])
        first_1 = w0 * first_1 + lanes[FIRST_IN + 1 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 1 * BLOCK_SIZE + c], lanes[SECOND_IN + 1 * BLOCK_SIZE + c] = first_1, second_1
        second_2 = w1 * second_2 + (w2 * first_2 + lanes[SECOND_IN + 2 * BLOCK_SIZE + c])
        first_2 = w0 * first_2 + lanes[FIRST_IN + 2 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 2 * BLOCK_SIZE + c], lanes[SECOND_IN + 2 * BLOCK_SIZE + c] = first_2, second_2
        second_3 = w1 * second_3 + (w2 * first_3 + lanes[SECOND_IN + 3 * BLOCK_SIZE + c])
        first_3 = w0 * first_3 + lanes[FIRST_IN + 3 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 3 * BLOCK_SIZE + c], lanes[SECOND_IN + 3 * BLOCK_SIZE + c] = first_3, second_3
        second_4 = w1 * second_4 + (w2 * first_4 + lanes[SECOND_IN + 4 * BLOCK_SIZE + c])
        first_4 = w0 * first_4 + lanes[FIRST_IN + 4 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 4 * BLOCK_SIZE + c], lanes[SECOND_IN + 4 * BLOCK_SIZE + c] = first_4, second_4
        second_5 = w1 * second_5 + (w2 * first_5 + lanes[SECOND_IN + 5 * BLOCK_SIZE + c])
        first_5 = w0 * first_5 + lanes[FIRST_IN + 5 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 5 * BLOCK_SIZE + c], lanes[SECOND_IN + 5 * BLOCK_SIZE + c] = first_5, second_5
        second_8 = w1 * second_8 + (w2 * first_8 + lanes[SECOND_IN + 6 * BLOCK_SIZE + c])
        first_8 = w0 * first_8 + lanes[FIRST_IN + 6 * BLOCK_SIZE + c]
        lanes[FIRST_IN + 6 * BLOCK_SIZE + c], lanes[SECOND_IN + 6 * BLOCK_SIZE + c] = first_8, second_8
    memory[Z1, 0], memory[Z2, 0] = first_0, second_0
    memory[Z1, 1], memory[Z2, 1] = first_1, second_1
    memory[Z1, 2], memory[Z2, 2] = first_2, second_2
    memory[Z1, 3], memory[Z2, 3] = first_3, second_3
    memory[Z1, 6] = first_3 + lanes[FREE_DECAY + BLOCK_SIZE - 1] * apart_6
    memory[Z2, 6] = second_3 + lanes[FREE_DECAY + 2 * BLOCK_SIZE - 1] * apart2_6 + lanes[FREE_DECAY + 3 * BLOCK_SIZE - 1] * apart_6
    memory[Z1, 4], memory[Z2, 4] = first_4, second_4
    memory[Z1, 7] = first_4 + lanes[FREE_DECAY + BLOCK_SIZE - 1] * apart_7
    memory[Z2, 7] = second_4 + lanes[FREE_DECAY + 2 * BLOCK_SIZE - 1] * apart2_7 + lanes[FREE_DECAY + 3 * BLOCK_SIZE - 1] * apart_7
    memory[Z1, 5], memory[Z2, 5] = first_5, second_5
    memory[Z1, 8], memory[Z2, 8] = first_8, second_8
    for c in range(BLOCK_SIZE):
        first_0, second_0 = lanes[FIRST_IN + 0 * BLOCK_SIZE + c], lanes[SECOND_IN + 0 * BLOCK_SIZE + c]
        signal_0 = second_0
        first_1, second_1 = lanes[FIRST_IN + 1 * BLOCK_SIZE + c], lanes[SECOND_IN + 1 * BLOCK_SIZE + c]
        signal_1 = second_1
        first_2, second_2 = lanes[FIRST_IN + 2 * BLOCK_SIZE + c], lanes[SECOND_IN + 2 * BLOCK_SIZE + c]
        signal_2 = (first_2 - second_2) * by2
        first_3, second_3 = lanes[FIRST_IN + 3 * BLOCK_SIZE + c], lanes[SECOND_IN + 3 * BLOCK_SIZE + c]
        signal_3 = (first_3 - second_3) * by2
        first_6 = first_3 + lanes[FREE_DECAY + c] * apart_6
        second_6 = second_3 + lanes[FREE_DECAY + BLOCK_SIZE + c] * apart2_6 + lanes[FREE_DECAY + 2 * BLOCK_SIZE + c] * apart_6
        signal_6 = (first_6 - second_6) * by2
        signal_6 = ((lanes[VALUE + 3 * BLOCK_SIZE + c] - first_6) * by1 - signal_6) * by2
        first_4, second_4 = lanes[FIRST_IN + 4 * BLOCK_SIZE + c], lanes[SECOND_IN + 4 * BLOCK_SIZE + c]
        signal_4 = (first_4 - second_4) * by2
        first_7 = first_4 + lanes[FREE_DECAY + c] * apart_7
        second_7 = second_4 + lanes[FREE_DECAY + BLOCK_SIZE + c] * apart2_7 + lanes[FREE_DECAY + 2 * BLOCK_SIZE + c] * apart_7
        signal_7 = (first_7 - second_7) * by2
        signal_7 = ((lanes[VALUE + 4 * BLOCK_SIZE + c] - first_7) * by1 - signal_7) * by2
        first_5, second_5 = lanes[FIRST_IN + 5 * BLOCK_SIZE + c], lanes[SECOND_IN + 5 * BLOCK_SIZE + c]
        signal_5 = (first_5 - second_5) * by2
        first_8, second_8 = lanes[FIRST_IN + 6 * BLOCK_SIZE + c], lanes[SECOND_IN + 6 * BLOCK_SIZE + c]
        signal_8 = second_8
        feature_0, feature_1, feature_2, feature_3, feature_4, feature_5, feature_6, feature_7, = _features(signal_0, signal_1, signal_2, signal_3, signal_4, signal_5, signal_6, signal_7, signal_8)
        lanes[FEATURE + 0 * BLOCK_SIZE + c] = feature_0
        lanes[FEATURE + 1 * BLOCK_SIZE + c] = feature_1
        lanes[FEATURE + 2 * BLOCK_SIZE + c] = feature_2
        lanes[FEATURE + 3 * BLOCK_SIZE + c] = feature_3
        lanes[FEATURE + 4 * BLOCK_SIZE + c] = feature_4
        lanes[FEATURE + 5 * BLOCK_SIZE + c] = feature_5
        lanes[FEATURE + 6 * BLOCK_SIZE + c] = feature_6
        lanes[FEATURE + 7 * BLOCK_SIZE + c] = feature_7
    features = lanes[FEATURE:].reshape((FEATURES, BLOCK_SIZE))
    for a in range(FEATURES):
        for b in range(a + 1):
            for c in range(PARTIAL_SUMS):
                products[a, b, c] += features[a, 0 * PARTIAL_SUMS + c] * features[b, 0 * PARTIAL_SUMS + c] + features[a, 1 * PARTIAL_SUMS + c] * features[b, 1 * PARTIAL_SUMS + c] + features[a, 2 * PARTIAL_SUMS + c] * features[b, 2 * PARTIAL_SUMS + c] + features[a, 3 * PARTIAL_SUMS + c] * features[b, 3 * PARTIAL_SUMS + c]


@internal
def _add_feature_products(products, gram):
    """Add the products of the features, summed over their lanes, to the Gram matrix of [φ τ]."""
    for a in range(FEATURES):
        for b in range(a + 1):
            total = products[a, b].sum()
            for row in range(NQ):
                for i in range(len(LINEAR) + 1):
                    for j in range(len(LINEAR) + 1):
                        weight = MIXING[row, i, a] * MIXING[row, j, b]
                        if a != b:
                            weight += MIXING[row, i, b] * MIXING[row, j, a]
                        gram[i, j] += weight * total


@inlined
def _controlled(t, theta_w, theta_p, dtheta_w, dtheta_p, parameters):
    """Angle and rate as the controller's sensors read them."""
    angle = theta_p
    rate = dtheta_p

    return angle, rate


@compiled
def closed_loop_batch(t, reference, reference_rate, gains, states, parameters, max_step, every, record):
    """Many machines under their PID controllers, as in closed_loop without noise.

    gains (B, 3), initial states (B, NX), which become the final ones, and parameters (B, NP) of each; record
    (ceil(N / every), NX + 1, B) receives states and voltage at every so many samples.
    BATCH_SIZE machines take each stage of a step side by side: one instruction advances several of them.
    """
    lanes = np.zeros((BATCH_ROWS + NP) * BATCH_SIZE)
    for first in range(0, states.shape[0], BATCH_SIZE):
        count = min(BATCH_SIZE, states.shape[0] - first)
        for c in range(BATCH_SIZE):
            b = first + min(c, count - 1)  # the last one fills the rows up
            lanes[INTEGRAL * BATCH_SIZE + c] = 0.0
            for i in range(NX):
                lanes[(STATE_ROW + i) * BATCH_SIZE + c] = states[b, i]
            for i in range(3):
                lanes[(GAINS + i) * BATCH_SIZE + c] = gains[b, i]
            for i in range(NP):
                lanes[(BATCH_ROWS + i) * BATCH_SIZE + c] = parameters[b, i]
        for k in range(t.size):
            _control(t[k], t[k] - t[max(k - 1, 0)], reference[k], reference_rate[k], lanes)
            if k % every == 0:
                for i in range(NX + 1):  # the voltage stands behind the states
                    for c in range(count):
                        record[k // every, i, first + c] = lanes[(STATE_ROW + i) * BATCH_SIZE + c]
            if k + 1 < t.size:
                steps = max(1, int(math.ceil((t[k + 1] - t[k]) / max_step - 1e-6)))
                h = (t[k + 1] - t[k]) / steps
                for step in range(steps):
                    _batch_step(t[k] + step * h, h, lanes)
        for c in range(count):
            for i in range(NX):
                states[first + c, i] = lanes[(STATE_ROW + i) * BATCH_SIZE + c]


@inlined
def _control(t, h, reference, reference_rate, lanes):
    """The controllers' voltages at a sample, h after the one before."""
    for c in range(BATCH_SIZE):
        angle, rate = _controlled(t, lanes[(STATE_ROW + 0) * BATCH_SIZE + c], lanes[(STATE_ROW + 1) * BATCH_SIZE + c], lanes[(STATE_ROW + 2) * BATCH_SIZE + c], lanes[(STATE_ROW + 3) * BATCH_SIZE + c], (lanes[(BATCH_ROWS + 0) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 1) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 2) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 3) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 4) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 5) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 6) * BATCH_SIZE + c], ))
        error = reference - angle
        lanes[INTEGRAL * BATCH_SIZE + c] += error * h
        lanes[INPUT_ROW * BATCH_SIZE + c] = (
            lanes[GAINS * BATCH_SIZE + c] * error
            + lanes[(GAINS + 1) * BATCH_SIZE + c] * lanes[INTEGRAL * BATCH_SIZE + c]
            + lanes[(GAINS + 2) * BATCH_SIZE + c] * (reference_rate - rate)
        )


@internal
def _batch_step(t, h, lanes):
    """One step of the classical fourth-order method for each of the BATCH_SIZE machines side by side."""
    for c in range(BATCH_SIZE):
        lanes[(STAGE_STATE + 0) * BATCH_SIZE + c] = lanes[(OLD_STATE + 0) * BATCH_SIZE + c] = lanes[(STATE_ROW + 0) * BATCH_SIZE + c]
        lanes[(STAGE_STATE + 1) * BATCH_SIZE + c] = lanes[(OLD_STATE + 1) * BATCH_SIZE + c] = lanes[(STATE_ROW + 1) * BATCH_SIZE + c]
        lanes[(STAGE_STATE + 2) * BATCH_SIZE + c] = lanes[(OLD_STATE + 2) * BATCH_SIZE + c] = lanes[(STATE_ROW + 2) * BATCH_SIZE + c]
        lanes[(STAGE_STATE + 3) * BATCH_SIZE + c] = lanes[(OLD_STATE + 3) * BATCH_SIZE + c] = lanes[(STATE_ROW + 3) * BATCH_SIZE + c]
    for c in range(BATCH_SIZE):
        angle_theta_p, = _angles(t, lanes[(STATE_ROW + 0) * BATCH_SIZE + c], lanes[(STATE_ROW + 1) * BATCH_SIZE + c], lanes[(STATE_ROW + 2) * BATCH_SIZE + c], lanes[(STATE_ROW + 3) * BATCH_SIZE + c], (lanes[(BATCH_ROWS + 0) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 1) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 2) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 3) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 4) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 5) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 6) * BATCH_SIZE + c], ))
        lanes[(ANGLE + 0) * BATCH_SIZE + c] = angle_theta_p
        sine, cosine = _sine_pair(angle_theta_p)
        lanes[(STAGE_TRIG + 0) * BATCH_SIZE + c] = lanes[(START_TRIG + 0) * BATCH_SIZE + c] = sine
        lanes[(STAGE_TRIG + 1) * BATCH_SIZE + c] = lanes[(START_TRIG + 1) * BATCH_SIZE + c] = cosine
    for stage in range(4):
        ahead, weight = _weights(stage, h)
        now = t + (0.0 if stage == 0 else 0.5 * h if stage < 3 else h)
        far = 0
        for c in range(BATCH_SIZE if stage > 0 else 0):
            angle_theta_p, = _angles(now, lanes[(STAGE_STATE + 0) * BATCH_SIZE + c], lanes[(STAGE_STATE + 1) * BATCH_SIZE + c], lanes[(STAGE_STATE + 2) * BATCH_SIZE + c], lanes[(STAGE_STATE + 3) * BATCH_SIZE + c], (lanes[(BATCH_ROWS + 0) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 1) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 2) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 3) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 4) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 5) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 6) * BATCH_SIZE + c], ))
            turn = angle_theta_p - lanes[(ANGLE + 0) * BATCH_SIZE + c]
            square = turn * turn
            far += square > SERIES_RANGE * SERIES_RANGE
            along, short = _series(turn, square)
            sine, cosine = lanes[(START_TRIG + 0) * BATCH_SIZE + c], lanes[(START_TRIG + 1) * BATCH_SIZE + c]
            lanes[(STAGE_TRIG + 0) * BATCH_SIZE + c] = sine + (cosine * along - sine * short)
            lanes[(STAGE_TRIG + 1) * BATCH_SIZE + c] = cosine - (sine * along + cosine * short)
        for c in range(BATCH_SIZE if far > 0 else 0):
            angle_theta_p, = _angles(now, lanes[(STAGE_STATE + 0) * BATCH_SIZE + c], lanes[(STAGE_STATE + 1) * BATCH_SIZE + c], lanes[(STAGE_STATE + 2) * BATCH_SIZE + c], lanes[(STAGE_STATE + 3) * BATCH_SIZE + c], (lanes[(BATCH_ROWS + 0) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 1) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 2) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 3) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 4) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 5) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 6) * BATCH_SIZE + c], ))
            lanes[(STAGE_TRIG + 0) * BATCH_SIZE + c], lanes[(STAGE_TRIG + 1) * BATCH_SIZE + c] = _sine_pair(angle_theta_p)
        for c in range(BATCH_SIZE):
            theta_w, theta_p, dtheta_w, dtheta_p, = lanes[(STAGE_STATE + 0) * BATCH_SIZE + c], lanes[(STAGE_STATE + 1) * BATCH_SIZE + c], lanes[(STAGE_STATE + 2) * BATCH_SIZE + c], lanes[(STAGE_STATE + 3) * BATCH_SIZE + c],
            ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(
                now, theta_w, theta_p, dtheta_w, dtheta_p, lanes[INPUT_ROW * BATCH_SIZE + c], lanes[(STAGE_TRIG + 0) * BATCH_SIZE + c], lanes[(STAGE_TRIG + 1) * BATCH_SIZE + c], (lanes[(BATCH_ROWS + 0) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 1) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 2) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 3) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 4) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 5) * BATCH_SIZE + c], lanes[(BATCH_ROWS + 6) * BATCH_SIZE + c], )
            )
            lanes[(STATE_ROW + 0) * BATCH_SIZE + c] += weight * dtheta_w
            lanes[(STAGE_STATE + 0) * BATCH_SIZE + c] = lanes[(OLD_STATE + 0) * BATCH_SIZE + c] + ahead * dtheta_w
            lanes[(STATE_ROW + 1) * BATCH_SIZE + c] += weight * dtheta_p
            lanes[(STAGE_STATE + 1) * BATCH_SIZE + c] = lanes[(OLD_STATE + 1) * BATCH_SIZE + c] + ahead * dtheta_p
            lanes[(STATE_ROW + 2) * BATCH_SIZE + c] += weight * ddtheta_w
            lanes[(STAGE_STATE + 2) * BATCH_SIZE + c] = lanes[(OLD_STATE + 2) * BATCH_SIZE + c] + ahead * ddtheta_w
            lanes[(STATE_ROW + 3) * BATCH_SIZE + c] += weight * ddtheta_p
            lanes[(STAGE_STATE + 3) * BATCH_SIZE + c] = lanes[(OLD_STATE + 3) * BATCH_SIZE + c] + ahead * ddtheta_p
