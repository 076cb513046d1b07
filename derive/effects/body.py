"""Effects on the body: its shape, the air, and what it is tied to."""

from __future__ import annotations

from derive.effects.row import Deformation, Effect, EffectParameter, Force
from derive.functions import Magnitude, symbol

ROWS = (
    Effect(
        "air_drag",
        "body",
        "Drag of the air on the moving robot.",
        "Q_w = −c θ̇w |θ̇w|",
        (EffectParameter("coefficient", "V s²/rad²", minimum=0.0, typical=0.02),),
        Force("ground", lambda a, v, coefficient: coefficient * v * Magnitude(v)),
        dissipates=True,
        means="At speed the robot pushes air: the loss grows with the square of its speed over ground.",
    ),
    Effect(
        "com_offset",
        "body",
        "The centre of mass does not lie on the line from which pitch is measured.",
        "centre of mass at angle θp + δ instead of θp",
        (EffectParameter("angle", "rad", minimum=-1.0, maximum=1.0, typical=0.02),),
        Deformation("com_angle"),
        means="The robot balances at a pitch that is not zero.",
    ),
    Effect(
        "tether_spring",
        "body",
        "A cable or spring pulls the robot back to where the log began.",
        "Q_w = −k (θw − θw at the first sample)",
        (EffectParameter("stiffness", "V/rad", minimum=0.0, typical=0.05),),
        Force("ground", lambda a, v, stiffness: stiffness * (a - symbol("origin"))),
        means="Something is attached to the robot: the cable weighs in, the more the further it goes.",
    ),
)
