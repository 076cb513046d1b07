"""Effects that logs cannot tell from others at all are no candidates, and the reason is said."""

import numpy as np
import pytest

from tests.raw_logs import way_of
from wheelpend import Model, load_log
from wheelpend.diagnosis.verdict import not_testable
from wheelpend.estimation.data import prepare

MODEL = Model.parse('plant = "slide"\n')
T = 0.005 * np.arange(2000)
ONE_WAY = 6.0 + 3.0 * np.sin(3.1 * T)
BOTH_WAYS = 6.0 * np.sin(3.1 * T)


@pytest.mark.parametrize(
    ("logs", "told"),
    [([ONE_WAY], False), ([BOTH_WAYS], True), ([ONE_WAY, -ONE_WAY], True), ([ONE_WAY, BOTH_WAYS], True)],
    ids=["one way", "both ways", "each another way", "one of them both"],
)
def test_a_difference_between_directions_is_told_by_a_log_that_goes_both_ways(logs, told):
    problem = prepare(MODEL, [load_log({"t": T, "v_in": u, "x": way_of(u)}, table=MODEL.table) for u in logs])
    names = {e.name for e in problem.candidates()}
    assert ("coulomb_asymmetry" in names) == ("viscous_asymmetry" in names) == told
    assert "coulomb_drive" in names
    assert ("goes one way" in not_testable(problem).get("coulomb_asymmetry", "")) == (not told)


def test_the_noise_of_a_fine_sensor_is_no_way_back():
    way = way_of(ONE_WAY)
    noisy = way + 1e-3 * np.random.default_rng(2).standard_normal(T.size)
    up, down = load_log({"t": T, "v_in": ONE_WAY, "x": noisy}, table=MODEL.table).ways[0]
    assert down < 0.01 * up and up == pytest.approx(np.ptp(way), rel=0.01)
    up, down = load_log({"t": T, "v_in": BOTH_WAYS, "x": way_of(BOTH_WAYS)}, table=MODEL.table).ways[0]
    assert 0.3 < down / (up + down) < 0.7
