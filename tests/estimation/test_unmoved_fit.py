"""A fit that ends where it began: at the optimum, or stuck."""

import numpy as np
import pytest

from wheelpend import Model, identify, simulate
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.identification import identify as identification
from wheelpend.identification.identify import MIN_PROMISED_SHARE


@pytest.fixture(scope="module")
def log():
    return simulate(Model.default("slide"), command="simple", duration=6.0, seed=3)


def unmoved_fit(log, inertia: float):
    """A problem and its fit of no rounds from an inertia."""
    problem = prepare(
        Model.parse(f'plant = "slide"\n[parameters]\nX1 = {{ nominal = {inertia} }}\n'), [log], use_all=True
    )
    return problem, fit_segments(problem, problem.data.estimation, {"X1": inertia}, ["X1"], rounds=0)


def test_the_gradient_promises_much_at_a_wrong_start_and_nothing_at_the_optimum(log):
    _, stuck = unmoved_fit(log, 1.0)
    best = identify(Model.default("slide"), [log]).parameters["X1"].value
    _, there = unmoved_fit(log, best)
    assert stuck.promised_decrease > 0.3 * stuck.cost
    assert 0.0 <= there.promised_decrease < 1e-3 * there.cost < MIN_PROMISED_SHARE * there.cost


def test_a_fit_that_returns_its_start_to_the_last_digit_is_a_failure(log, monkeypatch):
    monkeypatch.setattr(identification, "shooting_fit", lambda *asked: unmoved_fit(log, 1.0))
    with pytest.raises(Failure, match=r"must move from its start.*own values to the last digit.*Remove the values"):
        identify(Model.default("slide"), [log], method="shooting")


def test_identifying_again_from_identified_values_is_no_failure(log):
    first = identify(Model.default("slide"), [log])
    again = identify(first.model, [log])
    assert again.parameters["X1"].value == pytest.approx(first.parameters["X1"].value, rel=1e-6)
    assert np.isfinite(again.error)
