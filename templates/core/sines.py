"""Sines and cosines without calls and branches."""

import math

from templates.core.frame import ROUNDING, SERIES_RANGE, inlined


@inlined
def _sine_pair(x):
    """Sine and cosine to 2e-16 while |x| < 1e6, by their series within an eighth of a turn.

    Arithmetic alone, without calls and branches: several of them go side by side, in one instruction or in its shadow.
    """
    quarters = (x * (2.0 / math.pi) + ROUNDING) - ROUNDING
    rest = ((x - quarters * 1.570796325802803) - quarters * 9.920935791635221e-10) - quarters * 5.170182981794105e-19
    square = rest * rest
    fourth = square * square  # the series in halves that need not wait for each other
    sine = rest + rest * square * (
        (-1.66666666666666324348e-01 + square * 8.33333333332248946124e-03)
        + fourth * (
            (-1.98412698298579493134e-04 + square * 2.75573137070700676789e-06)
            + fourth * (-2.50507602534068634195e-08 + square * 1.58969099521155010221e-10)
        )
    )
    cosine = 1.0 - 0.5 * square + fourth * (
        (4.16666666666666019037e-02 - square * 1.38888888888741095749e-03)
        + fourth * (
            (2.48015872894767294178e-05 - square * 2.75573143513906633035e-07)
            + fourth * (2.08757232129817482790e-09 - square * 1.13596475577881948265e-11)
        )
    )
    turn = quarters - 4.0 * ((0.25 * quarters - 0.375 + ROUNDING) - ROUNDING)  # 0, 1, 2 or 3
    odd = turn == 1.0 or turn == 3.0
    first, second = (cosine, sine) if odd else (sine, cosine)
    return (-first if turn >= 2.0 else first), (-second if turn == 1.0 or turn == 2.0 else second)


@inlined
def _series(x, square):
    """sin x and 1 − cos x for |x| up to SERIES_RANGE."""
    fourth = square * square
    sine = x + x * square * (
        (-1.0 / 6.0 + square / 120.0) + fourth * (-1.0 / 5040.0 + square / 362880.0)
    )
    return sine, square * ((0.5 - square / 24.0) + fourth * (1.0 / 720.0 - square / 40320.0))


@inlined
def _rotated_sines(angle, start, sine, cosine):
    """Sine and cosine of an angle from those of one near it.

    A step takes one pair in full; its other stages turn that pair, which is faster and as accurate.
    """
    turn = angle - start
    square = turn * turn
    if square > SERIES_RANGE * SERIES_RANGE:
        return math.sin(angle), math.cos(angle)
    along, short = _series(turn, square)
    return sine + (cosine * along - sine * short), cosine - (sine * along + cosine * short)
