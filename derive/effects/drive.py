"""Effects between wheel and body: motor and gearbox. s is the slip speed of the drive, a its angle."""

from __future__ import annotations

import sympy as sp

from derive.effects.row import DryForce, Effect, EffectParameter, Force
from derive.functions import Magnitude

ROWS = (
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
            EffectParameter("periods", "1/turn", minimum=0.5, grid=(), typical=12.0),
        ),
        Force(
            "drive",
            lambda a, s, sine, cosine, periods: -(sine * sp.sin(periods * a) + cosine * sp.cos(periods * a)),
        ),
        means="The drive pulls towards preferred positions: magnets, brushes, or a damaged tooth.",
    ),
)
