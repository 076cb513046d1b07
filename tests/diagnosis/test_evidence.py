"""Discoveries are confirmed on data that did not make them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f as f_distribution

import derive
from tests.support import X, simulated
from wheelpend import Model
from wheelpend.diagnosis.evidence import (
    Comparisons,
    ValidatedFit,
    block_agreement,
    confirmation_p_value,
    deviation_from_absence,
    evaluate_candidate,
    is_physical,
    wald_p_value,
)
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.parameters import FreeParameter

TORQUE = "coulomb_drive.torque"


def autoregressive(shape, share, seed=0):
    noise = np.random.default_rng(seed).normal(size=shape) * np.sqrt(1 - share**2)
    return lfilter([1.0], [1.0, -share], noise, axis=-1)


def held_out(residual, change):
    data = SimpleNamespace(validation_values=residual.size, values=2 * residual.size)
    problem = SimpleNamespace(data=data)
    return confirmation_p_value(problem, [residual], [residual - change])


def test_held_out_data_confirm_an_effect_that_is_there_and_no_other():
    change = 0.3 * autoregressive((1, 1000), 0.98, 1).T
    by_chance = [held_out(autoregressive((1, 1000), 0.8, seed).T, change) for seed in range(10, 410)]
    assert np.mean(np.array(by_chance) < 0.05) < 0.08
    assert held_out(autoregressive((1, 1000), 0.8, 2).T + 3 * change, 3 * change) < 1e-4
    assert held_out(autoregressive((1, 1000), 0.0, 2).T - change, change) > 0.9


# ---- the evidence for one effect, on a log where it is there, but hardly so


@pytest.fixture(scope="module")
def faint():
    """A problem whose log has a little dry friction, its fit without it, and its fit with it."""
    log = simulated(duration=6.0, seed=5, coulomb_drive__torque=0.002)
    problem = prepare(Model.default(), [log], horizon=0.1)
    without = fit_segments(problem, problem.data.estimation, X, problem.base)
    return problem, without, fit_segments(problem, problem.data.estimation, X, [*problem.base, TORQUE])


def evidence(faint, tests=1, judged=1, significance=None):
    problem, without, fitted = faint
    before = ValidatedFit.of(problem, without)
    effect = derive.effects.find("coulomb_drive")
    return evaluate_candidate(problem, effect, fitted, before, Comparisons(tests, judged), significance)


def test_each_p_value_counts_how_many_effects_were_compared_for_it(faint):
    one, tests, judged, all_ = (evidence(faint, *c) for c in ((1, 1), (40, 1), (1, 5), (10**9, 10**9)))
    assert 0.0 < one.p_discovery < 0.02 and 0.0 < one.p_confirmation < 0.19
    assert (tests.p_discovery, tests.p_confirmation) == pytest.approx((40 * one.p_discovery, one.p_confirmation))
    assert (judged.p_discovery, judged.p_confirmation) == pytest.approx((one.p_discovery, 5 * one.p_confirmation))
    assert (all_.p_discovery, all_.p_confirmation, all_.p_value) == (1.0, 1.0, 1.0)
    assert one.p_value == max(one.p_discovery, one.p_confirmation)
    assert judged.p_value == max(judged.p_discovery, judged.p_confirmation) and tests.p_value == pytest.approx(
        tests.p_discovery
    )


def test_significance_is_taken_from_the_fit_that_is_named_for_it(faint):
    vague = replace(faint[2], covariance=100.0 * faint[2].covariance)
    assert evidence(faint, significance=vague).p_discovery > 0.3 > evidence(faint).p_discovery


def test_an_effect_counts_where_it_is_significant_possible_and_lowers_the_error_by_half_a_percent(faint):
    found = replace(evidence(faint), p_value=0.009, physical=True, error_after=1.0)
    assert found.is_supported(1.006) and not found.is_supported(1.004)
    assert not replace(found, p_value=0.011).is_supported(1.5)
    assert not replace(found, physical=False).is_supported(1.5)


def test_a_larger_effect_counts_beside_one_it_contains_where_it_adds_significantly(faint):
    smaller = replace(evidence(faint), error_after=1.0)
    larger = replace(smaller, effect="stribeck_drive", error_after=0.994, beyond={"coulomb_drive": 0.009})
    assert larger.improves_on(smaller)
    assert not replace(larger, error_after=0.996).improves_on(smaller)
    assert not replace(larger, beyond={"coulomb_drive": 0.011}).improves_on(smaller)


def test_the_wald_test_is_the_f_test_with_the_larger_of_two_covariances(faint):
    fitted, blocks, size = faint[2], faint[2].blocks, 3.0 * faint[2].sigma(TORQUE)
    at, size_of = np.array([size]), [fitted.element(TORQUE, None)]
    plain = replace(fitted, robust=fitted.covariance * 1e-6, cost=fitted.cost * 1e-6)
    freedom = sum(len(s) for s in fitted.states) - len(fitted.free)
    assert wald_p_value(plain, size_of, at) == pytest.approx(f_distribution.sf(9.0, 1, freedom), rel=1e-6)
    robust = replace(plain, robust=100.0 * fitted.covariance)
    assert wald_p_value(robust, size_of, at) == pytest.approx(f_distribution.sf(0.09, 1, blocks - 1), rel=1e-6)
    noisy = replace(plain, cost=9.0 * (fitted.count - sum(s.size for s in fitted.states)))
    assert wald_p_value(noisy, size_of, at) == pytest.approx(f_distribution.sf(1.0, 1, freedom), rel=1e-6)


def test_several_sizes_are_tested_together_over_their_number(faint):
    fitted, sizes = faint[2], [faint[2].element(n, None) for n in (TORQUE, "X1")]
    fitted = replace(fitted, robust=fitted.covariance * 1e-6, cost=fitted.cost * 1e-6)
    at = np.array([3.0 * fitted.sigma(TORQUE), 0.0])
    block = fitted.covariance[np.ix_(*2 * [[fitted.free.index(p) for p in sizes]])]
    freedom = sum(len(s) for s in fitted.states) - len(fitted.free)
    statistic = at @ np.linalg.solve(block, at) / 2
    assert wald_p_value(fitted, sizes, at) == pytest.approx(f_distribution.sf(statistic, 2, freedom), rel=1e-5)


def test_a_deviation_is_counted_from_the_size_at_which_an_effect_does_nothing(faint):
    fitted = replace(faint[2], values={**faint[2].values, "a.limit": 8.0, "b.limit": np.inf})
    found = deviation_from_absence(
        fitted, list(map(FreeParameter, ["a.limit", "b.limit", "X1"])), {"a.limit": 10.0, "b.limit": 10.0}
    )
    assert found == pytest.approx([-2.0, 0.0, fitted.values["X1"]])


def test_training_data_as_short_as_the_validation_data_count_with_their_uncertainty():
    change, residual = 0.3 * autoregressive((1, 1000), 0.0, 1).T, autoregressive((1, 1000), 0.0, 2).T

    def confirmed(training):
        problem = SimpleNamespace(data=SimpleNamespace(validation_values=1000, values=training))
        return confirmation_p_value(problem, [residual + change], [residual])

    assert confirmed(10**9) < confirmed(1000)
    assert confirmed(1000) < confirmed(300) < 0.5


def test_blocks_agree_where_the_error_falls_in_them():
    residual = autoregressive((1, 1000), 0.0).T
    assert block_agreement([residual], [0.5 * residual]) == "5/5"
    assert block_agreement([residual], [2.0 * residual]) == "0/5"
    assert block_agreement([residual], [np.vstack([0.5 * residual[:400], 2.0 * residual[400:]])]) == "2/5"
    assert block_agreement([residual, residual], [0.5 * residual, 2.0 * residual]) == "5/10"


def test_a_size_is_possible_up_to_two_standard_errors_beyond_its_range_and_its_order():
    dry, stribeck = (derive.effects.find(e) for e in ("coulomb_drive", "stribeck_drive"))
    assert is_physical(dry, {"torque": -0.19}, {"torque": 0.1})
    assert not is_physical(dry, {"torque": -0.21}, {"torque": 0.1})
    sigma = {"static": 0.05, "sliding": 0.05, "speed": 0.1}
    assert is_physical(stribeck, {"static": 0.3, "sliding": 0.49, "speed": 0.5}, sigma)
    assert not is_physical(stribeck, {"static": 0.3, "sliding": 0.51, "speed": 0.5}, sigma)
