"""Effects between wheel and body: motor and gearbox. s is the slip speed of the drive, a its angle."""

from __future__ import annotations

import sympy as sp

from derive.effects.row import DryForce, Effect, EffectParameter, Force, Quantiles, Ripple
from derive.functions import Magnitude

ROWS = (
    Effect(
        "viscous_drive",
        "drive",
        "Viscous friction in motor and gearbox.",
        "f = c s",
        (EffectParameter("coefficient", "V s/rad", minimum=0.0, typical=0.05),),
        Force("drive", lambda a, s, coefficient: coefficient * s),
        dissipates=True,
        means="Oil and grease cost torque in proportion to speed. Where the plant's own parameters contain it, as X6 "
        "and X7 of the wheel pendulum do, it is no step of its own: a refit of those parameters takes it up.",
    ),
    Effect(
        "coulomb_drive",
        "drive",
        "Dry friction in motor and gearbox.",
        "f = F sign s; sticks at s = 0 while the rest stays below F",
        (EffectParameter("torque", "V", minimum=0.0, typical=0.3),),
        DryForce("drive", lambda direction, s, torque: torque * direction),
        dissipates=True,
        means="Part of the drive voltage is spent before the gearbox moves at all; it sticks at every reversal.",
    ),
    Effect(
        "coulomb_asymmetry",
        "drive",
        "Dry friction in the drive is larger one way than the other.",
        "f = F while moving, either way; with dry friction it shifts both limits of sticking",
        (EffectParameter("torque", "V", typical=0.1),),
        DryForce("drive", lambda direction, s, torque: torque * direction**2),
        means="Gear teeth or brushes worn on one side: going forward costs more torque than going back.",
    ),
    Effect(
        "viscous_asymmetry",
        "drive",
        "Viscous friction in the drive is larger one way than the other.",
        "f = c |s|",
        (EffectParameter("coefficient", "V s/rad", typical=0.02),),
        Force("drive", lambda a, s, coefficient: coefficient * Magnitude(s)),
        means="The faster it turns, the more one direction costs than the other: a bearing or seal that is preloaded.",
    ),
    Effect(
        "stribeck_drive",
        "drive",
        "Dry friction in the drive that falls from a static to a sliding value as it starts to move.",
        "f = (F_c + (F_s − F_c) exp(−(s/v)²)) sign s; sticks at s = 0 while the rest stays below F_s",
        (
            EffectParameter("static", "V", minimum=0.0, typical=0.5),
            EffectParameter("sliding", "V", minimum=0.0, typical=0.2),
            EffectParameter(
                "speed",
                "rad/s",
                minimum=1e-3,
                typical=0.5,
                absent=0.1,
                bounded=True,
                starts=Quantiles("drive", (0.1, 0.3, 0.6)),
            ),
        ),
        DryForce(
            "drive",
            lambda direction, s, static, sliding, speed: (
                (sliding + (static - sliding) * sp.exp(-((s / speed) ** 2))) * direction
            ),
        ),
        dissipates=True,
        means="It breaks loose with a jerk and then runs more easily: at small commands it moves by stick and slip.",
        ordered=("sliding", "static"),
    ),
    Effect(
        "quadratic_drive",
        "drive",
        "Drag in the drive that grows with the square of its speed.",
        "f = c s |s|",
        (EffectParameter("coefficient", "V s²/rad²", minimum=0.0, typical=0.05),),
        Force("drive", lambda a, s, coefficient: coefficient * s * Magnitude(s)),
        dissipates=True,
        means="Fast motion costs more than viscous friction says, as with churning grease or a fan.",
    ),
    Effect(
        "cogging",
        "drive",
        "Torque ripple of the motor or a gear, repeating over a turn of the drive.",
        "f = −(a sin n(θw − θp) + b cos n(θw − θp))",
        (
            EffectParameter("sine", "V", scope="per log", typical=0.2),
            EffectParameter("cosine", "V", scope="per log", typical=0.1),
            EffectParameter(
                "periods", "1/turn", minimum=0.5, typical=12.0, absent=1.0, bounded=True, starts=Ripple("drive")
            ),
        ),
        Force(
            "drive",
            lambda a, s, sine, cosine, periods: -(sine * sp.sin(periods * a) + cosine * sp.cos(periods * a)),
        ),
        means="The drive pulls towards preferred positions: magnets, brushes, or a damaged tooth.",
        phased=("sine", "cosine"),
    ),
)
