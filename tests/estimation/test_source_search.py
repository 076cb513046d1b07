"""The search for random sources: the fit that it ends with is the likelier of those from large and from fast forces."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.estimation.random_source import RandomSource, with_forces
from wheelpend.estimation.source_search import FAST_FORCE, with_fast_forces

FORCE = RandomSource("wheel", (1.0, 0.0), (0.0, 0.0), 2.0, 0.5)
ERROR = RandomSource("theta_w", (0.0, 0.0), (1.0, 0.0), 3.0, 0.5)


class Recorder:
    """An estimator whose fits cost what they are told to, and which remembers where they began."""

    correlation_bounds = (0.08, 1.0)

    def __init__(self, deviance):
        self.deviance, self.begun = deviance, []

    def fit(self, theta, sources, effort, fixed_noise=False):
        self.begun.append((sources, fixed_noise))
        return SimpleNamespace(theta=theta + 1.0, sources=sources, kinds=sources[0], deviance=self.deviance)


def point(*sources):
    return SimpleNamespace(theta=np.zeros(1), sources=(sources,), kinds=sources, deviance=100.0)


@pytest.mark.parametrize(("deviance", "moves"), [(99.0, True), (101.0, False), (float("nan"), False)])
def test_a_fit_from_smaller_and_faster_forces_counts_where_it_is_likelier(deviance, moves):
    found, estimator = point(FORCE, ERROR), Recorder(deviance)
    assert (with_fast_forces(estimator, found) is not found) == moves
    (first, held), (_, free) = estimator.begun
    assert held and not free
    force, error = first[0]
    assert force.rms == pytest.approx(FAST_FORCE[0] * FORCE.rms)
    assert force.correlation_time == estimator.correlation_bounds[0]  # a tenth would be faster than it may be
    assert error == ERROR


def test_without_a_force_there_is_nothing_to_begin_anew():
    found, estimator = point(ERROR), Recorder(0.0)
    assert with_fast_forces(estimator, found) is found and not estimator.begun


def test_forces_of_all_logs_are_made_smaller_and_faster_and_errors_stay():
    ((force, error), (other,)) = with_forces(((FORCE, ERROR), (FORCE,)), 0.5, 0.5, 0.01)
    assert (force.rms, force.correlation_time, error) == (1.0, 0.25, ERROR) and other == force
