"""Effects between the commanded voltage V and the voltage U that reaches the motor."""

from __future__ import annotations

import math

from derive.effects.row import INPUT_SIGNAL, Effect, EffectParameter, Force, InputDelay, InputLag, InputMap, Quantiles
from derive.lazy import Magnitude, Ramp, Sign, functions

EFFECT_ROWS = (
    Effect(
        "actuator_delay",
        "actuator",
        "The commanded voltage acts later than logged.",
        "U(t) = V(t − d)",
        (
            EffectParameter(
                "delay", "s", letter="d", minimum=0.0, grid=(0.002, 0.006, 0.015, 0.04), typical=0.004, bounded=True
            ),
        ),
        InputDelay(),
        means="Communication, computation or the driver holds the command back; phase margin is lost.",
        resembles="slow sensors, and a time shift between the columns of the log; `wheelpend inspect` looks for the "
        "latter.",
    ),
    Effect(
        "winding_inductance",
        "actuator",
        "The current, and with it the torque, builds up only after a while.",
        "T dU/dt = V − U",
        (
            EffectParameter(
                "time_constant", "s", letter="T", minimum=0.0, grid=(0.002, 0.006, 0.02, 0.05), typical=0.01
            ),
        ),
        InputLag(),
        means="The windings' inductance L holds the current back, T = L/R_m: the paper's (5) in full instead of (7).",
        law_text="Integrated exactly for a held command, so that a time constant far below the sample interval is "
        "harmless.",
        resembles="`actuator_delay`: while both are short, a lag T and a delay T act alike to first order.",
        remarks=('The assumption `motor_circuit = "dynamic"` is this effect.',),
    ),
    Effect(
        "voltage_saturation",
        "actuator",
        "The driver cannot give more than a limit.",
        "U = V clipped to ±V_max",
        (
            EffectParameter(
                "limit",
                "V",
                letter="V_max",
                minimum=0.0,
                typical=10.0,
                absent=math.inf,
                bounded=True,
                starts=Quantiles(INPUT_SIGNAL, (0.5, 0.8, 0.95, 0.995)),
            ),
        ),
        InputMap(lambda V, t, limit: V - Sign(V) * Ramp(Magnitude(V) - limit)),
        means="The supply or the duty cycle is at its end: larger commands do nothing more, and control is lost there.",
        residual="a missing force while |V| is large, and none else.",
        resembles="friction that grows with speed, if the largest commands come with the largest speeds.",
        remarks=("Typical is a limit a little below the log's largest commands. A limit above these shows nowhere.",),
    ),
    Effect(
        "voltage_dead_zone",
        "actuator",
        "The driver swallows small voltages.",
        "U = sign V max(|V| − V0, 0)",
        (EffectParameter("threshold", "V", letter="V0", minimum=0.0, grid=(0.05, 0.2, 0.6), typical=0.3),),
        InputMap(lambda V, t, threshold: Sign(V) * Ramp(Magnitude(V) - threshold)),
        means="Commands below the threshold do nothing: compensate it in the driver or in the controller.",
        resembles="`coulomb_drive`.",
    ),
    Effect(
        "voltage_sag",
        "actuator",
        "The supply weakens while the log runs.",
        "U = V (1 − r t)",
        (EffectParameter("rate", "1/s", letter="r", minimum=-0.1, maximum=0.1, typical=0.005),),
        InputMap(lambda V, t, rate: V * (1 - rate * t)),
        means="The battery empties, or something warms up: the same command does less and less.",
        resembles="other effects that grow with time; a log of a few seconds shows none.",
    ),
    Effect(
        "voltage_asymmetry",
        "actuator",
        "The driver gives more voltage one way than the other.",
        "U = V (1 + r sign V)",
        (EffectParameter("ratio", "1", letter="r", minimum=-1.0, maximum=1.0, typical=0.05),),
        InputMap(lambda V, t, ratio: V * (1 + ratio * Sign(V))),
        means="Forward and backward commands are not worth the same.",
        resembles="`voltage_offset`.",
    ),
    Effect(
        "voltage_offset",
        "actuator",
        "A constant voltage is added to every command.",
        "U = V + V0",
        (EffectParameter("offset", "V", letter="V0", scope="per log", typical=0.2),),
        InputMap(lambda V, t, offset: V + offset),
        means="The driver's zero is off, or the motor is pulled one way.",
        resembles="`slope`, `voltage_asymmetry`.",
    ),
    Effect(
        "coasting_driver",
        "actuator",
        "The driver lets the motor coast in the pauses of its PWM.",
        "f = r |U| s in the drive",
        (EffectParameter("rate", "s/rad", letter="r", minimum=0.0, typical=0.02),),
        Force("drive", lambda a, s, rate: rate * Magnitude(functions.INPUT_SYMBOL) * s, follows_input=True),
        dissipates=True,
        means="Back-EMF brakes the motor only while the driver is on: in its slow-decay (brake) mode the speed would "
        "follow the duty on a straight line.",
        law_text="U is the voltage that reaches the motor, the supply's times the duty; the back-EMF acts for that "
        "share of the time, so that r is the back-EMF's constant over the supply's voltage. An H-bridge whose enable "
        "pin gets the PWM (L298N, say) drives a motor so.",
        residual="a missing force against the speed, the larger the command; the motor runs at half the duty nearly "
        "as fast as at full.",
        resembles="`quadratic_drive`, where large commands make large speeds; viscous friction, where the command is "
        "always as large.",
        remarks=("Not on a machine whose input is no voltage, nor with several inputs.",),
    ),
)
