"""The hit rate of the diagnosis on logs with hidden effects, from this project's simulator and from another engine.

In: the effect library and the paper's robot. Out: one Outcome per log, their Summary, docs/benchmark.md and the tables
of docs/statistics.md. Question: how often is a hidden effect named, and how often one that is not there?

cases             the logs to be made: effects, sizes, commands, sources
engine            logs from MuJoCo, which shares no code with this project
scene             the robot as MuJoCo's bodies, joints and tendons
laws              forces, voltage and sensors around it
shipped           the engine's logs in data/
trial             one log: hide, explain, compare with the truth
runner            all of them, on all cores, resumed after an interruption
summary           rates with their confidence intervals
page              docs/benchmark.md, after page.md
nonideal_sensors  complete logs with coloured noise, outliers, coarse encoders, jitter
alarms            false alarms on those, coverage of intervals, p-values of single effects
"""

from wheelpend.benchmarks.hidden_effects.cases import Case, plan
from wheelpend.benchmarks.hidden_effects.runner import run
from wheelpend.benchmarks.hidden_effects.summary import Summary, summarise
from wheelpend.benchmarks.hidden_effects.trial import Outcome, try_case

__all__ = ["Case", "Outcome", "Summary", "plan", "run", "summarise", "try_case"]
