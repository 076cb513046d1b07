"""Where a missing force is said to be large."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.diagnosis.missing_force.estimate import MissingForce, concentrations

PROBLEM = SimpleNamespace(module=SimpleNamespace(ROWS=("wheel", "body")))


def located(force, x, band=0.01):
    other = np.random.default_rng(1).normal(size=len(x))
    forces = np.column_stack([force, np.zeros(len(x))])
    missing = MissingForce(np.arange(len(x)), forces, np.full_like(forces, band), {"x": x, "other": other}, "log")
    return concentrations(PROBLEM, missing)


def test_a_force_that_acts_in_a_range_is_found_there_and_on_its_row():
    x = np.linspace(0.0, 12.0, 2401)[np.random.default_rng(0).permutation(2401)]
    (found, *_) = located(np.where((x > 9.0) & (x < 11.0), 0.5, 0.0), x)
    assert (found.row, found.state) == ("wheel", "x")
    assert (found.low, found.high) == pytest.approx((9.0, 11.0), abs=0.02)
    assert found.share == pytest.approx(1.0, abs=0.01)


def test_a_share_is_that_of_the_squares():
    x = np.linspace(0.0, 12.0, 2401)
    (found, *_) = located(np.where(x > 9.0, 0.4, 0.1), x)
    assert found.share == pytest.approx(3 * 0.16 / (3 * 0.16 + 9 * 0.01), rel=0.01)
    assert (found.low, found.high) == pytest.approx((9.0, 12.0), abs=0.02)


def test_a_force_within_its_band_and_one_that_is_everywhere_are_nowhere():
    x, random = np.linspace(0.0, 12.0, 2401), np.random.default_rng(2)
    assert located(np.where(x > 9.0, 0.5, 0.0), x, band=5.0) == ()
    assert located(random.choice([-0.5, 0.5], size=2401), x) == ()
