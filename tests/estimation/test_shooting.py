"""The same call gives the same bits, on one thread and on several."""

import numpy as np

from tests.support import CONSTANTS, X, simulated
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import initial_states
from wheelpend.kernels.load import library_module
from wheelpend.logs.log import Log, segment_bounds
from wheelpend.parallel import thread_budget


def test_the_same_call_gives_the_same_bits(lean):
    log: Log = simulated(duration=3.0)
    part = Segments(log, np.array([1e-4, 1e-2, 1e-2]), segment_bounds(log, 0.2))
    states, parameters = initial_states(lean, part), kernel_parameters(lean, X, log)
    one, two = (Simulator(lean).shoot(part, states, parameters, range(7)) for _ in range(2))
    assert one.gram.tobytes() == two.gram.tobytes()
    assert one.residual.tobytes() == two.residual.tobytes()
    assert simulated(duration=3.0).measured.tobytes() == simulated.__wrapped__(duration=3.0).measured.tobytes()


def test_threads_share_segments_without_a_trace(lean, monkeypatch):
    log = simulated(duration=3.0)
    part = Segments(log, np.array([1e-4, 1e-2, 1e-2]), segment_bounds(log, 0.2))
    states, parameters = initial_states(lean, part), kernel_parameters(lean, X, log)
    monkeypatch.setattr("wheelpend.parallel.threads", lambda: 2)
    shared = Simulator(lean).shoot(part, states, parameters, range(7))
    with thread_budget.joined(), thread_budget.joined():
        assert thread_budget.share() == 1
        alone = Simulator(lean).shoot(part, states, parameters, range(7))
    assert thread_budget.share() == 2
    assert shared.gram.tobytes() == alone.gram.tobytes()
    assert shared.residual.tobytes() == alone.residual.tobytes()


def test_the_slope_of_an_absent_force_with_a_memory_is_the_same_on_any_number_of_threads(monkeypatch):
    module = library_module("wheel_pendulum", {})
    log = simulated(duration=3.0)
    part = Segments(log, np.array([1e-4, 1e-2, 1e-2]), segment_bounds(log, 0.2))
    states, parameters = initial_states(module, part), kernel_parameters(module, {**X, **CONSTANTS}, log)
    [size] = module.HYSTERESIS_SIZES
    assert parameters[size] == 0.0
    monkeypatch.setattr("wheelpend.parallel.threads", lambda: 2)
    shared = Simulator(module).shoot(part, states, parameters, [size])
    with thread_budget.joined(), thread_budget.joined():
        alone = Simulator(module).shoot(part, states, parameters, [size])
    assert shared.gram.tobytes() == alone.gram.tobytes() and shared.gram[:, -2, -2].all()
