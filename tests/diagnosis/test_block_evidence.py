"""Blocks of validation data: pieces of one roll-out are not independent, whole segments are."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, diagnose
from wheelpend.diagnosis.block_evidence import (
    falls_in_blocks,
    falls_over_segments,
    p_value_of_rest,
    relative_lead_statistic,
)
from wheelpend.diagnosis.likelihood.held_out import one_sided_p_value

SAMPLES, LENGTH = 400, 50


def part(segments=SAMPLES // LENGTH):
    begins = np.arange(segments) * LENGTH
    return SimpleNamespace(bounds=np.stack([begins, begins + LENGTH], axis=1))


def growing_errors(random, segments=SAMPLES // LENGTH):
    """Residuals (N, 1) that grow from the start of every segment to an end at random."""
    return np.concatenate([random.standard_normal() * np.linspace(0.0, 1.0, LENGTH) for _ in range(segments)])[:, None]


def test_the_fall_of_whole_segments_is_summed_and_no_piece_of_one_counts_alone():
    before, after = np.ones((SAMPLES, 2)), np.full((SAMPLES, 2), 0.5)
    found, relative = falls_over_segments([part()], [before], [after])
    assert len(found) == 8 and np.allclose(found, 0.5 * LENGTH * 2 * 0.75)
    assert relative == pytest.approx((1.0 - 0.25) / (1.0 + 0.25))
    before[:LENGTH] = np.nan  # not judged: the log's own parameters are estimated there
    assert falls_over_segments([part()], [before], [after]).shape == (2, 7)
    assert falls_over_segments([part(), part()], [before, after], [after, after]).shape == (2, 15)
    assert falls_over_segments([], [], []).shape == (2, 0)


def test_no_single_segment_makes_a_rise_clear():
    before, after = np.ones((SAMPLES, 2)), np.full((SAMPLES, 2), 0.99)
    after[:LENGTH] = 1e3
    falls, relative = falls_over_segments([part()], [before], [after])
    assert falls[0] < -1e6 and relative[0] == pytest.approx(-1.0, abs=1e-5) and relative[1:].max() < 0.02
    after[:LENGTH] = np.inf
    assert falls_over_segments([part()], [before], [after])[1, 0] == -1.0


def test_models_that_are_alike_are_told_apart_no_more_often_than_the_level_says():
    random = np.random.default_rng(3)
    found = [
        one_sided_p_value(falls_over_segments([part(4)], [growing_errors(random, 4)], [growing_errors(random, 4)])[0])
        for _ in range(600)
    ]
    assert 0.005 < np.mean(np.array(found) < 0.05) < 0.075


def relative_fall(before, after):
    return (before - after) / (before + after)


@pytest.mark.parametrize("blocks", [1, 2, 3, 4, 8, 20])
def test_errors_at_random_lead_by_their_relative_squares_in_a_tenth_at_most_however_few_blocks_there_are(blocks):
    random = np.random.default_rng(blocks)
    pairs = [random.standard_normal((2, blocks)) ** 2 for _ in range(2000)]
    found = [relative_lead_statistic(relative_fall(one, other), np.zeros(blocks)) for one, other in pairs]
    assert np.mean(np.array(found) >= 2.0) <= 0.1
    assert blocks < 3 or np.mean(np.array(found) >= 1.0) >= 0.08  # nor is it of no power


def test_two_blocks_lead_where_both_errors_are_far_smaller_and_one_never_does():
    base = np.array([3.0, 900.0])
    far, near = relative_fall(base, np.array([1e-4, 0.1])), relative_fall(base, np.array([1.5, 600.0]))
    assert relative_lead_statistic(far, near) > 2.5 and relative_lead_statistic(near, far) < -2.5
    assert relative_lead_statistic(far[:1], near[:1]) < 2.0 and relative_lead_statistic(near, 0.0 * near) < 2.0
    lost, exact = np.array([-1.0, -1.0]), np.array([1.0, 1.0])  # one that ran away, one without any error
    assert relative_lead_statistic(exact, lost) == pytest.approx(2.0**1.5, rel=1e-6)
    assert relative_lead_statistic(np.zeros(0), np.zeros(0)) == 0.0


@pytest.mark.slow
def test_a_log_too_short_to_hold_anything_out_is_judged_on_what_was_fitted_and_by_no_traceback():
    logs = [simulated(duration=0.8, seed=seed, sample=0.002, coulomb_drive__torque=0.3) for seed in (3, 4)]
    named = [[c.effect for c in diagnose(Model.default(), [log]).named] for log in logs]
    assert ["coulomb_drive"] in named  # of one of them processors differ in the first step of the search
    assert all(names in ([], ["coulomb_drive"]) for names in named)
    assert p_value_of_rest([], 1.0) == 1.0 and falls_in_blocks([], []) == [0.0]


def test_a_change_is_judged_on_what_both_models_predict_and_lost_where_it_leaves_less_than_half():
    before, after = np.ones((100, 2)), np.full((100, 2), 0.5)
    assert falls_in_blocks([before], [after]).sum() == pytest.approx(0.5 * 200 * 0.75)
    after[:3] = np.nan  # first readings of a sensor that is late
    found = falls_in_blocks([before], [after])
    assert len(found) == 10 and found.sum() == pytest.approx(0.5 * 194 * 0.75)
    after[3:] = np.nan
    assert falls_in_blocks([before], [after]).max() < -1e30
    after[:3] = 0.5
    assert falls_in_blocks([before], [after]).max() < -1e30
