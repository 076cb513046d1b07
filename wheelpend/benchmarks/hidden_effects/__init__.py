"""How often the diagnosis is right: logs with hidden effects, from this project's simulator and from another engine.

cases    which logs
engine   logs from MuJoCo, which shares no code with this project
scene    the robot as MuJoCo's bodies, joints and tendons
laws     forces, voltage and sensors around it
shipped  the engine's logs in data/
trial    one log: hide, explain, compare with the truth
study    all of them, on all cores, to be resumed after an interruption
summary  rates with their confidence intervals
page     docs/benchmark.md
"""

from wheelpend.benchmarks.hidden_effects.cases import Case, plan
from wheelpend.benchmarks.hidden_effects.runner import run
from wheelpend.benchmarks.hidden_effects.summary import Summary, summarise
from wheelpend.benchmarks.hidden_effects.trial import Outcome, try_case

__all__ = ["Case", "Outcome", "Summary", "plan", "run", "summarise", "try_case"]
