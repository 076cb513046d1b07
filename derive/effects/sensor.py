"""Effects between the true motion and what the sensors report."""

from __future__ import annotations

from derive.effects.row import Effect, EffectParameter, SensorMap

ROWS = (
    Effect(
        "gyro_scale",
        "sensor",
        "The gyro's scale is off.",
        "measured θ̇p = (1 + k) true",
        (EffectParameter("scale", "1", minimum=-0.9, typical=0.05),),
        SensorMap("dtheta_p", lambda reading, scale: (1 + scale) * reading),
        means="Every rate is reported too large or too small by the same factor.",
    ),
    Effect(
        "imu_bias",
        "sensor",
        "The pitch sensor's zero is off.",
        "measured θp = true + b",
        (EffectParameter("bias", "rad", scope="per log", minimum=-1.0, maximum=1.0, typical=0.02),),
        SensorMap("theta_p", lambda reading, bias: reading + bias),
        means="The robot believes it stands upright when it does not.",
    ),
    Effect(
        "gyro_bias",
        "sensor",
        "The gyro's zero is off.",
        "measured θ̇p = true + b",
        (EffectParameter("bias", "rad/s", scope="per log", typical=0.02),),
        SensorMap("dtheta_p", lambda reading, bias: reading + bias),
        means="The gyro reports a turn while the body stands still; anything that integrates it drifts.",
    ),
)
