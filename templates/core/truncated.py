"""What dry friction leaves of a Gaussian slip: all that lies beyond a half width, and its pieces."""

import math

from templates.core.frame import CERTAIN_SIGMAS, inlined, internal


@inlined
def _tails(mean, sigma, width):
    """Bounds ±width in standard deviations from the mean; probabilities beyond them; densities there [1/σ]."""
    above, below = (width - mean) / sigma, (-width - mean) / sigma
    upper, lower = 0.5 * math.erfc(above / math.sqrt(2.0)), 0.5 * math.erfc(-below / math.sqrt(2.0))
    upper_density = math.exp(-0.5 * above * above) / math.sqrt(2.0 * math.pi)
    lower_density = math.exp(-0.5 * below * below) / math.sqrt(2.0 * math.pi)
    return above, below, upper, lower, upper_density, lower_density


@internal
def _shrunk(mean, sigma, width):
    """What is left of a Gaussian variable s beyond ±width, shrunk by it: mean, slope, signed share, and variance off the line.

    The slope is the probability of |s| > width (Stein's lemma), the signed share P(s > width) − P(s < −width).
    """
    if abs(mean) - abs(width) > CERTAIN_SIGMAS * sigma:
        sign = 1.0 if mean > 0.0 else -1.0
        return mean - sign * width, 1.0, sign, 0.0
    _, _, upper, lower, upper_density, lower_density = _tails(mean, sigma, width)
    left = sigma * (upper_density - lower_density) + (mean - width) * upper + (mean + width) * lower
    square = (sigma**2 + (mean - width) ** 2) * upper + (mean - width) * sigma * upper_density
    square += (sigma**2 + (mean + width) ** 2) * lower - (mean + width) * sigma * lower_density
    share = upper + lower
    return left, share, upper - lower, max(square - left**2 - (share * sigma) ** 2, 0.0)


@inlined
def _piece(share, density_low, density_high, bent):
    """Mean and variance of a piece of the standard normal distribution (Johnson, Kotz and Balakrishnan 1994, 13.10).

    Of its share, of the densities at its two ends, and of the difference between these times their places.
    """
    shift = (density_low - density_high) / share
    return shift, max(1.0 + bent / share - shift**2, 0.0)
