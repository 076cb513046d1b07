"""Error thresholds that decide how a fit is taken: over which horizon, and what counts as near the noise floor."""

from __future__ import annotations

DEFAULT_HORIZON_S = 0.5  # s, over which a prediction is judged
WRONG_START_ERROR_RATIO = 3.0  # an error this many times the noise floor may be that of a wrong start
MAX_EXPLAINED_ERROR_RATIO = 1.1  # error over noise floor above which something is still missing
MAX_NOISE_LEVEL_ERROR_RATIO = (
    1.02  # error over noise floor up to which a fit lies in the noise: what is missing, if anything, is small
)
