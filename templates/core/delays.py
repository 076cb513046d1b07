"""Delays of input and sensors: the command that acts, and the derivatives of delayed readings."""

from templates.core.frame import DELAY, DELAYED, NX, NY, SENSOR_DELAY, _state_derivative, inlined, internal


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
