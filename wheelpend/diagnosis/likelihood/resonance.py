"""Resonances of a filter's innovations: narrow bands in which a model misses far more than around them.

What is elastic and was not modelled rings at a frequency of its own. White innovations have the same power everywhere;
innovations behind a random force of another colour have a slope or a broad hump, which a resonance stands out of.
Source: Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. AU-15 (1967) 70.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.estimation.segments import contiguous_ranges

MAX_WINDOW_SAMPLES = 1024
MIN_WINDOWS = 16  # of which a spectrum is the mean, each overlapping the next by half
MIN_WINDOW_SAMPLES = 64
NEIGHBOURHOOD_SHARE, MIN_NEIGHBOURS = 0.5, 8  # of a frequency, and lines: to either side of a band
MIN_LINE = 4  # of a spectrum, below which a band is a trend of the window
MIN_HEIGHT = 3.0  # times the median of a band's neighbourhood
MAX_DAMPING = 0.2  # from there on it is a hump
MIN_HALF_WIDTH = 0.25  # lines of a spectrum, below which a band is too sharp to tell its damping
SIGNIFICANCE_LEVEL = 1e-3  # of all frequencies and channels together
MAX_INTERVAL_DIFFERENCE = 0.01  # relative, of the sample intervals of logs whose spectra are averaged
MAX_MISSING_SHARE = 0.02  # of a channel's readings
MIN_REPEATING_SHARE = 0.05  # of a channel's mean square, from which on a resonance leaves something unexplained


@dataclass(frozen=True)
class Resonance:
    """A narrow band of the innovations of one channel."""

    channel: str
    frequency_hz: float
    damping: float  # ratio: half the width between half-power points, over the frequency; 0 where it is too sharp
    share: float  # of the channel's mean square that the band has beyond what is around it
    p_value: float  # of so high a band anywhere in white innovations

    @property
    def repeats(self) -> bool:
        """True where it is so much of what the filter misses that something is unexplained."""
        return self.share >= MIN_REPEATING_SHARE

    def to_json(self) -> dict[str, Any]:
        """The resonance under the keys of JSON."""
        return {
            "channel": self.channel,
            "frequency_hz": self.frequency_hz,
            "damping": self.damping,
            "share": self.share,
            "p_value": self.p_value,
        }


def resonances(model: FilteredModel) -> tuple[Resonance, ...]:
    """The strongest resonance of each channel's innovations in the estimation logs, where it has one."""
    filters = model.estimator.problem
    runs = zip(filters.segments, filters.innovations(model.point.theta, model.point.sources), strict=True)
    pieces = [(s.log.dt, w[a:b, :, 0]) for s, w in runs for a, b in contiguous_ranges(s.bounds)]
    intervals = np.array([dt for dt, _ in pieces])
    alike = np.abs(intervals[:, None] / intervals - 1.0) < MAX_INTERVAL_DIFFERENCE
    chosen = alike[int(np.argmax(alike @ [len(w) for _, w in pieces]))]  # one spectrum is of one interval
    pieces = [piece for piece, is_chosen in zip(pieces, chosen, strict=True) if is_chosen]
    interval = float(np.mean(intervals[chosen]))
    names = model.problem.module.OUTPUTS
    found = (resonance_of([w[:, k] for _, w in pieces], interval, name, len(names)) for k, name in enumerate(names))
    return tuple(r for r in found if r is not None)


def resonance_of(pieces: list[np.ndarray], interval: float, channel: str, channels: int = 1) -> Resonance | None:
    """The strongest resonance of a channel's innovations, in pieces (n,) of one sample interval [s]; None without."""
    spectrum = _spectrum(pieces, interval)
    if spectrum is None:
        return None
    from scipy.stats import chi2  # imported late: scipy.stats takes longer to load than most commands

    frequency, power, windows = spectrum
    around = np.array([np.median(power[near]) for near in _neighbours(len(power))])
    height = power / around
    tried = len(power) - MIN_LINE
    p_values = np.minimum(1.0, chi2.sf(windows * height, windows) * tried * channels)
    standing_out = (np.arange(len(power)) >= MIN_LINE) & (p_values < SIGNIFICANCE_LEVEL) & (height > MIN_HEIGHT)
    if not standing_out.any():
        return None
    peak = int(np.argmax(np.where(standing_out, power - around, 0.0)))
    centre, half_width, rise = _fitted_peak(height, peak)
    damping = half_width / centre
    if not damping < MAX_DAMPING:
        return None
    share = float((rise * around).sum() / power[1:].sum())
    return Resonance(channel, centre * float(frequency[1]), damping, min(share, 1.0), float(p_values[peak]))


def _fitted_peak(height: np.ndarray, peak: int) -> tuple[float, float, np.ndarray]:
    """Place and half the width [lines] of a peak above a sloping background, and its height at every line.

    By Whittle's likelihood, in which each line scatters in proportion to its mean. Of what is too sharp the width is 0.
    """
    from scipy.optimize import minimize  # imported late, as above

    lines = np.arange(len(height))
    near = lines[[*_neighbours(len(height))][peak]]
    reach = 0.5 * float(near[-1] - near[0])

    def rise(point: np.ndarray, at: np.ndarray) -> np.ndarray:
        return np.exp(point[2]) / (1.0 + ((at - peak - point[0]) / np.exp(point[1])) ** 2)

    def cost(point: np.ndarray) -> float:
        mean = np.exp(point[3] + point[4] * (near - peak) / reach) + rise(point, near)
        return float(np.sum(height[near] / mean + np.log(mean)))

    start = np.array([0.0, np.log(1.5), np.log(height[peak] - 1.0), 0.0, 0.0])
    extent, scatter = np.log(len(height)), np.log(height[near].max() / max(height[near].min(), 1e-12))
    bounds = [  # the peak within its neighbourhood, no wider than the spectrum; the background within what is there
        (-reach, reach), (np.log(0.1 * MIN_HALF_WIDTH), extent), (0.0, start[2] + scatter),
        (-scatter, scatter), (-scatter, scatter),
    ]  # fmt: skip
    best = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options={"maxiter": 5000, "maxfev": 5000}).x
    half_width = float(np.exp(best[1]))
    return (
        float(np.clip(peak + best[0], 1.0, len(height) - 1.0)),
        half_width * (half_width > MIN_HALF_WIDTH),
        rise(best, lines),
    )


def _spectrum(pieces: list[np.ndarray], interval: float) -> tuple[np.ndarray, np.ndarray, int] | None:
    """Frequencies [Hz], mean power there, and the number of windows; None of too few samples, or too many missing."""
    from scipy.signal import welch  # imported late, as above

    whole = np.concatenate([np.zeros(0), *pieces])
    if not len(whole) or np.mean(~np.isfinite(whole)) > MAX_MISSING_SHARE:
        return None
    size, long = MAX_WINDOW_SAMPLES, [np.nan_to_num(p) for p in pieces]
    while sum(2 * len(p) // size - 1 for p in long if len(p) >= size) < MIN_WINDOWS:
        size //= 2
        if size < MIN_WINDOW_SAMPLES:
            return None
    long = [p for p in long if len(p) >= size]
    counts = [2 * len(p) // size - 1 for p in long]
    found = [welch(p, 1.0 / interval, nperseg=size) for p in long]
    return found[0][0], np.average([power for _, power in found], axis=0, weights=counts), sum(counts)


def _neighbours(lines: int) -> Iterator[slice]:
    """Of each line of a spectrum those around it: as many below as above, so that a slope has its median there."""
    for line in range(lines):
        half = max(MIN_NEIGHBOURS, min(round(NEIGHBOURHOOD_SHARE * line), lines - 1 - line))
        yield slice(max(line - half, 0), line + half + 1)
