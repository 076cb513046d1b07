"""A free play is found from far away."""

import pytest

from tests.support import CONSTANTS, simulated
from tests.support import X as ROUNDED

X = {**ROUNDED, "X5": ROUNDED["X3"] * CONSTANTS["g"] / CONSTANTS["R"]}  # of one mass: the paper's are rounded
KNOWN = {**X, **CONSTANTS, "L": 0.716}


@pytest.mark.slow
def test_a_free_play_is_found_from_nominal_values_a_tenth_off():
    from wheelpend import Model
    from wheelpend.diagnosis.backlash_start import find_backlash_start
    from wheelpend.estimation.continuation import fit_segments
    from wheelpend.estimation.data import prepare, shortened_segments
    from wheelpend.estimation.problem import with_stable_step

    problem = prepare(Model.default(), [simulated(seed=2, backlash__gap=0.01)]).with_candidates("backlash")
    far = {n: 0.9 * v if n.startswith("X") else v for n, v in {**KNOWN, **ROUNDED}.items()}
    free = [*problem.base, "backlash.gap"]
    near = find_backlash_start(problem, far, ({},), free, "backlash.gap")
    assert near["backlash.gap"] == pytest.approx(0.01, rel=0.1)
    problem = with_stable_step(problem, near)
    begun = fit_segments(problem, shortened_segments(problem, 0.3 * problem.horizon, max_segments=80), near, free)
    fitted = fit_segments(problem, problem.data.estimation, begun.values, free)
    assert fitted.values["backlash.gap"] == pytest.approx(0.01, rel=0.02)
    assert fitted.error < 1.1
