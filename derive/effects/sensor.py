"""Effects between the true motion and what the sensors report."""

from __future__ import annotations

from derive.effects.row import Effect, EffectParameter, SensorDelay, SensorFilter, SensorMap, Values
from derive.lazy import sp
from derive.plant_signature import GYRO

ANGLE_ZERO = EffectParameter(  # no fit may leave its range: beyond it an angle's offset is a disguise of other laws
    "bias", "rad", letter="b", scope="per log", minimum=-1.0, maximum=1.0, typical=0.02, bounded=True
)


def _error_within_a_turn(
    reading: sp.Expr, zero: sp.Expr, sine: sp.Expr, cosine: sp.Expr, second_sine: sp.Expr, second_cosine: sp.Expr
) -> sp.Expr:
    """Reading of a sensor that takes an angle from two signals with offsets, unequal gains and a phase error.

    To first order in these. Source: Heydemann, Applied Optics 20 (1981) 3382.
    """
    once = sine * sp.sin(reading) + cosine * sp.cos(reading)
    return reading + zero + once + second_sine * sp.sin(2 * reading) + second_cosine * sp.cos(2 * reading)


EFFECT_ROWS = (
    Effect(
        "encoder_eccentricity",
        "sensor",
        "The encoder's disc is off its axis.",
        "measured θw = true + a sin θw + b cos θw",
        (
            EffectParameter("sine", "rad", letter="a", scope="per log", typical=0.01),
            EffectParameter("cosine", "rad", letter="b", scope="per log", typical=0.005),
        ),
        SensorMap("theta_w", lambda reading, sine, cosine: reading + sine * sp.sin(reading) + cosine * sp.cos(reading)),
        means="The angle runs ahead and falls back once a turn; at a steady speed the speed seems to swing.",
        phased=("sine", "cosine"),
        residual="an error of the wheel's angle that repeats with every turn, the same at any speed.",
        resembles="`wheel_runout`.",
    ),
    Effect(
        "encoder_scale",
        "sensor",
        "The encoder's scale is off.",
        "measured θw = (1 + k) true",
        (EffectParameter("scale", "1", letter="k", minimum=-0.9, typical=0.05),),
        SensorMap("theta_w", lambda reading, scale: (1 + scale) * reading),
        means="The counts per turn, or the gear between encoder and wheel, are not what the software believes.",
        residual="next to none. While the pitch is small, other values of X1...X7 give the same readings: X1 and X6 "
        "are divided by 1 + k, X4 and X5 grow. 5 %, and even 20 %, on the aggressive command end at the noise without "
        "it, and the verdict is `nothing_missing`. No size is claimed in `detectable`. Its parameters are then off; "
        "measure a turn of the wheel.",
        resembles="other values of X1...X7.",
    ),
    Effect(
        "encoder_zero",
        "sensor",
        "The encoder of the first link does not read zero where the link hangs straight down.",
        "measured θ1 = true + b",
        (ANGLE_ZERO,),
        SensorMap("theta_1", lambda reading, bias: reading + bias),
        means="The zero was set with the pendulum not at rest, or the sensor was mounted askew.",
        resembles="with a driven link, `cogging` of one period per turn.",
        remarks=("Gravity shows it.",),
    ),
    Effect(
        "link_scale",
        "sensor",
        "The scale of the first link's angle sensor is off.",
        "measured θ1 = (1 + k) true",
        (EffectParameter("scale", "1", letter="k", minimum=-0.9, typical=0.05),),
        SensorMap("theta_1", lambda reading, scale: (1 + scale) * reading),
        means="A potentiometer whose travel is less than a turn, or an encoder whose counts per turn are not what the "
        "software believes.",
        residual="next to none while the swing is small: then other values of X1, X2, ... give the same readings.",
        resembles="on small swings other values of X1, X2, ...; `tether_spring`.",
        remarks=("Gravity shows it, from large angles.",),
    ),
    Effect(
        "link_nonlinearity",
        "sensor",
        "The first link's angle sensor runs ahead and falls back within a turn.",
        "measured θ1 = true + z + a sin θ1 + b cos θ1 + c sin 2θ1 + d cos 2θ1",
        (
            EffectParameter("zero", "rad", letter="z", minimum=-1.0, maximum=1.0, typical=0.01),
            EffectParameter("sine", "rad", letter="a", minimum=-0.5, maximum=0.5, typical=0.02),
            EffectParameter("cosine", "rad", letter="b", minimum=-0.5, maximum=0.5, typical=0.01),
            EffectParameter("second_sine", "rad", letter="c", minimum=-0.25, maximum=0.25, typical=0.03),
            EffectParameter("second_cosine", "rad", letter="d", minimum=-0.25, maximum=0.25, typical=0.01),
        ),
        SensorMap("theta_1", _error_within_a_turn),
        means="A magnet that is off the axis of a magnetic encoder, or whose two fields it reads as unequal or not at "
        "a right angle: errors of once and of twice a turn.",
        residual="an error of the angle that is the same wherever the link passes, at any speed.",
        resembles="on small swings `link_scale` and `encoder_zero`; `cogging` of one or two periods per turn.",
        remarks=("Gravity shows it, from large angles.",),
    ),
    Effect(
        "second_encoder_zero",
        "sensor",
        "The encoder of the second link does not read zero where the link hangs straight down.",
        "measured θ2 = true + b",
        (ANGLE_ZERO,),
        SensorMap("theta_2", lambda reading, bias: reading + bias),
        means="The zero was set with the pendulum not at rest, or the sensor was mounted askew.",
        resembles="with a driven link, `cogging` of one period per turn.",
        remarks=("Gravity shows it.",),
    ),
    Effect(
        "pitch_scale",
        "sensor",
        "The pitch sensor's scale is off.",
        "measured θp = (1 + k) true",
        (EffectParameter("scale", "1", letter="k", minimum=-0.9, typical=0.05),),
        SensorMap("theta_p", lambda reading, scale: (1 + scale) * reading),
        means="Every angle from the vertical is reported too large or too small by the same factor; its rate is not.",
        residual="pitch and gyro contradict each other in proportion to the motion.",
        resembles="`gyro_scale`: if both sensors were off by the same factor, other values of X1...X7 would give "
        "almost the same readings, so that only the ratio of the two shows well. Errors of 5 % are seldom told apart.",
    ),
    Effect(
        "gyro_scale",
        "sensor",
        "The gyro's scale is off.",
        "measured θ̇p = (1 + k) true",
        (EffectParameter("scale", "1", letter="k", minimum=-0.9, typical=0.05),),
        SensorMap("dtheta_p", lambda reading, scale: (1 + scale) * reading, GYRO),
        means="Every rate is reported too large or too small by the same factor.",
        resembles="`pitch_scale`; a wrong unit of the gyro column, for which `wheelpend inspect` looks.",
    ),
    Effect(
        "imu_bias",
        "sensor",
        "The pitch sensor's zero is off.",
        "measured θp = true + b",
        (ANGLE_ZERO,),
        SensorMap("theta_p", lambda reading, bias: reading + bias),
        means="The robot believes it stands upright when it does not.",
        resembles="`com_offset`, always: see below; also `slope`.",
    ),
    Effect(
        "gyro_bias",
        "sensor",
        "The gyro's zero is off.",
        "measured θ̇p = true + b",
        (EffectParameter("bias", "rad/s", letter="b", scope="per log", typical=0.02),),
        SensorMap("dtheta_p", lambda reading, bias: reading + bias, GYRO),
        means="The gyro reports a turn while the body stands still; anything that integrates it drifts.",
        resembles="`imu_bias` on short segments.",
    ),
    Effect(
        "second_gyro_scale",
        "sensor",
        "The scale of the second link's gyro is off.",
        "measured θ̇2 = (1 + k) true",
        (EffectParameter("scale", "1", letter="k", minimum=-0.9, typical=0.05),),
        SensorMap("dtheta_2", lambda reading, scale: (1 + scale) * reading),
        means="Every rate of the second link is reported too large or too small by the same factor.",
        resembles="a wrong unit of the gyro column, for which `wheelpend inspect` looks.",
    ),
    Effect(
        "second_gyro_bias",
        "sensor",
        "The zero of the second link's gyro is off.",
        "measured θ̇2 = true + b",
        (EffectParameter("bias", "rad/s", letter="b", scope="per log", typical=0.02),),
        SensorMap("dtheta_2", lambda reading, bias: reading + bias),
        means="The gyro reports a turn while the link stands still; anything that integrates it drifts.",
    ),
    Effect(
        "accelerometer_tilt",
        "sensor",
        "The pitch is fused with an accelerometer, which takes the robot's own acceleration for tilt.",
        "measured θp = true − k (θ̇w − y), dy/dt = (θ̇w − y) / T",
        (
            EffectParameter("gain", "s", letter="k", minimum=0.0, typical=0.003),
            EffectParameter(
                "time_constant",
                "s",
                letter="T",
                minimum=0.02,
                maximum=60.0,
                typical=1.0,
                absent=1.0,
                bounded=True,
                starts=Values((0.3, 1.0, 4.0)),
            ),
        ),
        SensorFilter(
            "theta_p",
            lambda reading, speed, state, gain, time_constant: reading - gain * (speed - state),
            "filtered_speed",
            lambda speed, state, gain, time_constant: (speed - state) / time_constant,
        ),
        means="A complementary filter trusts the gyro for as long as its time constant T: by then the pitch is off in "
        "proportion to the speed that was gained meanwhile.",
        law_text="y is the speed of the wheels behind a first-order filter, at rest where the log begins. With an "
        "accelerometer at the axle k is R/(g T); further up the body it is less.",
        residual="a pitch that lags behind the integral of the gyro while the robot speeds up, and comes back over T.",
        resembles="`imu_lag`, `pitch_scale`.",
        remarks=("`inspect` compares the pitch with the integral of the gyro.",),
    ),
    Effect(
        "imu_lag",
        "sensor",
        "Pitch and pitch rate are reported late.",
        "measured θp, θ̇p at t are true at t − d",
        (
            EffectParameter(
                "delay",
                "s",
                letter="d",
                minimum=0.0,
                maximum=0.3,
                grid=(0.002, 0.006, 0.02),
                typical=0.005,
                bounded=True,
            ),
        ),
        SensorDelay(("theta_p", "dtheta_p")),
        means="A filter, a bus or a slow sensor: the controller acts on what was, and phase margin is lost.",
        law_text="That holds for any fraction of a sample.",
        residual="pitch and rate behind what the wheel says, most while the body accelerates.",
        resembles="`actuator_delay`, which delays the wheel too.",
        remarks=("What is reported at the beginning of a segment follows backward from its initial state.",),
    ),
)
