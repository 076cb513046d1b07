"""Horizon of predictions, and the ratios of error to noise floor that classify a fit."""

from __future__ import annotations

DEFAULT_HORIZON_S = 0.5  # s, length of the segments over which a prediction error is taken
WRONG_START_ERROR_RATIO = 3.0  # error over noise floor from which a fit may have ended in a local minimum
MAX_EXPLAINED_ERROR_RATIO = 1.1  # error over noise floor above which something is still missing
MAX_NOISE_LEVEL_ERROR_RATIO = 1.02  # error over noise floor up to which a fit is at the noise level
