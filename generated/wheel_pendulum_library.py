# Made by wheelpend from model.toml with sympy 1.14.0 and Jinja 3.1.6; do not edit, run `wheelpend generate`.
# plant wheel_pendulum; assumptions planar=True, ground_friction_reaction=body, ground_friction=True, rotor_inertia=True, rotor_speed=body, gear_ratio_in_back_emf=once, motor_circuit=static, range=upright, gyro=True, rate_sensor=False, encoder=absolute; effects coulomb_drive, coulomb_asymmetry, viscous_asymmetry, load_friction, stribeck_drive, presliding_drive, quadratic_drive, cogging, ground_viscous, rolling_resistance, slope, wheel_runout, air_drag, com_offset, body_damping, tether_spring, payload_step, external_push, actuator_delay, winding_inductance, voltage_saturation, voltage_dead_zone, voltage_sag, voltage_asymmetry, voltage_offset, coasting_driver, encoder_eccentricity, encoder_scale, pitch_scale, gyro_scale, imu_bias, gyro_bias, imu_lag
"""Kernels of the model `wheel_pendulum with every effect`.

wheel row: 0 =
    + presliding_drive_force
    - missing.wheel
    - v_in
    + X1*ddtheta_w
    + X2*ddtheta_w
    + X6*dtheta_w
    + dtheta_w*ground_viscous.coefficient
    + external_push.torque*(Step(-external_push.end + t) - Step(-external_push.start + t))
    + tether_spring.stiffness*(-origin + theta_w)
    + viscous_asymmetry.coefficient*Magnitude(-dtheta_p + dtheta_w)
    - X2*ddtheta_p
    - X7*dtheta_p
    - cogging.cosine*cos(cogging.periods*(-theta_p + theta_w))
    - cogging.sine*sin(cogging.periods*(-theta_p + theta_w))
    - wheel_runout.cosine*cos(theta_w)
    - wheel_runout.sine*sin(theta_w)
    + X3*ddtheta_p*cos(com_offset.angle + slope.angle + theta_p)
    + air_drag.coefficient*dtheta_w*Magnitude(dtheta_w)
    + coasting_driver.rate*(-dtheta_p + dtheta_w)*Magnitude(v_in)
    + quadratic_drive.coefficient*(-dtheta_p + dtheta_w)*Magnitude(-dtheta_p + dtheta_w)
    - X3*dtheta_p**2*sin(com_offset.angle + slope.angle + theta_p)
    + X1*g*sin(slope.angle)/R
    + X3*ddtheta_p*payload_step.ratio*Step(-payload_step.time + t)*cos(com_offset.angle + slope.angle + theta_p)
    - X3*dtheta_p**2*payload_step.ratio*Step(-payload_step.time + t)*sin(com_offset.angle + slope.angle + theta_p)
    - 2*J_w*g*sin(slope.angle)/(R*alpha)
    + R*X3*ddtheta_w*payload_step.ratio*Step(-payload_step.time + t)/L
    + X3*g*payload_step.ratio*Step(-payload_step.time + t)*sin(slope.angle)/L
body row: 0 =
    + v_in
    - missing.body
    - presliding_drive_force
    + X2*ddtheta_p
    + X4*ddtheta_p
    + X7*dtheta_p
    + body_damping.coefficient*dtheta_p
    + cogging.cosine*cos(cogging.periods*(-theta_p + theta_w))
    + cogging.sine*sin(cogging.periods*(-theta_p + theta_w))
    - X2*ddtheta_w
    - X5*sin(com_offset.angle + theta_p)
    - X6*dtheta_w
    - viscous_asymmetry.coefficient*Magnitude(-dtheta_p + dtheta_w)
    + X3*ddtheta_w*cos(com_offset.angle + slope.angle + theta_p)
    - coasting_driver.rate*(-dtheta_p + dtheta_w)*Magnitude(v_in)
    - quadratic_drive.coefficient*(-dtheta_p + dtheta_w)*Magnitude(-dtheta_p + dtheta_w)
    - X5*payload_step.ratio*Step(-payload_step.time + t)*sin(com_offset.angle + theta_p)
    + X3*ddtheta_w*payload_step.ratio*Step(-payload_step.time + t)*cos(com_offset.angle + slope.angle + theta_p)
    + L*X3*ddtheta_p*payload_step.ratio*Step(-payload_step.time + t)/R

The command acts actuator_delay.delay later.
The voltage U in them follows the command: T dU/dt = V − U with T = winding_inductance.time_constant.
States theta_w, theta_p, dtheta_w, dtheta_p; voltage is what was commanded, held between samples; parameters as in PARAMETERS.
Angles in rad, times in s from the log's first sample, voltages in V. Every function is compiled by Numba and may be
called from compiled code.
"""

import math

import numpy as np
from numba import njit

STATES = ('theta_w', 'theta_p', 'dtheta_w', 'dtheta_p')
VARIABLES = ('theta_w', 'theta_p', 'dtheta_w', 'dtheta_p', 'presliding_drive_force')  # the states, then added states
OUTPUTS = ('theta_w', 'theta_p', 'dtheta_p')
ROWS = ('wheel', 'body')
PARAMETERS = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7', 'coulomb_drive.torque', 'coulomb_asymmetry.torque', 'viscous_asymmetry.coefficient', 'load_friction.share', 'stribeck_drive.static', 'stribeck_drive.sliding', 'stribeck_drive.speed', 'presliding_drive.torque', 'presliding_drive.stiffness', 'quadratic_drive.coefficient', 'cogging.sine', 'cogging.cosine', 'cogging.periods', 'ground_viscous.coefficient', 'rolling_resistance.torque', 'slope.angle', 'wheel_runout.sine', 'wheel_runout.cosine', 'air_drag.coefficient', 'com_offset.angle', 'body_damping.coefficient', 'tether_spring.stiffness', 'payload_step.time', 'payload_step.ratio', 'external_push.start', 'external_push.end', 'external_push.torque', 'actuator_delay.delay', 'winding_inductance.time_constant', 'voltage_saturation.limit', 'voltage_dead_zone.threshold', 'voltage_sag.rate', 'voltage_asymmetry.ratio', 'voltage_offset.offset', 'coasting_driver.rate', 'encoder_eccentricity.sine', 'encoder_eccentricity.cosine', 'encoder_scale.scale', 'pitch_scale.scale', 'gyro_scale.scale', 'imu_bias.bias', 'gyro_bias.bias', 'imu_lag.delay', 'missing.wheel', 'missing.body', 'R', 'g', 'alpha', 'J_w', 'L', 'origin')
UNITS = ('V s²/rad', 'V s²/rad', 'V s²/rad', 'V s²/rad', 'V', 'V s/rad', 'V s/rad', 'V', 'V', 'V s/rad', '1', 'V', 'V', 'rad/s', 'V', 'V/rad', 'V s²/rad²', 'V', 'V', '1/turn', 'V s/rad', 'V', 'rad', 'V', 'V', 'V s²/rad²', 'rad', 'V s/rad', 'V/rad', 's', '1', 's', 's', 'V', 's', 's', 'V', 'V', '1/s', '1', 'V', 's/rad', 'rad', 'rad', '1', '1', '1', 'rad', 'rad/s', 's', 'V', 'V', 'm', 'm/s²', 'N m/V', 'kg m²', 'm', 'rad')
ABSENT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 30.0, 0.0, 0.0, 0.0, 12.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0,)  # value of each parameter while its effect is absent; of a constant any number
ABSORBED = {'viscous_drive.coefficient': {'X6': 1.0, 'X7': 1.0}}  # effects that are part of the plant's own parameters, with weights on these
TWINS = {'coulomb_asymmetry': ('voltage_offset',), 'com_offset': ('imu_bias',), 'voltage_offset': ('coulomb_asymmetry',), 'imu_bias': ('com_offset',)}  # effects that change every log in the same way
CONTAINS = {'stribeck_drive': {'coulomb_drive': ((1.0,), (1.0,))}}  # effects within others: parameters of the larger by those of the smaller
NEEDS = {'slope.angle': ('R', 'g', 'alpha', 'J_w'), 'payload_step.time': ('R', 'L'), 'payload_step.ratio': ('R', 'L')}  # constants without which a parameter has no meaning
LINEAR = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7', 'coulomb_drive.torque', 'coulomb_asymmetry.torque', 'viscous_asymmetry.coefficient', 'stribeck_drive.static', 'stribeck_drive.sliding', 'quadratic_drive.coefficient', 'cogging.sine', 'cogging.cosine', 'ground_viscous.coefficient', 'rolling_resistance.torque', 'wheel_runout.sine', 'wheel_runout.cosine', 'air_drag.coefficient', 'body_damping.coefficient', 'tether_spring.stiffness', 'external_push.torque', 'coasting_driver.rate', 'missing.wheel', 'missing.body')  # parameters of the regressor, in the order of its columns
SIGNED = ()  # own parameters that may be negative: differences of physical constants
OWN_PARAMETERS = 7  # so many of PARAMETERS, from the first, are the plant's own
FITTED = 52  # so many of PARAMETERS, from the first, have sensitivities
MISSING_FORCES = ('missing.wheel', 'missing.body')  # unknown forces among PARAMETERS, one for each row, where there are any
CARRYING = ('presliding_drive',)  # effects with states that carry over from one fitted segment to the next
HYSTERESIS_SIZES = (14,)  # indices among PARAMETERS; no force has a memory where these are zero
INTERNAL = ()  # parameters of the forces along internal coordinates
STIFFEST = {}  # largest values of parameters that are infinite where an internal coordinate is rigid
DELAY = 34  # index of the input delay among PARAMETERS, or -1
LAG = 35  # index of the time constant of the input's lag, or -1
ORIGIN = 57  # index of the first coordinate's value at the log's first sample, or -1
NQ, NX, NY, NP = 2, 4, 3, 58
NA, NV = 2, 5  # moving coordinates; variables: the states, then added states
NR = 4  # variables, from the first, that readings depend on: the states, and a sensor's filter where there is one
NS = NV + (LAG >= 0)  # a lagging input is the last
RATES = (2, 3)  # where the rate of each moving coordinate stands among the variables
DELAYED = (False, True, True,)  # True for each output that the sensor delay acts on
SENSOR_DELAY = 49  # index of that delay among PARAMETERS, or -1
SURFACES = 2  # number of surfaces with dry friction
SLIP_MATRIX = np.array([(1.0, -1.0), (1.0, 0.0)], dtype=np.float64)  # (SURFACES, NA): slip speeds as weights on the rates
IN_DRY_LAW = np.isin(np.arange(NP), np.array([6, 7, 8, 10, 11, 12, 13, 21], dtype=np.int64))  # (NP,): True for each parameter that dry friction depends on
RATE, BEFORE, FORCE, UPPER, LOWER, DIRECTION = range(6)  # rows of the scratch array of dry friction
LANES = 8  # sensitivity columns that are advanced side by side
HYSTERESES = 1  # number of hysteresis forces
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
START_TRIG, STAGE_TRIG, BATCH_ROWS = ANGLE + 4, ANGLE + 12, ANGLE + 20
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
    cogging_periods = parameters[19]
    slope_angle = parameters[22]
    com_offset_angle = parameters[26]
    c0 = com_offset_angle + theta_p
    angle_theta_w = theta_w
    angle_sum_1 = cogging_periods*(-theta_p + theta_w)
    angle_sum_2 = c0
    angle_sum_3 = c0 + slope_angle

    return angle_theta_w, angle_sum_1, angle_sum_2, angle_sum_3,


@inlined
def _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, parameters):
    """Accelerations without dry friction, then the inverse mass matrix (NQ, NQ) row by row.

    140 operations.
    """
    X1 = parameters[0]
    X2 = parameters[1]
    X3 = parameters[2]
    X4 = parameters[3]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    viscous_asymmetry_coefficient = parameters[9]
    quadratic_drive_coefficient = parameters[16]
    cogging_sine = parameters[17]
    cogging_cosine = parameters[18]
    ground_viscous_coefficient = parameters[20]
    slope_angle = parameters[22]
    wheel_runout_sine = parameters[23]
    wheel_runout_cosine = parameters[24]
    air_drag_coefficient = parameters[25]
    body_damping_coefficient = parameters[27]
    tether_spring_stiffness = parameters[28]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    external_push_torque = parameters[33]
    coasting_driver_rate = parameters[41]
    missing_wheel = parameters[50]
    missing_body = parameters[51]
    R = parameters[52]
    g = parameters[53]
    alpha = parameters[54]
    J_w = parameters[55]
    L = parameters[56]
    origin = parameters[57]
    c0 = X3*cos_sum_3
    c1 = -t
    c2 = _step(-c1 - payload_step_time)
    c3 = c2*payload_step_ratio
    c4 = c0*c3
    c5 = X2 - c0 - c4
    c6 = X5*sin_sum_2
    c7 = -dtheta_p + dtheta_w
    c8 = abs(c7)
    c9 = X6*dtheta_w - X7*dtheta_p + c7*c8*quadratic_drive_coefficient + c7*coasting_driver_rate*abs(v_in) + c8*viscous_asymmetry_coefficient - cogging_cosine*cos_sum_1 - cogging_sine*sin_sum_1 + presliding_drive_force - v_in
    c10 = body_damping_coefficient*dtheta_p - c3*c6 - c6 - c9 - missing_body
    c11 = 1/R
    c12 = X3*c3
    c13 = L*c11*c12 + X2 + X4
    c14 = X3*(dtheta_p*dtheta_p)*sin_sum_3
    c15 = g*math.sin(slope_angle)
    c16 = c11*c15
    c17 = c12/L
    c18 = -2*J_w*c16/alpha + X1*c16 + air_drag_coefficient*dtheta_w*abs(dtheta_w) - c14*c3 - c14 + c15*c17 + c9 - cos_theta_w*wheel_runout_cosine + dtheta_w*ground_viscous_coefficient + external_push_torque*(_step(-c1 - external_push_end) - _step(-c1 - external_push_start)) - missing_wheel - sin_theta_w*wheel_runout_sine + tether_spring_stiffness*(-origin + theta_w)
    c19 = L*R
    c20 = X1*c19
    c21 = X2*c19
    c22 = 2*c21
    c23 = (X3*X3)*c19
    c24 = c23*(cos_sum_3*cos_sum_3)
    c25 = (L*L)*c12
    c26 = (R*R)*c12
    c27 = (c2*c2)*(payload_step_ratio*payload_step_ratio)
    c28 = c19/(X1*c25 + X2*c20 + X2*c25 + X2*c26 + X4*c20 + X4*c21 + X4*c26 + c0*c22 + c22*c4 + c23*c27 - c24*c27 - 2*c24*c3 - c24)
    c29 = R*c17 + X1 + X2
    c30 = c28*c5
    ddtheta_w = c28*(-c10*c5 - c13*c18)
    ddtheta_p = c28*(-c10*c29 - c18*c5)
    mobility_0_0 = c13*c28
    mobility_0_1 = c30
    mobility_1_0 = c30
    mobility_1_1 = c28*c29

    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@inlined
def _residual_jacobian(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, direction_drive, direction_ground, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, ddtheta_w, ddtheta_p, parameters, stage, by_parameter):
    """Derivatives of inertia − force at given accelerations: in the states, returned row by row, and in the parameters.

    The latter go into by_parameter[stage], where zero entries are not touched.
    213 operations.
    """
    X1 = parameters[0]
    X3 = parameters[2]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    viscous_asymmetry_coefficient = parameters[9]
    load_friction_share = parameters[10]
    stribeck_drive_static = parameters[11]
    stribeck_drive_sliding = parameters[12]
    stribeck_drive_speed = parameters[13]
    quadratic_drive_coefficient = parameters[16]
    cogging_sine = parameters[17]
    cogging_cosine = parameters[18]
    cogging_periods = parameters[19]
    ground_viscous_coefficient = parameters[20]
    slope_angle = parameters[22]
    wheel_runout_sine = parameters[23]
    wheel_runout_cosine = parameters[24]
    air_drag_coefficient = parameters[25]
    body_damping_coefficient = parameters[27]
    tether_spring_stiffness = parameters[28]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    coasting_driver_rate = parameters[41]
    R = parameters[52]
    g = parameters[53]
    alpha = parameters[54]
    J_w = parameters[55]
    L = parameters[56]
    origin = parameters[57]
    c0 = cogging_cosine*sin_sum_1
    c1 = c0*cogging_periods
    c2 = cogging_sine*cos_sum_1
    c3 = c2*cogging_periods
    c4 = c1 - c3
    c5 = X3*sin_sum_3
    c6 = c5*ddtheta_p
    c7 = (dtheta_p*dtheta_p)
    c8 = X3*c7*cos_sum_3
    c9 = -t
    c10 = _step(-c9 - payload_step_time)
    c11 = c10*payload_step_ratio
    c12 = c11*c6 + c11*c8 + c6 + c8
    c13 = abs(dtheta_w)
    c14 = 2*dtheta_p
    c15 = c14 - 2*dtheta_w
    c16 = stribeck_drive_speed**(-2)
    c17 = -dtheta_w
    c18 = c17 + dtheta_p
    c19 = -c18
    c20 = (c19*c19)
    c21 = math.exp(-c16*c20)
    c22 = c21*direction_drive
    c23 = c22*(-stribeck_drive_sliding + stribeck_drive_static)
    c24 = c16*c23
    c25 = abs(v_in)
    c26 = abs(c19)
    c27 = _sign(c19)
    c28 = X7*dtheta_p - X7*dtheta_w + v_in
    c29 = direction_drive*load_friction_share*_sign(c28)
    c30 = -X7*c29 + c19*c27*quadratic_drive_coefficient + c25*coasting_driver_rate + c26*quadratic_drive_coefficient + c27*viscous_asymmetry_coefficient
    c31 = X6 + c15*c24 + c30
    c32 = c14*c5
    c33 = X7 + c15*c24 + c30
    c34 = c19*coasting_driver_rate*_sign(v_in) + c29 - 1
    c35 = X5*cos_sum_2
    c36 = c5*ddtheta_w
    c37 = c11*c36 + c36
    c38 = c11*c35 + c35 + c37
    c39 = math.sin(slope_angle)
    c40 = 1/R
    c41 = c40*g
    c42 = ddtheta_p - ddtheta_w
    c43 = cos_sum_3*ddtheta_p
    c44 = c7*sin_sum_3
    c45 = 1/L
    c46 = c11*c45
    c47 = R*ddtheta_w
    c48 = c39*g
    c49 = c18*c29 - dtheta_p
    c50 = (direction_drive*direction_drive)
    c51 = direction_drive*abs(c28)
    c52 = direction_drive*(1 - c21)
    c53 = 2*c20*c23/(stribeck_drive_speed*stribeck_drive_speed*stribeck_drive_speed)
    c54 = c19*c26
    c55 = -theta_w
    c56 = -c55 - theta_p
    c57 = c0*c56 - c2*c56
    c58 = math.cos(slope_angle)
    c59 = X3*c10
    c60 = c45*c59
    c61 = c19*c25
    c62 = cos_sum_3*ddtheta_w
    c63 = L*c40*ddtheta_p
    c64 = c10*sin_sum_2
    by_0_0 = c4 - cos_theta_w*wheel_runout_sine + sin_theta_w*wheel_runout_cosine + tether_spring_stiffness
    by_0_1 = -c12 - c4
    by_0_2 = air_drag_coefficient*c13 + air_drag_coefficient*dtheta_w*_sign(dtheta_w) + c31 + ground_viscous_coefficient
    by_0_3 = -c11*c32 - c32 - c33
    by_0_4 = 1
    by_0_5 = c34
    by_1_0 = -c4
    by_1_1 = c1 - c3 - c38
    by_1_2 = -c31
    by_1_3 = body_damping_coefficient + c33
    by_1_4 = -1
    by_1_5 = -c34
    by_parameter[stage, 0, 0] = c39*c41 + ddtheta_w
    by_parameter[stage, 0, 1] = -c42
    by_parameter[stage, 0, 2] = c11*c43 - c11*c44 + c43 - c44 + c46*c47 + c46*c48
    by_parameter[stage, 0, 5] = dtheta_w
    by_parameter[stage, 0, 6] = c49
    by_parameter[stage, 0, 7] = direction_drive
    by_parameter[stage, 0, 8] = c50
    by_parameter[stage, 0, 9] = c26
    by_parameter[stage, 0, 10] = c51
    by_parameter[stage, 0, 11] = c22
    by_parameter[stage, 0, 12] = c52
    by_parameter[stage, 0, 13] = c53
    by_parameter[stage, 0, 16] = c54
    by_parameter[stage, 0, 17] = -sin_sum_1
    by_parameter[stage, 0, 18] = -cos_sum_1
    by_parameter[stage, 0, 19] = c57
    by_parameter[stage, 0, 20] = dtheta_w
    by_parameter[stage, 0, 21] = direction_ground
    by_parameter[stage, 0, 22] = -2*J_w*c41*c58/alpha + X1*c40*c58*g + X3*c10*c45*c58*g*payload_step_ratio - c12
    by_parameter[stage, 0, 23] = -sin_theta_w
    by_parameter[stage, 0, 24] = -cos_theta_w
    by_parameter[stage, 0, 25] = c13*dtheta_w
    by_parameter[stage, 0, 26] = -c12
    by_parameter[stage, 0, 28] = -c55 - origin
    by_parameter[stage, 0, 30] = c43*c59 - c44*c59 + c47*c60 + c48*c60
    by_parameter[stage, 0, 33] = _step(-c9 - external_push_end) - _step(-c9 - external_push_start)
    by_parameter[stage, 0, 41] = c61
    by_parameter[stage, 0, 50] = -1
    by_parameter[stage, 1, 1] = c42
    by_parameter[stage, 1, 2] = c11*c62 + c11*c63 + c62
    by_parameter[stage, 1, 3] = ddtheta_p
    by_parameter[stage, 1, 4] = -c64*payload_step_ratio - sin_sum_2
    by_parameter[stage, 1, 5] = c17
    by_parameter[stage, 1, 6] = -c49
    by_parameter[stage, 1, 7] = -direction_drive
    by_parameter[stage, 1, 8] = -c50
    by_parameter[stage, 1, 9] = -c26
    by_parameter[stage, 1, 10] = -c51
    by_parameter[stage, 1, 11] = -c22
    by_parameter[stage, 1, 12] = -c52
    by_parameter[stage, 1, 13] = -c53
    by_parameter[stage, 1, 16] = -c54
    by_parameter[stage, 1, 17] = sin_sum_1
    by_parameter[stage, 1, 18] = cos_sum_1
    by_parameter[stage, 1, 19] = -c57
    by_parameter[stage, 1, 22] = -c37
    by_parameter[stage, 1, 26] = -c38
    by_parameter[stage, 1, 27] = dtheta_p
    by_parameter[stage, 1, 30] = -X5*c64 + c59*c62 + c59*c63
    by_parameter[stage, 1, 41] = -c61
    by_parameter[stage, 1, 51] = -1

    return by_0_0, by_0_1, by_0_2, by_0_3, by_0_4, by_0_5, by_1_0, by_1_1, by_1_2, by_1_3, by_1_4, by_1_5


@inlined
def _dry_law(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, parameters, direction_drive, direction_ground):
    """Dry friction against the slip of each surface [V]; direction 0 where it sticks."""
    X7 = parameters[6]
    coulomb_drive_torque = parameters[7]
    coulomb_asymmetry_torque = parameters[8]
    load_friction_share = parameters[10]
    stribeck_drive_static = parameters[11]
    stribeck_drive_sliding = parameters[12]
    stribeck_drive_speed = parameters[13]
    rolling_resistance_torque = parameters[21]
    force_0 = coulomb_asymmetry_torque*(direction_drive*direction_drive) + coulomb_drive_torque*direction_drive + direction_drive*load_friction_share*abs(X7*dtheta_p - X7*dtheta_w + v_in) + direction_drive*(stribeck_drive_sliding + (-stribeck_drive_sliding + stribeck_drive_static)*math.exp(-((-dtheta_p + dtheta_w)*(-dtheta_p + dtheta_w))/(stribeck_drive_speed*stribeck_drive_speed)))
    force_1 = direction_ground*rolling_resistance_torque

    return force_0, force_1,


@compiled
def read_sensors(t, state, parameters, output):
    """Readings of the sensors in this state, into output (NY,)."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    encoder_eccentricity_sine = parameters[42]
    encoder_eccentricity_cosine = parameters[43]
    encoder_scale_scale = parameters[44]
    pitch_scale_scale = parameters[45]
    gyro_scale_scale = parameters[46]
    imu_bias_bias = parameters[47]
    gyro_bias_bias = parameters[48]
    output[0] = (encoder_scale_scale + 1)*(encoder_eccentricity_cosine*math.cos(theta_w) + encoder_eccentricity_sine*math.sin(theta_w) + theta_w)
    output[1] = imu_bias_bias + theta_p*(pitch_scale_scale + 1)
    output[2] = dtheta_p*(gyro_scale_scale + 1) + gyro_bias_bias


@inlined
def _sensor_jacobian(t, state, parameters, by_state, by_parameter):
    """Derivatives of the readings into (NY, NR) and (NY, NP); zero entries are not touched."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    encoder_eccentricity_sine = parameters[42]
    encoder_eccentricity_cosine = parameters[43]
    encoder_scale_scale = parameters[44]
    pitch_scale_scale = parameters[45]
    gyro_scale_scale = parameters[46]
    c0 = encoder_scale_scale + 1
    c1 = math.cos(theta_w)
    c2 = math.sin(theta_w)
    by_state[0, 0] = c0*(c1*encoder_eccentricity_sine - c2*encoder_eccentricity_cosine + 1)
    by_state[1, 1] = pitch_scale_scale + 1
    by_state[2, 3] = gyro_scale_scale + 1
    by_parameter[0, 42] = c0*c2
    by_parameter[0, 43] = c0*c1
    by_parameter[0, 44] = c1*encoder_eccentricity_cosine + c2*encoder_eccentricity_sine + theta_w
    by_parameter[1, 45] = theta_p
    by_parameter[1, 47] = 1
    by_parameter[2, 46] = dtheta_p
    by_parameter[2, 48] = 1


@inlined
def _decay(path, length):
    """exp(−path/length); where the length is not positive 1 at path 0, else 0."""
    if length > 0.0:
        return math.exp(-path / length)
    return 1.0 if path == 0.0 else 0.0


@inlined
def _inverse(x):
    """1/x where x is positive, else 0."""
    return 1.0 / x if x > 0.0 else 0.0


@inlined
def _presliding_drive_force(presliding_drive_before, presliding_drive_path, parameters):
    """Hysteresis force [V] at the end of a path of slip, from the force at its start."""
    presliding_drive_torque = parameters[14]
    presliding_drive_stiffness = parameters[15]
    c0 = presliding_drive_torque*_sign(presliding_drive_path)
    force = c0 + (-c0 + presliding_drive_before)*_decay(presliding_drive_stiffness*abs(presliding_drive_path), presliding_drive_torque)

    return force


@inlined
def _presliding_drive_force_jacobian(presliding_drive_before, presliding_drive_path, parameters, stage, row, by_parameter):
    """Its derivatives in the force before and in the path, returned, and in the parameters, into by_parameter[stage, row]."""
    presliding_drive_torque = parameters[14]
    presliding_drive_stiffness = parameters[15]
    c0 = abs(presliding_drive_path)
    c1 = c0*presliding_drive_stiffness
    c2 = _decay(c1, presliding_drive_torque)
    c3 = _sign(presliding_drive_path)
    c4 = c2*c3
    c5 = -c3*presliding_drive_torque + presliding_drive_before
    c6 = _inverse(presliding_drive_torque)
    c7 = c5*c6
    by_before = c2
    by_path = -c4*c7*presliding_drive_stiffness
    by_parameter[stage, row, 14] = c1*c2*c5*(c6*c6) + c3 - c4
    by_parameter[stage, row, 15] = -c0*c2*c7

    return by_before, by_path


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NA):
        speed += SLIP_MATRIX[surface, k] * state[RATES[k]]
    return speed


@inlined
def _accelerate(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, direction_drive, direction_ground, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, smooth, parameters):
    """Accelerations with dry friction, mobility, and the forces on the surfaces.

    Directions −1 and +1 slip that way, at 0 a surface sticks: the force there cancels the slip acceleration, and the
    mobility is that of a machine that cannot move in this direction.
    """
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, parameters)
    if smooth:  # no surface has friction
        return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, 0.0, 0.0
    force_0, force_1, = _dry_law(t, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, parameters, direction_drive, direction_ground)
    force_0 = force_0 if direction_drive != 0.0 else 0.0
    ddtheta_w -= force_0 * (1.0 * mobility_0_0 + -1.0 * mobility_0_1)
    ddtheta_p -= force_0 * (1.0 * mobility_1_0 + -1.0 * mobility_1_1)
    force_1 = force_1 if direction_ground != 0.0 else 0.0
    ddtheta_w -= force_1 * (1.0 * mobility_0_0 + 0.0 * mobility_0_1)
    ddtheta_p -= force_1 * (1.0 * mobility_1_0 + 0.0 * mobility_1_1)
    if direction_drive == 0.0:
        response_0_0 = 1.0 * mobility_0_0 + -1.0 * mobility_0_1
        response_0_1 = 1.0 * mobility_1_0 + -1.0 * mobility_1_1
        inverse_mass_0 = 1.0 * response_0_0 + -1.0 * response_0_1
        force_0 = (1.0 * ddtheta_w + -1.0 * ddtheta_p) / inverse_mass_0
        ddtheta_w -= response_0_0 * force_0
        mobility_0_0 -= response_0_0 * response_0_0 / inverse_mass_0
        mobility_0_1 -= response_0_0 * response_0_1 / inverse_mass_0
        ddtheta_p -= response_0_1 * force_0
        mobility_1_0 -= response_0_1 * response_0_0 / inverse_mass_0
        mobility_1_1 -= response_0_1 * response_0_1 / inverse_mass_0
    if direction_ground == 0.0:
        response_1_0 = 1.0 * mobility_0_0 + 0.0 * mobility_0_1
        response_1_1 = 1.0 * mobility_1_0 + 0.0 * mobility_1_1
        inverse_mass_1 = 1.0 * response_1_0 + 0.0 * response_1_1
        force_1 = (1.0 * ddtheta_w + 0.0 * ddtheta_p) / inverse_mass_1
        ddtheta_w -= response_1_0 * force_1
        mobility_0_0 -= response_1_0 * response_1_0 / inverse_mass_1
        mobility_0_1 -= response_1_0 * response_1_1 / inverse_mass_1
        ddtheta_p -= response_1_1 * force_1
        mobility_1_0 -= response_1_1 * response_1_0 / inverse_mass_1
        mobility_1_1 -= response_1_1 * response_1_1 / inverse_mass_1
    if direction_drive == 0.0 and direction_ground == 0.0:  # its own force, without what the later one took over
        force_0 -= force_1 * (1.0 * response_0_0 + 0.0 * response_0_1) / inverse_mass_0
    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, force_0, force_1


@internal
def _rate(t, state, voltage, parameters, dry):
    """Accelerations under the directions dry[DIRECTION], into dry[RATE], and the forces on the surfaces, into dry[FORCE]."""
    angle_theta_w, angle_sum_1, angle_sum_2, angle_sum_3, = _angles(t, state[0], state[1], state[2], state[3], _frozen(parameters))
    sin_theta_w, cos_theta_w = math.sin(angle_theta_w), math.cos(angle_theta_w)
    sin_sum_1, cos_sum_1 = math.sin(angle_sum_1), math.cos(angle_sum_1)
    sin_sum_2, cos_sum_2 = math.sin(angle_sum_2), math.cos(angle_sum_2)
    sin_sum_3, cos_sum_3 = math.sin(angle_sum_3), math.cos(angle_sum_3)
    (
        dry[RATE, 0], dry[RATE, 1], mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, dry[FORCE, 0], dry[FORCE, 1],
    ) = _accelerate(
        t, state[0], state[1], state[2], state[3], state[4], voltage, dry[DIRECTION, 0], dry[DIRECTION, 1], sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, False, _frozen(parameters)
    )  # fmt: skip


@inlined
def _store_rate(dry):
    """Copy the accelerations dry[RATE] to dry[BEFORE]."""
    for k in range(NA):
        dry[BEFORE, k] = dry[RATE, k]


@inlined
def _frozen(parameters):
    """The parameters as a tuple, which no store can change: what follows from them alone is computed once a step."""
    return parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5], parameters[6], parameters[7], parameters[8], parameters[9], parameters[10], parameters[11], parameters[12], parameters[13], parameters[14], parameters[15], parameters[16], parameters[17], parameters[18], parameters[19], parameters[20], parameters[21], parameters[22], parameters[23], parameters[24], parameters[25], parameters[26], parameters[27], parameters[28], parameters[29], parameters[30], parameters[31], parameters[32], parameters[33], parameters[34], parameters[35], parameters[36], parameters[37], parameters[38], parameters[39], parameters[40], parameters[41], parameters[42], parameters[43], parameters[44], parameters[45], parameters[46], parameters[47], parameters[48], parameters[49], parameters[50], parameters[51], parameters[52], parameters[53], parameters[54], parameters[55], parameters[56], parameters[57],


@inlined
def _is_frictionless(parameters):
    """True where no surface has dry friction."""
    return parameters[7] == 0.0 and parameters[8] == 0.0 and parameters[10] == 0.0 and parameters[11] == 0.0 and parameters[12] == 0.0 and parameters[21] == 0.0


@inlined
def _has_friction(parameters, columns):
    """True where a surface has dry friction, or would have some by a change of the parameters in these columns."""
    found = not _is_frictionless(parameters)
    for column in columns:
        found = found or column == 7 or column == 8 or column == 10 or column == 11 or column == 12 or column == 21
    return found


@inlined
def _slip_directions(state, dry):
    """Directions of slip by the sign of the slip speeds, into dry[DIRECTION]."""
    for i in range(SURFACES):
        dry[DIRECTION, i] = 1.0 if _slip(state, i) >= 0.0 else -1.0


@inlined
def _friction_limits(t, state, voltage, parameters, dry):
    """Friction of each surface as it slips forward, in dry[UPPER], and backward, in dry[LOWER]; sticking, it lies between them."""
    dry[UPPER, 0], dry[UPPER, 1], = _dry_law(t, state[0], state[1], state[2], state[3], state[4], voltage, _frozen(parameters), 1.0, 1.0)
    dry[LOWER, 0], dry[LOWER, 1], = _dry_law(t, state[0], state[1], state[2], state[3], state[4], voltage, _frozen(parameters), -1.0, -1.0)


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
    voltage_saturation_limit = parameters[36]
    voltage_dead_zone_threshold = parameters[37]
    voltage_sag_rate = parameters[38]
    voltage_asymmetry_ratio = parameters[39]
    voltage_offset_offset = parameters[40]
    c0 = v_in - max(-voltage_saturation_limit + abs(v_in), 0.0)*_sign(v_in)
    c1 = (-t*voltage_sag_rate + 1)*max(-voltage_dead_zone_threshold + abs(c0), 0.0)*_sign(c0)
    driven = c1*(voltage_asymmetry_ratio*_sign(c1) + 1) + voltage_offset_offset

    return driven


@inlined
def _drive_jacobian(t, v_in, parameters, by_parameter):
    """Derivatives of the driven input into (NP,); zero entries are not touched."""
    voltage_saturation_limit = parameters[36]
    voltage_dead_zone_threshold = parameters[37]
    voltage_sag_rate = parameters[38]
    voltage_asymmetry_ratio = parameters[39]
    c0 = _sign(v_in)
    c1 = -t*voltage_sag_rate + 1
    c2 = -voltage_saturation_limit + abs(v_in)
    c3 = -c0*max(c2, 0.0) + v_in
    c4 = _sign(c3)
    c5 = -voltage_dead_zone_threshold + abs(c3)
    c6 = max(c5, 0.0)
    c7 = c1*c4
    c8 = c6*c7
    c9 = _sign(c8)
    c10 = c9*voltage_asymmetry_ratio + 1
    c11 = c10*_step(c5)
    by_parameter[36] = c0*c1*c11*(c4*c4)*_step(c2)
    by_parameter[37] = -c11*c7
    by_parameter[38] = -c10*c4*c6*t
    by_parameter[39] = c8*c9
    by_parameter[40] = 1


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
    begin, slope = _lag(h, parameters[LAG])[:2]
    driven = _driven(t, voltage, parameters)
    return driven + (begin + 0.5 * slope * h) * (state[NV] - driven)


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
    time_constant, delay = parameters[LAG], _input_delay(parameters)
    first = acting
    while first > 0 and when - t[first] - delay < LAG_MEMORY * time_constant and np.isfinite(voltage[first - 1]):
        first -= 1
    driven_by = np.zeros(FITTED + 1)
    _drive_jacobian(when, voltage[first], parameters, driven_by)
    state[NV] = _driven(when, voltage[first], parameters)
    for c in range(sens.shape[1]):
        sens[NV, c] = driven_by[columns[c - NX]] if c >= NX else 0.0
    for j in range(first + 1, acting + 1):
        until = when if j == acting else t[j + 1] + delay
        _, _, left, _, _, left_by = _lag(max(until - t[j] - delay, 1e-12), time_constant)
        _drive_jacobian(until, voltage[j], parameters, driven_by)
        driven = _driven(until, voltage[j], parameters)
        excess = state[NV] - driven
        state[NV] = driven + left * excess
        for c in range(sens.shape[1]):
            column = columns[c - NX] if c >= NX else FITTED
            sens[NV, c] = _lagged(left, left_by, sens[NV, c], excess if column == LAG else 0.0, driven_by[column])
    for c in range(NX, sens.shape[1]):
        if columns[c - NX] == DELAY and time_constant > 0.0:
            sens[NV, c] = (state[NV] - _driven(when, voltage[acting], parameters)) / time_constant


@compiled
def acting_voltage(t, voltage, parameters):
    """The input (N,) that acts at each sample just before its command: the commanded one unless the input lags."""
    acting, sens, columns = np.empty(t.size), np.zeros((NS, 0)), np.empty(0, np.int64)
    state, start = np.zeros(NS), np.zeros(NX)
    for k in range(t.size):
        _initial_state(t[k], t, voltage, _acting_sample(t, k, t[k], parameters), start, parameters, columns, state, sens)
        acting[k] = state[NV]
    return acting


@internal
def _runge_kutta(t, h, state, v_in, parameters, new_state, dry, smooth, linearise, stages, by_parameter):
    """One step of the classical fourth-order method for the state (NS,), also in place.

    The surfaces slip as dry[DIRECTION] says; smooth tells that none has friction. Where asked to, it linearises the four stages for _propagate.
    """
    direction_drive = dry[DIRECTION, 0]
    direction_ground = dry[DIRECTION, 1]
    theta_w = theta_w_new = theta_w_old = state[0]
    theta_p = theta_p_new = theta_p_old = state[1]
    dtheta_w = dtheta_w_new = dtheta_w_old = state[2]
    dtheta_p = dtheta_p_new = dtheta_p_old = state[3]
    presliding_drive_force_old = state[4]
    begin, descent, end, begin_by, descent_by, end_by = _lag(h, parameters[LAG])
    driven = _driven(t + 0.5 * h, v_in, parameters)
    excess = state[NV] - driven
    if linearise:
        _drive_jacobian(t + 0.5 * h, v_in, parameters, by_parameter[DRIVE, 0])
        stages[4, SHARE], stages[4, SHARE + 1], stages[4, SHARE + 2] = end, end_by, excess
    frozen = _frozen(parameters)
    start_theta_w, start_sum_1, start_sum_2, start_sum_3, = _angles(t, theta_w, theta_p, dtheta_w, dtheta_p, frozen)
    sin_theta_w, cos_theta_w = start_sin_theta_w, start_cos_theta_w = _sine_pair(start_theta_w)
    sin_sum_1, cos_sum_1 = start_sin_sum_1, start_cos_sum_1 = _sine_pair(start_sum_1)
    sin_sum_2, cos_sum_2 = start_sin_sum_2, start_cos_sum_2 = _sine_pair(start_sum_2)
    sin_sum_3, cos_sum_3 = start_sin_sum_3, start_cos_sum_3 = _sine_pair(start_sum_3)
    for stage in range(4):
        ahead, weight = _weights(stage, h)
        now = t + (1e-6 * h if stage == 0 else 0.5 * h if stage < 3 else (1.0 - 1e-6) * h)
        path = 1.0 * (theta_w - theta_w_old) + -1.0 * (theta_p - theta_p_old)
        presliding_drive_force = _presliding_drive_force(presliding_drive_force_old, path, frozen)
        if linearise:
            stages[stage, MEMORY + 0], stages[stage, MEMORY + 1] = _presliding_drive_force_jacobian(
                presliding_drive_force_old, path, frozen, stage, NA + 0, by_parameter
            )
        share = begin + descent * (now - t)
        v_in = driven + share * excess
        if stage > 0:
            angle_theta_w, angle_sum_1, angle_sum_2, angle_sum_3, = _angles(now, theta_w, theta_p, dtheta_w, dtheta_p, frozen)
            sin_theta_w, cos_theta_w = _rotated_sines(angle_theta_w, start_theta_w, start_sin_theta_w, start_cos_theta_w)
            sin_sum_1, cos_sum_1 = _rotated_sines(angle_sum_1, start_sum_1, start_sin_sum_1, start_cos_sum_1)
            sin_sum_2, cos_sum_2 = _rotated_sines(angle_sum_2, start_sum_2, start_sin_sum_2, start_cos_sum_2)
            sin_sum_3, cos_sum_3 = _rotated_sines(angle_sum_3, start_sum_3, start_sin_sum_3, start_cos_sum_3)
        ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, force_0, force_1 = _accelerate(now, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, direction_drive, direction_ground, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, smooth, frozen)
        if linearise:
            by_0_0, by_0_1, by_0_2, by_0_3, by_0_4, by_0_5, by_1_0, by_1_1, by_1_2, by_1_3, by_1_4, by_1_5 = _residual_jacobian(now, theta_w, theta_p, dtheta_w, dtheta_p, presliding_drive_force, v_in, direction_drive, direction_ground, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, ddtheta_w, ddtheta_p, frozen, stage, by_parameter)
            stages[stage, 0] = -(mobility_0_0 * by_0_0 + mobility_0_1 * by_1_0)
            stages[stage, 1] = -(mobility_0_0 * by_0_1 + mobility_0_1 * by_1_1)
            stages[stage, 2] = -(mobility_0_0 * by_0_2 + mobility_0_1 * by_1_2)
            stages[stage, 3] = -(mobility_0_0 * by_0_3 + mobility_0_1 * by_1_3)
            stages[stage, 4] = -(mobility_0_0 * by_0_4 + mobility_0_1 * by_1_4)
            stages[stage, 5] = -(mobility_0_0 * by_0_5 + mobility_0_1 * by_1_5)
            stages[stage, MOBILITY + 0] = mobility_0_0
            stages[stage, MOBILITY + 1] = mobility_0_1
            stages[stage, 6] = -(mobility_1_0 * by_0_0 + mobility_1_1 * by_1_0)
            stages[stage, 7] = -(mobility_1_0 * by_0_1 + mobility_1_1 * by_1_1)
            stages[stage, 8] = -(mobility_1_0 * by_0_2 + mobility_1_1 * by_1_2)
            stages[stage, 9] = -(mobility_1_0 * by_0_3 + mobility_1_1 * by_1_3)
            stages[stage, 10] = -(mobility_1_0 * by_0_4 + mobility_1_1 * by_1_4)
            stages[stage, 11] = -(mobility_1_0 * by_0_5 + mobility_1_1 * by_1_5)
            stages[stage, MOBILITY + 2] = mobility_1_0
            stages[stage, MOBILITY + 3] = mobility_1_1
            stages[stage, SHARE], stages[stage, SHARE + 1] = share, begin_by + descent_by * (now - t)
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
    path = 1.0 * (theta_w_new - theta_w_old) + -1.0 * (theta_p_new - theta_p_old)
    new_state[4] = _presliding_drive_force(presliding_drive_force_old, path, frozen)
    if linearise:
        stages[4, MEMORY + 0], stages[4, MEMORY + 1] = _presliding_drive_force_jacobian(
            presliding_drive_force_old, path, frozen, 4, NA + 0, by_parameter
        )
    new_state[NV] = driven + end * excess


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
            lanes[DRIVEN + c] = by_parameter[DRIVE, 0, column]
            lanes[EXCESS + c] = stages[4, SHARE + 2] if column == LAG else 0.0
        for stage in range(4):
            ahead, weight = _weights(stage, h)
            by_0_0, by_0_1, by_0_2, by_0_3, by_0_4, by_0_5 = stages[stage, 0 + 0], stages[stage, 0 + 1], stages[stage, 0 + 2], stages[stage, 0 + 3], stages[stage, 0 + 4], stages[stage, 0 + 5]
            by_1_0, by_1_1, by_1_2, by_1_3, by_1_4, by_1_5 = stages[stage, 6 + 0], stages[stage, 6 + 1], stages[stage, 6 + 2], stages[stage, 6 + 3], stages[stage, 6 + 4], stages[stage, 6 + 5]
            share, share_by = stages[stage, SHARE], stages[stage, SHARE + 1]
            before_0, along_0 = stages[stage, MEMORY + 0], stages[stage, MEMORY + 1]
            for c in range(LANES):
                theta_w = lanes[STAGE + 0 * LANES + c]
                theta_p = lanes[STAGE + 1 * LANES + c]
                dtheta_w = lanes[STAGE + 2 * LANES + c]
                dtheta_p = lanes[STAGE + 3 * LANES + c]
                path = 1.0 * (theta_w - lanes[START + 0 * LANES + c]) + -1.0 * (theta_p - lanes[START + 1 * LANES + c])
                presliding_drive_force = (
                    before_0 * lanes[START + 4 * LANES + c] + along_0 * path
                    + lanes[OWN + (DERIVATIVE_ROWS * stage + NA + 0) * LANES + c]
                )
                v_in = _lagged(
                    share, share_by, lanes[START + NV * LANES + c], lanes[EXCESS + c], lanes[DRIVEN + c]
                )
                ddtheta_w = lanes[OWN + (DERIVATIVE_ROWS * stage + 0) * LANES + c] + by_0_0 * theta_w + by_0_1 * theta_p + by_0_2 * dtheta_w + by_0_3 * dtheta_p + by_0_4 * presliding_drive_force + by_0_5 * v_in
                ddtheta_p = lanes[OWN + (DERIVATIVE_ROWS * stage + 1) * LANES + c] + by_1_0 * theta_w + by_1_1 * theta_p + by_1_2 * dtheta_w + by_1_3 * dtheta_p + by_1_4 * presliding_drive_force + by_1_5 * v_in
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
            path = 1.0 * (lanes[END + 0 * LANES + c] - lanes[START + 0 * LANES + c]) + -1.0 * (lanes[END + 1 * LANES + c] - lanes[START + 1 * LANES + c])
            sens[4, first + c] = (
                stages[4, MEMORY + 0] * lanes[START + 4 * LANES + c]
                + stages[4, MEMORY + 1] * path + lanes[OWN + (DERIVATIVE_ROWS * 4 + NA + 0) * LANES + c]
            )
            sens[NV, first + c] = _lagged(
                stages[4, SHARE], stages[4, SHARE + 1], lanes[START + NV * LANES + c], lanes[EXCESS + c], lanes[DRIVEN + c]
            )


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
                acting = new_state[NV]
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
    acting = _driven(t, voltage, parameters)
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
    old, new = _driven(t, old, parameters), _driven(t, new, parameters)
    if parameters[LAG] > 0.0:
        for c in range(columns.size):
            if columns[c] == DELAY:
                sens[NV, NX + c] += (old - new) / parameters[LAG]
        return
    for c in range(columns.size):
        if columns[c] == DELAY:
            _stick_slip_rate(t, state, old, parameters, dry)
            _store_rate(dry)
            _stick_slip_rate(t, state, new, parameters, dry)
            for k in range(NA):
                sens[RATES[k], NX + c] += dry[BEFORE, k] - dry[RATE, k]


@internal
def _event_jump(sens, state, voltage, t, parameters, columns, dry, moment):
    """Jump of the sensitivity in an event time where the event begins or ends."""
    acting = state[NV]
    for c in range(columns.size):
        if columns[c] == moment:
            _stick_slip_rate(t - 1e-9, state, acting, parameters, dry)
            _store_rate(dry)
            _stick_slip_rate(t + 1e-9, state, acting, parameters, dry)
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
    acting = state[NV]
    _stick_slip_rate(t, state, acting, parameters, dry)
    for k in range(NQ):
        slope[k], slope[NQ + k] = state[NQ + k], dry[RATE, k]


@compiled
def simulate(t, voltage, state, parameters, max_step):
    """States (N, NX) at the samples t (N,) under the commanded voltage (N,), from an initial state (NX,).

    Added states begin at rest. Where the initial state gives them too, (NV,), they are returned: (N, NV).
    """
    states = np.empty((t.size, state.size))
    columns = np.empty(0, np.int64)
    now, sens = np.zeros(NS), np.zeros((NS, 0))
    new_state, stages, by_parameter, lanes, dry = _workspace()
    acting = _acting_sample(t, FIRST_SAMPLE, t[0], parameters)
    _initial_state(t[0], t, voltage, acting, state, parameters, columns, now, sens)
    states[0] = now[: state.size]
    delay, smooth, linearise = _input_delay(parameters), _is_frictionless(parameters), False
    now_t = t[0]
    for k in range(t.size - 1):
        goal = t[k + 1]
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _delay_jump(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            if parameters[29] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 29)
            if now_t < parameters[29] < until:  # something begins or ends within
                until = parameters[29]
            if parameters[31] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 31)
            if now_t < parameters[31] < until:  # something begins or ends within
                until = parameters[31]
            if parameters[32] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 32)
            if now_t < parameters[32] < until:  # something begins or ends within
                until = parameters[32]
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
        for i in range(state.size):
            states[k + 1, i] = now[i]
    return states


@compiled
def closed_loop(t, reference, reference_rate, gains, state, parameters, noise, quantum, max_step):
    """The machine under its PID controller: states (N, NX), measured (N, NY) and voltage (N,).

    At each sample the sensors read the state, delayed ones that of an earlier time; noise (N, NY) is added, channels with a
    quantum > 0 are rounded to it, and the controller computes kp e + ki ∫e + kd ė from gains (3,), with
    e = reference − measured angle and ė = reference rate − measured rate; the voltage is held until the next sample.
    """
    states, measured, voltage = np.empty((t.size, NX)), np.empty((t.size, NY)), np.zeros(t.size)
    columns = np.empty(0, np.int64)
    now, sens, output = np.zeros(NS), np.zeros((NS, 0)), np.zeros(NY)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    now[:NX] = state
    integral, acting = 0.0, _acting_sample(t, FIRST_SAMPLE, t[0], parameters)
    delay, sensor_delay, smooth, linearise = _input_delay(parameters), _sensor_delay(parameters), _is_frictionless(parameters), False
    now_t, k, early = t[0], 0, 0
    while k < t.size:
        goal = max(now_t, min(t[k], t[early] - sensor_delay) if early < t.size else t[k])
        while now_t < goal:
            while acting + 1 < t.size and t[acting + 1] + delay <= now_t:  # a command begins to act, if delayed between samples
                if linearise:
                    _delay_jump(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(goal, t[acting + 1] + delay) if acting + 1 < t.size else goal
            if parameters[29] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 29)
            if now_t < parameters[29] < until:  # something begins or ends within
                until = parameters[29]
            if parameters[31] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 31)
            if now_t < parameters[31] < until:  # something begins or ends within
                until = parameters[31]
            if parameters[32] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 32)
            if now_t < parameters[32] < until:  # something begins or ends within
                until = parameters[32]
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
        read_sensors(now_t, now, parameters, output)
        for y in range(NY):
            if ahead if DELAYED[y] else on_time:
                sample = early if DELAYED[y] else k
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
                _initial_state(t[0], t, voltage, acting, state, parameters, columns, now, sens)
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
            if parameters[29] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 29)
            if now_t < parameters[29] < until:  # something begins or ends within
                until = parameters[29]
            if parameters[31] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 31)
            if now_t < parameters[31] < until:  # something begins or ends within
                until = parameters[31]
            if parameters[32] == now_t and linearise:
                _event_jump(sens, now, voltage[acting], now_t, parameters, columns, dry, 32)
            if now_t < parameters[32] < until:  # something begins or ends within
                until = parameters[32]
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
        while early < bounds[s, 1] and t[early] - sensor_delay < now_t:
            early += 1
        following, latest, before = early, acting, now_t
        for i in range(NS):
            new_state[i] = now[i]
        while early > k:
            early -= 1
            while before > max(t[early] - sensor_delay, t[0]):
                until = max(t[early] - sensor_delay, t[acting] + delay if acting > 0 else t[0])
                _step_back(before, before - until, new_state, voltage[acting], parameters, dry)
                before = until
                acting -= acting > 0 and before <= t[acting] + delay
            read_sensors(before, new_state, parameters, reading)
            _sensor_jacobian(before, new_state, parameters, by_state, reading_by)
            _sensor_delay_jacobian(before, new_state, voltage[acting], parameters, columns, dry, slope, by_state, reading_by)
            for c in range(columns.size):
                inside = window[c, 0] <= k - bounds[s, 0] < window[c, 1]
                active[c] = columns[c] if inside else FITTED
            _reading_jacobian(sens, by_state, reading_by, active, rows)
            for y in range(NY):
                sample = early if DELAYED[y] else k
                missing = not (t[early] - sensor_delay >= t[0] if DELAYED[y] else False) or np.isnan(measured[min(sample, t.size - 1), y])
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
        early, acting = following, latest
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
                if parameters[29] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, active, dry, 29)
                if now_t < parameters[29] < until:  # something begins or ends within
                    until = parameters[29]
                if parameters[31] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, active, dry, 31)
                if now_t < parameters[31] < until:  # something begins or ends within
                    until = parameters[31]
                if parameters[32] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, active, dry, 32)
                if now_t < parameters[32] < until:  # something begins or ends within
                    until = parameters[32]
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


@internal
def _step_back(t, h, state, voltage, parameters, dry):
    """Coordinates and rates a short time h earlier, by the accelerations that the command gives where it ends."""
    acting = state[NV] if parameters[LAG] > 0.0 else _driven(t, voltage, parameters)
    _stick_slip_rate(t, state, acting, parameters, dry)
    for k in range(NQ):
        state[k] += h * (0.5 * h * dry[RATE, k] - state[NQ + k])
        state[NQ + k] -= h * dry[RATE, k]


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
    parts = 1 if lagging else parts  # what lags is followed in one part
    count, (mixture, costs, rays) = 1, _empty_mixture(parts, size)
    rubs = _has_friction(parameters, columns)
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
            rubbing[:], count = 0.0, 1
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
                if parameters[29] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, chosen, dry, 29)
                if now_t < parameters[29] < until:  # something begins or ends within
                    until = parameters[29]
                if parameters[31] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, chosen, dry, 31)
                if now_t < parameters[31] < until:  # something begins or ends within
                    until = parameters[31]
                if parameters[32] == now_t and linearise:
                    _event_jump(sens, now, voltage[acting], now_t, parameters, chosen, dry, 32)
                if now_t < parameters[32] < until:  # something begins or ends within
                    until = parameters[32]
                steps = max(1, int(math.ceil((until - now_t) / max_step - 1e-6)))
                h = (until - now_t) / steps
                begin = now_t
                rests = 0  # that part the step under way: each surface once, else what is hardly known to slip would part it without end
                while begin < until:
                    length = until - begin if until - begin < 1.5 * h else h
                    if rubs and rests < SURFACES:
                        whole = length
                        length = _until_rest(begin, whole, now, voltage[acting], force, mixing, forces, rubbing, parameters, new_state, dry, stages, by_parameter)
                        rests = rests + 1 if length < whole else 0
                    else:
                        rests = 0
                    end = begin + length if length < until - begin else until
                    if lagging:
                        before[:], sens_before[:] = now, sens[:, first:]
                    _hold_forces(sens, force, mixing, forces, rubbing, parameters)
                    for i in range(SURFACES):
                        dry[DIRECTION, i] = 0.0  # friction is one of the held forces
                    _runge_kutta(begin, length, now, voltage[acting], parameters, now, dry, True, True, stages, by_parameter)
                    _propagate(length, sens, chosen, stages, by_parameter, lanes)
                    surface = 0 if rubs else SURFACES
                    if rubs and count == 1:
                        surface = _rub(
                            begin, now, sens, voltage[acting], mixing, parameters, columns, covariance, rubbing, added, friction, along, row_slope, dry, parts > 1,
                        )  # fmt: skip
                    if surface < SURFACES:
                        count = _rub_parts(
                            surface, count, begin, now, sens, voltage[acting], mixing, parameters, columns, covariance, rubbing, friction, along, row_slope, dry,
                            transition, product, mixture, costs, rays,
                        )  # fmt: skip
                    _move_sources(length, sens, mixing, noise, force, force_by, transition)
                    if lagging:
                        _lag_sensors(length, before, sens_before, now, sens, by_state, reads, noise, force, force_by, transition)
                    _spread(noise, added, covariance, transition, product)
                    if surface < SURFACES:
                        _end_parts(count, noise, now, force, covariance, transition, mixture)
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
                if count > 1:
                    root, white, log_variance = _assimilate_parts(
                        count, error, 1.0 / weight[y] ** 2, by, row, now, sens, force, force_by, covariance, gain, crossed, mixture
                    )
                    log_variance += 2.0 * math.log(weight[y])
                else:
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


@internal
def _until_rest(
    t, length, now, voltage, force, mixing, forces, rubbing, parameters, new_state, dry, stages, by_parameter
):
    """A step's length, or less where a surface that slips will first be at rest: there its friction changes within a step."""
    _friction_limits(t, now, voltage, parameters, dry)
    for r in range(forces.size):
        parameters[forces[r]] = 0.0
        for j in range(force.size):
            parameters[forces[r]] += mixing[r, j] * force[j]
    _slip_directions(now, dry)
    _rate(t, now, _acting(t, length, now, voltage, parameters), parameters, dry)
    near = False
    for i in range(SURFACES):
        slip, change = _slip(now, i), REST_MARGIN * length * abs(_slip_rate(dry, RATE, i))
        near = near or (dry[UPPER, i] > dry[LOWER, i] and slip != 0.0 and abs(slip) < change)
    if not near:
        return length
    for i in range(SURFACES):
        slip = _slip(now, i)
        rubs = dry[UPPER, i] if slip > 0.0 else dry[LOWER, i] if slip < 0.0 else rubbing[i]
        for r in range(forces.size):
            parameters[forces[r]] -= SLIP_MATRIX[i, r] * rubs
    dry[DIRECTION] = 0.0
    share, first = 1.0, SURFACES  # that will be at rest first
    for attempt in range(REST_ATTEMPTS):
        _runge_kutta(t, length * share, now, voltage, parameters, new_state, dry, True, False, stages, by_parameter)
        if attempt > 0:
            slip, later = _slip(now, first), _slip(new_state, first)
            share = min(1.0, share * slip / (slip - later))
            continue
        for i in range(SURFACES):
            slip, later = _slip(now, i), _slip(new_state, i)
            if dry[UPPER, i] > dry[LOWER, i] and slip * later < 0.0 and slip / (slip - later) < share:
                share, first = slip / (slip - later), i
        if first == SURFACES or share < MIN_PART:
            return length
    return length * share if MIN_PART < share < 1.0 - MIN_PART else length


@internal
def _rub(
    t, now, sens, voltage, mixing, parameters, columns, covariance, rubbing, added, friction, along, slope, dry, stops,
):  # fmt: skip
    """Dry friction over a step: an impulse that stops what slips, if it can, on the average over where the state may be.

    Implicit time stepping after Moreau (1988): of the slip with which a step would end, friction of a half width κ leaves
    what lies beyond ±κ. The filter knows that slip as a Gaussian variable; mean and slope of what is left follow in
    closed form, and what a line cannot say of it adds to the covariance. Returns the number of surfaces; where it stops
    before one that may stick, the number of those before.
    """
    rows = mixing.shape[0]
    for a in range(NS):
        for b in range(NS):
            added[a, b] = 0.0
    _friction_derivatives(t, now, voltage, parameters, columns, friction, dry)
    for i in range(SURFACES):
        middle, half = friction[0, i, columns.size], friction[1, i, columns.size]
        changes = False
        for c in range(columns.size):
            changes = changes or friction[0, i, c] != 0.0 or friction[1, i, c] != 0.0
        if half == 0.0 and middle == 0.0 and rubbing[i] == 0.0 and not changes:
            continue  # and none of the free parameters would change that
        response = _slip_response(i, rows, sens, along, slope)
        variance = _slip_variance(slope, mixing, covariance)
        slip = _slip(now, i) + response * (rubbing[i] - middle)
        left, share, signed, lost = _shrunk(slip, math.sqrt(max(variance, 1e-60)), response * half)
        if stops and half > 0.0 and share < 1.0 - RARE:
            return i
        force = (slip - left) / response + middle
        lost /= response**2
        for a in range(NS):
            for b in range(NS):
                added[a, b] += along[a] * along[b] * lost
        _push(i, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope)
    return SURFACES


@internal
def _rub_parts(
    surface, count, t, now, sens, voltage, mixing, parameters, columns, covariance, rubbing, friction, along, slope, dry,
    transition, product, mixture, costs, rays,
):  # fmt: skip
    """Dry friction over a step from a surface on, on the average over all parts; cut where it sticks. Returns their number."""
    rows = mixing.shape[0]
    if count > 1:
        _friction_derivatives(t, now, voltage, parameters, columns, friction, dry)
    _begin_parts(count, sens, mixing, covariance, transition, product, mixture)
    for i in range(surface, SURFACES):
        middle, half = friction[0, i, columns.size], friction[1, i, columns.size]
        response = _slip_response(i, rows, sens, along, slope)
        slip = _slip(now, i) + response * (rubbing[i] - middle)
        left, share, signed = slip, 1.0, 0.0
        if half > 0.0:
            _slip_rays(i, along, response, rays)
            count, left, share, signed = _split_parts(count, slip, response * half, rays, mixture, costs)
        force = (slip - left) / response + middle
        _push(i, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope)
    return count


@inlined
def _push(surface, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope):
    """Let a surface's friction act on the states and their sensitivities, instead of what acted over the step."""
    for a in range(NS):
        now[a] -= along[a] * (force - rubbing[surface])
    stopped = (share - 1.0) / response
    for c in range(sens.shape[1]):
        by = stopped * slope[c]
        if c >= NS + rows:
            by -= share * friction[0, surface, c - NS - rows] + signed * friction[1, surface, c - NS - rows]
        for a in range(NS):
            sens[a, c] += along[a] * by
    rubbing[surface] = force


@inlined
def _slip_response(surface, rows, sens, along, slope):
    """Derivatives of the states in a force along a surface, into along, and of its slip in all, into slope.

    Returns the slip's in that force.
    """
    for a in range(NS):
        along[a] = 0.0
        for r in range(rows):
            along[a] += sens[a, NS + r] * SLIP_MATRIX[surface, r]
    response = 0.0
    for k in range(NA):
        response += SLIP_MATRIX[surface, k] * along[RATES[k]]
    for c in range(sens.shape[1]):
        slope[c] = 0.0
        for k in range(NA):
            slope[c] += SLIP_MATRIX[surface, k] * sens[RATES[k], c]
    return response


@inlined
def _slip_rays(surface, along, response, rays):
    """Derivatives of a slip in the variables at the end of a step, and theirs in a slip that friction takes away."""
    for a in range(rays.shape[1]):
        rays[BY_VARIABLE, a] = 0.0
        rays[PUSH, a] = along[a] / response if a < NS else 0.0
    for k in range(NA):
        rays[BY_VARIABLE, RATES[k]] = SLIP_MATRIX[surface, k]


@internal
def _friction_derivatives(t, state, voltage, parameters, columns, friction, dry):
    """Middle and half width of each surface's friction, into friction (2, SURFACES, n + 1), after their derivatives."""
    count = columns.size
    for c in range(count, -1, -1):
        if c < count and not IN_DRY_LAW[columns[c]]:
            for i in range(SURFACES):
                friction[0, i, c] = friction[1, i, c] = 0.0
            continue
        step = 0.0
        if c < count:
            kept = parameters[columns[c]]
            step = 1e-6 * max(abs(kept), 1e-3)
            parameters[columns[c]] = kept + step
        _friction_limits(t, state, voltage, parameters, dry)
        for i in range(SURFACES):
            friction[0, i, c] = 0.5 * (dry[UPPER, i] + dry[LOWER, i])
            friction[1, i, c] = 0.5 * (dry[UPPER, i] - dry[LOWER, i])
            if c < count:
                friction[0, i, c] = (friction[0, i, c] - friction[0, i, count]) / step
                friction[1, i, c] = (friction[1, i, c] - friction[1, i, count]) / step
        if c < count:
            parameters[columns[c]] = kept


@inlined
def _slip_variance(slope, mixing, covariance):
    """Variance of a slip from its derivatives in the states and in the rows' forces at the beginning of the step."""
    size, total = covariance.shape[0], 0.0
    for a in range(size):
        by, crossed = _slope_in(a, slope, mixing), 0.0
        for b in range(a):
            crossed += covariance[a, b] * _slope_in(b, slope, mixing)
        total += by * (covariance[a, a] * by + 2.0 * crossed)
    return total


@inlined
def _slope_in(variable, slope, mixing):
    """Derivative of a slip in one of the filter's variables: a state, or a source by the rows that it acts on."""
    if variable < NS:
        return slope[variable]
    by = 0.0
    for r in range(mixing.shape[0]):
        by += slope[NS + r] * mixing[r, variable - NS]
    return by


@inlined
def _tails(mean, sigma, width):
    """Bounds ±width in standard deviations from the mean; probabilities beyond them; densities there [1/σ]."""
    above, below = (width - mean) / sigma, (-width - mean) / sigma
    upper, lower = 0.5 * math.erfc(above / math.sqrt(2.0)), 0.5 * math.erfc(-below / math.sqrt(2.0))
    upper_density = math.exp(-0.5 * above * above) / math.sqrt(2.0 * math.pi)
    lower_density = math.exp(-0.5 * below * below) / math.sqrt(2.0 * math.pi)
    return above, below, upper, lower, upper_density, lower_density


@internal
def _shrunk(mean, sigma, width):
    """What is left of a Gaussian variable s beyond ±width, shrunk by it: mean, slope, signed share, and variance off the line.

    The slope is the probability of |s| > width (Stein's lemma), the signed share P(s > width) − P(s < −width).
    """
    if abs(mean) - abs(width) > CERTAIN_SIGMAS * sigma:
        sign = 1.0 if mean > 0.0 else -1.0
        return mean - sign * width, 1.0, sign, 0.0
    _, _, upper, lower, upper_density, lower_density = _tails(mean, sigma, width)
    left = sigma * (upper_density - lower_density) + (mean - width) * upper + (mean + width) * lower
    square = (sigma**2 + (mean - width) ** 2) * upper + (mean - width) * sigma * upper_density
    square += (sigma**2 + (mean + width) ** 2) * lower - (mean + width) * sigma * lower_density
    share = upper + lower
    return left, share, upper - lower, max(square - left**2 - (share * sigma) ** 2, 0.0)


@inlined
def _piece(share, density_low, density_high, bent):
    """Mean and variance of a piece of the standard normal distribution (Johnson, Kotz and Balakrishnan 1994, 13.10).

    Of its share, of the densities at its two ends, and of the difference between these times their places.
    """
    shift = (density_low - density_high) / share
    return shift, max(1.0 + bent / share - shift**2, 0.0)


@inlined
def _empty_mixture(parts, size):
    """Mixture with room for so many parts and the three that friction makes of each, costs of mergers, and a slip's rays."""
    room = 4 * parts if parts > 1 else 0
    return np.zeros((room + 3, size + 1, size + 1)), np.zeros((room, room)), np.zeros((3, size))


@internal
def _begin_parts(count, sens, mixing, covariance, transition, product, mixture):
    """Move all parts to the end of a step without friction's change; where there was one, it is the filter's own."""
    size = covariance.shape[0]
    for a in range(size):
        for b in range(size):
            mixture[FLOOR, a, b] = 0.0
            if count == 1:
                mixture[0, a, b] = covariance[a, b]
        if count == 1:
            mixture[0, size, a] = 0.0
    if count == 1:
        mixture[0, WEIGHT, size] = 1.0
    for i in range(NS):
        for j in range(size):
            transition[i, j] = sens[i, j] if j < NS else 0.0
            for r in range(mixing.shape[0] if j >= NS else 0):
                transition[i, j] += sens[i, NS + r] * mixing[r, j - NS]
    for p in range(count):
        _move_part_on(p, transition, product, mixture)


@internal
def _move_part_on(p, transition, product, mixture):
    """Offset and covariance of a part after a step, by the first rows of a transition: only the states move in it."""
    size = transition.shape[0]
    for i in range(NS):
        total = 0.0
        for k in range(size):
            total += transition[i, k] * mixture[p, size, k]
        mixture[TRIAL, size, i] = total
        for a in range(size):
            total = 0.0
            for k in range(size):
                total += transition[i, k] * mixture[p, k, a]
            product[i, a] = total
    for i in range(NS):
        mixture[p, size, i] = mixture[TRIAL, size, i]
        for j in range(i + 1):
            total = 0.0
            for k in range(size):
                total += product[i, k] * transition[j, k]
            mixture[p, i, j] = mixture[p, j, i] = total
        for j in range(NS, size):
            mixture[p, i, j] = mixture[p, j, i] = product[i, j]


@internal
def _split_parts(count, slip, width, rays, mixture, costs):
    """Cut each part where friction does, and merge what is alike.

    Returns how many parts there are then; and mean, slope and signed share of what friction leaves of the slip, whose
    mean was slip. Offsets are then from that mean.
    """
    size, room, new = rays.shape[1], costs.shape[0] // 4, costs.shape[0] // 4
    left, share, signed = 0.0, 0.0, 0.0
    for p in range(count):
        weight, (offset, variance) = mixture[p, WEIGHT, size], _regress_on_slip(p, width, rays, mixture)
        mean, sigma = slip + offset, math.sqrt(variance)
        above, below, upper, lower, at_upper, at_lower = _tails(mean, sigma, width)
        left += weight * (sigma * (at_upper - at_lower) + (mean - width) * upper + (mean + width) * lower)
        share += weight * (upper + lower)
        signed += weight * (upper - lower)
        sticks = 1.0 - upper - lower
        if weight * sticks >= RARE:
            shift, spread = _piece(sticks, at_lower, at_upper, below * at_lower - above * at_upper)
            _cut_part(
                p, new, sticks, shift * sigma, mean + shift * sigma, spread * variance, variance, True, rays, mixture
            )
            new += 1
        if weight * upper >= RARE:
            shift, spread = _piece(upper, at_upper, 0.0, above * at_upper)
            _cut_part(p, new, upper, shift * sigma, width, spread * variance, variance, False, rays, mixture)
            new += 1
        if weight * lower >= RARE:
            shift, spread = _piece(lower, 0.0, at_lower, -below * at_lower)
            _cut_part(p, new, lower, shift * sigma, -width, spread * variance, variance, False, rays, mixture)
            new += 1
    _settle_parts(new - room, room, slip - left, width, rays, mixture)
    return _reduce_parts(new - room, room, mixture, costs), left, share, signed


@internal
def _regress_on_slip(p, width, rays, mixture):
    """Offset and variance of a part's slip; into rays the regression of its variables on it.

    A slip that stuck before is known to the last digit, and what else varies with it is rounding: so no slip counts as
    known better than a small share of friction's half width.
    """
    size, offset, variance = rays.shape[1], 0.0, 0.0
    for a in range(size):
        total = 0.0
        for b in range(size):
            total += mixture[p, a, b] * rays[BY_VARIABLE, b]
        rays[ON_SLIP, a] = total
        offset += rays[BY_VARIABLE, a] * mixture[p, size, a]
        variance += rays[BY_VARIABLE, a] * total
    variance = max(variance, (KNOWN_SLIP * width) ** 2)
    for a in range(size):
        rays[ON_SLIP, a] /= variance
    return offset, variance


@internal
def _cut_part(old, new, share, shift, taken, spread, variance, sticks, rays, mixture):
    """Moments of a part given that its slip has another mean and variance, from which friction takes what it does."""
    size = rays.shape[1]
    mixture[new, WEIGHT, size] = mixture[old, WEIGHT, size] * share
    for a in range(size):
        on_slip = rays[ON_SLIP, a]
        by = on_slip - rays[PUSH, a] if sticks else on_slip
        mixture[new, size, a] = mixture[old, size, a] + on_slip * shift - rays[PUSH, a] * taken
        for b in range(a + 1):
            other = rays[ON_SLIP, b] - rays[PUSH, b] if sticks else rays[ON_SLIP, b]
            value = mixture[old, a, b] - on_slip * rays[ON_SLIP, b] * variance + by * other * spread
            mixture[new, a, b] = mixture[new, b, a] = value


@inlined
def _settle_parts(count, first, taken, width, rays, mixture):
    """Let what was cut be the mixture's parts, with weights of sum 1 and offsets from where friction leaves the mean."""
    size, total = rays.shape[1], 0.0
    for p in range(count):
        total += mixture[first + p, WEIGHT, size]
    for p in range(count):
        for a in range(size + 1):
            for b in range(size + 1):
                mixture[p, a, b] = mixture[first + p, a, b]
        mixture[p, WEIGHT, size] /= total
        for a in range(size):
            mixture[p, size, a] += rays[PUSH, a] * taken
    for a in range(size):
        for b in range(a + 1):
            mixture[FLOOR, a, b] += (ALIKE * width) ** 2 * rays[PUSH, a] * rays[PUSH, b]


@internal
def _end_parts(count, noise, now, force, covariance, transition, mixture):
    """Let the parts' forces decay and be driven anew, after the filter's own did."""
    size = covariance.shape[0]
    for p in range(count):
        for j in range(NS, size):
            decay = transition[j, j]
            mixture[p, size, j] *= decay
            for a in range(size):
                mixture[p, a, j] *= decay
            for a in range(size):
                mixture[p, j, a] *= decay
            mixture[p, j, j] += noise[j - NS, 0] ** 2 * (1.0 - decay**2)
    _gather(count, now, force, covariance, mixture)


@internal
def _gather(count, now, force, covariance, mixture):
    """Mean and covariance of all parts are the filter's own; their offsets are from that mean."""
    size = covariance.shape[0]
    for a in range(size):
        mean = 0.0
        for p in range(count):
            mean += mixture[p, WEIGHT, size] * mixture[p, size, a]
        for p in range(count):
            mixture[p, size, a] -= mean
        if a < NS:
            now[a] += mean
        else:
            force[a - NS] += mean
    for a in range(size):
        for b in range(a + 1):
            total = 0.0
            for p in range(count):
                own = mixture[p, a, b] + mixture[p, size, a] * mixture[p, size, b]
                total += mixture[p, WEIGHT, size] * own
            covariance[a, b] = covariance[b, a] = total


@internal
def _assimilate_parts(count, error, variance, by, row, now, sens, force, force_by, covariance, gain, crossed, mixture):
    """Update all parts by a reading, and weigh them by how well each foretold it.

    Returns the standard deviation of the error, the whitened innovation and the logarithm of a variance: such that the
    innovation's slope in the error is the score of the mixture, and that both make −2 log of its likelihood.
    """
    size, rows = by.size, sens.shape[1] - row.size + 1
    total, score, likelihood, largest = variance, 0.0, 0.0, -math.inf
    for a in range(size):
        for b in range(size):
            total += by[a] * covariance[a, b] * by[b]
    for p in range(count):
        largest = max(largest, _assimilate_part(p, error, variance, by, gain, crossed, mixture))
    for p in range(count):
        likelihood += math.exp(mixture[p, VOLUME, size] - largest)
    for p in range(count):
        share = math.exp(mixture[p, VOLUME, size] - largest) / likelihood
        score += share * mixture[p, WEIGHT, size]
        mixture[p, WEIGHT, size] = share
    _gather(count, now, force, covariance, mixture)
    for a in range(size):
        effective = 0.0  # the mean's derivative in the error: covariance with the reading over the noise (Tweedie)
        for b in range(size):
            effective += covariance[a, b] * by[b] / variance
        for c in range(row.size - 1):
            if a < NS:
                sens[a, rows + c] -= effective * row[c]
            else:
                force_by[a - NS, c] -= effective * row[c]
    root = math.sqrt(total)
    return root, root * score, -2.0 * (largest + math.log(likelihood)) - total * score**2


@internal
def _assimilate_part(p, error, variance, by, gain, crossed, mixture):
    """Update a part by a reading; in place of its weight stands its score then, of its volume its log-likelihood.

    Returns this logarithm.
    """
    size, own = by.size, error
    for i in range(size):
        own -= by[i] * mixture[p, size, i]
    total = _learn(variance, by, mixture[p], mixture[TRIAL, size], gain, crossed)
    for i in range(size):
        mixture[p, size, i] += gain[i] * own
    weight = max(mixture[p, WEIGHT, size], 1e-300)
    mixture[p, WEIGHT, size] = own / total
    mixture[p, VOLUME, size] = math.log(weight) - 0.5 * own**2 / total - 0.5 * math.log(total)
    return mixture[p, VOLUME, size]


@internal
def _reduce_parts(count, room, mixture, costs):
    """Merge parts while they are more than there is room for, or while it costs next to nothing; returns their number."""
    size = mixture.shape[1] - 1
    for p in range(count):
        mixture[p, VOLUME, size] = _log_volume(p, mixture)
        for q in range(p):
            costs[p, q] = _merging_cost(p, q, mixture)
    while count > 1:
        least, first, second = math.inf, 0, 1
        for p in range(count):
            for q in range(p):
                if costs[p, q] < least:
                    least, first, second = costs[p, q], q, p
        if count <= room and least > RARE:
            break
        _merge(first, second, mixture)
        count -= 1
        _move_part(count, second, mixture, costs)
        for p in range(count):
            if p != first:
                costs[max(p, first), min(p, first)] = _merging_cost(p, first, mixture)
    return count


@internal
def _move_part(old, new, mixture, costs):
    """Let the last of all parts take the place of another."""
    for a in range(mixture.shape[1]):
        for b in range(mixture.shape[1]):
            mixture[new, a, b] = mixture[old, a, b]
    for p in range(old):
        if p != new:
            costs[max(p, new), min(p, new)] = costs[old, p]


@internal
def _merging_cost(first, second, mixture):
    """What the merger of two parts costs at most [nat] (Runnalls 2007, equation 16)."""
    size = mixture.shape[1] - 1
    _merge_covariances(first, second, mixture)
    one, other = mixture[first, WEIGHT, size], mixture[second, WEIGHT, size]
    apart = one * mixture[first, VOLUME, size] + other * mixture[second, VOLUME, size]
    return 0.5 * ((one + other) * _log_volume(TRIAL, mixture) - apart)


@internal
def _merge(first, second, mixture):
    """Let the first of two parts be both."""
    size = mixture.shape[1] - 1
    _merge_covariances(first, second, mixture)
    share = mixture[second, WEIGHT, size] / (mixture[first, WEIGHT, size] + mixture[second, WEIGHT, size])
    for a in range(size):
        mixture[first, size, a] += share * (mixture[second, size, a] - mixture[first, size, a])
        for b in range(a + 1):
            mixture[first, a, b] = mixture[first, b, a] = mixture[TRIAL, a, b]
    mixture[first, WEIGHT, size] += mixture[second, WEIGHT, size]
    mixture[first, VOLUME, size] = _log_volume(TRIAL, mixture)


@internal
def _merge_covariances(first, second, mixture):
    """Covariance of two parts together, to be tried."""
    size = mixture.shape[1] - 1
    share = mixture[second, WEIGHT, size] / (mixture[first, WEIGHT, size] + mixture[second, WEIGHT, size])
    between = share * (1.0 - share)
    for a in range(size):
        by = between * (mixture[second, size, a] - mixture[first, size, a])
        for b in range(a + 1):
            both = mixture[first, a, b] + share * (mixture[second, a, b] - mixture[first, a, b])
            mixture[TRIAL, a, b] = both + by * (mixture[second, size, b] - mixture[first, size, b])


@internal
def _log_volume(part, mixture):
    """Logarithm of the determinant of a covariance, no less than the floor, from its factors L D Lᵀ."""
    size, total, product = mixture.shape[1] - 1, 0.0, 1.0
    for a in range(size):
        for b in range(a):
            value = mixture[part, a, b] + mixture[FLOOR, a, b]
            for c in range(b):
                value -= mixture[FACTOR, a, c] * mixture[FACTOR, c, b]
            mixture[FACTOR, a, b] = value  # of L D
        diagonal = value = mixture[part, a, a] + mixture[FLOOR, a, a]
        for c in range(a):
            mixture[FACTOR, c, a] = mixture[FACTOR, a, c] * mixture[FACTOR, c, c]  # of Lᵀ
            value -= mixture[FACTOR, a, c] * mixture[FACTOR, c, a]
        value = max(value, 1e-12 * diagonal, 1e-100)
        mixture[FACTOR, a, a] = 1.0 / value
        product *= value
        if not 1e-150 < product < 1e150:
            total += math.log(product)
            product = 1.0
    return total + math.log(product)


@compiled
def regressor(t, state, rate, voltage, parameters):
    """Left side (NQ,) [V] and regressor φ (NQ, len(LINEAR)) at given accelerations (paper eqs. 21-23)."""
    tau, phi = np.zeros(NQ), np.zeros((NQ, len(LINEAR)))
    v_in = voltage
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    ddtheta_w = rate[0]
    ddtheta_p = rate[1]
    direction_drive = _sign(1.0 * state[2] + -1.0 * state[3])
    direction_ground = _sign(1.0 * state[2])
    X7 = parameters[6]
    load_friction_share = parameters[10]
    stribeck_drive_speed = parameters[13]
    cogging_periods = parameters[19]
    slope_angle = parameters[22]
    com_offset_angle = parameters[26]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    R = parameters[52]
    g = parameters[53]
    alpha = parameters[54]
    J_w = parameters[55]
    L = parameters[56]
    origin = parameters[57]
    c0 = 1/R
    c1 = g*math.sin(slope_angle)
    c2 = c0*c1
    c3 = X7*dtheta_p
    c4 = X7*dtheta_w
    c5 = c3 - c4 + v_in
    c6 = direction_drive*load_friction_share
    c7 = _sign(c5)
    c8 = c6*c7
    c9 = c3*c8 - c4*c8 - c6*abs(c5) + v_in
    c10 = -ddtheta_p + ddtheta_w
    c11 = com_offset_angle + theta_p
    c12 = c11 + slope_angle
    c13 = math.cos(c12)
    c14 = c13*ddtheta_p
    c15 = (dtheta_p*dtheta_p)
    c16 = c15*math.sin(c12)
    c17 = -t
    c18 = payload_step_ratio*_step(-c17 - payload_step_time)
    c19 = c18/L
    c20 = c7*direction_drive*dtheta_p*load_friction_share - c8*dtheta_w - dtheta_p
    c21 = (direction_drive*direction_drive)
    c22 = abs(-dtheta_p + dtheta_w)
    c23 = stribeck_drive_speed**(-2)
    c24 = direction_drive*math.exp(-c15*c23 + 2*c23*dtheta_p*dtheta_w - c23*(dtheta_w*dtheta_w))
    c25 = -c24 + direction_drive
    c26 = -c22*dtheta_p + c22*dtheta_w
    c27 = cogging_periods*theta_p - cogging_periods*theta_w
    c28 = math.sin(c27)
    c29 = -math.cos(c27)
    c30 = abs(v_in)
    c31 = -c30*dtheta_p + c30*dtheta_w
    c32 = c13*ddtheta_w
    c33 = math.sin(c11)
    tau[0] = 2*J_w*c2/alpha + c9
    tau[1] = c9
    phi[0, 0] = c2 + ddtheta_w
    phi[0, 1] = c10
    phi[0, 2] = R*c19*ddtheta_w + c1*c19 + c14*c18 + c14 - c16*c18 - c16
    phi[0, 5] = dtheta_w
    phi[0, 6] = c20
    phi[0, 7] = direction_drive
    phi[0, 8] = c21
    phi[0, 9] = c22
    phi[0, 10] = c24
    phi[0, 11] = c25
    phi[0, 12] = c26
    phi[0, 13] = c28
    phi[0, 14] = c29
    phi[0, 15] = dtheta_w
    phi[0, 16] = direction_ground
    phi[0, 17] = -math.sin(theta_w)
    phi[0, 18] = -math.cos(theta_w)
    phi[0, 19] = dtheta_w*abs(dtheta_w)
    phi[0, 21] = -origin + theta_w
    phi[0, 22] = _step(-c17 - external_push_end) - _step(-c17 - external_push_start)
    phi[0, 23] = c31
    phi[0, 24] = -1
    phi[1, 1] = c10
    phi[1, 2] = -L*c0*c18*ddtheta_p - c18*c32 - c32
    phi[1, 3] = -ddtheta_p
    phi[1, 4] = c18*c33 + c33
    phi[1, 5] = dtheta_w
    phi[1, 6] = c20
    phi[1, 7] = direction_drive
    phi[1, 8] = c21
    phi[1, 9] = c22
    phi[1, 10] = c24
    phi[1, 11] = c25
    phi[1, 12] = c26
    phi[1, 13] = c28
    phi[1, 14] = c29
    phi[1, 20] = -dtheta_p
    phi[1, 23] = c31
    phi[1, 25] = 1

    return tau, phi


@compiled
def regressor_parts(t, state, voltage, parameters):
    """φ2, φ1, φ0 (NQ, len(LINEAR)) each, with φ = d²φ2/dt² + dφ1/dt + φ0 (paper eqs. 25, 26)."""
    phi2, phi1, phi0 = np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR)))
    v_in = voltage
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    direction_drive = _sign(1.0 * state[2] + -1.0 * state[3])
    direction_ground = _sign(1.0 * state[2])
    X7 = parameters[6]
    load_friction_share = parameters[10]
    stribeck_drive_speed = parameters[13]
    cogging_periods = parameters[19]
    slope_angle = parameters[22]
    com_offset_angle = parameters[26]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    R = parameters[52]
    g = parameters[53]
    L = parameters[56]
    origin = parameters[57]
    c0 = -theta_w
    c1 = -c0 - theta_p
    c2 = -t
    c3 = payload_step_ratio*_step(-c2 - payload_step_time)
    c4 = c3/L
    c5 = 1/R
    c6 = -theta_p
    c7 = com_offset_angle + theta_p
    c8 = c7 + slope_angle
    c9 = math.cos(c8)
    c10 = c3*c9 + c9
    c11 = g*math.sin(slope_angle)
    c12 = _sign(X7*dtheta_p - X7*dtheta_w + v_in)
    c13 = c12*direction_drive*dtheta_p*load_friction_share - c12*direction_drive*dtheta_w*load_friction_share - dtheta_p
    c14 = (direction_drive*direction_drive)
    c15 = abs(-dtheta_p + dtheta_w)
    c16 = stribeck_drive_speed**(-2)
    c17 = direction_drive*math.exp(-c16*(dtheta_p*dtheta_p) + 2*c16*dtheta_p*dtheta_w - c16*(dtheta_w*dtheta_w))
    c18 = -c17 + direction_drive
    c19 = -c15*dtheta_p + c15*dtheta_w
    c20 = cogging_periods*theta_p - cogging_periods*theta_w
    c21 = math.sin(c20)
    c22 = -math.cos(c20)
    c23 = abs(v_in)
    c24 = -c23*dtheta_p + c23*dtheta_w
    c25 = dtheta_p*dtheta_w*math.sin(c8)
    c26 = math.sin(c7)
    phi2[0, 0] = theta_w
    phi2[0, 1] = c1
    phi2[0, 2] = R*c4*theta_w
    phi2[1, 1] = c1
    phi2[1, 2] = -L*c3*c5*theta_p
    phi2[1, 3] = c6
    phi1[0, 2] = c10*dtheta_p
    phi1[0, 5] = theta_w
    phi1[0, 15] = theta_w
    phi1[1, 2] = -c10*dtheta_w
    phi1[1, 5] = theta_w
    phi1[1, 20] = c6
    phi0[0, 0] = c11*c5
    phi0[0, 2] = c11*c4
    phi0[0, 6] = c13
    phi0[0, 7] = direction_drive
    phi0[0, 8] = c14
    phi0[0, 9] = c15
    phi0[0, 10] = c17
    phi0[0, 11] = c18
    phi0[0, 12] = c19
    phi0[0, 13] = c21
    phi0[0, 14] = c22
    phi0[0, 16] = direction_ground
    phi0[0, 17] = -math.sin(theta_w)
    phi0[0, 18] = -math.cos(theta_w)
    phi0[0, 19] = dtheta_w*abs(dtheta_w)
    phi0[0, 21] = -c0 - origin
    phi0[0, 22] = _step(-c2 - external_push_end) - _step(-c2 - external_push_start)
    phi0[0, 23] = c24
    phi0[0, 24] = -1
    phi0[1, 2] = -c25*c3 - c25
    phi0[1, 4] = c26*c3 + c26
    phi0[1, 6] = c13
    phi0[1, 7] = direction_drive
    phi0[1, 8] = c14
    phi0[1, 9] = c15
    phi0[1, 10] = c17
    phi0[1, 11] = c18
    phi0[1, 12] = c19
    phi0[1, 13] = c21
    phi0[1, 14] = c22
    phi0[1, 23] = c24
    phi0[1, 25] = 1

    return phi2, phi1, phi0


@compiled
def energy_parts(t, state, voltage, parameters):
    """Energy stored (n,), power taken (n,) and power supplied: supplied = (d stored/dt + taken) · X, n = len(LINEAR).

    The rows times their rates, summed: the energy balance, which holds without accelerations. In V rad, V rad/s.
    """
    stored, taken, supplied = np.zeros(len(LINEAR)), np.zeros(len(LINEAR)), np.zeros(1)
    v_in = voltage
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    direction_drive = _sign(1.0 * state[2] + -1.0 * state[3])
    direction_ground = _sign(1.0 * state[2])
    X7 = parameters[6]
    load_friction_share = parameters[10]
    stribeck_drive_speed = parameters[13]
    cogging_periods = parameters[19]
    slope_angle = parameters[22]
    com_offset_angle = parameters[26]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    R = parameters[52]
    g = parameters[53]
    alpha = parameters[54]
    J_w = parameters[55]
    L = parameters[56]
    origin = parameters[57]
    c0 = (dtheta_w*dtheta_w)
    c1 = (1/2)*c0
    c2 = 1/R
    c3 = g*math.sin(slope_angle)
    c4 = c2*c3
    c5 = dtheta_p*dtheta_w
    c6 = (dtheta_p*dtheta_p)
    c7 = (1/2)*c6
    c8 = com_offset_angle + theta_p
    c9 = c5*math.cos(c8 + slope_angle)
    c10 = -t
    c11 = payload_step_ratio*_step(-c10 - payload_step_time)
    c12 = c11/L
    c13 = (direction_drive*direction_drive)
    c14 = 1/cogging_periods
    c15 = cogging_periods*theta_p - cogging_periods*theta_w
    c16 = math.cos(c15)
    c17 = c14*c16
    c18 = (cogging_periods != 0)
    c19 = math.sin(c15)
    c20 = c14*c19
    c21 = dtheta_p*math.sin(c8)
    c22 = X7*dtheta_p - X7*dtheta_w + v_in
    c23 = _sign(c22)
    c24 = c23*direction_drive*load_friction_share
    c25 = c24*c6
    c26 = c0*c24
    c27 = abs(-dtheta_p + dtheta_w)
    c28 = stribeck_drive_speed**(-2)
    c29 = math.exp(-c0*c28 - c28*c6 + 2*c28*dtheta_p*dtheta_w)
    c30 = direction_drive*dtheta_p
    c31 = direction_drive*dtheta_w
    c32 = c29*c30 - c29*c31
    c33 = 2*c5
    c34 = ((c19) if c18 else (0))
    c35 = ((-c19) if c18 else (0))
    c36 = ((c16) if c18 else (1))
    c37 = ((-c16) if c18 else (0))
    c38 = abs(v_in)
    c39 = load_friction_share*abs(c22)
    stored[0] = c1 + c4*theta_w
    stored[1] = c1 - c5 + c7
    stored[2] = L*c11*c2*c7 + R*c1*c12 + c11*c9 + c9
    stored[3] = c7
    stored[7] = -direction_drive*theta_p + direction_drive*theta_w
    stored[8] = -c13*theta_p + c13*theta_w
    stored[13] = -((-c17) if c18 else (0)) + ((c17) if c18 else (0))
    stored[14] = -((-c20) if c18 else (theta_w)) + ((c20) if c18 else (theta_p))
    stored[16] = direction_ground*theta_w
    stored[17] = math.cos(theta_w)
    stored[18] = -math.sin(theta_w)
    stored[21] = -origin*theta_w + (1/2)*(theta_w*theta_w)
    stored[24] = -theta_w
    stored[25] = -theta_p
    taken[2] = c12*c3*dtheta_w
    taken[4] = -c11*c21 - c21
    taken[5] = c0 - c5
    taken[6] = 2*c23*direction_drive*dtheta_p*dtheta_w*load_friction_share - c25 - c26 - c5 + c6
    taken[9] = -c27*dtheta_p + c27*dtheta_w
    taken[10] = -c32
    taken[11] = -c30 + c31 + c32
    taken[12] = c0*c27 - c27*c33 + c27*c6
    taken[13] = -c19*dtheta_p + c19*dtheta_w + c34*dtheta_p - c34*dtheta_w - c35*dtheta_p + c35*dtheta_w
    taken[14] = c16*dtheta_p - c16*dtheta_w - c36*dtheta_p + c36*dtheta_w + c37*dtheta_p - c37*dtheta_w
    taken[15] = c0
    taken[19] = c0*abs(dtheta_w)
    taken[20] = c6
    taken[22] = dtheta_w*_step(-c10 - external_push_end) - dtheta_w*_step(-c10 - external_push_start)
    taken[23] = c0*c38 - c33*c38 + c38*c6
    supplied[0] = 2*J_w*c4*dtheta_w/alpha + X7*c24*c33 - X7*c25 - X7*c26 + c30*c39 - c31*c39 - dtheta_p*v_in + dtheta_w*v_in

    return stored, taken, supplied[0]


SIGNALS, FEATURES = 43, 26
DERIVATIVES = np.array([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 0, 0, 0, 0, 0])  # how often each signal is differentiated
HELD_INPUT = np.array([False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False])  # whether it is constant between samples
UNMEASURED = np.array([2])  # states that no sensor reads: rates of coordinates
Z1, Z2, OLD, NEW, STATE = 0, 1, 2, 3, 4  # rows of the filters' memory
MIXING = np.array([((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)), ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0))], dtype=np.float64)  # weights of the features in [φ τ], by row


@inlined
def _signals(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, sin_theta_w, cos_theta_w, sin_sum_1, cos_sum_1, sin_sum_2, cos_sum_2, sin_sum_3, cos_sum_3, parameters):
    """Distinct quantities that enter the filters."""
    direction_drive = _sign(1.0 * dtheta_w + -1.0 * dtheta_p)
    direction_ground = _sign(1.0 * dtheta_w)
    X7 = parameters[6]
    load_friction_share = parameters[10]
    stribeck_drive_speed = parameters[13]
    cogging_periods = parameters[19]
    slope_angle = parameters[22]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    external_push_start = parameters[31]
    external_push_end = parameters[32]
    R = parameters[52]
    g = parameters[53]
    alpha = parameters[54]
    J_w = parameters[55]
    L = parameters[56]
    origin = parameters[57]
    c0 = 1/R
    c1 = g*math.sin(slope_angle)
    c2 = c0*c1
    c3 = -t
    c4 = payload_step_ratio*_step(-c3 - payload_step_time)
    c5 = c4/L
    c6 = X7*dtheta_p
    c7 = X7*dtheta_w
    c8 = c6 - c7 + v_in
    c9 = direction_drive*load_friction_share
    c10 = c9*_sign(c8)
    c11 = abs(-dtheta_p + dtheta_w)
    c12 = stribeck_drive_speed**(-2)
    c13 = cogging_periods*theta_p - cogging_periods*theta_w
    c14 = abs(v_in)
    c15 = dtheta_p*dtheta_w*sin_sum_3
    c16 = cos_sum_3*dtheta_p
    c17 = cos_sum_3*dtheta_w
    signal_0 = c2
    signal_1 = c1*c5
    signal_2 = dtheta_p
    signal_3 = c10*dtheta_p
    signal_4 = c10*dtheta_w
    signal_5 = direction_drive
    signal_6 = (direction_drive*direction_drive)
    signal_7 = c11
    signal_8 = direction_drive*math.exp(-c12*(dtheta_p*dtheta_p) + 2*c12*dtheta_p*dtheta_w - c12*(dtheta_w*dtheta_w))
    signal_9 = c11*dtheta_w
    signal_10 = c11*dtheta_p
    signal_11 = math.sin(c13)
    signal_12 = math.cos(c13)
    signal_13 = direction_ground
    signal_14 = sin_theta_w
    signal_15 = cos_theta_w
    signal_16 = dtheta_w*abs(dtheta_w)
    signal_17 = theta_w
    signal_18 = origin
    signal_19 = _step(-c3 - external_push_start)
    signal_20 = _step(-c3 - external_push_end)
    signal_21 = c14*dtheta_w
    signal_22 = c14*dtheta_p
    signal_23 = 1
    signal_24 = c15
    signal_25 = c15*c4
    signal_26 = c4*sin_sum_2
    signal_27 = sin_sum_2
    signal_28 = c16
    signal_29 = c16*c4
    signal_30 = theta_w
    signal_31 = c17
    signal_32 = c17*c4
    signal_33 = theta_p
    signal_34 = theta_w
    signal_35 = theta_p
    signal_36 = R*c5*theta_w
    signal_37 = L*c0*c4*theta_p
    signal_38 = v_in
    signal_39 = c9*abs(c8)
    signal_40 = c10*c6
    signal_41 = c10*c7
    signal_42 = J_w*c2/alpha

    return signal_0, signal_1, signal_2, signal_3, signal_4, signal_5, signal_6, signal_7, signal_8, signal_9, signal_10, signal_11, signal_12, signal_13, signal_14, signal_15, signal_16, signal_17, signal_18, signal_19, signal_20, signal_21, signal_22, signal_23, signal_24, signal_25, signal_26, signal_27, signal_28, signal_29, signal_30, signal_31, signal_32, signal_33, signal_34, signal_35, signal_36, signal_37, signal_38, signal_39, signal_40, signal_41, signal_42,


@internal
def _signals_at(t, state, voltage, parameters, signal):
    """_signals in a state (NX,), into signal (SIGNALS,)."""
    angle_theta_w, angle_sum_1, angle_sum_2, angle_sum_3, = _angles(t, state[0], state[1], state[2], state[3], _frozen(parameters))
    signal[0], signal[1], signal[2], signal[3], signal[4], signal[5], signal[6], signal[7], signal[8], signal[9], signal[10], signal[11], signal[12], signal[13], signal[14], signal[15], signal[16], signal[17], signal[18], signal[19], signal[20], signal[21], signal[22], signal[23], signal[24], signal[25], signal[26], signal[27], signal[28], signal[29], signal[30], signal[31], signal[32], signal[33], signal[34], signal[35], signal[36], signal[37], signal[38], signal[39], signal[40], signal[41], signal[42], = _signals(t, state[0], state[1], state[2], state[3], voltage, math.sin(angle_theta_w), math.cos(angle_theta_w), math.sin(angle_sum_1), math.cos(angle_sum_1), math.sin(angle_sum_2), math.cos(angle_sum_2), math.sin(angle_sum_3), math.cos(angle_sum_3), parameters)


@internal
def _signal_rates(t, state, voltage, parameters, speed):
    """Time derivatives of the signals that are differentiated twice, into speed (SIGNALS,)."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    payload_step_time = parameters[29]
    payload_step_ratio = parameters[30]
    R = parameters[52]
    L = parameters[56]
    c0 = payload_step_ratio*_step(-payload_step_time + t)
    speed[34] = dtheta_w
    speed[35] = dtheta_p
    speed[36] = R*c0*dtheta_w/L
    speed[37] = L*c0*dtheta_p/R


@inlined
def _features(signal_0, signal_1, signal_2, signal_3, signal_4, signal_5, signal_6, signal_7, signal_8, signal_9, signal_10, signal_11, signal_12, signal_13, signal_14, signal_15, signal_16, signal_17, signal_18, signal_19, signal_20, signal_21, signal_22, signal_23, signal_24, signal_25, signal_26, signal_27, signal_28, signal_29, signal_30, signal_31, signal_32, signal_33, signal_34, signal_35, signal_36, signal_37, signal_38, signal_39, signal_40, signal_41, signal_42):
    """Sums of filtered signals that always come together."""
    feature_0 = signal_0
    feature_1 = signal_1 + signal_28 + signal_29 + signal_36
    feature_2 = -signal_2 + signal_3 - signal_4
    feature_3 = signal_5
    feature_4 = signal_6
    feature_5 = signal_7
    feature_6 = signal_8
    feature_7 = -signal_10 + signal_9
    feature_8 = signal_11
    feature_9 = -signal_12
    feature_10 = signal_13
    feature_11 = -signal_14
    feature_12 = -signal_15
    feature_13 = signal_16
    feature_14 = signal_17 - signal_18
    feature_15 = -signal_19 + signal_20
    feature_16 = signal_21 - signal_22
    feature_17 = -signal_23
    feature_18 = -signal_24 - signal_25 - signal_31 - signal_32 - signal_37
    feature_19 = signal_26 + signal_27
    feature_20 = signal_30
    feature_21 = -signal_33
    feature_22 = signal_34
    feature_23 = -signal_35
    feature_24 = signal_38 - signal_39 + signal_40 - signal_41
    feature_25 = 2*signal_42

    return feature_0, feature_1, feature_2, feature_3, feature_4, feature_5, feature_6, feature_7, feature_8, feature_9, feature_10, feature_11, feature_12, feature_13, feature_14, feature_15, feature_16, feature_17, feature_18, feature_19, feature_20, feature_21, feature_22, feature_23, feature_24, feature_25,


@internal
def _assemble(signal, tau, phi):
    """Filtered left side and regressor from the filtered signals (paper eqs. 39, 40)."""
    feature_0, feature_1, feature_2, feature_3, feature_4, feature_5, feature_6, feature_7, feature_8, feature_9, feature_10, feature_11, feature_12, feature_13, feature_14, feature_15, feature_16, feature_17, feature_18, feature_19, feature_20, feature_21, feature_22, feature_23, feature_24, feature_25, = _features(signal[0], signal[1], signal[2], signal[3], signal[4], signal[5], signal[6], signal[7], signal[8], signal[9], signal[10], signal[11], signal[12], signal[13], signal[14], signal[15], signal[16], signal[17], signal[18], signal[19], signal[20], signal[21], signal[22], signal[23], signal[24], signal[25], signal[26], signal[27], signal[28], signal[29], signal[30], signal[31], signal[32], signal[33], signal[34], signal[35], signal[36], signal[37], signal[38], signal[39], signal[40], signal[41], signal[42])
    c0 = feature_22 + feature_23
    c1 = feature_3 - feature_6
    tau[0] = feature_24 + feature_25
    tau[1] = feature_24
    phi[0, 0] = feature_0 + feature_22
    phi[0, 1] = c0
    phi[0, 2] = feature_1
    phi[0, 5] = feature_20
    phi[0, 6] = feature_2
    phi[0, 7] = feature_3
    phi[0, 8] = feature_4
    phi[0, 9] = feature_5
    phi[0, 10] = feature_6
    phi[0, 11] = c1
    phi[0, 12] = feature_7
    phi[0, 13] = feature_8
    phi[0, 14] = feature_9
    phi[0, 15] = feature_20
    phi[0, 16] = feature_10
    phi[0, 17] = feature_11
    phi[0, 18] = feature_12
    phi[0, 19] = feature_13
    phi[0, 21] = feature_14
    phi[0, 22] = feature_15
    phi[0, 23] = feature_16
    phi[0, 24] = feature_17
    phi[1, 1] = c0
    phi[1, 2] = feature_18
    phi[1, 3] = feature_23
    phi[1, 4] = feature_19
    phi[1, 5] = feature_20
    phi[1, 6] = feature_2
    phi[1, 7] = feature_3
    phi[1, 8] = feature_4
    phi[1, 9] = feature_5
    phi[1, 10] = feature_6
    phi[1, 11] = c1
    phi[1, 12] = feature_7
    phi[1, 13] = feature_8
    phi[1, 14] = feature_9
    phi[1, 20] = feature_21
    phi[1, 23] = feature_16
    phi[1, 25] = -feature_17


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
    """
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


BLOCK_SIZE, PARTIAL_SUMS = 64, 16  # samples that are worked on side by side, and sums that are kept apart: with these all stays in the nearest cache
INTERVAL_TOLERANCE = 1e-6  # by which share the interval may differ within a block
BLOCK_STRIDE = BLOCK_SIZE + 8  # room for the sample before a block
SINES = NX * BLOCK_STRIDE  # rows of the scratch array of a block: states, sines and cosines, what enters the filters and leaves them, features
FIRST_IN = SINES + 8 * BLOCK_STRIDE
FILTERS = 40  # signals that are the same, and differ in their derivatives alone, share one
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


@compiled
def closed_loop_batch(t, reference, reference_rate, gains, states, parameters, max_step, every, record):
    """Many machines under their PID controllers, as in closed_loop without noise.

    gains (B, 3), initial states (B, NX), which become the final ones, and parameters (B, NP) of each; record
    (ceil(N / every), NX + 1, B) receives states and voltage at every so many samples.
    """
    noise, quantum = np.zeros((t.size, NY)), np.zeros(NY)
    for b in range(states.shape[0]):
        path, _, voltage = closed_loop(
            t, reference, reference_rate, gains[b], states[b], parameters[b], noise, quantum, max_step
        )
        for k in range(0, t.size, every):
            for i in range(NX):
                record[k // every, i, b] = path[k, i]
            record[k // every, NX, b] = voltage[k]
        states[b] = path[-1]
