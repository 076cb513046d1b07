"""Contenders in turn: machines drift by half from minute to minute, ratios within one run do not."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter, process_time

TURN_TIME_S = 0.05  # s

Contender = Callable[[], float]  # does the work once and returns how long it took [s]


def timed(work: Callable[[], object], clock: Callable[[], float] = process_time) -> Contender:
    """Contender that does this work, by default in processor time, which other processes disturb least.

    Work on several cores, or in other processes, takes perf_counter instead.
    """

    def once() -> float:
        begin = clock()
        work()
        return clock() - begin

    return once


def best_in_turn(
    *contenders: Contender, seconds: float = 3.0, min_rounds: int = 3, turn: float = TURN_TIME_S
) -> list[float]:
    """Best time of each contender [s], over rounds in which they take turns: at least so many, for so many seconds."""
    best, begin, rounds = [float("inf")] * len(contenders), perf_counter(), 0
    while rounds < min_rounds or perf_counter() - begin < seconds:
        best = [min(b, one_turn(contender, turn)) for b, contender in zip(best, contenders, strict=True)]
        rounds += 1
    return best


def one_turn(contender: Contender, seconds: float) -> float:
    """Best time of short work done again and again [s]: what ran before it is then out of the caches and the clock."""
    best, begin = contender(), perf_counter()
    while perf_counter() - begin < seconds:
        best = min(best, contender())
    return best
