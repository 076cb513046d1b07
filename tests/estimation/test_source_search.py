"""Where a fit with random forces begins: large ones everywhere, or those that are likeliest at a start."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.estimation.test_filter_error import MASS, SLIDE, recorded
from wheelpend import Model
from wheelpend.estimation import source_search
from wheelpend.estimation.data import prepare
from wheelpend.estimation.filter_fit import Effort
from wheelpend.estimation.random_source import RandomSource, possible_errors, possible_forces
from wheelpend.identification.filter_error_method import filter_estimator

FORCE = RandomSource("cart", (1.0,), (0.0,), 1.0, 0.1)
GOOD, FAR = np.array([1.0]), np.array([2.0])


class Carried:
    """An estimator whose fits with large forces end far away; ``deviance`` is that of its last fits, by place."""

    def __init__(self, deviance: dict[float, float]) -> None:
        self.deviance = deviance

    def sized(self, source: RandomSource, share: float, time: float) -> RandomSource:
        return source

    def in_all_logs(self, sources: tuple) -> tuple:
        return (sources,)

    def fit(self, theta: np.ndarray, sources: tuple, effort: Effort, *, fixed_noise: bool = False) -> SimpleNamespace:
        carried = FAR if fixed_noise else theta
        return SimpleNamespace(theta=carried, sources=sources, deviance=self.deviance[float(carried[0])])


@pytest.mark.parametrize(("near", "far", "ends"), [(10.0, 20.0, GOOD), (20.0, 10.0, FAR)])
def test_of_a_fit_that_large_forces_carry_away_and_one_from_what_is_likely_at_the_start_the_likelier_counts(
    near, far, ends
):
    found = source_search._freest(Carried({1.0: near, 2.0: far}), [GOOD], (FORCE,))
    assert found.theta == ends


def test_what_is_likeliest_at_a_start_leaves_the_parameters_there():
    t = np.arange(0.0, 4.0, 0.01)
    log = recorded("slide", t, 6.0 * np.sin(7.0 * t))
    estimator, _ = filter_estimator(prepare(SLIDE, [log], use_all=True, lean=True), {"X1": MASS})
    start = 1.5 * estimator.problem.space.start()
    force = possible_forces(SLIDE.plant_signature, estimator.problem.module.NY)[0]
    sources = estimator.in_all_logs((estimator.sized(force, 1.0, 0.05),))
    begun, ended = estimator.point(start, sources), estimator.fit(start, sources, source_search.SOURCES_ALONE)
    assert np.array_equal(ended.theta, start) and ended.deviance < begun.deviance - 10.0


@pytest.mark.parametrize(("slow", "fast"), [(5.0, 2.0), (5.0, 0.0), (0.0, 2.0)])
def test_a_sensor_may_be_wrong_slowly_and_fast_and_gets_a_second_error_only_then(slow, fast):
    t, random = np.arange(0.0, 10.0, 0.005), np.random.default_rng(5)
    log = recorded("slide", t, 6.0 * np.sin(7.0 * t))
    sigma = 1e-3
    for size, time in ((slow, 0.2), (fast, 0.01)):
        decay, error = np.exp(-0.005 / time), [0.0]
        for step in random.standard_normal(t.size - 1):
            error.append(decay * error[-1] + np.sqrt(1.0 - decay**2) * step)
        log.measured[:, 0] += size * sigma * np.array(error)
    stated = f"[sensors.noise]\nx = {sigma}\ndx = 0.02\n"
    model = Model.parse(f'plant = "slide"\n[assumptions]\nrate_sensor = true\n{stated}')
    estimator, _ = filter_estimator(prepare(model, [log], use_all=True, lean=True), {"X1": MASS})
    errors = possible_errors(("x", "dx"), 1)
    force = possible_forces(SLIDE.plant_signature, 2)[0]
    one = [estimator.sized(force, 0.05, 0.05), estimator.sized(errors[0], 3.0, 0.05)]
    point = estimator.fit(estimator.problem.space.start(), estimator.in_all_logs(tuple(one)))
    found = source_search.with_second_errors(estimator, point, errors)
    own = sorted(s.correlation_time for s in found.kinds if s.place == "x")
    if slow and fast:
        assert 0.004 < own[0] < 0.025 < 0.08 < own[1] and found.deviance < point.deviance - 30.0
    else:
        assert found is point and len(own) == 1


def test_a_sensor_may_have_the_error_of_a_filter_beside_others_and_alone_it_has_not():
    beside, alone = possible_errors(("x", "dx"), 1), possible_errors(("x",), 1)
    assert [(e.place, e.lags) for e in beside] == [("x", False), ("dx", False), ("x", True), ("dx", True)]
    assert [(e.place, e.lags) for e in alone] == [("x", False)]  # what lags there is what drives the machine
