"""A unit that the model describes worse than the others stands out, and hardly any other does."""

import numpy as np
import pytest

from wheelpend.campaigns.misfits import misfits
from wheelpend.campaigns.one_log import ErrorCovariance, Estimate, LogResult
from wheelpend.campaigns.units import unit_errors, units_answer


def named(values):
    return [m.unit for m in misfits({str(k): [float(v)] for k, v in enumerate(values)})]


def test_a_unit_far_worse_than_the_others_is_named_the_worst_first():
    assert named([1.0, 1.01, 0.99, 50.0, 1.0, 1.02]) == ["3"]
    assert named([1.0, 1.01, 0.99, 50.0, 1.0, 1.02, 200.0, 1.0, 0.98, 1.01]) == ["6", "3"]
    (found,) = misfits({"a": [1.0], "b": [1.02], "c": [0.98], "d": [25.0, 36.0], "e": [1.0]})
    assert (found.unit, found.error, found.usual) == ("d", pytest.approx(30.0), 1.0) and found.p_value < 0.01


def test_better_units_slightly_worse_ones_and_too_few_are_not_named():
    assert named([10.0, 10.1, 9.9, 1.0, 10.0, 9.8]) == []
    assert named([1.0] * 50 + [1.1]) == [], "a tenth is what a model that is explained may leave"
    assert named([1.0, 80.0]) == [] == named([])


@pytest.mark.parametrize(("units", "most"), [(6, 8), (12, 8), (100, 8)])
@pytest.mark.parametrize("scatter", [0.01, 0.7])
def test_units_that_are_alike_are_hardly_ever_accused(units, most, scatter):
    rng = np.random.default_rng((units, int(100 * scatter)))
    accusing = sum(bool(named(np.exp(scatter * rng.normal(size=units)))) for _ in range(100))
    assert accusing <= most


def test_a_unit_has_the_error_of_its_logs_over_their_noise_floors():
    logs = [LogResult("1", unit="a", error=3.0, noise_floor=1.0), LogResult("2", unit="a", error=2.0, noise_floor=2.0),
            LogResult("3", unit="b", error=1.0), LogResult("4", unit="c", failure="It fell."),
            LogResult("5", error=1.0, noise_floor=1.0)]  # fmt: skip
    assert unit_errors(logs) == {"a": [3.0, 1.0]}


@pytest.mark.parametrize("scatter", [0.1, 0.7])
@pytest.mark.parametrize(("many", "few"), [((90, 20), (10, 1)), ((50, 20), (50, 1)), ((80, 10), (20, 2))])
def test_a_unit_with_few_logs_is_not_accused_for_that(scatter, many, few):
    rng = np.random.default_rng(int(10 * scatter) + many[0])
    accusing = 0
    for _ in range(60):
        logs = [k for units, k in (many, few) for _ in range(units)]
        accusing += bool(misfits({str(n): np.exp(scatter * rng.normal(size=k)) for n, k in enumerate(logs)}))
    assert accusing <= 8


def test_units_that_differ_among_each_other_are_no_misfits_and_a_worse_one_with_many_logs_is():
    rng = np.random.default_rng(1)
    errors = {str(n): np.exp(0.3 * rng.normal() + 0.2 * rng.normal(size=5)) for n in range(40)}
    assert misfits(errors) == ()
    (found,) = misfits({**errors, "worn": np.exp(2.5 + 0.2 * rng.normal(size=5))})
    assert found.unit == "worn"


def test_a_unit_that_the_model_does_not_describe_is_left_out_of_the_fleet_and_stands_out():
    def result(k, error):
        covariance = ErrorCovariance(("X1",), ((0.01 * error**2,),))
        value = 1.0 + 0.05 * np.sin(k)
        return LogResult(str(k), unit=f"robot {k}", parameters={"X1": Estimate(value, 0.1 * error)}, error=error,
                         covariance=covariance, noise_floor=1.0)  # fmt: skip

    answer = units_answer([result(k, 40.0 if k == 2 else 1.0) for k in range(8)])
    assert answer.standing_out == ("robot 2",) and answer.to_json()["misfits"] == answer.misfits
    assert [u.unit for u in answer.fleet.units] == [f"robot {k}" for k in range(8) if k != 2]
    assert len(answer.units) == 8
