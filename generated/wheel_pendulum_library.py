# Made by wheelpend from model.toml with sympy 1.14.0; do not edit, run `wheelpend generate`.
# plant wheel_pendulum; assumptions ground_friction_reaction=body, rotor_inertia=True, rotor_speed=body, gear_ratio_in_back_emf=once, motor_circuit=static, encoder=absolute; effects coulomb_drive, coulomb_asymmetry, viscous_asymmetry, stribeck_drive, quadratic_drive, cogging, ground_viscous, rolling_resistance, slope, wheel_runout, air_drag, com_offset, tether_spring, actuator_delay, winding_inductance, voltage_saturation, voltage_dead_zone, voltage_sag, voltage_asymmetry, voltage_offset, encoder_eccentricity, encoder_scale, pitch_scale, gyro_scale, imu_bias, gyro_bias
"""Kernels of the model `wheel_pendulum with every effect`.

wheel row: 0 =
    - missing.wheel
    - v_in
    + X1*ddtheta_w
    + X2*ddtheta_w
    + X6*dtheta_w
    + dtheta_w*ground_viscous.coefficient
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
    + quadratic_drive.coefficient*(-dtheta_p + dtheta_w)*Magnitude(-dtheta_p + dtheta_w)
    - X3*dtheta_p**2*sin(com_offset.angle + slope.angle + theta_p)
    + X1*g*sin(slope.angle)/R
    - 2*J_w*g*sin(slope.angle)/(R*alpha)
body row: 0 =
    + v_in
    - missing.body
    + X2*ddtheta_p
    + X4*ddtheta_p
    + X7*dtheta_p
    + cogging.cosine*cos(cogging.periods*(-theta_p + theta_w))
    + cogging.sine*sin(cogging.periods*(-theta_p + theta_w))
    - X2*ddtheta_w
    - X5*sin(com_offset.angle + theta_p)
    - X6*dtheta_w
    - viscous_asymmetry.coefficient*Magnitude(-dtheta_p + dtheta_w)
    + X3*ddtheta_w*cos(com_offset.angle + slope.angle + theta_p)
    - quadratic_drive.coefficient*(-dtheta_p + dtheta_w)*Magnitude(-dtheta_p + dtheta_w)

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
OUTPUTS = ('theta_w', 'theta_p', 'dtheta_p')
ROWS = ('wheel', 'body')
PARAMETERS = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7', 'coulomb_drive.torque', 'coulomb_asymmetry.torque', 'viscous_asymmetry.coefficient', 'stribeck_drive.static', 'stribeck_drive.sliding', 'stribeck_drive.speed', 'quadratic_drive.coefficient', 'cogging.sine', 'cogging.cosine', 'cogging.periods', 'ground_viscous.coefficient', 'rolling_resistance.torque', 'slope.angle', 'wheel_runout.sine', 'wheel_runout.cosine', 'air_drag.coefficient', 'com_offset.angle', 'tether_spring.stiffness', 'actuator_delay.delay', 'winding_inductance.time_constant', 'voltage_saturation.limit', 'voltage_dead_zone.threshold', 'voltage_sag.rate', 'voltage_asymmetry.ratio', 'voltage_offset.offset', 'encoder_eccentricity.sine', 'encoder_eccentricity.cosine', 'encoder_scale.scale', 'pitch_scale.scale', 'gyro_scale.scale', 'imu_bias.bias', 'gyro_bias.bias', 'missing.wheel', 'missing.body', 'R', 'g', 'alpha', 'J_w', 'origin')
UNITS = ('V s²/rad', 'V s²/rad', 'V s²/rad', 'V s²/rad', 'V', 'V s/rad', 'V s/rad', 'V', 'V', 'V s/rad', 'V', 'V', 'rad/s', 'V s²/rad²', 'V', 'V', '1/turn', 'V s/rad', 'V', 'rad', 'V', 'V', 'V s²/rad²', 'rad', 'V/rad', 's', 's', 'V', 'V', '1/s', '1', 'V', 'rad', 'rad', '1', '1', '1', 'rad', 'rad/s', 'V', 'V', 'm', 'm/s²', 'N m/V', 'kg m²', 'rad')
ABSENT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0)  # value of each parameter while its effect is absent; 1 for a constant
ABSORBED = {'viscous_drive.coefficient': {'X6': 1.0, 'X7': 1.0}}  # effects that are part of the plant's own parameters, with weights on these
TWINS = {'coulomb_asymmetry': ('voltage_offset',), 'com_offset': ('imu_bias',), 'voltage_offset': ('coulomb_asymmetry',), 'imu_bias': ('com_offset',)}  # effects that change every log in the same way
CONTAINS = {'stribeck_drive': {'coulomb_drive': ((1.0,), (1.0,))}}  # effects within others: parameters of the larger by those of the smaller
NEEDS = {'slope.angle': ('R', 'g', 'alpha', 'J_w')}  # constants without which a parameter has no meaning
LINEAR = ('X1', 'X2', 'X3', 'X4', 'X5', 'X6', 'X7', 'coulomb_drive.torque', 'coulomb_asymmetry.torque', 'viscous_asymmetry.coefficient', 'stribeck_drive.static', 'stribeck_drive.sliding', 'quadratic_drive.coefficient', 'cogging.sine', 'cogging.cosine', 'ground_viscous.coefficient', 'rolling_resistance.torque', 'wheel_runout.sine', 'wheel_runout.cosine', 'air_drag.coefficient', 'tether_spring.stiffness', 'missing.wheel', 'missing.body')  # parameters of the regressor, in the order of its columns
FITTED = 41  # so many of PARAMETERS, from the first, have sensitivities
DELAY = 25  # index of the input delay among PARAMETERS, or -1
LAG = 26  # index of the time constant of the input's lag, or -1
ORIGIN = 45  # index of the wheel's angle at the log's first sample, or -1
NQ, NX, NY, NP = 2, 4, 3, 46
NS = NX + (LAG >= 0)  # states that are integrated: a lagging input is the last
DRY = 2  # surfaces with dry friction
SLIPS = np.array([(1.0, -1.0), (1.0, 0.0)], dtype=np.float64)  # slip speeds as weights on the rates
RATE, BEFORE, FORCE, UPPER, LOWER, DIRECTION = range(6)  # rows of the scratch array of dry friction
LANES = 8  # sensitivity columns that are advanced side by side
START, STAGE, END, OWN, DRIVEN, EXCESS = (LANES * row for row in (0, NS, 2 * NS, 3 * NS, 3 * NS + 4 * NQ, 3 * NS + 4 * NQ + 1))
MOBILITY, SHARE, DRIVE = NQ * NS, NQ * NS + NQ * NQ, 4  # where the coefficients of a stage, and the driven input's, begin
FIRST = np.int64(0)  # sample; for a literal 0 numba would compile functions once more
CONTROLLED = (1, 2)  # outputs that the controller sees: angle and its rate
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

    96 operations.
    """
    X1 = parameters[0]
    X2 = parameters[1]
    X3 = parameters[2]
    X4 = parameters[3]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    viscous_asymmetry_coefficient = parameters[9]
    quadratic_drive_coefficient = parameters[13]
    cogging_sine = parameters[14]
    cogging_cosine = parameters[15]
    cogging_periods = parameters[16]
    ground_viscous_coefficient = parameters[17]
    slope_angle = parameters[19]
    wheel_runout_sine = parameters[20]
    wheel_runout_cosine = parameters[21]
    air_drag_coefficient = parameters[22]
    com_offset_angle = parameters[23]
    tether_spring_stiffness = parameters[24]
    missing_wheel = parameters[39]
    missing_body = parameters[40]
    R = parameters[41]
    g = parameters[42]
    alpha = parameters[43]
    J_w = parameters[44]
    origin = parameters[45]
    c0 = X6*dtheta_w
    c1 = X7*dtheta_p
    c2 = com_offset_angle + theta_p
    c3 = -dtheta_p + dtheta_w
    c4 = abs(c3)
    c5 = c4*viscous_asymmetry_coefficient
    c6 = -theta_w
    c7 = cogging_periods*(-c6 - theta_p)
    c8 = cogging_cosine*math.cos(c7)
    c9 = cogging_sine*math.sin(c7)
    c10 = c3*c4*quadratic_drive_coefficient
    c11 = -X5*math.sin(c2) - c0 + c1 - c10 - c5 + c8 + c9 - missing_body + v_in
    c12 = c2 + slope_angle
    c13 = math.cos(c12)
    c14 = X3*c13
    c15 = 1/(X1*X2 + X1*X4 + X2*X4 + 2*X2*c14 - (X3*X3)*(c13*c13))
    c16 = c15*(X2 - c14)
    c17 = math.sin(slope_angle)
    c18 = 1/R
    c19 = -2*J_w*c17*c18*g/alpha + X1*c17*c18*g - X3*(dtheta_p*dtheta_p)*math.sin(c12) + air_drag_coefficient*dtheta_w*abs(dtheta_w) + c0 - c1 + c10 + c5 - c8 - c9 + dtheta_w*ground_viscous_coefficient - missing_wheel + tether_spring_stiffness*(-c6 - origin) - v_in - wheel_runout_cosine*math.cos(theta_w) - wheel_runout_sine*math.sin(theta_w)
    c20 = c15*(X2 + X4)
    c21 = c15*(X1 + X2)
    ddtheta_w = -c11*c16 - c19*c20
    ddtheta_p = -c11*c21 - c16*c19
    mobility_0_0 = c20
    mobility_0_1 = c16
    mobility_1_0 = c16
    mobility_1_1 = c21

    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1


@inlined
def _residual_jacobian(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, direction_drive, direction_ground, ddtheta_w, ddtheta_p, parameters, stage, by_parameter):
    """Derivatives of inertia − force at given accelerations: in the states, returned row by row, and in the parameters.

    The latter go into by_parameter[stage], where zero entries are not touched.
    135 operations.
    """
    X1 = parameters[0]
    X3 = parameters[2]
    X5 = parameters[4]
    X6 = parameters[5]
    X7 = parameters[6]
    viscous_asymmetry_coefficient = parameters[9]
    stribeck_drive_static = parameters[10]
    stribeck_drive_sliding = parameters[11]
    stribeck_drive_speed = parameters[12]
    quadratic_drive_coefficient = parameters[13]
    cogging_sine = parameters[14]
    cogging_cosine = parameters[15]
    cogging_periods = parameters[16]
    ground_viscous_coefficient = parameters[17]
    slope_angle = parameters[19]
    wheel_runout_sine = parameters[20]
    wheel_runout_cosine = parameters[21]
    air_drag_coefficient = parameters[22]
    com_offset_angle = parameters[23]
    tether_spring_stiffness = parameters[24]
    R = parameters[41]
    g = parameters[42]
    alpha = parameters[43]
    J_w = parameters[44]
    origin = parameters[45]
    c0 = math.sin(theta_w)
    c1 = math.cos(theta_w)
    c2 = -theta_w
    c3 = -c2 - theta_p
    c4 = c3*cogging_periods
    c5 = math.sin(c4)
    c6 = c5*cogging_cosine
    c7 = c6*cogging_periods
    c8 = math.cos(c4)
    c9 = c8*cogging_sine
    c10 = c9*cogging_periods
    c11 = -c10 + c7
    c12 = com_offset_angle + theta_p
    c13 = c12 + slope_angle
    c14 = math.sin(c13)
    c15 = X3*c14
    c16 = (dtheta_p*dtheta_p)
    c17 = math.cos(c13)
    c18 = X3*c16*c17 + c15*ddtheta_p
    c19 = abs(dtheta_w)
    c20 = 2*dtheta_p
    c21 = c20 - 2*dtheta_w
    c22 = stribeck_drive_speed**(-2)
    c23 = -dtheta_w
    c24 = -c23 - dtheta_p
    c25 = (c24*c24)
    c26 = math.exp(-c22*c25)
    c27 = c26*direction_drive
    c28 = c27*(-stribeck_drive_sliding + stribeck_drive_static)
    c29 = c22*c28
    c30 = abs(c24)
    c31 = _sign(c24)
    c32 = c24*c31*quadratic_drive_coefficient + c30*quadratic_drive_coefficient + c31*viscous_asymmetry_coefficient
    c33 = X6 + c21*c29 + c32
    c34 = X7 + c21*c29 + c32
    c35 = c15*ddtheta_w
    c36 = X5*math.cos(c12) + c35
    c37 = 1/R
    c38 = c37*g
    c39 = ddtheta_p - ddtheta_w
    c40 = (direction_drive*direction_drive)
    c41 = direction_drive*(1 - c26)
    c42 = 2*c25*c28/(stribeck_drive_speed*stribeck_drive_speed*stribeck_drive_speed)
    c43 = c24*c30
    c44 = c3*c6 - c3*c9
    c45 = math.cos(slope_angle)
    by_0_0 = c0*wheel_runout_cosine - c1*wheel_runout_sine + c11 + tether_spring_stiffness
    by_0_1 = -c11 - c18
    by_0_2 = air_drag_coefficient*c19 + air_drag_coefficient*dtheta_w*_sign(dtheta_w) + c33 + ground_viscous_coefficient
    by_0_3 = -c15*c20 - c34
    by_0_4 = -1
    by_1_0 = -c11
    by_1_1 = -c10 - c36 + c7
    by_1_2 = -c33
    by_1_3 = c34
    by_1_4 = 1
    by_parameter[stage, 0, 0] = c38*math.sin(slope_angle) + ddtheta_w
    by_parameter[stage, 0, 1] = -c39
    by_parameter[stage, 0, 2] = -c14*c16 + c17*ddtheta_p
    by_parameter[stage, 0, 5] = dtheta_w
    by_parameter[stage, 0, 6] = -dtheta_p
    by_parameter[stage, 0, 7] = direction_drive
    by_parameter[stage, 0, 8] = c40
    by_parameter[stage, 0, 9] = c30
    by_parameter[stage, 0, 10] = c27
    by_parameter[stage, 0, 11] = c41
    by_parameter[stage, 0, 12] = c42
    by_parameter[stage, 0, 13] = c43
    by_parameter[stage, 0, 14] = -c5
    by_parameter[stage, 0, 15] = -c8
    by_parameter[stage, 0, 16] = c44
    by_parameter[stage, 0, 17] = dtheta_w
    by_parameter[stage, 0, 18] = direction_ground
    by_parameter[stage, 0, 19] = -2*J_w*c38*c45/alpha + X1*c37*c45*g - c18
    by_parameter[stage, 0, 20] = -c0
    by_parameter[stage, 0, 21] = -c1
    by_parameter[stage, 0, 22] = c19*dtheta_w
    by_parameter[stage, 0, 23] = -c18
    by_parameter[stage, 0, 24] = -c2 - origin
    by_parameter[stage, 0, 39] = -1
    by_parameter[stage, 1, 1] = c39
    by_parameter[stage, 1, 2] = c17*ddtheta_w
    by_parameter[stage, 1, 3] = ddtheta_p
    by_parameter[stage, 1, 4] = -math.sin(c12)
    by_parameter[stage, 1, 5] = c23
    by_parameter[stage, 1, 6] = dtheta_p
    by_parameter[stage, 1, 7] = -direction_drive
    by_parameter[stage, 1, 8] = -c40
    by_parameter[stage, 1, 9] = -c30
    by_parameter[stage, 1, 10] = -c27
    by_parameter[stage, 1, 11] = -c41
    by_parameter[stage, 1, 12] = -c42
    by_parameter[stage, 1, 13] = -c43
    by_parameter[stage, 1, 14] = c5
    by_parameter[stage, 1, 15] = c8
    by_parameter[stage, 1, 16] = -c44
    by_parameter[stage, 1, 19] = -c35
    by_parameter[stage, 1, 23] = -c36
    by_parameter[stage, 1, 40] = -1

    return by_0_0, by_0_1, by_0_2, by_0_3, by_0_4, by_1_0, by_1_1, by_1_2, by_1_3, by_1_4


@inlined
def _dry_law(theta_w, theta_p, dtheta_w, dtheta_p, parameters, direction_drive, direction_ground):
    """Dry friction against the slip of each surface [V]; direction 0 where it sticks."""
    coulomb_drive_torque = parameters[7]
    coulomb_asymmetry_torque = parameters[8]
    stribeck_drive_static = parameters[10]
    stribeck_drive_sliding = parameters[11]
    stribeck_drive_speed = parameters[12]
    rolling_resistance_torque = parameters[18]
    force_0 = coulomb_asymmetry_torque*(direction_drive*direction_drive) + coulomb_drive_torque*direction_drive + direction_drive*(stribeck_drive_sliding + (-stribeck_drive_sliding + stribeck_drive_static)*math.exp(-((-dtheta_p + dtheta_w)*(-dtheta_p + dtheta_w))/(stribeck_drive_speed*stribeck_drive_speed)))
    force_1 = direction_ground*rolling_resistance_torque

    return force_0, force_1,


@compiled
def read_sensors(t, state, parameters, output):
    """What the sensors read in this state, into output (NY,)."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    encoder_eccentricity_sine = parameters[32]
    encoder_eccentricity_cosine = parameters[33]
    encoder_scale_scale = parameters[34]
    pitch_scale_scale = parameters[35]
    gyro_scale_scale = parameters[36]
    imu_bias_bias = parameters[37]
    gyro_bias_bias = parameters[38]
    output[0] = (encoder_scale_scale + 1)*(encoder_eccentricity_cosine*math.cos(theta_w) + encoder_eccentricity_sine*math.sin(theta_w) + theta_w)
    output[1] = imu_bias_bias + theta_p*(pitch_scale_scale + 1)
    output[2] = dtheta_p*(gyro_scale_scale + 1) + gyro_bias_bias


@inlined
def _sensor_jacobian(t, state, parameters, by_state, by_parameter):
    """Derivatives of the readings into (NY, NX) and (NY, NP); zero entries are not touched."""
    theta_w = state[0]
    theta_p = state[1]
    dtheta_p = state[3]
    encoder_eccentricity_sine = parameters[32]
    encoder_eccentricity_cosine = parameters[33]
    encoder_scale_scale = parameters[34]
    pitch_scale_scale = parameters[35]
    gyro_scale_scale = parameters[36]
    c0 = encoder_scale_scale + 1
    c1 = math.cos(theta_w)
    c2 = math.sin(theta_w)
    by_state[0, 0] = c0*(c1*encoder_eccentricity_sine - c2*encoder_eccentricity_cosine + 1)
    by_state[1, 1] = pitch_scale_scale + 1
    by_state[2, 3] = gyro_scale_scale + 1
    by_parameter[0, 32] = c0*c2
    by_parameter[0, 33] = c0*c1
    by_parameter[0, 34] = c1*encoder_eccentricity_cosine + c2*encoder_eccentricity_sine + theta_w
    by_parameter[1, 35] = theta_p
    by_parameter[1, 37] = 1
    by_parameter[2, 36] = dtheta_p
    by_parameter[2, 38] = 1


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NQ):
        speed += SLIPS[surface, k] * state[NQ + k]
    return speed


@inlined
def _accelerate(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, direction_drive, direction_ground, parameters):
    """Accelerations with dry friction, mobility, and the forces on the surfaces.

    Directions −1 and +1 slip that way, at 0 a surface sticks: the force there cancels the slip acceleration, and the
    mobility is that of a machine that cannot move in this direction.
    """
    ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1 = _free_motion(t, theta_w, theta_p, dtheta_w, dtheta_p, v_in, parameters)
    force_0, force_1, = _dry_law(theta_w, theta_p, dtheta_w, dtheta_p, parameters, direction_drive, direction_ground)
    force_0 = force_0 if direction_drive != 0.0 else 0.0
    ddtheta_w -= force_0 * (1.0 * mobility_0_0 + -1.0 * mobility_0_1)
    ddtheta_p -= force_0 * (1.0 * mobility_1_0 + -1.0 * mobility_1_1)
    force_1 = force_1 if direction_ground != 0.0 else 0.0
    ddtheta_w -= force_1 * (1.0 * mobility_0_0 + 0.0 * mobility_0_1)
    ddtheta_p -= force_1 * (1.0 * mobility_1_0 + 0.0 * mobility_1_1)
    if direction_drive == 0.0:
        reach_0_0 = 1.0 * mobility_0_0 + -1.0 * mobility_0_1
        reach_0_1 = 1.0 * mobility_1_0 + -1.0 * mobility_1_1
        give_0 = 1.0 * reach_0_0 + -1.0 * reach_0_1
        force_0 = (1.0 * ddtheta_w + -1.0 * ddtheta_p) / give_0
        ddtheta_w -= reach_0_0 * force_0
        mobility_0_0 -= reach_0_0 * reach_0_0 / give_0
        mobility_0_1 -= reach_0_0 * reach_0_1 / give_0
        ddtheta_p -= reach_0_1 * force_0
        mobility_1_0 -= reach_0_1 * reach_0_0 / give_0
        mobility_1_1 -= reach_0_1 * reach_0_1 / give_0
    if direction_ground == 0.0:
        reach_1_0 = 1.0 * mobility_0_0 + 0.0 * mobility_0_1
        reach_1_1 = 1.0 * mobility_1_0 + 0.0 * mobility_1_1
        give_1 = 1.0 * reach_1_0 + 0.0 * reach_1_1
        force_1 = (1.0 * ddtheta_w + 0.0 * ddtheta_p) / give_1
        ddtheta_w -= reach_1_0 * force_1
        mobility_0_0 -= reach_1_0 * reach_1_0 / give_1
        mobility_0_1 -= reach_1_0 * reach_1_1 / give_1
        ddtheta_p -= reach_1_1 * force_1
        mobility_1_0 -= reach_1_1 * reach_1_0 / give_1
        mobility_1_1 -= reach_1_1 * reach_1_1 / give_1
    if direction_drive == 0.0 and direction_ground == 0.0:  # its own force, without what the later one took over
        force_0 -= force_1 * (1.0 * reach_0_0 + 0.0 * reach_0_1) / give_0
    return ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, force_0, force_1


@internal
def _rate(t, state, voltage, parameters, dry):
    """Accelerations under the directions dry[DIRECTION], into dry[RATE], and the forces on the surfaces, into dry[FORCE]."""
    (
        dry[RATE, 0], dry[RATE, 1], mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, dry[FORCE, 0], dry[FORCE, 1],
    ) = _accelerate(
        t, state[0], state[1], state[2], state[3], voltage, dry[DIRECTION, 0], dry[DIRECTION, 1], _frozen(parameters)
    )  # fmt: skip


@inlined
def _keep(dry):
    """Keep the accelerations dry[RATE] in dry[BEFORE]."""
    for k in range(NQ):
        dry[BEFORE, k] = dry[RATE, k]


@inlined
def _frozen(parameters):
    """The parameters as a tuple, which no store can change: what follows from them alone is computed once a step."""
    return parameters[0], parameters[1], parameters[2], parameters[3], parameters[4], parameters[5], parameters[6], parameters[7], parameters[8], parameters[9], parameters[10], parameters[11], parameters[12], parameters[13], parameters[14], parameters[15], parameters[16], parameters[17], parameters[18], parameters[19], parameters[20], parameters[21], parameters[22], parameters[23], parameters[24], parameters[25], parameters[26], parameters[27], parameters[28], parameters[29], parameters[30], parameters[31], parameters[32], parameters[33], parameters[34], parameters[35], parameters[36], parameters[37], parameters[38], parameters[39], parameters[40], parameters[41], parameters[42], parameters[43], parameters[44], parameters[45],


@inlined
def _smooth(parameters):
    """Whether no surface has friction."""
    return parameters[7] == 0.0 and parameters[8] == 0.0 and parameters[10] == 0.0 and parameters[11] == 0.0 and parameters[18] == 0.0


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
    dry[UPPER, 0], dry[UPPER, 1], = _dry_law(state[0], state[1], state[2], state[3], _frozen(parameters), 1.0, 1.0)
    dry[LOWER, 0], dry[LOWER, 1], = _dry_law(state[0], state[1], state[2], state[3], _frozen(parameters), -1.0, -1.0)
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
    voltage_saturation_limit = parameters[27]
    voltage_dead_zone_threshold = parameters[28]
    voltage_sag_rate = parameters[29]
    voltage_asymmetry_ratio = parameters[30]
    voltage_offset_offset = parameters[31]
    c0 = v_in - max(-voltage_saturation_limit + abs(v_in), 0.0)*_sign(v_in)
    c1 = (-t*voltage_sag_rate + 1)*max(-voltage_dead_zone_threshold + abs(c0), 0.0)*_sign(c0)
    driven = c1*(voltage_asymmetry_ratio*_sign(c1) + 1) + voltage_offset_offset

    return driven


@inlined
def _drive_jacobian(t, v_in, parameters, by_parameter):
    """Derivatives of the driven input into (NP,); zero entries are not touched."""
    voltage_saturation_limit = parameters[27]
    voltage_dead_zone_threshold = parameters[28]
    voltage_sag_rate = parameters[29]
    voltage_asymmetry_ratio = parameters[30]
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
    by_parameter[27] = c0*c1*c11*(c4*c4)*_step(c2)
    by_parameter[28] = -c11*c7
    by_parameter[29] = -c10*c4*c6*t
    by_parameter[30] = c8*c9
    by_parameter[31] = 1


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
    if LAG < 0:
        return voltage
    begin, slope = _lag(h, parameters[LAG])[:2]
    driven = _driven(t, voltage, parameters)
    return driven + (begin + 0.5 * slope * h) * (state[NX] - driven)


@internal
def _begin(t, voltage, k, start, parameters, columns, state, sens):
    """State (NS,) and sensitivities (NS, n) at sample k, from coordinates and rates (NX,).

    A lagging input follows from the commands before; the first command of a log, or the first after missing ones, counts
    as one that has acted for long.
    """
    for i in range(NX):
        state[i] = start[i]
        for c in range(sens.shape[1]):
            sens[i, c] = 1.0 if c == i else 0.0
    if LAG < 0:
        return
    time_constant, delay = parameters[LAG], _delay(parameters)
    acting = _acting_at(t, k, parameters)
    first = acting
    while first > 0 and t[k] - t[first] - delay < LAG_MEMORY * time_constant and np.isfinite(voltage[first - 1]):
        first -= 1
    driven_by = np.zeros(FITTED + 1)
    _drive_jacobian(t[k], voltage[first], parameters, driven_by)
    state[NX] = _driven(t[k], voltage[first], parameters)
    for c in range(sens.shape[1]):
        sens[NX, c] = driven_by[columns[c - NX]] if c >= NX else 0.0
    for j in range(first + 1, acting + 1):
        until = t[k] if j == acting else t[j + 1] + delay
        _, _, left, _, _, left_by = _lag(max(until - t[j] - delay, 1e-12), time_constant)
        _drive_jacobian(until, voltage[j], parameters, driven_by)
        driven = _driven(until, voltage[j], parameters)
        excess = state[NX] - driven
        state[NX] = driven + left * excess
        for c in range(sens.shape[1]):
            column = columns[c - NX] if c >= NX else FITTED
            sens[NX, c] = _lagged(left, left_by, sens[NX, c], excess if column == LAG else 0.0, driven_by[column])
    for c in range(NX, sens.shape[1]):
        if columns[c - NX] == DELAY and time_constant > 0.0:
            sens[NX, c] = (state[NX] - _driven(t[k], voltage[acting], parameters)) / time_constant


@compiled
def acting_voltage(t, voltage, parameters):
    """The input (N,) that acts at each sample just before its command: the commanded one unless the input lags."""
    acting, sens, columns = np.empty(t.size), np.zeros((NS, 0)), np.empty(0, np.int64)
    state, start = np.zeros(NS), np.zeros(NX)
    for k in range(t.size):
        _begin(t, voltage, k, start, parameters, columns, state, sens)
        acting[k] = state[NX] if LAG >= 0 else voltage[k]
    return acting


@internal
def _runge_kutta(t, h, state, v_in, parameters, new_state, dry, linearise, stages, by_parameter):
    """One step of the classical fourth-order method for the state (NS,), also in place.

    The surfaces slip as dry[DIRECTION] says. Where asked to, it linearises the four stages for _propagate.
    """
    direction_drive = dry[DIRECTION, 0]
    direction_ground = dry[DIRECTION, 1]
    theta_w = theta_w_new = theta_w_old = state[0]
    theta_p = theta_p_new = theta_p_old = state[1]
    dtheta_w = dtheta_w_new = dtheta_w_old = state[2]
    dtheta_p = dtheta_p_new = dtheta_p_old = state[3]
    begin, descent, end, begin_by, descent_by, end_by = _lag(h, parameters[LAG])
    driven = _driven(t + 0.5 * h, v_in, parameters)
    excess = state[NX] - driven
    if linearise:
        _drive_jacobian(t + 0.5 * h, v_in, parameters, by_parameter[DRIVE, 0])
        stages[4, SHARE], stages[4, SHARE + 1], stages[4, SHARE + 2] = end, end_by, excess
    frozen = _frozen(parameters)
    for stage in range(4):
        ahead, weight = _weights(stage, h)
        now = t + (0.0 if stage == 0 else 0.5 * h if stage < 3 else h)
        share = begin + descent * (now - t)
        v_in = driven + share * excess
        ddtheta_w, ddtheta_p, mobility_0_0, mobility_0_1, mobility_1_0, mobility_1_1, force_0, force_1 = _accelerate(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, direction_drive, direction_ground, frozen)
        if linearise:
            by_0_0, by_0_1, by_0_2, by_0_3, by_0_4, by_1_0, by_1_1, by_1_2, by_1_3, by_1_4 = _residual_jacobian(now, theta_w, theta_p, dtheta_w, dtheta_p, v_in, direction_drive, direction_ground, ddtheta_w, ddtheta_p, frozen, stage, by_parameter)
            stages[stage, 0] = -(mobility_0_0 * by_0_0 + mobility_0_1 * by_1_0)
            stages[stage, 1] = -(mobility_0_0 * by_0_1 + mobility_0_1 * by_1_1)
            stages[stage, 2] = -(mobility_0_0 * by_0_2 + mobility_0_1 * by_1_2)
            stages[stage, 3] = -(mobility_0_0 * by_0_3 + mobility_0_1 * by_1_3)
            stages[stage, 4] = -(mobility_0_0 * by_0_4 + mobility_0_1 * by_1_4)
            stages[stage, MOBILITY + 0] = mobility_0_0
            stages[stage, MOBILITY + 1] = mobility_0_1
            stages[stage, 5] = -(mobility_1_0 * by_0_0 + mobility_1_1 * by_1_0)
            stages[stage, 6] = -(mobility_1_0 * by_0_1 + mobility_1_1 * by_1_1)
            stages[stage, 7] = -(mobility_1_0 * by_0_2 + mobility_1_1 * by_1_2)
            stages[stage, 8] = -(mobility_1_0 * by_0_3 + mobility_1_1 * by_1_3)
            stages[stage, 9] = -(mobility_1_0 * by_0_4 + mobility_1_1 * by_1_4)
            stages[stage, MOBILITY + 2] = mobility_1_0
            stages[stage, MOBILITY + 3] = mobility_1_1
            stages[stage, SHARE], stages[stage, SHARE + 1] = share, begin_by + descent_by * (now - t)
        theta_w_new += weight * dtheta_w
        dtheta_w_new += weight * ddtheta_w
        theta_p_new += weight * dtheta_p
        dtheta_p_new += weight * ddtheta_p
        theta_w = theta_w_old + ahead * dtheta_w
        dtheta_w = dtheta_w_old + ahead * ddtheta_w
        theta_p = theta_p_old + ahead * dtheta_p
        dtheta_p = dtheta_p_old + ahead * ddtheta_p
    new_state[0] = theta_w_new
    new_state[1] = theta_p_new
    new_state[2] = dtheta_w_new
    new_state[3] = dtheta_p_new
    new_state[NX] = driven + end * excess


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
            for i in range(NX):
                lanes[STAGE + i * LANES + c] = lanes[END + i * LANES + c] = lanes[START + i * LANES + c]
            for stage in range(4):
                for k in range(NQ):
                    own = 0.0
                    for m in range(NQ):
                        own -= stages[stage, MOBILITY + k * NQ + m] * by_parameter[stage, m, column]
                    lanes[OWN + (NQ * stage + k) * LANES + c] = own
            lanes[DRIVEN + c] = by_parameter[DRIVE, 0, column]
            lanes[EXCESS + c] = stages[4, SHARE + 2] if column == LAG else 0.0
        for stage in range(4):
            ahead, weight = _weights(stage, h)
            by_0_0, by_0_1, by_0_2, by_0_3, by_0_4 = stages[stage, 0 + 0], stages[stage, 0 + 1], stages[stage, 0 + 2], stages[stage, 0 + 3], stages[stage, 0 + 4]
            by_1_0, by_1_1, by_1_2, by_1_3, by_1_4 = stages[stage, 5 + 0], stages[stage, 5 + 1], stages[stage, 5 + 2], stages[stage, 5 + 3], stages[stage, 5 + 4]
            share, share_by = stages[stage, SHARE], stages[stage, SHARE + 1]
            for c in range(LANES):
                theta_w = lanes[STAGE + 0 * LANES + c]
                theta_p = lanes[STAGE + 1 * LANES + c]
                dtheta_w = lanes[STAGE + 2 * LANES + c]
                dtheta_p = lanes[STAGE + 3 * LANES + c]
                v_in = _lagged(
                    share, share_by, lanes[START + NX * LANES + c], lanes[EXCESS + c], lanes[DRIVEN + c]
                )
                ddtheta_w = lanes[OWN + (NQ * stage + 0) * LANES + c] + by_0_0 * theta_w + by_0_1 * theta_p + by_0_2 * dtheta_w + by_0_3 * dtheta_p + by_0_4 * v_in
                ddtheta_p = lanes[OWN + (NQ * stage + 1) * LANES + c] + by_1_0 * theta_w + by_1_1 * theta_p + by_1_2 * dtheta_w + by_1_3 * dtheta_p + by_1_4 * v_in
                lanes[END + 0 * LANES + c] += weight * dtheta_w
                lanes[STAGE + 0 * LANES + c] = lanes[START + 0 * LANES + c] + ahead * dtheta_w
                lanes[END + 1 * LANES + c] += weight * dtheta_p
                lanes[STAGE + 1 * LANES + c] = lanes[START + 1 * LANES + c] + ahead * dtheta_p
                lanes[END + 2 * LANES + c] += weight * ddtheta_w
                lanes[STAGE + 2 * LANES + c] = lanes[START + 2 * LANES + c] + ahead * ddtheta_w
                lanes[END + 3 * LANES + c] += weight * ddtheta_p
                lanes[STAGE + 3 * LANES + c] = lanes[START + 3 * LANES + c] + ahead * ddtheta_p
        for c in range(count):
            for i in range(NX):
                sens[i, first + c] = lanes[END + i * LANES + c]
            sens[NX, first + c] = _lagged(
                stages[4, SHARE], stages[4, SHARE + 1], lanes[START + NX * LANES + c], lanes[EXCESS + c], lanes[DRIVEN + c]
            )


@inlined
def _workspace():
    """Scratch arrays of the integrator.

    The next state; coefficients by stage; derivatives of the residual by stage, row and parameter, the
    last of the driven input; sensitivities side by side; rows for dry friction.
    """
    return (
        np.zeros(NS), np.zeros((5, SHARE + 3)), np.zeros((5, NQ, FITTED + 1)),
        np.zeros(EXCESS + LANES), np.zeros((6, max(NQ, DRY))),
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
    for k in range(NQ):
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
        for k in range(NQ):
            slip += SLIPS[surface, k] * sens[NQ + k, c]
        for k in range(NQ):
            sens[NQ + k, c] -= (dry[BEFORE, k] - dry[RATE, k]) * slip / approach


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
                if LAG >= 0:
                    acting = new_state[NX]
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
    """Accelerations (NQ,) [rad/s²] in a state (NX,); dry friction sticks where it can."""
    dry = np.zeros((6, max(NQ, DRY)))
    acting = _driven(t, voltage, parameters) if LAG >= 0 else voltage
    _settle(t, state, acting, parameters, dry)
    _rate(t, state, acting, parameters, dry)
    return dry[RATE, :NQ].copy()


@internal
def _switch(sens, state, old, new, t, parameters, columns, dry):
    """A delayed command switches: the later it does, the longer the old one acts."""
    if LAG >= 0:
        old, new = _driven(t, old, parameters), _driven(t, new, parameters)
    for c in range(columns.size):
        if columns[c] == DELAY and LAG >= 0 and parameters[LAG] > 0.0:
            sens[NX, NX + c] += (old - new) / parameters[LAG]
        elif columns[c] == DELAY:
            _settle(t, state, old, parameters, dry)
            _rate(t, state, old, parameters, dry)
            _keep(dry)
            _settle(t, state, new, parameters, dry)
            _rate(t, state, new, parameters, dry)
            for k in range(NQ):
                sens[NQ + k, NX + c] += dry[BEFORE, k] - dry[RATE, k]


@inlined
def _delay(parameters):
    """How much later a command acts."""
    return parameters[DELAY] if DELAY >= 0 else 0.0


@internal
def _acting_at(t, k, parameters):
    """The sample whose command still acts just before sample k."""
    delay = _delay(parameters)
    acting = max(k - 1, 0)
    while acting > 0 and t[acting] + delay > t[k]:
        acting -= 1
    return acting


@compiled
def simulate(t, voltage, state, parameters, max_step):
    """States (N, NX) at the samples t (N,) under the commanded voltage (N,), from an initial state (NX,)."""
    states = np.empty((t.size, NX))
    columns = np.empty(0, np.int64)
    now, sens = np.zeros(NS), np.zeros((NS, 0))
    new_state, stages, by_parameter, lanes, dry = _workspace()
    _begin(t, voltage, FIRST, state, parameters, columns, now, sens)
    states[0] = now[:NX]
    acting = _acting_at(t, FIRST, parameters)
    delay, smooth, linearise = _delay(parameters), _smooth(parameters), False
    for k in range(t.size - 1):
        now_t, end = t[k], t[k + 1]
        while now_t < end:
            while acting < k and t[acting + 1] + delay <= now_t:  # a delayed command begins to act
                if linearise:
                    _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                acting += 1
            until = min(end, t[acting + 1] + delay) if acting < k else end
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
        for i in range(NX):
            states[k + 1, i] = now[i]
    return states


@compiled
def closed_loop(t, reference, reference_rate, gains, state, parameters, noise, quantum, max_step):
    """The robot under its PID controller: states (N, NX), measured (N, NY) and voltage (N,).

    At each sample the sensors read the state, noise (N, NY) is added, channels with a quantum > 0 are rounded to it, and
    the controller computes kp e + ki ∫e + kd ė from gains (3,), with e = reference − measured angle and
    ė = reference rate − measured rate; the voltage is held until the next sample.
    """
    states, measured, voltage = np.empty((t.size, NX)), np.empty((t.size, NY)), np.zeros(t.size)
    columns = np.empty(0, np.int64)
    now, sens, output = np.zeros(NS), np.zeros((NS, 0)), np.zeros(NY)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    now[:NX] = state
    integral, acting = 0.0, _acting_at(t, FIRST, parameters)
    delay, smooth, linearise = _delay(parameters), _smooth(parameters), False
    for k in range(t.size):
        for i in range(NX):
            states[k, i] = now[i]
        read_sensors(t[k], now, parameters, output)
        for y in range(NY):
            reading = output[y] + noise[k, y]
            measured[k, y] = np.round(reading / quantum[y]) * quantum[y] if quantum[y] > 0.0 else reading
        error = reference[k] - measured[k, CONTROLLED[0]]
        if k > 0:
            integral += error * (t[k] - t[k - 1])
        slope = reference_rate[k] - measured[k, CONTROLLED[1]]
        voltage[k] = gains[0] * error + gains[1] * integral + gains[2] * slope
        if k == 0:
            _begin(t, voltage, FIRST, state, parameters, columns, now, sens)
        if k + 1 < t.size:
            now_t, end = t[k], t[k + 1]
            while now_t < end:
                while acting < k and t[acting + 1] + delay <= now_t:  # a delayed command begins to act
                    if linearise:
                        _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                    acting += 1
                until = min(end, t[acting + 1] + delay) if acting < k else end
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
    return states, measured, voltage


@compiled
def sensitivities(t, voltage, state, parameters, columns, max_step):
    """States (N, NX), readings (N, NY) and their derivatives (N, NY, NX + n).

    The derivatives are in the initial state, then in the n parameters whose indices are in columns (n,).
    """
    n = NX + columns.size
    states, readings, derivatives = np.empty((t.size, NX)), np.empty((t.size, NY)), np.empty((t.size, NY, n))
    now, sens, reading, rows = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY), np.zeros((NY, n))
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1))
    _begin(t, voltage, FIRST, state, parameters, columns, now, sens)
    acting = _acting_at(t, FIRST, parameters)
    delay, smooth, linearise = _delay(parameters), _smooth(parameters), n > 0
    for k in range(t.size):
        for i in range(NX):
            states[k, i] = now[i]
        read_sensors(t[k], now, parameters, reading)
        _sensor_jacobian(t[k], now, parameters, by_state, reading_by)
        _chain(sens, by_state, reading_by, columns, rows)
        for y in range(NY):
            readings[k, y] = reading[y]
            for c in range(n):
                derivatives[k, y, c] = rows[y, c]
        if k + 1 < t.size:
            now_t, end = t[k], t[k + 1]
            while now_t < end:
                while acting < k and t[acting + 1] + delay <= now_t:  # a delayed command begins to act
                    if linearise:
                        _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, columns, dry)
                    acting += 1
                until = min(end, t[acting + 1] + delay) if acting < k else end
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
    return states, readings, derivatives


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
    parameters of columns. window (columns.size, 2) switches a parameter's derivative on for some samples of each segment. residual (N, NY) receives
    (measured − simulated) · weight.
    """
    n = NX + columns.size
    now, sens, reading = np.zeros(NS), np.zeros((NS, n)), np.zeros(NY)
    new_state, stages, by_parameter, lanes, dry = _workspace()
    by_state, reading_by = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1))
    rows, active = np.zeros((NY, n + 1)), columns.copy()
    delay, smooth, linearise = _delay(parameters), _smooth(parameters), n > 0
    for s in range(bounds.shape[0]):
        gram[s] = 0.0
        _begin(t, voltage, bounds[s, 0], states[s], parameters, columns, now, sens)
        acting = _acting_at(t, bounds[s, 0], parameters)
        for k in range(bounds[s, 0], bounds[s, 1]):
            read_sensors(t[k], now, parameters, reading)
            _sensor_jacobian(t[k], now, parameters, by_state, reading_by)
            for c in range(columns.size):
                inside = window[c, 0] <= k - bounds[s, 0] < window[c, 1]
                active[c] = columns[c] if inside else FITTED
            _chain(sens, by_state, reading_by, active, rows)
            for y in range(NY):
                residual[k, y] = rows[y, n] = (measured[k, y] - reading[y]) * weight[y]
                missing = np.isnan(measured[k, y])
                for c in range(n):
                    rows[y, c] = 0.0 if missing else rows[y, c] * weight[y]
                rows[y, n] = 0.0 if missing else rows[y, n]
            for a in range(n + 1):
                for b in range(a + 1):
                    total = gram[s, a, b]
                    for y in range(NY):
                        total += rows[y, a] * rows[y, b]
                    gram[s, a, b] = total
            if k + 1 < bounds[s, 1]:
                now_t, end = t[k], t[k + 1]
                while now_t < end:
                    while acting < k and t[acting + 1] + delay <= now_t:  # a delayed command begins to act
                        if linearise:
                            _switch(sens, now, voltage[acting], voltage[acting + 1], now_t, parameters, active, dry)
                        acting += 1
                    until = min(end, t[acting + 1] + delay) if acting < k else end
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
        for a in range(n + 1):
            for b in range(a):
                gram[s, b, a] = gram[s, a, b]


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
    stribeck_drive_speed = parameters[12]
    cogging_periods = parameters[16]
    slope_angle = parameters[19]
    com_offset_angle = parameters[23]
    R = parameters[41]
    g = parameters[42]
    alpha = parameters[43]
    J_w = parameters[44]
    origin = parameters[45]
    c0 = g*math.sin(slope_angle)/R
    c1 = -ddtheta_p + ddtheta_w
    c2 = com_offset_angle + theta_p
    c3 = c2 + slope_angle
    c4 = math.cos(c3)
    c5 = (dtheta_p*dtheta_p)
    c6 = -dtheta_p
    c7 = (direction_drive*direction_drive)
    c8 = abs(-dtheta_p + dtheta_w)
    c9 = stribeck_drive_speed**(-2)
    c10 = direction_drive*math.exp(-c5*c9)*math.exp(-c9*(dtheta_w*dtheta_w))*math.exp(2*c9*dtheta_p*dtheta_w)
    c11 = -c10 + direction_drive
    c12 = -c8*dtheta_p + c8*dtheta_w
    c13 = cogging_periods*theta_p - cogging_periods*theta_w
    c14 = math.sin(c13)
    c15 = -math.cos(c13)
    tau[0] = 2*J_w*c0/alpha + v_in
    tau[1] = v_in
    phi[0, 0] = c0 + ddtheta_w
    phi[0, 1] = c1
    phi[0, 2] = c4*ddtheta_p - c5*math.sin(c3)
    phi[0, 5] = dtheta_w
    phi[0, 6] = c6
    phi[0, 7] = direction_drive
    phi[0, 8] = c7
    phi[0, 9] = c8
    phi[0, 10] = c10
    phi[0, 11] = c11
    phi[0, 12] = c12
    phi[0, 13] = c14
    phi[0, 14] = c15
    phi[0, 15] = dtheta_w
    phi[0, 16] = direction_ground
    phi[0, 17] = -math.sin(theta_w)
    phi[0, 18] = -math.cos(theta_w)
    phi[0, 19] = dtheta_w*abs(dtheta_w)
    phi[0, 20] = -origin + theta_w
    phi[0, 21] = -1
    phi[1, 1] = c1
    phi[1, 2] = -c4*ddtheta_w
    phi[1, 3] = -ddtheta_p
    phi[1, 4] = math.sin(c2)
    phi[1, 5] = dtheta_w
    phi[1, 6] = c6
    phi[1, 7] = direction_drive
    phi[1, 8] = c7
    phi[1, 9] = c8
    phi[1, 10] = c10
    phi[1, 11] = c11
    phi[1, 12] = c12
    phi[1, 13] = c14
    phi[1, 14] = c15
    phi[1, 22] = 1

    return tau, phi


@compiled
def regressor_parts(t, state, voltage, parameters):
    """φ2, φ1, φ0 (NQ, len(LINEAR)) each, with φ = d²φ2/dt² + dφ1/dt + φ0 (paper eqs. 25, 26)."""
    phi2, phi1, phi0 = np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR))), np.zeros((NQ, len(LINEAR)))
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    direction_drive = _sign(1.0 * state[2] + -1.0 * state[3])
    direction_ground = _sign(1.0 * state[2])
    stribeck_drive_speed = parameters[12]
    cogging_periods = parameters[16]
    slope_angle = parameters[19]
    com_offset_angle = parameters[23]
    R = parameters[41]
    g = parameters[42]
    origin = parameters[45]
    c0 = -theta_w
    c1 = -c0 - theta_p
    c2 = -theta_p
    c3 = com_offset_angle + theta_p
    c4 = c3 + slope_angle
    c5 = math.cos(c4)
    c6 = (direction_drive*direction_drive)
    c7 = abs(-dtheta_p + dtheta_w)
    c8 = stribeck_drive_speed**(-2)
    c9 = dtheta_p*dtheta_w
    c10 = direction_drive*math.exp(2*c8*c9)*math.exp(-c8*(dtheta_p*dtheta_p))*math.exp(-c8*(dtheta_w*dtheta_w))
    c11 = -c10 + direction_drive
    c12 = -c7*dtheta_p + c7*dtheta_w
    c13 = cogging_periods*theta_p - cogging_periods*theta_w
    c14 = math.sin(c13)
    c15 = -math.cos(c13)
    phi2[0, 0] = theta_w
    phi2[0, 1] = c1
    phi2[1, 1] = c1
    phi2[1, 3] = c2
    phi1[0, 2] = c5*dtheta_p
    phi1[0, 5] = theta_w
    phi1[0, 6] = c2
    phi1[0, 15] = theta_w
    phi1[1, 2] = -c5*dtheta_w
    phi1[1, 5] = theta_w
    phi1[1, 6] = c2
    phi0[0, 0] = g*math.sin(slope_angle)/R
    phi0[0, 7] = direction_drive
    phi0[0, 8] = c6
    phi0[0, 9] = c7
    phi0[0, 10] = c10
    phi0[0, 11] = c11
    phi0[0, 12] = c12
    phi0[0, 13] = c14
    phi0[0, 14] = c15
    phi0[0, 16] = direction_ground
    phi0[0, 17] = -math.sin(theta_w)
    phi0[0, 18] = -math.cos(theta_w)
    phi0[0, 19] = dtheta_w*abs(dtheta_w)
    phi0[0, 20] = -c0 - origin
    phi0[0, 21] = -1
    phi0[1, 2] = -c9*math.sin(c4)
    phi0[1, 4] = math.sin(c3)
    phi0[1, 7] = direction_drive
    phi0[1, 8] = c6
    phi0[1, 9] = c7
    phi0[1, 10] = c10
    phi0[1, 11] = c11
    phi0[1, 12] = c12
    phi0[1, 13] = c14
    phi0[1, 14] = c15
    phi0[1, 22] = 1

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
    stribeck_drive_speed = parameters[12]
    cogging_periods = parameters[16]
    slope_angle = parameters[19]
    com_offset_angle = parameters[23]
    R = parameters[41]
    g = parameters[42]
    alpha = parameters[43]
    J_w = parameters[44]
    origin = parameters[45]
    c0 = (dtheta_w*dtheta_w)
    c1 = (1/2)*c0
    c2 = g*math.sin(slope_angle)/R
    c3 = dtheta_p*dtheta_w
    c4 = -c3
    c5 = (dtheta_p*dtheta_p)
    c6 = (1/2)*c5
    c7 = com_offset_angle + theta_p
    c8 = (direction_drive*direction_drive)
    c9 = 1/cogging_periods
    c10 = cogging_periods*theta_p - cogging_periods*theta_w
    c11 = math.cos(c10)
    c12 = c11*c9
    c13 = (cogging_periods != 0)
    c14 = math.sin(c10)
    c15 = c14*c9
    c16 = abs(-dtheta_p + dtheta_w)
    c17 = direction_drive*dtheta_p
    c18 = stribeck_drive_speed**(-2)
    c19 = 2*c3
    c20 = math.exp(-c0*c18)*math.exp(c18*c19)*math.exp(-c18*c5)
    c21 = c17*c20
    c22 = c20*direction_drive*dtheta_w
    c23 = ((c14) if c13 else (0))
    c24 = ((-c14) if c13 else (0))
    c25 = ((c11) if c13 else (1))
    c26 = ((-c11) if c13 else (0))
    stored[0] = c1 + c2*theta_w
    stored[1] = c1 + c4 + c6
    stored[2] = c3*math.cos(c7 + slope_angle)
    stored[3] = c6
    stored[4] = math.cos(c7)
    stored[7] = -direction_drive*theta_p + direction_drive*theta_w
    stored[8] = -c8*theta_p + c8*theta_w
    stored[13] = -((-c12) if c13 else (0)) + ((c12) if c13 else (0))
    stored[14] = -((-c15) if c13 else (theta_w)) + ((c15) if c13 else (theta_p))
    stored[16] = direction_ground*theta_w
    stored[17] = math.cos(theta_w)
    stored[18] = -math.sin(theta_w)
    stored[20] = -origin*theta_w + (1/2)*(theta_w*theta_w)
    stored[21] = -theta_w
    stored[22] = -theta_p
    taken[5] = c0 - c3
    taken[6] = c4 + c5
    taken[9] = -c16*dtheta_p + c16*dtheta_w
    taken[10] = -c21 + c22
    taken[11] = -c17 + c21 - c22 + direction_drive*dtheta_w
    taken[12] = c0*c16 - c16*c19 + c16*c5
    taken[13] = -c14*dtheta_p + c14*dtheta_w + c23*dtheta_p - c23*dtheta_w - c24*dtheta_p + c24*dtheta_w
    taken[14] = c11*dtheta_p - c11*dtheta_w - c25*dtheta_p + c25*dtheta_w + c26*dtheta_p - c26*dtheta_w
    taken[15] = c0
    taken[19] = c0*abs(dtheta_w)
    supplied[0] = 2*J_w*c2*dtheta_w/alpha - dtheta_p*v_in + dtheta_w*v_in

    return stored, taken, supplied[0]


SIGNALS = 26
DERIVATIVES = np.array([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 0, 0])  # how often each signal is differentiated
HELD = np.array([False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False, False])  # whether it is constant between samples
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
    direction_drive = _sign(1.0 * state[2] + -1.0 * state[3])
    direction_ground = _sign(1.0 * state[2])
    stribeck_drive_speed = parameters[12]
    cogging_periods = parameters[16]
    slope_angle = parameters[19]
    com_offset_angle = parameters[23]
    R = parameters[41]
    g = parameters[42]
    alpha = parameters[43]
    J_w = parameters[44]
    origin = parameters[45]
    c0 = g*math.sin(slope_angle)/R
    c1 = abs(-dtheta_p + dtheta_w)
    c2 = stribeck_drive_speed**(-2)
    c3 = dtheta_p*dtheta_w
    c4 = direction_drive*math.exp(2*c2*c3)*math.exp(-c2*(dtheta_p*dtheta_p))*math.exp(-c2*(dtheta_w*dtheta_w))
    c5 = cogging_periods*theta_p - cogging_periods*theta_w
    c6 = -theta_w
    c7 = com_offset_angle + theta_p
    c8 = c7 + slope_angle
    c9 = math.cos(c8)
    c10 = -theta_p
    signal[0] = c0
    signal[1] = direction_drive
    signal[2] = (direction_drive*direction_drive)
    signal[3] = c1
    signal[4] = c4
    signal[5] = -c4 + direction_drive
    signal[6] = -c1*dtheta_p + c1*dtheta_w
    signal[7] = math.sin(c5)
    signal[8] = -math.cos(c5)
    signal[9] = direction_ground
    signal[10] = -math.sin(theta_w)
    signal[11] = -math.cos(theta_w)
    signal[12] = dtheta_w*abs(dtheta_w)
    signal[13] = -c6 - origin
    signal[14] = -1
    signal[15] = -c3*math.sin(c8)
    signal[16] = math.sin(c7)
    signal[17] = c9*dtheta_p
    signal[18] = theta_w
    signal[19] = c10
    signal[20] = -c9*dtheta_w
    signal[21] = theta_w
    signal[22] = -c6 - theta_p
    signal[23] = c10
    signal[24] = 2*J_w*c0/alpha + v_in
    signal[25] = v_in


@internal
def _signal_rates(t, state, voltage, parameters, speed):
    """How fast those change that are differentiated twice, into speed (SIGNALS,)."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    speed[21] = dtheta_w
    speed[22] = -dtheta_p + dtheta_w
    speed[23] = -dtheta_p


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
    signal_11 = signal[11]
    signal_12 = signal[12]
    signal_13 = signal[13]
    signal_14 = signal[14]
    signal_15 = signal[15]
    signal_16 = signal[16]
    signal_17 = signal[17]
    signal_18 = signal[18]
    signal_19 = signal[19]
    signal_20 = signal[20]
    signal_21 = signal[21]
    signal_22 = signal[22]
    signal_23 = signal[23]
    signal_24 = signal[24]
    signal_25 = signal[25]
    tau[0] = signal_24
    tau[1] = signal_25
    phi[0, 0] = signal_0 + signal_21
    phi[0, 1] = signal_22
    phi[0, 2] = signal_17
    phi[0, 5] = signal_18
    phi[0, 6] = signal_19
    phi[0, 7] = signal_1
    phi[0, 8] = signal_2
    phi[0, 9] = signal_3
    phi[0, 10] = signal_4
    phi[0, 11] = signal_5
    phi[0, 12] = signal_6
    phi[0, 13] = signal_7
    phi[0, 14] = signal_8
    phi[0, 15] = signal_18
    phi[0, 16] = signal_9
    phi[0, 17] = signal_10
    phi[0, 18] = signal_11
    phi[0, 19] = signal_12
    phi[0, 20] = signal_13
    phi[0, 21] = signal_14
    phi[1, 1] = signal_22
    phi[1, 2] = signal_15 + signal_20
    phi[1, 3] = signal_23
    phi[1, 4] = signal_16
    phi[1, 5] = signal_18
    phi[1, 6] = signal_19
    phi[1, 7] = signal_1
    phi[1, 8] = signal_2
    phi[1, 9] = signal_3
    phi[1, 10] = signal_4
    phi[1, 11] = signal_5
    phi[1, 12] = signal_6
    phi[1, 13] = signal_7
    phi[1, 14] = signal_8
    phi[1, 22] = -signal_14


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
