"""Logs of machines on a bench, simulated apart from the tool's simulator."""

import numpy as np

from wheelpend import Log
from wheelpend.benchmarks.benches.machines import Bench, counted, motion


def swing_log(
    rate_hz: float, span_s: float, counts: int, begin: float, inertia: float, *,
    zero: float = 0.0, viscous: float = 0.0, dry: float = 0.0, quadratic: float = 0.0,
) -> Log:  # fmt: skip
    """A pendulum let go at an angle [rad], until it stops and beyond; forces in units of its weight."""
    t = np.arange(round(span_s * rate_hz)) / rate_hz
    seen = motion(Bench(inertia, 1.0, viscous, dry, quadratic), 1.0 / rate_hz, np.zeros(t.size), begin) + zero
    return Log("swing", t, np.zeros(t.size), counted(seen, counts)[:, None], ("theta_1",), rates={})


def shaft_log(
    rate_hz: float, volts: np.ndarray, counts: int, inertia: float, viscous: float, *,
    dry: float = 0.0, quadratic: float = 0.0, limit: float = np.inf, back_emf: float = 0.0, supply: float = 0.0,
) -> Log:  # fmt: skip
    """A motor's shaft under a voltage (N,), held from row to row and limited [V]; forces in V.

    With a supply [V] its driver lets it coast in the pauses of its pulses.
    """
    t = np.arange(len(volts)) / rate_hz
    bench = Bench(inertia, 0.0, viscous, dry, quadratic, back_emf, supply)
    seen = motion(bench, 1.0 / rate_hz, np.clip(volts, -limit, limit))
    return Log("shaft", t, volts, counted(seen, counts)[:, None], ("theta_m",), rates={})
