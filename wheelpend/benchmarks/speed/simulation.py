"""Rows: the closed loop, one trajectory and many."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from time import perf_counter

import numpy as np

from wheelpend import parallel
from wheelpend.benchmarks.speed import reference
from wheelpend.benchmarks.speed.environment import OWN_ENVIRONMENT_PATH, peer
from wheelpend.benchmarks.speed.record import NotMeasurableError, Times
from wheelpend.benchmarks.speed.setting import Loop, Setting
from wheelpend.benchmarks.speed.timing import Contender, best_in_turn, timed
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S

BATCH_SIZE = 1000  # trajectories
RECORD_INTERVAL_SAMPLES = 100  # samples between records of a batch
MAX_STEP_S = 1.5 * SAMPLE_INTERVAL_S  # s, the longest: one step per sample, whatever rounding does


def against_c(s: Setting) -> Times:
    """One trajectory, per step."""
    loop = s.loop()
    work, record = c_closed_loop(loop)
    work()
    states, _, voltage = generated_closed_loop(s, loop)()
    ran = record[:, :, 0]
    reference.require_agreement("closed loop", np.column_stack([states, voltage]), ran, np.abs(ran).max(axis=0))
    return Times(*best_in_turn(timed(generated_closed_loop(s, loop)), timed(work))).per(len(loop.t) - 1)


def against_peer(s: Setting, name: str) -> Times:
    """One trajectory, per step, against another package."""
    loop = s.loop()
    with peer(OWN_ENVIRONMENT_PATH if name == "lambdify" else s.peers, name, **loop._asdict()) as (contender, result):
        if name != "mujoco":  # which moves another machine
            states = generated_closed_loop(s, loop)()[0]
            reference.require_agreement(f"closed loop by {name}", states[-1], result, np.abs(states).max(axis=0), 1e-6)
        return Times(*best_in_turn(timed(generated_closed_loop(s, loop)), contender)).per(len(loop.t) - 1)


def batch_against_c(s: Setting) -> Times:
    """Many trajectories on one core, per step of one of them."""
    loop, mine, theirs = s.loop(), Batch(s.loop(), BATCH_SIZE), Batch(s.loop(), BATCH_SIZE)
    mine.advance(s)
    work = theirs.in_c()
    work()
    scale = np.abs(theirs.record).max(axis=(0, 2))[:, None]
    reference.require_agreement("batch", mine.record, theirs.record, scale)
    reference.require_agreement("batch", mine.states, theirs.states, scale[:-1, 0])
    return Times(*best_in_turn(timed(partial(mine.advance, s)), theirs.restarted(work))).per(
        BATCH_SIZE * (len(loop.t) - 1)
    )


def batch_on_two_cores(s: Setting) -> Times:
    """Many trajectories in two threads against one, per step of one of them."""
    if parallel.cores() < 2:
        raise NotMeasurableError("this process may use one core only")
    loop, whole = s.loop(), Batch(s.loop(), BATCH_SIZE)
    halves = [Batch(loop, BATCH_SIZE // 2) for _ in range(2)]
    whole.advance(s)
    with ThreadPoolExecutor(2) as pool:
        both = timed(lambda: list(pool.map(lambda half: half.advance(s), halves)), perf_counter)
        return Times(*best_in_turn(both, timed(partial(whole.advance, s), perf_counter))).per(
            BATCH_SIZE * (len(loop.t) - 1)
        )


class Batch:
    """Robots that differ a little, each under the same controller."""

    def __init__(self, loop: Loop, count: int):
        rng = np.random.default_rng(0)
        self.loop = loop
        self.gains = np.tile(loop.gains, (count, 1))  # (count, 3)
        self.parameters = loop.parameters * rng.uniform(0.95, 1.05, (count, len(loop.parameters)))
        self.begin = rng.normal(size=(count, len(loop.state))) * 0.01
        self.states = self.begin.copy()  # (count, NX), the last ones afterwards
        self.record = np.empty((-(-len(loop.t) // RECORD_INTERVAL_SAMPLES), len(loop.state) + 1, count))

    def advance(self, s: Setting) -> None:
        """Run the generated kernel from the beginning; raises NotMeasurableError while there is none."""
        kernel = getattr(s.lean, "closed_loop_batch", None)
        if kernel is None:
            raise NotMeasurableError("the generated module has no closed_loop_batch")
        self.states[:] = self.begin
        l = self.loop
        kernel(
            l.t,
            l.reference,
            l.rate,
            self.gains,
            self.states,
            self.parameters,
            MAX_STEP_S,
            RECORD_INTERVAL_SAMPLES,
            self.record,
        )

    def in_c(self) -> Callable[[], object]:
        """The C loop from the states as they are, one robot after the other."""
        l = self.loop
        return reference.call("closed_loop", len(l.t), l.t, l.reference, l.rate, len(self.states), self.gains,
                              self.states, self.parameters, RECORD_INTERVAL_SAMPLES, self.record)  # fmt: skip

    def restarted(self, work: Callable[[], object]) -> Contender:
        """The C loop from the beginning."""

        def once() -> None:
            self.states[:] = self.begin
            work()

        return timed(once)


def generated_closed_loop(s: Setting, loop: Loop) -> Callable[[], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The generated closed loop: states, readings and voltage."""
    noise, quantum = np.zeros((len(loop.t), s.lean.NY)), np.zeros(s.lean.NY)
    return partial(s.lean.closed_loop, *loop, noise, quantum, MAX_STEP_S)


def c_closed_loop(loop: Loop) -> tuple[Callable[[], object], np.ndarray]:
    """The C loop from the beginning, and its record (N, NX + 1, 1) of states and voltage."""
    record, state = np.empty((len(loop.t), len(loop.state) + 1, 1)), loop.state.copy()
    run = reference.call("closed_loop", len(loop.t), loop.t, loop.reference, loop.rate, 1, loop.gains, state,
                         loop.parameters, 1, record)  # fmt: skip

    def work() -> None:
        state[:] = loop.state
        run()

    return work, record
