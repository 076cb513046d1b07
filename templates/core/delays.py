"""Delays of input and sensors: which command acts, and what a later reading says of the time before."""

from templates.core.frame import DELAY, LATE, NX, NY, SENSOR_DELAY, _slope, inlined, internal


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
