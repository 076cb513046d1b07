"""Whether the filter-error method's numbers are right: its precision, its intervals, and the random forces it finds.

In: the paper's robot, complete or on rough ground. Out: one Answer per log, rates and ratios, a section of
docs/statistics.md. Questions: is the estimate as precise as the record allows, do its intervals hold the truth, is the
force found where it is, as large and as slow as it is, and does it leave alone what is slow and lawful?

bound     the Cramér-Rao bound of a record, by shooting segments tied by continuity
forces    random forces to be played, of the kind that the filter assumes and of others
machine   the robot in MuJoCo with such a force
trial     one log: made, identified, compared with the truth
runner    all of them, on all cores, resumed after an interruption
summary   rates and ratios with their intervals
page      the section of docs/statistics.md
"""

from wheelpend.benchmarks.random_force.runner import plan, run
from wheelpend.benchmarks.random_force.trial import Answer, Case, try_case

__all__ = ["Answer", "Case", "plan", "run", "try_case"]
