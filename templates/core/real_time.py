"""A machine in a real-time loop: one sample period after another, with the commands under way and the readings to come."""

import math

import numpy as np

from templates.core.delays import _input_delay, _sensor_delay
from templates.core.frame import (
    DELAYED,
    EVENT_TIMES,
    LAG,
    NA,
    NQ,
    NS,
    NV,
    NX,
    NY,
    ORIGIN,
    RATE,
    SURFACES,
    _driven,
    _is_frictionless,
    _rate,
    _runge_kutta,
    _stick_and_slip,
    compiled,
    inlined,
    internal,
    read_sensors,
)
from templates.core.friction import _slip_directions, _stick_or_slip


@compiled
def start_machine(state, voltage, parameters, now, commands, readings):
    """Begin at coordinates and rates (NX,), every command until now having been this voltage.

    Written: now (NS,), the state with what effects add to it; commands (n,), the newest first; readings (m, NY) of
    sensors that are late, the newest first; and what of the parameters (NP,) depends on where the machine begins.
    """
    _begin(state, voltage, parameters, now, commands)
    for j in range(readings.shape[0]):
        read_sensors(0.0, now, parameters, readings[j])


@internal
def _begin(state, voltage, parameters, now, commands):
    """The state with what effects add to it at rest, and every command until now the same."""
    for i in range(NS):
        now[i] = state[i] if i < NX else 0.0
    if ORIGIN >= 0:
        parameters[ORIGIN] = state[0]
    if LAG >= 0:
        now[NV] = _driven(0.0, voltage, parameters)
    for j in range(commands.shape[0]):
        commands[j] = voltage


@compiled
def step_machine(t, h, voltage, parameters, max_step, now, commands, readings, output):
    """One sample period h [s] from the time t under a voltage that is commanded at t and held; readings at its end.

    The three arrays are those of start_machine and move on; output (NY,) is written. n and m must exceed the delays of
    input and sensors, counted in whole periods, by two; a longer delay is cut to that, one that is negative or no number
    counts as none. No step is longer than max_step.
    """
    for j in range(commands.shape[0] - 1, 0, -1):
        commands[j] = commands[j - 1]
    commands[0] = voltage
    for j in range(readings.shape[0] - 1, 0, -1):
        for y in range(NY):
            readings[j, y] = readings[j - 1, y]
    delay, sensor_delay = _input_delay(parameters), _sensor_delay(parameters)
    whole = _whole_periods(delay, h, commands.shape[0] - 2)
    late = _whole_periods(sensor_delay, h, readings.shape[0] - 2)
    switch = min(max(0.0, delay - whole * h), h)  # when the next command begins to act
    look = h - min(max(0.0, sensor_delay - late * h), h)  # when a late sensor looks
    begin = 0.0
    for part in range(3):
        end = min(switch, look) if part == 0 else max(switch, look) if part == 1 else h
        if end > begin:
            _advance(t, begin, end, commands[whole + 1 if end <= switch else whole], parameters, max_step, now)
        if end == look:
            read_sensors(t + end, now, parameters, readings[0])
        begin = end
    read_sensors(t + h, now, parameters, output)
    for y in range(NY):
        if DELAYED[y]:
            output[y] = readings[late, y]


@inlined
def _whole_periods(delay, h, most):
    """How many whole periods h [s] are in a delay [s], at most so many; none in one that is negative or no number."""
    periods = delay / h + 1e-6
    return int(periods) if 0.0 < periods < most else most if periods >= most else 0


@internal
def _advance(t, begin, end, voltage, parameters, max_step, now):
    """Advance the state from one time after t to another under an input that acts all the while."""
    columns, sens = np.empty(0, np.int64), np.zeros((NS, 0))
    new_state, dry = np.zeros(NS), np.zeros((6, max(NA, SURFACES)))
    stages, by_parameter, lanes = np.zeros((0, 0)), np.zeros((0, 0, 0)), np.zeros(0)
    smooth = _is_frictionless(parameters)
    while begin < end:
        until = end
        for i in range(EVENT_TIMES.size):  # something begins or ends within
            moment = parameters[EVENT_TIMES[i]] - t
            if begin < moment < until:
                until = moment
        steps = max(1, int(math.ceil((until - begin) / max_step - 1e-6)))  # noqa: RUF046 (Numba gives a float)
        h = (until - begin) / steps
        for step in range(steps):
            now_t = t + begin + step * h
            if smooth:
                _slip_directions(now, dry)
                _runge_kutta(now_t, h, now, voltage, parameters, now, dry, True, False, stages, by_parameter)
            else:
                _stick_and_slip(
                    now_t, h, now, sens, voltage, parameters, columns, new_state, stages, by_parameter, lanes, dry
                )
        begin = until


@compiled
def machine_rates(t, now, voltage, parameters, rates):
    """Time derivatives of coordinates and rates, into rates (NX,), in a state (NS,); friction sticks where it can."""
    dry = np.zeros((6, max(NA, SURFACES)))
    acting = now[NV] if LAG >= 0 else voltage
    _stick_or_slip(t, now, acting, parameters, dry)
    _rate(t, now, acting, parameters, dry)
    for k in range(NQ):
        rates[k] = now[NQ + k]
        rates[NQ + k] = dry[RATE, k]
