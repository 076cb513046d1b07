"""Whether an effect's parameters are physically possible: in their range, in order, and no friction that drives.

And whether logs determine its shape: a law whose shape they leave open is to them a simpler law.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import derive
from derive.effects import DryForce, Effect
from wheelpend.estimation.estimate import EffectEstimate, is_known_to_its_size
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameter_table import conservative_standard_error
from wheelpend.estimation.problem import EstimationProblem

MAX_STANDARD_ERRORS = 2.0  # by which a parameter may be beyond what is possible


def is_physical(effect: Effect, coefficients: Mapping[str, float], sigma: Mapping[str, float]) -> bool:
    """Every coefficient within its physical range, and in its order, up to two standard errors."""
    slack = {n: MAX_STANDARD_ERRORS * s for n, s in sigma.items()}
    pairs = itertools.pairwise(effect.ordered)
    return all(
        p.minimum - slack[p.name] <= coefficients[p.name] <= p.maximum + slack[p.name] for p in effect.parameters
    ) and all(coefficients[a] <= coefficients[b] + slack[a] + slack[b] for a, b in pairs)


def is_determined(effect: Effect, found: EffectEstimate) -> bool:
    """True where an inner parameter is known to better than its own size; else the effect is a simpler one."""
    inner = effect.profiled
    return inner is None or is_known_to_its_size(found.coefficients[inner.name], found.sigma[inner.name])


def is_within_its_friction(problem: EstimationProblem, effect: Effect, fitted: Fit) -> bool:
    """True but of a difference between directions larger than the friction that differs, up to two standard errors.

    One way it would drive the machine, but for other frictions. Not judged where the plant's own parameters
    contain that friction: they contain more than it; nor of dry friction, of which a constant torque is the difference.
    """
    if not effect.varies or isinstance(effect.enters, DryForce):
        return True
    (size,), (friction,) = effect.full_names, derive.effects.find(effect.varies).full_names
    module = problem.module
    if friction in module.ABSORBED:
        return True
    free = (n for n in (size, friction) if n in fitted.names)
    slack = MAX_STANDARD_ERRORS * sum(conservative_standard_error(fitted, n) for n in free)
    in_logs = [fitted.of_log(k) for k in range(len(problem.logs))]
    return all(abs(values[size]) <= values.get(friction, 0.0) + slack for values in in_logs)
