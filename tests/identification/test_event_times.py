"""When an event began and ended is not carried off by the jumps of a random force beside it."""

import pytest

from wheelpend.benchmarks.random_force.trial import Case, try_case

pytestmark = pytest.mark.extras  # MuJoCo plays the machine


@pytest.mark.slow
@pytest.mark.long
def test_a_push_of_ten_standard_errors_stays_where_it_is_given():
    found = try_case(Case("lawful", 11, "first_order", "wheel", "external_push", 0.7978652475353083))
    start, end, size = (found.parameters[f"external_push.{name}"] for name in ("start", "end", "torque"))
    assert abs(start.value - start.truth) < 0.005 and abs(end.value - end.truth) < 0.005  # one began 0.065 s too early
    assert abs(size.deviation) < 3.0 and 0.05 < size.sigma < 0.15
