"""A first-order lag of the input over one step, exact in its integral and first moment."""

import math

from templates.core.frame import inlined, internal


@internal
def _lag(h, time_constant):
    """Share exp(−s/T) of an old input that still acts, as a straight line in s over a step h.

    Returns begin and slope of the straight line in s that has its integral and its first moment, its value at h, and the
    derivatives of the three in T. The line serves the integrator, which a T far below h would leave unstable, and at
    T = 0 it has the derivatives of a pure delay.
    """
    if time_constant <= 0.0:
        return 0.0, 0.0, 0.0, 4.0 / h, -6.0 / (h * h), 0.0
    x = h / time_constant
    end = math.exp(-x)
    if x < 1e-3:  # the closed form cancels
        return (
            1.0 - x * x / 12.0, (0.5 * x * x - x) / h, end,
            x * x / (6.0 * time_constant), (x - x * x) / (h * time_constant), end * x / time_constant,
        )  # fmt: skip
    area, moment = time_constant * (1.0 - end), time_constant * (h - time_constant * (1.0 - end))
    area_by, moment_by = 1.0 - end - x * end, h - 2.0 * time_constant * (1.0 - end) + h * end
    slope, slope_by = 12.0 * (0.5 * area * h - moment) / h**3, 12.0 * (0.5 * area_by * h - moment_by) / h**3
    return area / h - 0.5 * slope * h, slope, end, area_by / h - 0.5 * slope_by * h, slope_by, end * x / time_constant


@inlined
def _lagged(share, share_by, old, excess, driven_by):
    """Sensitivity of driven + share · excess, where old is that of the old input; excess is 0 but for the lag's column."""
    return share * old + (1.0 - share) * driven_by + share_by * excess
