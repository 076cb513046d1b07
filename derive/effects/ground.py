"""Effects between wheel and ground. v is the wheel's angular speed, a its angle."""

from __future__ import annotations

import math

from derive.effects.row import Deformation, DryForce, Effect, EffectParameter, Force, InternalForce, Values
from derive.lazy import Least, sp

RIGID_GRIP_V_S_RAD = 300.0  # V s/rad: a grip that counts as rigid

EFFECT_ROWS = (
    Effect(
        "ground_viscous",
        "ground",
        "Viscous friction between wheel and ground, with no share for the body.",
        "Q_w = −c θ̇w",
        (EffectParameter("coefficient", "V s/rad", letter="c", minimum=0.0, typical=0.05),),
        Force("ground", lambda a, v, coefficient: coefficient * v),
        dissipates=True,
        means="Rolling on this ground costs torque in proportion to speed, and the body does not feel its reaction.",
        resembles='a wrong assumption on `ground_friction_reaction`. With `"none"` it is part of X6 and invisible.',
    ),
    Effect(
        "rolling_resistance",
        "ground",
        "Dry rolling resistance of the wheels on the ground.",
        "Q_w = −F sign θ̇w; sticks at θ̇w = 0 while the rest stays below F",
        (EffectParameter("torque", "V", letter="F", minimum=0.0, typical=0.2),),
        DryForce("ground", lambda direction, v, torque: torque * direction),
        dissipates=True,
        means="Soft tyres or soft ground: a constant torque is lost as long as the wheels roll.",
        resembles="`coulomb_drive`: while the body hardly turns, slip and wheel speed are almost the same.",
    ),
    Effect(
        "slope",
        "ground",
        "The ground is tilted by γ, uphill in the direction of growing θw.",
        "gravity tilted by γ against the track; pitch from the vertical",
        (EffectParameter("angle", "rad", letter="γ", scope="per log", minimum=-1.0, maximum=1.0, typical=0.02),),
        Deformation("track_slope"),
        means="The robot stands on a hill and needs a constant torque to hold its place.",
        resembles="`com_offset`, `imu_bias`, `voltage_offset`: all move the point of balance or need a constant "
        "torque.",
        remarks=(
            "Needs `R`, `g`, `alpha`, `J_w` in `[constants]`; without them it is not judged, and the "
            "diagnosis says so.",
        ),
    ),
    Effect(
        "wheel_slip",
        "ground",
        "The wheels creep and slip on the ground.",
        "cart speed v free; traction F tanh(k (θ̇w − v/R)/F) on both",
        (
            EffectParameter(
                "stiffness",
                "V s/rad",
                letter="k",
                minimum=0.1,
                maximum=60.0,
                typical=20.0,
                absent=math.inf,
                bounded=True,
                starts=Values((3.0, 10.0, 40.0)),
            ),
            EffectParameter(
                "limit",
                "V",
                letter="F",
                minimum=0.1,
                maximum=1000.0,
                typical=5.0,
                absent=10.0,
                bounded=True,
                grid=(3.0,),
            ),
        ),
        InternalForce(
            "creep",
            lambda q, dq, stiffness, limit: limit * sp.tanh(Least(stiffness, RIGID_GRIP_V_S_RAD) * dq / limit),
        ),
        dissipates=True,
        means="Dust, wet floor or hard tyres: the wheels turn further than the robot travels, most under hard pushes.",
        law_text="The traction acts on the wheels and on the cart, whose speed is a coordinate of its own.",
        residual="after strong commands the wheel is ahead of what the body's motion says.",
        resembles="`winding_inductance` where it only creeps; `encoder_eccentricity`, `voltage_saturation` where it "
        "slides.",
        remarks=("It needs the constants `alpha` and `J_w`.",),
    ),
    Effect(
        "wheel_runout",
        "ground",
        "The wheels are not round or not centred, so that rolling goes up and down once a turn.",
        "Q_w = a sin θw + b cos θw",
        (
            EffectParameter("sine", "V", letter="a", scope="per log", typical=0.1),
            EffectParameter("cosine", "V", letter="b", scope="per log", typical=0.05),
        ),
        Force("ground", lambda a, v, sine, cosine: -(sine * sp.sin(a) + cosine * sp.cos(a))),
        means="The robot prefers one position of its wheels and needs torque, once per turn, to roll out of it.",
        phased=("sine", "cosine"),
        residual="a missing force on the wheel row that repeats with every turn of the wheel.",
        resembles="`encoder_eccentricity`, which repeats likewise but grows with the speed; `cogging` with few "
        "periods, which acts on both rows; `tether_spring` or `slope` while the wheels turn less than once.",
    ),
)
