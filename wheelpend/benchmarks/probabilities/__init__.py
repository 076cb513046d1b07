"""Whether the probabilities of a diagnosis mean what they say.

In: logs with nothing, one effect, two, or one that is not in the library hidden in them, in shares that are known, of
sizes around what a log just shows. Out: one Outcome per log, a reliability table and its picture, docs/trust.md.
Question: of all answers with a probability of 0.7, are seven in ten right?

cases     what is hidden in which log, drawn by a fixed seed
trial     one log: made, diagnosed, and the truth beside it
runner    all of them, on all cores, resumed after an interruption
summary   reliability and score
page      docs/trust.md between its marks, and the reliability diagram
"""

from wheelpend.benchmarks.probabilities.cases import Case, plan
from wheelpend.benchmarks.probabilities.runner import run
from wheelpend.benchmarks.probabilities.trial import Outcome, try_case

__all__ = ["Case", "Outcome", "plan", "run", "try_case"]
