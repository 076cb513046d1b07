"""The methods of identification, and the checks of what may be set for each."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Literal, NamedTuple

import numpy as np

from wheelpend.errors import Failure, did_you_mean
from wheelpend.identification.instrumental import IV_TIME_CONSTANTS_S

METHOD_NAMES = ("filter_error", "shooting", "filtered", "iv", "recursive", "energy", "inverse", "differentiation")
DEFAULT_METHOD = "filter_error"
LEAST_SQUARES = ("differentiation", "filtered", "recursive", "energy")  # methods that noise in the regressor biases
PAPER_TAU = (2.25, 6.5)  # s, the paper's Tables 1 and 2
DEFAULT_TAU: dict[str, tuple[float, ...]] = {
    "filtered": PAPER_TAU,
    "recursive": PAPER_TAU,
    "iv": IV_TIME_CONSTANTS_S,
    "energy": (np.inf,),
}
IS_FIRST_ORDER_HOLD = {"zero": False, "first": True}
DEFAULT_HOLD = {"filtered": "first", "recursive": "zero"}  # zero is the paper's (41)
TauOption = Sequence[float] | float | Literal["auto"] | None

TAU_RANGE_S = 1e-6, 1e6  # s; beyond them a filter follows every sample of any log, or none
MIN_FORGETTING = 0.5  # below it the last sample outweighs all others together


class RegressionOptions(NamedTuple):
    """A regression method with its settings, checked."""

    method: str
    tau: tuple[float, ...]  # s; empty where the method has no filters
    hold: str | None  # zero or first; None where the method does not interpolate
    forgetting: float


def check_method(method: str) -> None:
    """Raise Failure where no method has this name."""
    if method not in METHOD_NAMES:
        raise Failure(
            f"No method named '{method}'. Known methods: {', '.join(METHOD_NAMES)}.{did_you_mean(method, METHOD_NAMES)}"
        )


def check_options(method: str, tau: TauOption, hold: str | None, forgetting: float | None) -> RegressionOptions:
    """Settings of a method, its own ones where none are given; raises Failure for those that cannot be."""
    return RegressionOptions(method, check_tau(method, tau), check_hold(method, hold), check_forgetting(forgetting))


def check_tau(method: str, tau: TauOption) -> tuple[float, ...]:
    """Time constants [s] of a method; its own where none are given or they are to be chosen for the log."""
    default = DEFAULT_TAU.get(method, ())
    if tau is None or (tau == "auto" and len(default) != 1) or not default:
        return default
    if tau == "auto":
        raise Failure(f"The time constants of '{method}' cannot be chosen with auto. Give --tau T in s, or none.")
    assert not isinstance(tau, str)
    given = tuple(map(float, tau)) if isinstance(tau, Sequence) else (float(tau),)
    if len(given) != len(default):
        needs = "one time constant" if len(default) == 1 else "two time constants"
        raise Failure(f"The method '{method}' takes {needs} in s, but {len(given)} came. "
                      f"Give --tau {','.join(('0.5', '1')[: len(default)])}.")  # fmt: skip
    least, most = TAU_RANGE_S
    if not all(least <= t <= most for t in given) and given != (np.inf,):
        raise Failure(f"Time constants must be positive and finite, in s, not {', '.join(f'{t:g}' for t in given)}. "
                      f"Give some from {least:g} to {most:g}.")  # fmt: skip
    return given


def check_hold(method: str, hold: str | None) -> str | None:
    """Interpolation of measured signals between samples, zero or first; None for methods that use none."""
    if hold is not None and hold not in IS_FIRST_ORDER_HOLD:
        raise Failure(
            f"No hold named '{hold}'. Known holds: {', '.join(IS_FIRST_ORDER_HOLD)}."
            f"{did_you_mean(hold, IS_FIRST_ORDER_HOLD)}"
        )
    return (hold or DEFAULT_HOLD[method]) if method in DEFAULT_HOLD else None


def check_forgetting(forgetting: float | None) -> float:
    """Factor by which a sample's weight falls with each that follows; 1 where none is given."""
    if forgetting is None:
        return 1.0
    if not MIN_FORGETTING <= forgetting <= 1.0:
        raise Failure(f"The forgetting factor must be at least {MIN_FORGETTING:g} and at most 1, not {forgetting:g}. "
                      "1 forgets nothing; 0.9999 remembers about 10000 samples.")  # fmt: skip
    return float(forgetting)


def unused_option_warnings(method: str, tau: TauOption, hold: str | None, forgetting: float | None) -> tuple[str, ...]:
    """A warning for each option that is given and that the method does not use."""
    ignored: list[tuple[str, object, Collection[str]]] = [
        ("--tau", tau, DEFAULT_TAU),
        ("--hold", hold, DEFAULT_HOLD),
        ("--forgetting", forgetting, ("recursive",)),
    ]
    return tuple(f"{option} is not used by the method '{method}'."
                 for option, given, users in ignored if given is not None and method not in users)  # fmt: skip
