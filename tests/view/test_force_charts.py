"""The missing force is drawn over time, states and pairs; what is chosen in one chart is the same in all of them."""

import numpy as np
import pytest

from wheelpend.reports.page.binning import bin_means, quantile_bins
from wheelpend.view.force_charts import MAP_BINS, Force, over_pair, over_time, over_variable


@pytest.fixture
def force():
    """Dry friction against a speed that swings, told in another order than that of time."""
    t = np.linspace(0.0, 20.0, 2001)
    speed = 3.0 * np.sin(t)
    order = np.random.default_rng(0).permutation(len(t))
    told = {
        "log": "a.csv",
        "t": t[order].tolist(),
        "force": [(-0.3 * np.sign(speed))[order].tolist(), (0.1 * t)[order].tolist()],
        "sigma": [np.full(len(t), 0.02).tolist()] * 2,
        "variables": {"speed": speed[order].tolist(), "angle": (3.0 * np.cos(t))[order].tolist()},
        "units": {"speed": "rad/s", "angle": "rad"},
    }
    return Force.of(told, 0, "V")


def binned(x, y):
    return bin_means(x, y, quantile_bins(x)).T


def named(figure):
    return {trace.name: trace for trace in figure.data}


def test_samples_are_drawn_in_the_order_of_time_with_a_band_of_two_standard_deviations(force):
    drawn = named(over_time(force, np.zeros(len(force.t), dtype=bool)))
    assert np.all(np.diff(drawn["missing force"].x) > 0.0) and "chosen" not in drawn
    band = np.array(drawn["± 2 standard deviations"].y, dtype=float)
    assert band[0] - drawn["missing force"].y[0] == pytest.approx(0.04)


def test_a_range_of_a_state_and_a_stretch_of_time_choose_the_same_samples_in_every_chart(force):
    chosen = force.within("speed", 1.0, 2.0)
    assert 100 < chosen.sum() < 1000 and (force.variables["speed"][chosen] >= 1.0).all()
    over = named(over_variable(force, "angle", chosen))["chosen"]
    assert len(over.x) == chosen.sum()
    line = named(over_time(force, chosen))["chosen"]
    assert sum(y is not None for y in line.y) == chosen.sum()
    stretch = force.within("t", 3.0, 4.0)
    assert force.t[stretch].min() >= 3.0 and force.t[stretch].max() <= 4.0 and stretch.sum() == 101
    assert len(named(over_pair(force, ("speed", "angle"), stretch))["chosen"].x) == stretch.sum()


def test_the_mean_over_a_state_is_the_law_and_the_map_is_blank_where_nothing_was(force):
    centres, means, errors = binned(force.variables["speed"], force.force)
    assert np.sign(means).tolist() == (-np.sign(centres)).tolist() and np.abs(means).max() == pytest.approx(0.3)
    assert (errors >= 0.0).all()
    (heat,) = over_pair(force, ("speed", "angle"), np.zeros(len(force.t), dtype=bool)).data
    cells = [v for row in heat.z for v in row]
    blank = cells.count(None)
    assert MAP_BINS**2 * 0.5 < blank < MAP_BINS**2 * 0.95  # a circle's rim
    assert heat.zmax == -heat.zmin == pytest.approx(0.3, rel=0.05)


def test_a_map_spans_a_variable_that_is_never_positive_and_one_that_does_not_change(force):
    states = force.variables | {"volts": -np.abs(force.variables["angle"]), "still": np.full(len(force.t), 3.0)}
    (heat,) = over_pair(force._replace(variables=states), ("volts", "still"), np.zeros(len(force.t), dtype=bool)).data
    assert heat.x[0] < -2.8 and -0.2 < heat.x[-1] < 0.0 and 3.0 < heat.y[0] < heat.y[-1] < 4.0
    assert sum(v is not None for row in heat.z for v in row) == MAP_BINS


def test_a_coloured_force_is_known_no_better_than_by_its_visits_to_a_range():
    """Against the scatter of the means over many records of a force that does not depend on the state."""
    rng, means, told = np.random.default_rng(5), [], []
    speed = 3.0 * np.sin(np.linspace(0.0, 40.0, 2000))
    for _ in range(60):
        shocks, coloured = rng.normal(size=2000), np.zeros(2000)
        for k in range(1, 2000):
            coloured[k] = 0.9 * coloured[k - 1] + shocks[k]
        _, mean, errors = binned(speed, coloured)
        means.append(mean)
        told.append(errors)
    scatter = np.sqrt(np.mean(np.square(means)))
    assert 0.5 < np.sqrt(np.mean(np.square(told))) / scatter < 1.5


def test_what_a_candidate_would_explain_is_drawn_beside_the_force(force):
    drawn = named(over_time(force, np.zeros(len(force.t), dtype=bool), 0.5 * force.force, "coulomb_drive"))
    assert drawn["coulomb_drive would explain"].y[10] == pytest.approx(0.5 * drawn["missing force"].y[10])


def test_a_variable_that_stands_still_and_a_value_that_is_none_are_drawn_all_the_same(force):
    still = force._replace(variables={"a": np.zeros(len(force.t)), "b": force.t})
    assert len(over_pair(still, ("a", "b"), force.within("t", 0.0, 1.0)).data) == 2
    gap = force._replace(force=np.where(force.t > 10.0, np.nan, force.force))
    assert None in named(over_time(gap, np.zeros(len(gap.t), dtype=bool)))["missing force"].y
