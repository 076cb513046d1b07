"""Diagnoses of a robot that is pushed at random: what is named, and what is named that is not there.

In: logs of an engine with a random force, and nothing, one effect, or one that is not in the library hidden in them.
Out: one Outcome per log, and rates beside their goals in docs/statistics.md.
Question: is the right effect named where nothing ever reaches sensor noise?

cases     what is hidden in which log, and which force acts beside it
trial     one log: made, diagnosed, and the truth beside it
runner    all of them, on all cores, resumed after an interruption
page      rates, and every log that was not right, in docs/statistics.md between their marks
"""

from wheelpend.benchmarks.pushed.cases import Case, plan
from wheelpend.benchmarks.pushed.runner import run
from wheelpend.benchmarks.pushed.trial import Outcome, try_case

__all__ = ["Case", "Outcome", "plan", "run", "try_case"]
