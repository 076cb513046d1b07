"""To which tolerance a committed number is compared: 1e-6 of itself, or more where that was measured to be needed.

Measured between two records of the same code on one processor: kernels compiled for it, and kernels compiled for a
generic one (NUMBA_CPU_NAME=generic) with the oldest routines of linear algebra and of NumPy
(OPENBLAS_CORETYPE=Nehalem, NPY_DISABLE_CPU_FEATURES of all beyond X86_V2), and between two processors, with and without
512-bit vectors. But for the rows of LOOSER nothing differed by more than 1e-6 of itself.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from differences import OF_ITS_KIND, Rule, Tolerance

USUAL = Tolerance(rtol=1e-6, atol=1e-9)


class Looser(NamedTuple):
    """A tolerance that some places need."""

    place: str  # regular expression of CHAIN.STEP.answer.KEY...
    tolerance: Tolerance


# Of each row the largest difference that was measured; the tolerance leaves room for other processors.
LOOSER = (
    # four seconds of a machine that the model does not describe: a deviance settles where it falls by less than 0.1,
    # which is a third of a standard error, between processors with and without 512-bit vectors: a fifth, biases 0.65
    Looser(
        r"campaign\.(identify|simulated)\.answer\.summary\.parameters\.X\d\.furthest\.log", OF_ITS_KIND
    ),  # of two alike
    Looser(r"campaign\.(identify|simulated)\.answer\.summary\.parameters\.", Tolerance(rtol=1.0, atol=1e-3)),
    Looser(r"campaign\.(identify|simulated)\.", Tolerance(rtol=0.4, atol=1e-3)),
    # the same fit from Python: 0.03
    Looser(r"python\.api\.stdout", Tolerance(rtol=0.1, atol=1e-3)),
    # a free-form law after a model that is far off, between the same: 0.04
    Looser(r"diagnose\.law\.answer\.", Tolerance(rtol=0.1, atol=1e-6)),
    # shape of a law that is not the one, between the same: 4e-5, of a p-value of 1e-41 0.3
    Looser(r"diagnose\.without\.answer\.candidates\[0\]\.p_discovery", Tolerance(rtol=1.0)),
    Looser(r"diagnose\.without\.answer\.candidates\[0\]\.sigma\.", Tolerance(rtol=1e-3)),
    # correlations near zero and quantiles of innovations, between the same: 8e-5
    Looser(r"\w+\.\w+\.answer\.residuals\.", Tolerance(rtol=1e-3, atol=1e-7)),
    # a stiffness at its upper bound, which the log does not determine: 0.7
    Looser(r"diagnose\.without\.answer\.candidates\[1\]\.(sigma\.|p_discovery)", Tolerance(rtol=1.0)),
    # a fit with a random force that these three seconds hardly tell from the model, between two processors: 0.1
    Looser(r"identify\.save\.", Tolerance(rtol=0.3, atol=1e-3)),
    # size and time of a random force that three seconds hardly tell from the model, between two processors: 0.024
    Looser(r"change\.remove\.model\.toml\[(74|75|79|80)\]", Tolerance(rtol=0.03)),
    # replicas of a closed loop, which is unstable, between two processors: 5e-3
    Looser(r"identify\.\w+\.answer\.bias\.", Tolerance(rtol=5e-2, atol=1e-9)),
    # what is left to chance, kept in the model file, between two processors: 4e-4
    Looser(r"\w+\.\w+\.model\.toml", Tolerance(rtol=1e-2, atol=1e-9)),
    # e to the minus of a large number, and no absolute tolerance, to which all of them would be zero: 2e-6
    Looser(r".*\.p_(value|discovery|confirmation)$", Tolerance(rtol=1e-4)),
    # instruments through filters so slow that they hardly determine anything: 7e-6
    Looser(r"identify_long\.iv_auto\.answer\.guide\.rows", Tolerance(rtol=1e-4, atol=1e-9)),
    # a likelihood that is flat, and settled once it falls by less than 0.1: not measured on another processor yet
    Looser(r".*\.answer\.(remainder|covariance|widening)", Tolerance(rtol=0.2, atol=1e-3)),
    # smallest of several factors, some of them 1e-7: 3e-3
    Looser(r"reproduce\.all\.answer\.choices.*\.smallest$", Tolerance(rtol=3e-2)),
    # two draws only, of estimates that these logs hardly determine: 2e-5
    Looser(r"reproduce\.all\.answer\.", Tolerance(rtol=2e-4, atol=1e-9)),
)


def rule(chain: str) -> Rule:
    """Tolerance of each place of a chain's committed results."""
    return lambda place: next((row.tolerance for row in LOOSER if re.match(row.place, chain + place)), USUAL)
