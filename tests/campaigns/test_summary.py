"""The summary says what the answers of many logs have in common."""

import numpy as np
import pytest

from wheelpend import Model
from wheelpend.campaigns.one_log import Estimate, LogResult, NamedEffect, SimulationSpec
from wheelpend.campaigns.summary import parameter_agreement, parameter_recovery, summarise

SHORT = 3.0  # s


def test_logs_of_one_value_agree_and_one_that_is_off_is_named():
    sigma, names = np.full(20, 0.1), [f"drive{k}" for k in range(20)]
    values = 2.0 + np.random.default_rng(0).normal(size=20) * sigma
    assert parameter_agreement(names, np.column_stack([values, sigma])).p_value > 0.05
    values[7] = 3.0
    off = parameter_agreement(names, np.column_stack([values, sigma]))
    assert off.p_value < 1e-9
    assert off.furthest.log == "drive7"
    assert off.furthest.sigmas == pytest.approx(10.0, abs=3.0)


def test_chi_square_is_that_of_the_weighted_mean():
    found = parameter_agreement(["a", "b"], np.array([[1.0, 1.0], [4.0, 2.0]]))
    assert found.mean == pytest.approx((1.0 + 4.0 / 4.0) / 1.25)
    assert found.chi_square == pytest.approx(9.0 / 5.0)  # difference squared over the sum of the variances


def test_bias_spread_and_coverage_are_those_of_the_estimates():
    found = parameter_recovery([1.0, 2.0, 6.0], [(1.0, 0.1), (2.0, 1.0), (6.0, 3.0)], truth=2.0)
    assert (found.mean, found.bias, found.inside) == (3.0, 1.0, (2, 3))
    assert found.spread == pytest.approx(np.std([1.0, 2.0, 6.0], ddof=1))


def diagnosed(*named, verdict="effect_missing", **parameters):
    told = tuple(NamedEffect(effect, tuple(equivalent)) for effect, *equivalent in named)
    estimates = {n.replace("__", "."): Estimate(v, 0.1) for n, v in parameters.items()}
    return LogResult("log", verdict=verdict, named=told, effects=tuple(n.effect for n in told), parameters=estimates)


def test_what_is_hidden_counts_as_found_where_it_or_an_equivalent_is_named():
    told = [diagnosed(("slope",)), diagnosed(("com_offset", "slope")), diagnosed(("coulomb_drive",))]
    found = summarise(Model.default(), SimulationSpec("aggressive", SHORT, {"slope.angle": 0.01}), told)
    assert found.first_right == (2, 3)
    assert found.found == {"slope": (2, 3)}
    assert found.named == {"slope": 1, "com_offset": 1, "coulomb_drive": 1}
    assert found.false_alarms is None


def test_what_is_named_where_nothing_is_hidden_is_a_false_alarm():
    told = [diagnosed(verdict="nothing_missing"), diagnosed(("slope",)), diagnosed(verdict="unexplained")]
    assert summarise(Model.default(), SimulationSpec("aggressive", SHORT, {}), told).false_alarms == (2, 3)


def test_parameters_are_those_of_the_model_that_most_logs_end_with():
    told = [diagnosed(("slope",), slope__angle=0.01)] * 2 + [diagnosed(("com_offset",), com_offset__angle=0.5)]
    found = summarise(Model.default(), None, told)
    assert (found.effects, list(found.parameters)) == (("slope",), ["slope.angle"])


def test_a_truth_within_two_standard_errors_is_inside_and_one_beyond_is_not():
    inside = {k: parameter_recovery([2.0 + k * 0.1], [(2.0 + k * 0.1, 0.1)], truth=2.0).inside.hits
              for k in (-2.1, -1.8, 0.0, 1.8, 2.1)}  # fmt: skip
    assert inside == {-2.1: 0, -1.8: 1, 0.0: 1, 1.8: 1, 2.1: 0}


def test_a_bias_has_the_standard_error_of_a_mean():
    values = [1.0, 2.0, 6.0, 3.0]
    found = parameter_recovery(values, [(v, 0.5) for v in values], truth=2.5)
    assert found.bias_sigma == pytest.approx(np.std(values, ddof=1) / 2.0)
    assert (found.bias, found.sigma, found.logs) == (0.5, 0.5, 4)
    assert parameter_recovery([1.0], [(1.0, 0.1)], truth=1.0).bias_sigma is None


def test_an_agreement_has_the_weighted_mean_with_its_own_standard_error_and_degrees():
    found = parameter_agreement(["a", "b", "c"], np.array([[1.0, 1.0], [4.0, 2.0], [1.0, 0.5]]))
    assert found.mean_sigma == pytest.approx(5.25**-0.5)  # of weights 1, 1/4 and 4
    assert (found.degrees, found.sigma) == (2, pytest.approx(3.5 / 3))
    assert found.spread == pytest.approx(np.std([1.0, 4.0, 1.0], ddof=1))
    assert found.p_value == pytest.approx(np.exp(-found.chi_square / 2))  # of two degrees of freedom
    assert found.furthest.log == "b" and found.furthest.sigmas == pytest.approx(3.0 / np.sqrt(4.0 + 0.2))


def test_logs_above_the_noise_floor_are_listed_with_what_was_named_the_worst_first():
    def answer(log, error, after=None, floor=0.9):
        return LogResult(log, error=error, error_after=after, noise_floor=floor)

    logs = [answer("good", 9.0, 0.98), answer("bad", 1.0), answer("worse", 9.0, 2.0), answer("lower", 0.95)]
    found = summarise(Model.default(), None, [*logs, LogResult("gone", failure="no file")])
    assert found.unexplained == ("worse", "bad")
    assert (found.logs, found.failed) == (5, 1)
    assert found.error == pytest.approx((19.95 / 4, 0.95, 9.0)) and found.error_after == pytest.approx(
        (1.49, 0.98, 2.0)
    )


def test_parameters_that_scatter_too_much_are_named_for_all_parameters_together():
    def estimates(off):
        return {"X1": Estimate(1.0 + off, 0.1), "X2": Estimate(2.0, 0.1)}

    def told(*offs):
        logs = [LogResult(str(k), parameters=estimates(off)) for k, off in enumerate(offs)]
        return summarise(Model.default(), None, logs).disagreeing

    assert told(0.0, 0.42) == ("X1",)  # p = 0.003 of two parameters
    assert told(0.0, 0.38) == ()  # p = 0.007, which would do for one


def test_what_is_another_in_every_log_is_no_disagreement():
    def told(name):
        logs = [LogResult(str(k), parameters={name: Estimate(0.01 * k, 1e-4)}) for k in range(3)]
        return summarise(Model.default(), None, logs)

    assert told("slope.angle").disagreeing == () and told("X1").disagreeing == ("X1",)
    assert told("slope.angle").parameters["slope.angle"].spread == pytest.approx(0.01)


def test_a_log_that_is_far_more_certain_than_all_others_together_is_compared_with_these():
    told = np.array([[1.0, 1e-10], [3.0, 2.0], [5.0, 2.0]])
    found = parameter_agreement(["sure", "b", "c"], told)
    others = np.array([4.0, 1.0, 1.0])  # weighted means of the other ones
    distances = np.abs(told[:, 0] - others) / np.hypot([1e-10, 2.0, 2.0], [np.sqrt(2.0), 1e-10, 1e-10])
    assert found.furthest.log == "sure" and found.furthest.sigmas == pytest.approx(distances.max(), rel=1e-6)
