"""A filter that begins in mid-action knows nothing of what moves inside the machine, and follows it all the same."""

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Model
from wheelpend.diagnosis.likelihood.filtered_model import estimator_of
from wheelpend.estimation.data import prepare
from wheelpend.estimation.problem import with_stable_step
from wheelpend.estimation.starts import best_start

SHAFT = {"drive_compliance.stiffness": 60.0, "drive_compliance.damping": 0.3}
SLIP = {"wheel_slip.stiffness": 5.0, "wheel_slip.limit": 5.0}


def innovations_at_the_truth(hidden: dict[str, float]) -> np.ndarray:
    """Whitened innovations (N, NY) of the true machine's filter, which begins 0.15 s after the log did."""
    effect = next(iter(hidden)).split(".")[0]
    log = simulated(duration=4.0, seed=3, **{n.replace(".", "__"): v for n, v in hidden.items()})
    problem, start = best_start(prepare(Model.default(), [log]))
    problem = with_stable_step(problem.with_effects([effect]), {})
    estimator = estimator_of(problem, [{**start, **X, **hidden}])
    assert estimator.problem.segments[0].bounds[0, 0] > 100  # the shaft is wound up by then
    found = estimator.problem.inside_innovations(estimator.problem.space.start(), [()])
    return np.concatenate(found)[..., 0]


@pytest.mark.parametrize("hidden", [SHAFT, SLIP])
def test_without_a_random_force_the_innovations_are_the_noise_of_the_sensors(hidden):
    whitened = innovations_at_the_truth(hidden)
    assert np.sqrt(np.nanmean(whitened**2, axis=0)) == pytest.approx(1.0, abs=0.05)
    assert 2.0 < np.nanmax(np.abs(whitened)) < 5.0
