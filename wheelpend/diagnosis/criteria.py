"""Thresholds of the diagnosis that several of its modules share; one that a single module uses stands there."""

from __future__ import annotations

MIN_RELATIVE_ERROR_DECREASE = 0.005  # relative fall of the validation error below which an effect is not worth naming
MAX_EQUIVALENT_ERROR_DIFFERENCE = 0.01  # relative difference of validation errors within which effects are equivalent
MAX_EVALUATED_COST_RATIO = 2.0  # cost over the lowest one, up to which a partial refit goes on to validation
MIN_REMAINING_INFORMATION_SHARE = 1e-3  # of a column's information, beside other columns, below which it says nothing
MIN_WAVE_PHASE_RAD = 3.0  # rad of phase that a log must cover to show a wave
MAX_ADDED_EFFECTS = 4  # added one after the other before a search ends
MAX_BACKWARD_STEPS = 3  # times that a search is made again without an effect that proved needless beside others
SHORT_HORIZON_SHARE = 0.1  # of the horizon: segments so short that the problem is almost linear
MIDDLE_HORIZON_SHARE = 0.3  # of the horizon: segments on which refits are compared before the full ones
