"""Beside a random force an effect needs evidence, and must lower the error or the force; one of them is enough."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.diagnosis.likelihood.judgement import Judged


def judged(error_after=100.0, less_force=0.0, falls=(-2.0, 1.0, 1.5), **changed):
    told = {"p_value": 1e-6, "p_confirmation": 1e-3, "physical": True, "error_after": error_after, **changed}
    return Judged(SimpleNamespace(**told), None, None, np.linspace(-1.0, 3.0, 20), 50.0, less_force, np.array(falls))


@pytest.mark.parametrize(
    ("error_after", "less_force", "supported"),
    [(99.0, 0.0, True), (103.0, 0.1, True), (95.0, -0.2, True), (99.8, 0.004, False), (103.0, 0.0, False)],
)
def test_an_effect_lowers_the_error_or_the_force(error_after, less_force, supported):
    assert judged(error_after, less_force).is_supported(100.0) == supported


def test_an_error_may_rise_by_less_than_the_force_falls():
    assert judged(109.0, 0.1).is_supported(100.0) and not judged(112.0, 0.1).is_supported(100.0)
    assert not judged(200.0, 0.47).is_supported(100.0)  # a lag that half of the force went into


@pytest.mark.parametrize("changed", [{"p_value": 0.02}, {"p_confirmation": 0.06}, {"physical": False}])
def test_an_effect_needs_significance_confirmation_and_a_possible_size(changed):
    assert judged(90.0, 0.1).is_supported(100.0) and not judged(90.0, 0.1, **changed).is_supported(100.0)


def test_most_blocks_must_be_likelier_or_better_predicted():
    few = judged(90.0, 0.1, falls=(-1.0, -1.0, 5.0))._replace(gains=np.r_[np.full(11, -0.1), np.full(9, 5.0)])
    assert few.evidence > 0.0 and not few.is_supported(100.0)
    assert few._replace(falls=np.array([1.0, 1.0, -1.5])).is_supported(100.0)
