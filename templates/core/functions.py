"""Functions that are not smooth, and those that stay finite where a parameter is zero."""

import math

from templates.core.frame import inlined


@inlined
def _sign(x):
    """−1.0, 0.0 or 1.0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@inlined
def _step(x):
    """1.0 where x is positive, else 0.0."""
    return 1.0 if x > 0.0 else 0.0


@inlined
def _decay(path, length):
    """exp(−path/length); where the length is not positive 1 at path 0, else 0."""
    if length > 0.0:
        return math.exp(-path / length)
    return 1.0 if path == 0.0 else 0.0


@inlined
def _inverse(x):
    """1/x where x is positive, else 0."""
    return 1.0 / x if x > 0.0 else 0.0
