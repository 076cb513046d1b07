"""A resonance of innovations is found with its frequency and damping, and none where there is none."""

import numpy as np
import pytest
from scipy.signal import lfilter

from wheelpend.diagnosis.likelihood.resonance import resonance_of

INTERVAL = 1e-3  # s
SAMPLES = 20_000


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def ringing(frequency, damping, seed, size):
    """Noise through an oscillator of this frequency [Hz] and damping ratio, of so large a root mean square."""
    rate = 2.0 * np.pi * frequency * INTERVAL
    radius = np.exp(-damping * rate)
    poles = [1.0, -2.0 * radius * np.cos(rate * np.sqrt(1.0 - damping**2)), radius**2]
    found = lfilter([1.0], poles, white(seed))
    return found * size / found.std()


@pytest.mark.parametrize(
    ("frequency", "damping"), [(97.0, 0.05), (97.0, 0.1), (250.0, 0.03), (30.0, 0.08), (50.0, 0.02), (200.0, 0.006)]
)
def test_a_ring_is_found_with_its_frequency_damping_and_share(frequency, damping):
    found = resonance_of([white(1) + ringing(frequency, damping, 2, 0.7)], INTERVAL, "x")
    assert found is not None and found.channel == "x" and found.repeats
    assert abs(found.frequency_hz / frequency - 1.0) < 0.05
    assert 0.6 * damping < found.damping < 1.6 * damping
    assert 0.2 < found.share < 0.45  # 0.49 / 1.49, less the skirts


def test_a_hum_is_too_sharp_to_have_a_damping():
    hum = 0.5 * np.sin(2.0 * np.pi * 50.0 * INTERVAL * np.arange(SAMPLES))
    found = resonance_of([white(3) + hum], INTERVAL, "x")
    assert found is not None and abs(found.frequency_hz - 50.0) < 0.5 and found.damping == 0.0


@pytest.mark.parametrize("colour", [[1.0], [1.0, -0.9], [1.0, 0.7]])
def test_noise_of_a_broad_colour_has_none(colour):
    found = [resonance_of([lfilter([1.0], colour, white(100 + seed))], INTERVAL, "x") for seed in range(40)]
    assert sum(f is not None for f in found) <= 1


@pytest.mark.parametrize("seed", [12, 23, 29])
def test_a_line_far_above_the_noise_is_fitted_without_leaving_the_range_of_numbers(seed):
    time = np.arange(SAMPLES) * INTERVAL
    loud = 1e5 * np.exp(-time) * np.sin(2.0 * np.pi * 40.0 * time)
    steady = 1e6 * np.sin(2.0 * np.pi * 17.0 * time)
    for signal in (loud, steady):  # a warning of overflow is an error here
        found = resonance_of([np.random.default_rng(seed).standard_normal(SAMPLES) + signal], INTERVAL, "x", 3)
        assert found is None or 10.0 < found.frequency_hz < 50.0


def test_a_gap_parts_what_is_looked_at_and_few_or_missing_samples_tell_nothing():
    signal = white(1) + ringing(97.0, 0.05, 2, 0.7)
    found = resonance_of([signal[:8000], signal[9000:]], INTERVAL, "x")
    assert found is not None and abs(found.frequency_hz - 97.0) < 5.0
    short = resonance_of(np.split(signal, 20), INTERVAL, "x")
    assert short is not None and abs(short.frequency_hz - 97.0) < 5.0
    assert resonance_of([signal[:300]], INTERVAL, "x") is None
    assert resonance_of([np.where(np.arange(SAMPLES) % 10, np.nan, signal)], INTERVAL, "x") is None
    assert resonance_of([], INTERVAL, "x") is None
