"""Effects on the body: its shape, the air, and what it is tied to."""

from __future__ import annotations

from derive.effects.row import Deformation, Effect, EffectParameter, Force, InternalForce, Onset, Values
from derive.lazy import Magnitude, Step, functions, sp, symbol

EFFECT_ROWS = (
    Effect(
        "air_drag",
        "body",
        "Drag of the air on the moving robot.",
        "Q_w = −c θ̇w |θ̇w|",
        (EffectParameter("coefficient", "V s²/rad²", letter="c", minimum=0.0, typical=0.02),),
        Force("ground", lambda a, v, coefficient: coefficient * v * Magnitude(v)),
        dissipates=True,
        means="At speed the robot pushes air: the loss grows with the square of its speed over ground.",
        resembles="`quadratic_drive`.",
    ),
    Effect(
        "com_offset",
        "body",
        "The centre of mass does not lie on the line from which pitch is measured.",
        "centre of mass at angle θp + δ instead of θp",
        (EffectParameter("angle", "rad", letter="δ", minimum=-1.0, maximum=1.0, typical=0.02, bounded=True),),
        Deformation("com_angle"),
        means="The robot balances at a pitch that is not zero.",
        resembles="`imu_bias`, always: see below; also `slope`.",
    ),
    Effect(
        "body_damping",
        "body",
        "Viscous damping of the body's turning, against the world.",
        "Q_p = −c θ̇p",
        (EffectParameter("coefficient", "V s/rad", letter="c", minimum=0.0, typical=0.05),),
        Force("body", lambda a, v, coefficient: coefficient * v),
        dissipates=True,
        means="The air, or something that the body drags along, resists leaning in proportion to its rate.",
        residual="a missing force on the body row over θ̇p, on a straight line through zero.",
        resembles="`ground_viscous` with a negative size, which is impossible.",
    ),
    Effect(
        "tether_spring",
        "body",
        "A cable or spring pulls the robot back to where the log began.",
        "Q_w = −k (θw − θw at the first sample)",
        (EffectParameter("stiffness", "V/rad", letter="k", minimum=0.0, typical=0.05),),
        Force("outside", lambda a, v, stiffness: stiffness * (a - symbol("origin"))),
        means="Something is attached to the robot: the cable weighs in, the more the further it goes.",
        resembles="`slope` or `voltage_offset`, if the robot stays in one place.",
    ),
    Effect(
        "unbalance",
        "body",
        "A load out of balance: gravity pulls it to one side.",
        "Q_w = a sin θw + b cos θw",
        (
            EffectParameter("sine", "V", letter="a", scope="per log", typical=0.3),
            EffectParameter("cosine", "V", letter="b", scope="per log", typical=0.1),
        ),
        Force("load", lambda a, s, sine, cosine: -(sine * sp.sin(a) + cosine * sp.cos(a))),
        means="What the shaft turns is heavier on one side: left alone it comes to rest with that below, and within a "
        "turn it costs now more, now less.",
        phased=("sine", "cosine"),
        law_text="Only on a shaft. An arm or a link hangs on a [pendulum](plants.md), whose own parameters hold its "
        "weight.",
        residual="a missing force of one period a turn over the shaft's angle.",
        resembles="`cogging` of one period a turn, which is the same force; over a small part of a turn "
        "`voltage_offset`.",
    ),
    Effect(
        "slosh",
        "body",
        "Something hangs or sloshes in the body: a damped pendulum on its axis.",
        "φ̈ + 2 ζ ω (φ̇ − θ̇p) + ω² sin φ = −(acceleration of its pivot), of mass r M, hung at a height above the axle",
        (
            EffectParameter("mass_ratio", "1", letter="r", minimum=0.0, maximum=1.0, typical=0.05),
            EffectParameter("height", "m", typical=0.5, absent=0.7),
            EffectParameter(
                "frequency",
                "rad/s",
                letter="ω",
                minimum=0.5,
                maximum=100.0,
                typical=8.0,
                absent=8.0,
                bounded=True,
                starts=Values((3.0, 5.0, 8.0, 13.0, 20.0)),
            ),
            EffectParameter(
                "damping", "1", letter="ζ", minimum=0.0, maximum=5.0, typical=0.3, absent=0.2, bounded=True
            ),
        ),
        InternalForce(
            "slosh_angle",
            lambda q, dq, **parameters: 0,
            (
                ("slosh_mass", lambda mass_ratio, height, frequency, damping: mass_ratio),
                ("slosh_height", lambda mass_ratio, height, frequency, damping: height),
                ("slosh_length", lambda mass_ratio, height, frequency, damping: symbol("g") / frequency**2),
                ("slosh_decay", lambda mass_ratio, height, frequency, damping: 2 * damping * frequency),
            ),
        ),
        means="A half-full tank, a loose cable or a soft payload swings in the body, a beat of its own.",
        law_text="The pendulum hangs on the body's axis, has the length g/ω² and is damped against the body; φ is its "
        "angle against the vertical.",
        residual="an oscillation of the body with a frequency of its own, long after the command.",
        resembles="nothing else keeps a beat of its own; a nearly undamped one that is thrown over the top is "
        "chaotic and cannot be fitted.",
        remarks=("It needs the constants `R`, `g` and `L`, which turn X5 into the body's mass.",),
    ),
    Effect(
        "payload_step",
        "body",
        "The body gets heavier, or lighter, at a moment.",
        "M becomes M (1 + r) from a moment on",
        (
            EffectParameter(
                "time", "s", scope="event", minimum=0.0, typical=8.0, absent=0.0, starts=Onset(), event_time=True
            ),
            EffectParameter("ratio", "1", letter="r", scope="event", minimum=-0.9, typical=0.1),
        ),
        Deformation("payload", lambda t, time, ratio: ratio * Step(t - time)),
        means="Something was put on, or taken off, while the log ran; parameters before and after are not the same.",
        law_text="What is put on or taken off is at the centre of mass; J_b stays.",
        residual="the same everywhere, with one sign before and another after the moment.",
        resembles="`voltage_sag` over a short log.",
        remarks=("It needs the constants `R`, `g` and `L`.",),
    ),
    Effect(
        "external_push",
        "body",
        "Somebody, or something, pushes the robot for a while.",
        "Q_w = F from start to end",
        (
            EffectParameter(
                "start", "s", scope="event", minimum=0.0, typical=8.0, absent=0.0, starts=Onset(), event_time=True
            ),
            EffectParameter(
                "end", "s", scope="event", minimum=0.0, typical=8.5, absent=0.0, starts=Onset(), event_time=True
            ),
            EffectParameter("torque", "V", letter="F", scope="event", typical=0.5),
        ),
        Force(
            "outside",
            lambda a, v, start, end, torque: (
                torque * (Step(functions.TIME_SYMBOL - end) - Step(functions.TIME_SYMBOL - start))
            ),
        ),
        means="The model is not at fault here: leave the push out of the log, or keep it out of the fit.",
        residual="nothing but a burst between two moments.",
        resembles="`payload_step` where it lasts to the log's end; `slope` on a log that starts on it.",
    ),
)
