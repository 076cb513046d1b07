"""Effects between wheel and ground. v is the wheel's angular speed, a its angle."""

from __future__ import annotations

import sympy as sp

from derive.effects.row import Deformation, DryForce, Effect, EffectParameter, Force

ROWS = (
    Effect(
        "ground_viscous",
        "ground",
        "Viscous friction between wheel and ground, with no share for the body.",
        "Q_w = −c θ̇w",
        (EffectParameter("coefficient", "V s/rad", minimum=0.0, typical=0.05),),
        Force("ground", lambda a, v, coefficient: coefficient * v),
        dissipates=True,
        means="Rolling on this ground costs torque in proportion to speed, and the body does not feel its reaction.",
    ),
    Effect(
        "rolling_resistance",
        "ground",
        "Dry rolling resistance of the wheels on the ground.",
        "Q_w = −F sign θ̇w; sticks at θ̇w = 0 while the rest stays below F",
        (EffectParameter("torque", "V", minimum=0.0, typical=0.2),),
        DryForce("ground", lambda direction, v, torque: torque * direction),
        dissipates=True,
        means="Soft tyres or soft ground: a constant torque is lost as long as the wheels roll.",
    ),
    Effect(
        "slope",
        "ground",
        "The ground is tilted by γ, uphill in the direction of growing θw.",
        "gravity tilted by γ against the track; pitch from the vertical",
        (EffectParameter("angle", "rad", scope="per log", minimum=-1.0, maximum=1.0, typical=0.02),),
        Deformation("track_slope"),
        means="The robot stands on a hill and needs a constant torque to hold its place.",
    ),
    Effect(
        "wheel_runout",
        "ground",
        "The wheels are not round or not centred, so that rolling goes up and down once a turn.",
        "Q_w = a sin θw + b cos θw",
        (
            EffectParameter("sine", "V", scope="per log", typical=0.1),
            EffectParameter("cosine", "V", scope="per log", typical=0.05),
        ),
        Force("ground", lambda a, v, sine, cosine: -(sine * sp.sin(a) + cosine * sp.cos(a))),
        means="The robot prefers one position of its wheels and needs torque, once per turn, to roll out of it.",
        phased=("sine", "cosine"),
    ),
)
