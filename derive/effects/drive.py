"""Effects between wheel and body: motor and gearbox. s is the slip speed of the drive, a its angle."""

from __future__ import annotations

import math

from derive.effects.row import (
    DryForce,
    Effect,
    EffectParameter,
    Force,
    HysteresisForce,
    InternalForce,
    InternalPlay,
    Quantiles,
    Ripple,
    Values,
)
from derive.lazy import Decay, Least, Magnitude, Sign, Step, functions, sp

RIGID_STIFFNESS_V_RAD = 4000.0  # V/rad: a stiffness that counts as rigid, as that of the teeth on either side of a play
CONTACT_LOSS_S_RAD = 1.5  # s/rad: how much of the bounce a contact takes


def contact_force(q: sp.Expr, dq: sp.Expr) -> sp.Expr:
    """Force of a contact that counts as rigid and loses energy in proportion to its force (Hunt and Crossley 1975)."""
    return RIGID_STIFFNESS_V_RAD * q * (1 + CONTACT_LOSS_S_RAD * dq * Sign(q))


EFFECT_ROWS = (
    Effect(
        "viscous_drive",
        "drive",
        "Viscous friction in motor and gearbox.",
        "f = c s",
        (EffectParameter("coefficient", "V s/rad", letter="c", minimum=0.0, typical=0.05),),
        Force("drive", lambda a, s, coefficient: coefficient * s),
        dissipates=True,
        undriven=(
            "Viscous friction in the bearing.",
            "Oil in the bearing, or air around what swings, resists in proportion to speed.",
        ),
        means="Oil and grease cost torque in proportion to speed. Where the plant's own parameters contain it, it is "
        "no step of its own: a refit of those parameters takes it up.",
        residual="none. On the wheel pendulum it is part of X6 and X7, which a refit raises by c each; it is "
        "therefore never tried, and `wheelpend add viscous_drive` refuses and says so. `simulate --hide "
        "viscous_drive=0.05` raises X6 and X7. On a plant whose own parameters do not contain it, it is an effect "
        "like any other.",
    ),
    Effect(
        "coulomb_drive",
        "drive",
        "Dry friction in motor and gearbox.",
        "f = F sign s; sticks at s = 0 while the rest stays below F",
        (EffectParameter("torque", "V", letter="F", minimum=0.0, typical=0.3),),
        DryForce("drive", lambda direction, s, torque: torque * direction),
        dissipates=True,
        undriven=(
            "Dry friction in the bearing.",
            "The bearing or its seal rubs with the same torque at any speed: a swing ends at a standstill, not slowly.",
        ),
        means="Part of the drive voltage is spent before the gearbox moves at all; it sticks at every reversal.",
        resembles="`voltage_dead_zone` (both cost voltage before anything moves, but a dead zone follows the "
        "command's sign and friction that of the slip), `rolling_resistance`.",
    ),
    Effect(
        "coulomb_asymmetry",
        "drive",
        "Dry friction in the drive is larger one way than the other.",
        "f = F while moving, either way; with dry friction it shifts both limits of sticking",
        (EffectParameter("torque", "V", letter="F", typical=0.1),),
        DryForce("drive", lambda direction, s, torque: torque * direction**2),
        means="Gear teeth or brushes worn on one side: going forward costs more torque than going back.",
        residual="a constant missing force of opposite sign on the two rows, whatever the speed.",
        resembles="`voltage_offset`, always: see below; also `slope`, which acts on the wheel row alone.",
        remarks=(
            "|F| is not more than the dry friction it belongs to, or it would drive the machine one way: then it is "
            "the motor's or its driver's.",
        ),
        varies="coulomb_drive",
        needs_motor=True,
    ),
    Effect(
        "viscous_asymmetry",
        "drive",
        "Viscous friction in the drive is larger one way than the other.",
        "f = c |s|",
        (EffectParameter("coefficient", "V s/rad", letter="c", typical=0.02),),
        Force("drive", lambda a, s, coefficient: coefficient * Magnitude(s)),
        means="The faster it turns, the more one direction costs than the other: a bearing or seal that is preloaded.",
        residual="a missing force against |slip speed| on a straight line through zero, with the same sign both ways.",
        resembles="`voltage_asymmetry` and `voltage_offset` on a log with little change of speed.",
        remarks=(
            "It takes energy out as long as |c| is less than the viscous friction itself. Where the model has less of "
            "that, it is judged impossible, but for plants whose own parameters contain it: X6 and X7 contain the "
            "motor's back-EMF too.",
        ),
        varies="viscous_drive",
        needs_motor=True,
    ),
    Effect(
        "load_friction",
        "drive",
        "Dry friction in the gearbox that grows with the load it carries.",
        "f = μ |T| sign s, T the torque that the motor passes on; sticks at s = 0 while the rest stays below μ |T|",
        (EffectParameter("share", "1", letter="μ", minimum=0.0, maximum=1.0, typical=0.1),),
        DryForce(
            "drive", lambda direction, s, share: share * Magnitude(functions.LOAD_SYMBOL) * direction, loaded=True
        ),
        dissipates=True,
        means="Teeth and screws rub the harder the more they carry: a share of every torque is lost, whatever the "
        "speed. A worm gear or a trapezoidal screw loses most.",
        law_text="The back-EMF is taken off T.",
        residual="at reversals, and only where the motor pushes; none while it idles.",
        resembles="`voltage_asymmetry` in one direction of travel, `coulomb_drive` where the load hardly changes.",
        remarks=("Not on a machine without a motor.",),
    ),
    Effect(
        "stribeck_drive",
        "drive",
        "Dry friction in the drive that falls from a static to a sliding value as it starts to move.",
        "f = (F_c + (F_s − F_c) exp(−(s/v)²)) sign s; sticks at s = 0 while the rest stays below F_s",
        (
            EffectParameter("static", "V", letter="F_s", minimum=0.0, typical=0.5),
            EffectParameter("sliding", "V", letter="F_c", minimum=0.0, typical=0.2),
            EffectParameter(
                "speed",
                "rad/s",
                letter="v",
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
        undriven=(
            "Dry friction in the bearing that falls from a static to a sliding value as it starts to move.",
            "It breaks loose with a jerk and then runs more easily: a small swing ends at once.",
        ),
        means="It breaks loose with a jerk and then runs more easily: at small commands it moves by stick and slip.",
        ordered=("sliding", "static"),
        residual="after a refit with `coulomb_drive`, peaks of missing force within a few v of every reversal.",
        resembles="`coulomb_drive`, which it contains (static = sliding); `voltage_dead_zone`. It is named only "
        "where it is worth naming over `coulomb_drive`, and takes the place of that where the model has it.",
    ),
    Effect(
        "presliding_drive",
        "drive",
        "Dry friction in the drive that winds up like a spring before it slides (Dahl).",
        "f = k z, dz/dt = s − |s| z k/F",
        (
            EffectParameter("torque", "V", letter="F", minimum=0.0, typical=0.3),
            EffectParameter(
                "stiffness",
                "V/rad",
                letter="k",
                minimum=0.1,
                maximum=5000.0,
                typical=30.0,
                absent=30.0,
                bounded=True,
                starts=Values((3.0, 12.0, 50.0, 200.0)),
            ),
        ),
        HysteresisForce(  # dz/dt is s (1 − z k/F sign s): along a path of slip the force approaches ±F
            "drive",
            lambda before, path, torque, stiffness: (
                torque * Sign(path) + (before - torque * Sign(path)) * Decay(stiffness * Magnitude(path), torque)
            ),
        ),
        dissipates=True,
        undriven=(
            "Dry friction in the bearing that winds up like a spring before it slides (Dahl).",
            "Seals and grease give way before they slide: around a reversal the friction builds up with the angle.",
        ),
        means="Teeth, seals and grease give way before they slide: around a reversal the friction builds up with the "
        "angle, not with the direction. With a growing stiffness it becomes dry friction.",
        approaches="coulomb_drive",
        law_text="Along a path of slip x without a reversal that is f(x) = F sign x + (f(0) − F sign x) exp(−k "
        "|x|/F), which the integrator uses; so no stiffness is too large for it. Absent at no torque.",
        residual="after a refit with `coulomb_drive`, missing force within F/k radians of every reversal, and a loop "
        "when it is drawn over the angle.",
        resembles="`coulomb_drive`, its limit for a stiff contact; `backlash`, which also delays what happens after "
        "a reversal.",
        remarks=("The friction carries on from segment to segment.",),
    ),
    Effect(
        "drive_compliance",
        "drive",
        "The shaft between motor and wheel is elastic.",
        "motor and wheel turn by themselves, joined by k (θ_motor − θw) + c d/dt (θ_motor − θw)",
        (
            EffectParameter(
                "stiffness",
                "V/rad",
                letter="k",
                minimum=1.0,
                maximum=4000.0,
                typical=50.0,
                absent=math.inf,
                bounded=True,
                starts=Values((20.0, 60.0, 200.0, 600.0)),
            ),
            EffectParameter("damping", "V s/rad", letter="c", minimum=0.0, typical=0.1, bounded=True),
        ),
        InternalForce(
            "twist",
            lambda q, dq, stiffness, damping: (
                Least(stiffness, RIGID_STIFFNESS_V_RAD) * q
                + damping * dq * Step(Magnitude(q))
                + Step(stiffness - RIGID_STIFFNESS_V_RAD) * (contact_force(q, dq) - contact_force(q, sp.Integer(0)))
            ),
        ),
        dissipates=True,
        means="A long shaft, a belt or a coupling winds up: the wheel follows the motor late and rings after a jerk.",
        law_text="The rotors' inertia X2, the motors and their part X7 of the damping act on the motor's side, the "
        "encoder reads the wheel. It needs `rotor_inertia = true`. A stiffness of 4000 V/rad counts as rigid.",
        residual="an oscillation of the wheel after every change of the voltage, of about √(k (1/X2 + 1/X1)) rad/s; "
        "seen by sensors fast enough for it.",
        resembles="`actuator_delay` and `winding_inductance` where the sensors are slow; `backlash`.",
    ),
    Effect(
        "backlash",
        "drive",
        "Free play between motor and wheel.",
        "no drive force while the motor is inside the gap",
        (
            EffectParameter(
                "gap",
                "rad",
                minimum=0.0,
                maximum=1.0,
                typical=0.03,
                bounded=True,
                starts=Values((0.005, 0.015, 0.04, 0.1)),
            ),
        ),
        InternalPlay("twist", lambda gap: gap, contact_force),
        means="Worn or loose teeth: at a reversal the motor first crosses the gap, and the wheels roll on their own.",
        law_text="`gap` is its full width; at its ends acts a contact of 4000 V/rad that takes most of the bounce "
        "(Hunt and Crossley), or the shaft where it is elastic.",
        residual="bursts at every reversal of the torque between motor and wheel.",
        resembles="`voltage_dead_zone`, `presliding_drive`, `actuator_delay`.",
        remarks=(
            "Where the motor is at a moment depends on every contact before, so that a fit from far away ends "
            "in one of many wrong minima. So it is tried last, where no other effect leads to the noise, and then "
            "from the first start before any fit, which is the nominal values where the model has some: segments that "
            "fit badly count less, a grid of gaps is tried, and the derivatives are differences over whole chains of "
            "segments. That takes about half a minute. Measured with nominal values 10 % off and the aggressive "
            "command: a gap of 0.03 rad ends at 0.0300 rad and in the noise for all three seeds tried. From starts "
            "without nominal values, and with the simple command, it was not found in the few cases tried; the "
            "verdict is then `unexplained`.",
        ),
    ),
    Effect(
        "quadratic_drive",
        "drive",
        "Drag in the drive that grows with the square of its speed.",
        "f = c s |s|",
        (EffectParameter("coefficient", "V s²/rad²", letter="c", minimum=0.0, typical=0.05),),
        Force("drive", lambda a, s, coefficient: coefficient * s * Magnitude(s)),
        dissipates=True,
        undriven=(
            "Drag that grows with the square of the speed.",
            "What swings pushes air: fast motion costs more than viscous friction says.",
        ),
        means="Fast motion costs more than viscous friction says, as with churning grease or a fan.",
        resembles="`air_drag`; with a negative size, which is impossible, dry friction.",
    ),
    Effect(
        "cogging",
        "drive",
        "Torque ripple of the motor or a gear, repeating over a turn of the drive.",
        "f = −(a sin n(θw − θp) + b cos n(θw − θp))",
        (
            EffectParameter("sine", "V", letter="a", scope="per log", typical=0.2),
            EffectParameter("cosine", "V", letter="b", scope="per log", typical=0.1),
            EffectParameter(
                "periods",
                "1/turn",
                letter="n",
                minimum=0.5,
                typical=12.0,
                absent=12.0,
                bounded=True,
                starts=Ripple("drive"),
            ),
        ),
        Force(
            "drive",
            lambda a, s, sine, cosine, periods: -(sine * sp.sin(periods * a) + cosine * sp.cos(periods * a)),
        ),
        means="The drive pulls towards preferred positions: magnets, brushes, or a damaged tooth.",
        phased=("sine", "cosine"),
        covers=("unbalance",),
        resembles="other disturbances that repeat with the wheel's angle.",
        remarks=("The diagnosis searches 1 to 60 periods per turn.",),
        needs_motor=True,
    ),
)
