"""Error thresholds that decide how a fit is taken: over which horizon, and what counts as near the noise floor."""

from __future__ import annotations

HORIZON = 0.5  # s, over which a prediction is judged
FAR = 3.0  # an error this many times the noise floor may be that of a wrong start
EXPLAINED = 1.1  # error over noise floor above which something is still missing
VISIBLE = 1.02  # error over noise floor up to which a fit lies in the noise: what is missing, if anything, is small
