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
CONTROLLED = (1, 2)  # outputs that the controller sees: angle and its rate
AT_REST = 1e-9  # slip speed below which a surface may stick [rad/s]
LAG_MEMORY = 40.0  # time constants after which an old command is forgotten
EVENTS = 16  # stick-slip events handled within one step
compiled = njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")


@compiled
def _sign(x):
    """−1.0, 0.0 or 1.0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@compiled
def _step(x):
    """1.0 where x is positive, else 0.0."""
    return 1.0 if x > 0.0 else 0.0


@compiled
def _free_motion(t, state, voltage, parameters, rate, mobility):
    """Accelerations without dry friction into rate (NQ,), inverse mass matrix into mobility (NQ, NQ).

    96 operations.
    """
    v_in = voltage
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
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
    rate[0] = -c11*c16 - c19*c20
    rate[1] = -c11*c21 - c16*c19
    mobility[0, 0] = c20
    mobility[0, 1] = c16
    mobility[1, 0] = c16
    mobility[1, 1] = c21


@compiled
def _residual_jacobian(t, state, voltage, parameters, rate, direction, by_state, by_parameter):
    """Derivatives of inertia − force at given accelerations, into (NQ, NX) and (NQ, NP); zero entries are not touched.

    135 operations.
    """
    theta_w = state[0]
    theta_p = state[1]
    dtheta_w = state[2]
    dtheta_p = state[3]
    ddtheta_w = rate[0]
    ddtheta_p = rate[1]
    direction_drive = direction[0]
    direction_ground = direction[1]
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
    by_state[0, 0] = c0*wheel_runout_cosine - c1*wheel_runout_sine + c11 + tether_spring_stiffness
    by_state[0, 1] = -c11 - c18
    by_state[0, 2] = air_drag_coefficient*c19 + air_drag_coefficient*dtheta_w*_sign(dtheta_w) + c33 + ground_viscous_coefficient
    by_state[0, 3] = -c15*c20 - c34
    by_state[0, 4] = -1
    by_state[1, 0] = -c11
    by_state[1, 1] = -c10 - c36 + c7
    by_state[1, 2] = -c33
    by_state[1, 3] = c34
    by_state[1, 4] = 1
    by_parameter[0, 0] = c38*math.sin(slope_angle) + ddtheta_w
    by_parameter[0, 1] = -c39
    by_parameter[0, 2] = -c14*c16 + c17*ddtheta_p
    by_parameter[0, 5] = dtheta_w
    by_parameter[0, 6] = -dtheta_p
    by_parameter[0, 7] = direction_drive
    by_parameter[0, 8] = c40
    by_parameter[0, 9] = c30
    by_parameter[0, 10] = c27
    by_parameter[0, 11] = c41
    by_parameter[0, 12] = c42
    by_parameter[0, 13] = c43
    by_parameter[0, 14] = -c5
    by_parameter[0, 15] = -c8
    by_parameter[0, 16] = c44
    by_parameter[0, 17] = dtheta_w
    by_parameter[0, 18] = direction_ground
    by_parameter[0, 19] = -2*J_w*c38*c45/alpha + X1*c37*c45*g - c18
    by_parameter[0, 20] = -c0
    by_parameter[0, 21] = -c1
    by_parameter[0, 22] = c19*dtheta_w
    by_parameter[0, 23] = -c18
    by_parameter[0, 24] = -c2 - origin
    by_parameter[0, 39] = -1
    by_parameter[1, 1] = c39
    by_parameter[1, 2] = c17*ddtheta_w
    by_parameter[1, 3] = ddtheta_p
    by_parameter[1, 4] = -math.sin(c12)
    by_parameter[1, 5] = c23
    by_parameter[1, 6] = dtheta_p
    by_parameter[1, 7] = -direction_drive
    by_parameter[1, 8] = -c40
    by_parameter[1, 9] = -c30
    by_parameter[1, 10] = -c27
    by_parameter[1, 11] = -c41
    by_parameter[1, 12] = -c42
    by_parameter[1, 13] = -c43
    by_parameter[1, 14] = c5
    by_parameter[1, 15] = c8
    by_parameter[1, 16] = -c44
    by_parameter[1, 19] = -c35
    by_parameter[1, 23] = -c36
    by_parameter[1, 40] = -1


@compiled
def _dry_law(state, parameters, direction, force):
    """Dry friction against the slip of each surface [V] into force (DRY,); direction 0 where it sticks."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    direction_drive = direction[0]
    direction_ground = direction[1]
    coulomb_drive_torque = parameters[7]
    coulomb_asymmetry_torque = parameters[8]
    stribeck_drive_static = parameters[10]
    stribeck_drive_sliding = parameters[11]
    stribeck_drive_speed = parameters[12]
    rolling_resistance_torque = parameters[18]
    force[0] = coulomb_asymmetry_torque*(direction_drive*direction_drive) + coulomb_drive_torque*direction_drive + direction_drive*(stribeck_drive_sliding + (-stribeck_drive_sliding + stribeck_drive_static)*math.exp(-((-dtheta_p + dtheta_w)*(-dtheta_p + dtheta_w))/(stribeck_drive_speed*stribeck_drive_speed)))
    force[1] = direction_ground*rolling_resistance_torque

    return force


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


@compiled
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


@compiled
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NQ):
        speed += SLIPS[surface, k] * state[NQ + k]
    return speed


@compiled
def _solve(matrix, right, size):
    """Solve a small symmetric positive definite system in place of its right side."""
    for i in range(size):
        for j in range(i + 1, size):
            factor = matrix[j, i] / matrix[i, i]
            for k in range(i, size):
                matrix[j, k] -= factor * matrix[i, k]
            right[j] -= factor * right[i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]


@compiled
def _any_stuck(direction):
    """Whether any surface sticks."""
    for i in range(DRY):
        if direction[i] == 0.0:
            return True
    return False


@compiled
def _hold(mobility, direction, vector, force):
    """Forces on the stuck surfaces that cancel the slip acceleration of vector (NQ,), and take them off it."""
    index = np.flatnonzero(direction == 0.0)
    stuck = index.size
    matrix, right = np.zeros((stuck, stuck)), np.zeros(stuck)
    for a in range(stuck):
        for k in range(NQ):
            right[a] += SLIPS[index[a], k] * vector[k]
            for b in range(stuck):
                for m in range(NQ):
                    matrix[a, b] += SLIPS[index[a], k] * mobility[k, m] * SLIPS[index[b], m]
    _solve(matrix, right, stuck)
    for a in range(stuck):
        force[index[a]] = right[a]
        for k in range(NQ):
            for m in range(NQ):
                vector[k] -= mobility[k, m] * SLIPS[index[a], m] * right[a]


@compiled
def _accelerate(t, state, voltage, parameters, direction, rate, mobility, force):
    """Accelerations with dry friction: −1 and +1 slip in that direction, 0 sticks. Also fills mobility and force."""
    _free_motion(t, state, voltage, parameters, rate, mobility)
    if DRY == 0:
        return
    _dry_law(state, parameters, direction, force)
    for i in range(DRY):
        if direction[i] != 0.0 and force[i] != 0.0:
            for k in range(NQ):
                for m in range(NQ):
                    rate[k] -= mobility[k, m] * SLIPS[i, m] * force[i]
    if _any_stuck(direction):
        _hold(mobility, direction, rate, force)


@compiled
def _limits(state, parameters, direction, upper, lower):
    """Dry friction of every surface that is just about to slip forwards and backwards; overwrites direction."""
    for i in range(DRY):
        direction[i] = 1.0
    _dry_law(state, parameters, direction, upper)
    for i in range(DRY):
        direction[i] = -1.0
    _dry_law(state, parameters, direction, lower)


@compiled
def _settle(t, state, voltage, parameters, direction, rate, mobility, force, upper, lower):
    """Decide which surfaces slip and which stick, into direction (DRY,).

    A surface at rest sticks while the force that holds it lies between its limits. One without friction never sticks.
    """
    _limits(state, parameters, direction, upper, lower)
    stuck = False
    for i in range(DRY):
        speed = _slip(state, i)
        direction[i] = 1.0 if speed >= 0.0 else -1.0
        if upper[i] > lower[i] and abs(speed) <= AT_REST:
            direction[i] = 0.0
            stuck = True
    for _ in range(DRY + 1):
        if not stuck:
            return
        stuck = False
        _accelerate(t, state, voltage, parameters, direction, rate, mobility, force)
        for i in range(DRY):
            if direction[i] == 0.0 and force[i] > upper[i]:
                direction[i] = 1.0
                stuck = True
            elif direction[i] == 0.0 and force[i] < lower[i]:
                direction[i] = -1.0
                stuck = True


@compiled
def _driven(t, voltage, parameters):
    """What the actuator makes of a command, before it lags."""
    driven = np.zeros(1)
    v_in = voltage
    voltage_saturation_limit = parameters[27]
    voltage_dead_zone_threshold = parameters[28]
    voltage_sag_rate = parameters[29]
    voltage_asymmetry_ratio = parameters[30]
    voltage_offset_offset = parameters[31]
    c0 = v_in - max(-voltage_saturation_limit + abs(v_in), 0.0)*_sign(v_in)
    c1 = (-t*voltage_sag_rate + 1)*max(-voltage_dead_zone_threshold + abs(c0), 0.0)*_sign(c0)
    driven[0] = c1*(voltage_asymmetry_ratio*_sign(c1) + 1) + voltage_offset_offset

    return driven[0]


@compiled
def _drive_jacobian(t, voltage, parameters, by_parameter):
    """Derivatives of the driven input into (NP,); zero entries are not touched."""
    v_in = voltage
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


@compiled
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


@compiled
def _lagged(share, share_by, state, sens, driven, driven_by, columns, to_state, to_sens):
    """Input that acts while a share of the old one is left, with its sensitivities, into the last entry of to_state."""
    excess = state[NX] - driven
    to_state[NX] = driven + share * excess
    for c in range(sens.shape[1]):
        to_sens[NX, c] = share * sens[NX, c]
        if c >= NX:
            to_sens[NX, c] += (1.0 - share) * driven_by[columns[c - NX]]
            if columns[c - NX] == LAG:
                to_sens[NX, c] += share_by * excess


@compiled
def _acting(t, h, state, voltage, parameters):
    """The input that acts in the mean over the next h."""
    if LAG < 0:
        return voltage
    begin, slope = _lag(h, parameters[LAG])[:2]
    driven = _driven(t, voltage, parameters)
    return driven + (begin + 0.5 * slope * h) * (state[NX] - driven)


@compiled
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
    time_constant, delay = parameters[LAG], parameters[DELAY] if DELAY >= 0 else 0.0
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
        if sens.shape[1]:
            _drive_jacobian(until, voltage[j], parameters, driven_by)
        _lagged(left, left_by, state, sens, _driven(until, voltage[j], parameters), driven_by, columns, state, sens)
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


@compiled
def _linearise(t, state, voltage, parameters, direction, columns, work):
    """Derivatives of the accelerations in the states, then in the parameters of columns, into jacobian (NQ, NS + n).

    Implicit differentiation of residual(acceleration, ...) = 0; a stuck surface has no slip acceleration to change.
    A column FITTED stands for a parameter that is switched off.
    """
    rate, mobility, force, by_state, by_parameter, jacobian, column = work[:7]
    _residual_jacobian(t, state, voltage, parameters, rate, direction, by_state, by_parameter)
    for k in range(NQ):
        for c in range(NS + columns.size):
            jacobian[k, c] = 0.0
        for m in range(NQ):
            weight = -mobility[k, m]
            for c in range(NS):
                jacobian[k, c] += weight * by_state[m, c]
            for c in range(columns.size):
                jacobian[k, NS + c] += weight * by_parameter[m, columns[c]]
    if _any_stuck(direction):
        for c in range(NS + columns.size):
            for k in range(NQ):
                column[k] = jacobian[k, c]
            _hold(mobility, direction, column, force)
            for k in range(NQ):
                jacobian[k, c] = column[k]


@compiled
def _runge_kutta(t, h, state, sens, voltage, parameters, direction, columns, new_state, new_sens, work):
    """One step of the classical fourth-order method for the state (NS,) and its sensitivities (NS, n)."""
    rate, mobility, force = work[:3]
    jacobian, _, stage, slope, sens_stage, sens_slope = work[5:11]
    n = sens.shape[1]
    for i in range(NS):
        stage[i] = state[i]
        new_state[i] = state[i]
        for c in range(n):
            sens_stage[i, c] = sens[i, c]
            new_sens[i, c] = sens[i, c]
    if LAG >= 0:
        begin, descent, end, begin_by, descent_by, end_by = _lag(h, parameters[LAG])
        driven, driven_by = _driven(t + 0.5 * h, voltage, parameters), work[11]
        if n:
            _drive_jacobian(t + 0.5 * h, voltage, parameters, driven_by)
    for number in range(4):
        now = t + (0.0 if number == 0 else h if number == 3 else 0.5 * h)
        weight = h / 6.0 if number in (0, 3) else h / 3.0
        ahead = 0.5 * h if number < 2 else h
        acting = voltage
        if LAG >= 0:
            share, share_by = begin + descent * (now - t), begin_by + descent_by * (now - t)
            _lagged(share, share_by, state, sens, driven, driven_by, columns, stage, sens_stage)
            acting = stage[NX]
        _accelerate(now, stage, acting, parameters, direction, rate, mobility, force)
        for k in range(NQ):
            slope[k] = stage[NQ + k]
            slope[NQ + k] = rate[k]
        if n:
            _linearise(now, stage, acting, parameters, direction, columns, work)
            for k in range(NQ):
                for c in range(n):
                    sens_slope[k, c] = sens_stage[NQ + k, c]
                    sens_slope[NQ + k, c] = jacobian[k, c - NX + NS] if c >= NX else 0.0
                for m in range(NS):
                    for c in range(n):
                        sens_slope[NQ + k, c] += jacobian[k, m] * sens_stage[m, c]
            for i in range(NS):
                for c in range(n):
                    new_sens[i, c] += weight * sens_slope[i, c]
                    sens_stage[i, c] = sens[i, c] + ahead * sens_slope[i, c]
        for i in range(NS):
            new_state[i] += weight * slope[i]
            stage[i] = state[i] + ahead * slope[i]
    if LAG >= 0:
        _lagged(end, end_by, state, sens, driven, driven_by, columns, new_state, new_sens)


@compiled
def _workspace(n):
    """Scratch arrays of _runge_kutta for n sensitivity columns."""
    return (
        np.zeros(NQ), np.zeros((NQ, NQ)), np.zeros(DRY), np.zeros((NQ, NS)), np.zeros((NQ, FITTED + 1)),
        np.zeros((NQ, n + 1)), np.zeros(NQ), np.zeros(NS), np.zeros(NS), np.zeros((NS, n)), np.zeros((NS, n)),
        np.zeros(FITTED + 1),
    )  # fmt: skip


@compiled
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


@compiled
def _slip_rate(rate, surface):
    """Slip acceleration of a surface."""
    total = 0.0
    for k in range(NQ):
        total += SLIPS[surface, k] * rate[k]
    return total


@compiled
def _jump(state, sens, before, after, surface):
    """Change the sensitivities at a stick-slip event: its time depends on them (saltation)."""
    approach = _slip_rate(before, surface)
    if approach == 0.0:
        return
    for c in range(sens.shape[1]):
        slip = 0.0
        for k in range(NQ):
            slip += SLIPS[surface, k] * sens[NQ + k, c]
        for k in range(NQ):
            sens[NQ + k, c] -= (before[k] - after[k]) * slip / approach


@compiled
def _copy(state, sens, to_state, to_sens):
    """Copy state and sensitivities entry by entry, which is faster than slices for arrays this small."""
    for i in range(NS):
        to_state[i] = state[i]
        for c in range(sens.shape[1]):
            to_sens[i, c] = sens[i, c]


@compiled
def _advance(t, h, state, sens, voltage, parameters, columns, new_state, new_sens, work, friction):
    """Advance state and sensitivities in place by h under a constant command, through stick-slip events."""
    if DRY == 0:
        empty = np.empty(0)
        _runge_kutta(t, h, state, sens, voltage, parameters, empty, columns, new_state, new_sens, work)
        _copy(new_state, new_sens, state, sens)
        return
    rate, mobility, force = work[0], work[1], work[2]
    direction, previous, before, upper, lower = friction
    remaining = h
    for event in range(EVENTS):
        acting = _acting(t, remaining, state, voltage, parameters)
        _settle(t, state, acting, parameters, direction, rate, mobility, force, upper, lower)
        for i in range(DRY):
            if direction[i] == 0.0 and sens.shape[1]:  # what would still slip is stopped at once
                previous[:] = direction
                previous[i] = 1.0
                _accelerate(t, state, acting, parameters, previous, before, mobility, force)
                _accelerate(t, state, acting, parameters, direction, rate, mobility, force)
                _jump(state, sens, before, rate, i)
        _runge_kutta(t, remaining, state, sens, voltage, parameters, direction, columns, new_state, new_sens, work)
        first, landing = -1, remaining
        if event < EVENTS - 1:
            for i in range(DRY):
                start, end = _slip(state, i), _slip(new_state, i)
                if direction[i] != 0.0 and upper[i] > lower[i] and end * direction[i] < 0.0 and abs(start) > AT_REST:
                    _accelerate(t, state, acting, parameters, direction, rate, mobility, force)
                    start_rate = _slip_rate(rate, i)
                    _accelerate(t + remaining, new_state, acting, parameters, direction, rate, mobility, force)
                    when = _landing(remaining, start, start_rate, end, _slip_rate(rate, i))
                    if when < landing:
                        first, landing = i, when
        if first >= 0:
            for _ in range(3):  # Newton on the step itself, whose error the interpolant does not see
                _runge_kutta(t, landing, state, sens, voltage, parameters, direction, columns, new_state, new_sens, work)
                if LAG >= 0:
                    acting = new_state[NX]
                _accelerate(t + landing, new_state, acting, parameters, direction, before, mobility, force)
                approach = _slip_rate(before, first)
                if abs(_slip(new_state, first)) <= 1e-13 or approach == 0.0:
                    break
                landing = min(max(landing - _slip(new_state, first) / approach, 0.0), remaining)
        _copy(new_state, new_sens, state, sens)
        if first < 0:
            return
        t += landing
        remaining -= landing
        previous[:] = direction
        _settle(t, state, acting, parameters, direction, rate, mobility, force, upper, lower)
        if direction[first] != 0.0 and sens.shape[1]:  # a reversal; sticking is handled where the next step begins
            _accelerate(t, state, acting, parameters, direction, rate, mobility, force)
            _jump(state, sens, before, rate, first)
        if remaining <= 0.0:
            return


@compiled
def acceleration(t, state, voltage, parameters):
    """Accelerations (NQ,) [rad/s²] in a state (NX,); dry friction sticks where it can."""
    rate, mobility, force = np.zeros(NQ), np.zeros((NQ, NQ)), np.zeros(DRY)
    direction, upper, lower = np.zeros(DRY), np.zeros(DRY), np.zeros(DRY)
    acting = _driven(t, voltage, parameters) if LAG >= 0 else voltage
    if DRY:
        _settle(t, state, acting, parameters, direction, rate, mobility, force, upper, lower)
    _accelerate(t, state, acting, parameters, direction, rate, mobility, force)
    return rate


@compiled
def _friction_workspace():
    """Scratch arrays of _advance for dry friction."""
    return np.zeros(DRY), np.zeros(DRY), np.zeros(NQ), np.zeros(DRY), np.zeros(DRY)


@compiled
def _switch(sens, state, old, new, t, parameters, columns, work, friction):
    """A delayed command switches: the later it does, the longer the old one acts."""
    if LAG >= 0:
        old, new = _driven(t, old, parameters), _driven(t, new, parameters)
    for c in range(columns.size):
        if columns[c] == DELAY and LAG >= 0 and parameters[LAG] > 0.0:
            sens[NX, NX + c] += (old - new) / parameters[LAG]
        elif columns[c] == DELAY:
            rate, mobility, force = work[0], work[1], work[2]
            direction, previous, before, upper, lower = friction
            _settle(t, state, old, parameters, direction, rate, mobility, force, upper, lower)
            _accelerate(t, state, old, parameters, direction, before, mobility, force)
            _settle(t, state, new, parameters, direction, rate, mobility, force, upper, lower)
            _accelerate(t, state, new, parameters, direction, rate, mobility, force)
            for k in range(NQ):
                sens[NQ + k, NX + c] += before[k] - rate[k]


@compiled
def _interval(t, voltage, k, acting, state, sens, parameters, columns, max_step, new_state, new_sens, work, friction):
    """Advance in place from sample k to the next; returns which sample's command acts at the end.

    A delayed command switches inside the interval, which is split there. ``acting`` is the sample whose command acts at
    the beginning.
    """
    delay = parameters[DELAY] if DELAY >= 0 else 0.0
    now, end = t[k], t[k + 1]
    while True:
        if acting < k and t[acting + 1] + delay <= now:
            if sens.shape[1]:
                _switch(sens, state, voltage[acting], voltage[acting + 1], now, parameters, columns, work, friction)
            acting += 1
            continue
        if now >= end:
            return acting
        until = min(end, t[acting + 1] + delay) if acting < k else end
        steps = max(1, int(math.ceil((until - now) / max_step - 1e-6)))
        h = (until - now) / steps
        for s in range(steps):
            _advance(
                now + s * h, h, state, sens, voltage[acting], parameters, columns, new_state, new_sens, work, friction
            )
        now = until
        if until >= end:
            return acting


@compiled
def _acting_at(t, k, parameters):
    """The sample whose command still acts just before sample k."""
    delay = parameters[DELAY] if DELAY >= 0 else 0.0
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
    new_state, new_sens, work, friction = np.zeros(NS), np.zeros((NS, 0)), _workspace(0), _friction_workspace()
    _begin(t, voltage, 0, state, parameters, columns, now, sens)
    states[0] = now[:NX]
    acting = _acting_at(t, 0, parameters)
    for k in range(t.size - 1):
        acting = _interval(
            t, voltage, k, acting, now, sens, parameters, columns, max_step, new_state, new_sens, work, friction
        )
        states[k + 1] = now[:NX]
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
    new_state, new_sens, work, friction = np.zeros(NS), np.zeros((NS, 0)), _workspace(0), _friction_workspace()
    now[:NX] = state
    integral, acting = 0.0, _acting_at(t, 0, parameters)
    for k in range(t.size):
        states[k] = now[:NX]
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
            _begin(t, voltage, 0, state, parameters, columns, now, sens)
        if k + 1 < t.size:
            acting = _interval(
                t, voltage, k, acting, now, sens, parameters, columns, max_step, new_state, new_sens, work, friction
            )
    return states, measured, voltage


@compiled
def sensitivities(t, voltage, state, parameters, columns, max_step):
    """States (N, NX), readings (N, NY) and their derivatives (N, NY, NX + n).

    The derivatives are in the initial state, then in the n parameters whose indices are in columns (n,).
    """
    n = NX + columns.size
    states, readings, derivatives = np.empty((t.size, NX)), np.empty((t.size, NY)), np.zeros((t.size, NY, n))
    now, sens = np.zeros(NS), np.zeros((NS, n))
    new_state, new_sens, work, friction = np.zeros(NS), np.zeros((NS, n)), _workspace(n), _friction_workspace()
    _begin(t, voltage, 0, state, parameters, columns, now, sens)
    by_state, by_parameter = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1))
    acting = _acting_at(t, 0, parameters)
    for k in range(t.size):
        states[k] = now[:NX]
        read_sensors(t[k], now, parameters, readings[k])
        _sensor_jacobian(t[k], now, parameters, by_state, by_parameter)
        _chain(sens, by_state, by_parameter, columns, derivatives[k])
        if k + 1 < t.size:
            acting = _interval(
                t, voltage, k, acting, now, sens, parameters, columns, max_step, new_state, new_sens, work, friction
            )
    return states, readings, derivatives


@compiled
def _chain(sens, by_state, by_parameter, columns, derivative):
    """Derivatives of the readings (NY, n) from those of the state."""
    for y in range(NY):
        for c in range(sens.shape[1]):
            total = by_parameter[y, columns[c - NX]] if c >= NX else 0.0
            for i in range(NX):
                total += by_state[y, i] * sens[i, c]
            derivative[y, c] = total


@compiled
def shoot(t, voltage, measured, weight, bounds, states, parameters, columns, window, max_step, gram, residual):
    """Simulate every segment from its own initial state and gather the weighted least-squares problem.

    measured (N, NY) may hold NaN; weight (NY,) is 1/σ; bounds (S, 2) are half-open sample ranges; states (S, NX).
    gram (S, n+1, n+1) receives [J r]ᵀ[J r] with n = NX + columns.size: derivatives in the initial state, then in the
    parameters of columns. window (columns.size, 2) switches a parameter's derivative on for some samples of each segment. residual (N, NY) receives
    (measured − simulated) · weight.
    """
    n = NX + columns.size
    new_state, new_sens, work, friction = np.zeros(NS), np.zeros((NS, n)), _workspace(n), _friction_workspace()
    by_state, by_parameter, reading = np.zeros((NY, NX)), np.zeros((NY, FITTED + 1)), np.zeros(NY)
    now, sens = np.zeros(NS), np.zeros((NS, n))
    derivative, row, active = np.zeros((NY, n)), np.zeros(n + 1), columns.copy()
    for s in range(bounds.shape[0]):
        gram[s] = 0.0
        _begin(t, voltage, bounds[s, 0], states[s], parameters, columns, now, sens)
        acting = _acting_at(t, bounds[s, 0], parameters)
        for k in range(bounds[s, 0], bounds[s, 1]):
            read_sensors(t[k], now, parameters, reading)
            _sensor_jacobian(t[k], now, parameters, by_state, by_parameter)
            for c in range(columns.size):
                inside = window[c, 0] <= k - bounds[s, 0] < window[c, 1]
                active[c] = columns[c] if inside else FITTED
            _chain(sens, by_state, by_parameter, active, derivative)
            for y in range(NY):
                error = (measured[k, y] - reading[y]) * weight[y]
                residual[k, y] = error
                if np.isnan(measured[k, y]):
                    continue
                for c in range(n):
                    row[c] = derivative[y, c] * weight[y]
                row[n] = error
                for a in range(n + 1):
                    for b in range(a + 1):
                        gram[s, a, b] += row[a] * row[b]
            if k + 1 < bounds[s, 1]:
                acting = _interval(
                    t, voltage, k, acting, now, sens, parameters, active, max_step, new_state, new_sens, work, friction
                )
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


@compiled
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


@compiled
def _signal_rates(t, state, voltage, parameters, speed):
    """How fast those change that are differentiated twice, into speed (SIGNALS,)."""
    dtheta_w = state[2]
    dtheta_p = state[3]
    speed[21] = dtheta_w
    speed[22] = -dtheta_p + dtheta_w
    speed[23] = -dtheta_p


@compiled
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


@compiled
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
