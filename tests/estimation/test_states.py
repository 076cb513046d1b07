"""Initial states of segments, and of what the machine carries inside."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support import CONSTANTS, simulated
from tests.support import X as ROUNDED
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.shooting import Simulator
from wheelpend.kernels import load as kernels

X = {**ROUNDED, "X5": ROUNDED["X3"] * CONSTANTS["g"] / CONSTANTS["R"]}  # of one mass: the paper's are rounded
KNOWN = {**X, **CONSTANTS, "L": 0.716}


@lru_cache
def freed(*names):
    """The library with this free inside the machine."""
    return kernels.library_module("wheel_pendulum", {}, (), names)


def test_a_segment_begins_with_what_the_one_before_hands_on():
    from wheelpend.estimation.prediction import segments_rms_error
    from wheelpend.estimation.segments import Segments
    from wheelpend.estimation.states import fit_states, initial_states

    log = simulated(duration=6.0, drive_compliance__stiffness=50.0, drive_compliance__damping=0.1)
    module = freed("twist")
    values = {**KNOWN, "drive_compliance.stiffness": 50.0, "drive_compliance.damping": 0.1}
    bounds = np.array([[k, k + 500] for k in range(0, 6000, 500)])
    part = Segments(log, np.array([2 * np.pi / 60000 / np.sqrt(12), 0.00873, 0.00873]), bounds)
    _, shot = fit_states(
        Simulator(module, 1e-3), part, initial_states(module, part), kernel_parameters(module, values, log)
    )
    assert segments_rms_error(part, shot) == pytest.approx(1.0, abs=0.05)


def test_a_free_play_is_refitted_from_nearby():
    from wheelpend import Model
    from wheelpend.estimation.continuation import fit_segments
    from wheelpend.estimation.data import prepare
    from wheelpend.estimation.problem import with_stable_step

    problem = prepare(Model.default(), [simulated(seed=3, duration=8.0, backlash__gap=0.03)]).with_candidates(
        "backlash"
    )
    near = {n: 1.03 * v if n.startswith("X") else v for n, v in {**KNOWN, **ROUNDED}.items()}
    problem = with_stable_step(problem, near)
    fitted = fit_segments(
        problem, problem.data.estimation, {**near, "backlash.gap": 0.028}, [*problem.base, "backlash.gap"], rounds=40
    )
    assert fitted.values["backlash.gap"] == pytest.approx(0.03, abs=3e-4)
    assert fitted.error < 1.1


def test_a_segment_alone_is_begun_where_least_squares_puts_it():
    from wheelpend.estimation.segments import Segments
    from wheelpend.estimation.states import initial_states, sequential_states

    log = simulated(duration=3.0, drive_compliance__stiffness=50.0, drive_compliance__damping=0.1)
    module = freed("twist")
    parameters = kernel_parameters(
        module, {**KNOWN, "drive_compliance.stiffness": 50.0, "drive_compliance.damping": 0.1}, log
    )
    part = Segments(log, np.array([2 * np.pi / 60000 / np.sqrt(12), 0.00873, 0.00873]), np.array([[0, 400]]))
    begun = initial_states(module, part)
    found = sequential_states(Simulator(module, 1e-3), part, begun, parameters, 8)

    def residual(state):
        shot = Simulator(module, 1e-3).shoot(part, state[None], parameters)
        return shot.residual[:400][np.isfinite(shot.residual[:400])]

    best = least_squares(residual, begun[0], x_scale=np.abs(begun[0]) + 1e-2, xtol=1e-12, ftol=1e-12)
    assert np.sum(residual(found[0]) ** 2) == pytest.approx(2.0 * best.cost, rel=1e-5)


def test_first_guesses_come_from_a_parabola_or_what_the_points_allow():
    from wheelpend.estimation.first_guess import parabolas

    t = np.array([0.0, 0.011, 0.019, 0.031])
    parabola, gap = 3.0 - 2.0 * t + 7.0 * t**2, np.nan
    signals = np.array([parabola, [1.0, gap, gap, 1.62], [gap, 4.0, gap, gap], [gap] * 4])
    found, _ = parabolas(np.tile(t, (4, 1)), signals)
    assert found[:3] == pytest.approx(np.array([[3.0, -2.0], [1.0, 20.0], [4.0, 0.0]]))
    assert np.isnan(found[3]).all()
