"""A fleet's mean and scatter are found, what stands out is named with its size, and what does not is left alone."""

import numpy as np
import pytest

from wheelpend.campaigns.drift import drifts
from wheelpend.campaigns.fleet import UnitEstimate, combined, difference_between, explained_difference, fleet_of

NAMES = ("X1", "X2", "X6", "coulomb_drive.torque")
MEAN = np.array([0.04, 0.12, 2.0, 0.3])
SCATTER = np.array([4e-4, 1e-3, 0.02, 0.01])
SIGMA = np.array([2e-3, 2e-3, 0.01, 0.005])
CORRELATION = np.array([[1.0, -0.95, 0.3, 0.0], [-0.95, 1.0, -0.2, 0.0], [0.3, -0.2, 1.0, 0.4], [0.0, 0.0, 0.4, 1.0]])


def made_up_units(seed, count=60, odd=None):
    """Units drawn around MEAN, estimated with errors of different sizes; odd ones differ in one parameter."""
    rng = np.random.default_rng(seed)
    units = []
    for k in range(count):
        covariance = CORRELATION * np.outer(SIGMA, SIGMA) * rng.uniform(0.5, 2.0)
        truth = MEAN + SCATTER * rng.normal(size=4)
        for name, by in (odd or {}).get(k, {}).items():
            truth[NAMES.index(name)] += by
        units.append(UnitEstimate(f"unit {k}", NAMES, rng.multivariate_normal(truth, covariance), covariance))
    return units


def test_mean_and_scatter_of_equal_errors_are_those_of_the_closed_form():
    rng = np.random.default_rng(2)
    covariance = np.diag([0.3, 0.2]) ** 2
    values = rng.normal([1.0, 5.0], [0.5, 0.4], size=(40, 2))
    found = fleet_of([UnitEstimate(f"{k}", ("a", "b"), v, covariance) for k, v in enumerate(values)])
    expected = np.cov(values.T) - covariance
    assert found.odd == ()
    assert [p.mean for p in found.parameters.values()] == pytest.approx(values.mean(axis=0), rel=1e-6)
    np.testing.assert_allclose(found.scatter, expected, atol=1e-4)
    assert [p.scatter for p in found.parameters.values()] == pytest.approx(np.sqrt(np.diag(expected)), rel=1e-3)


def test_units_that_differ_by_nothing_but_their_errors_do_not_scatter():
    rng = np.random.default_rng(3)
    covariance = np.diag(SIGMA**2)
    units = [UnitEstimate(f"{k}", NAMES, rng.normal(MEAN, SIGMA), covariance) for k in range(50)]
    found = fleet_of(units)
    assert not any(p.scatters for p in found.parameters.values()) and found.odd == ()
    assert all(p.scatter_interval[0] < 0.3 * s and p.scatter < 0.7 * s
               for p, s in zip(found.parameters.values(), SIGMA, strict=True))  # fmt: skip


def test_the_unit_that_aged_stands_out_by_what_aged_with_an_interval_that_covers():
    odd = {7: {"coulomb_drive.torque": 0.12}, 23: {"X6": -0.25}}
    found = fleet_of(made_up_units(4, odd=odd))
    named = {o.unit: [e.parameter for e in o.difference.parameters] for o in found.odd}
    assert named == {"unit 7": ["coulomb_drive.torque"], "unit 23": ["X6"]}
    for one in found.odd:
        (size,) = odd[int(one.unit.split()[1])].values()
        (explained,) = one.difference.parameters
        assert explained.interval[0] < size < explained.interval[1] and abs(size) > 4.0 * explained.sigma
    assert found.parameters["X6"].scatters and found.parameters["X6"].scatter == pytest.approx(0.02, rel=0.35)


def test_of_fleets_in_which_nothing_aged_hardly_a_unit_stands_out():
    odd = [len(fleet_of(made_up_units(seed)).odd) for seed in range(20, 30)]
    assert sum(odd) <= 3


def test_scatter_and_mean_have_intervals_that_cover():
    inside = []
    for seed in range(40, 60):
        found = fleet_of(made_up_units(seed, count=25))
        for name, mean, scatter in zip(NAMES, MEAN, SCATTER, strict=True):
            row = found.parameters[name]
            inside.append((abs(row.mean - mean) < 1.96 * row.mean_sigma,
                           row.scatter_interval[0] <= scatter <= row.scatter_interval[1]))  # fmt: skip
    assert (np.mean(inside, axis=0) > 0.85).all()


def test_a_difference_is_explained_by_the_parameter_that_suffices_though_its_neighbour_is_off_too():
    errors = np.array([1.0, 1.0])
    covariance = np.array([[1.0, 0.99], [0.99, 1.0]]) * np.outer(errors, errors)
    found = explained_difference(np.array([2.0, 0.0]), covariance, ["a", "b"])
    assert [e.parameter for e in found.parameters] == ["a"]
    assert found.parameters[0].difference == pytest.approx(2.0) and found.rest_p_value > 0.9
    alike = explained_difference(np.array([2.0, 2.0]), covariance, ["a", "b"])
    assert alike.parameters == () and alike.p_value > 0.05


def test_two_units_differ_in_two_things_or_in_nothing():
    one, other = made_up_units(5, count=2, odd={1: {"X6": 0.3, "coulomb_drive.torque": -0.2}})
    found = difference_between(one, other)
    assert {e.parameter for e in found.parameters} == {"X6", "coulomb_drive.torque"} and found.rest_p_value > 0.01
    sizes = {e.parameter: e.difference for e in found.parameters}
    assert sizes["X6"] == pytest.approx(0.3, abs=0.08) and sizes["coulomb_drive.torque"] == pytest.approx(
        -0.2, abs=0.05
    )
    assert difference_between(one, one).parameters == ()


def test_too_few_units_are_no_fleet_and_logs_of_one_unit_are_one_estimate():
    units = made_up_units(6, count=4)
    assert fleet_of(units[:2]) is None
    both = combined("machine", units[:2])
    assert both.unit == "machine"
    assert (np.diag(both.covariance) < np.diag(units[0].covariance)).all()
    np.testing.assert_allclose(combined("same", units[:1]).values, units[0].values, rtol=1e-9)


def test_what_wears_over_the_days_is_a_drift_and_what_does_not_is_none():
    rng = np.random.default_rng(8)
    days, estimates = [], []
    for unit in range(6):
        for day in (0.0, 30.0, 60.0, 90.0):
            truth = MEAN.copy()
            truth[3] += 0.0004 * day + (0.002 * day if unit == 2 else 0.0)
            estimates.append(UnitEstimate(f"{unit}", NAMES, rng.normal(truth, SIGMA), np.diag(SIGMA**2)))
            days.append(day)
    found = drifts(estimates, days)
    assert {d.parameter for d in found} == {"coulomb_drive.torque"}
    own = {d.unit: d for d in found}
    assert own["2"].per_day == pytest.approx(0.0024, abs=3.0 * own["2"].sigma)
    assert None in own and 0.0 < own[None].per_day < 0.002
    still = [UnitEstimate(e.unit, NAMES, rng.normal(MEAN, SIGMA), e.covariance) for e in estimates]
    assert drifts(still, days) == ()
    assert drifts(estimates[:2], [0.0, 1.0]) == ()
