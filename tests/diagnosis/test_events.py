"""What happens once is found where it happened, and judged on data that hold it."""

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model
from wheelpend.diagnosis.events import find_events, fit_event
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare, with_interleaved_validation
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import validation_residuals

PUSH = {"external_push__start": 8.988, "external_push__end": 10.608, "external_push__torque": -0.426}


@pytest.fixture(scope="module")
def bent():
    """A study of a log with a push, and the fit of a model that knows of none."""
    problem, start = best_start(prepare(Model.default(), [simulated(seed=20, **PUSH)]))
    return problem, fit_model(problem, start, free_names(problem, ()))


def pushes(bent):
    return [p for p in find_events(*bent, bent[1].error) if p.effect.name == "external_push"]


def test_a_push_is_seen_where_it_was_though_every_parameter_is_bent_to_it(bent):
    first = pushes(bent)[0]
    assert first.start["external_push.start"] == pytest.approx(8.988, abs=0.15)
    assert first.start["external_push.end"] == pytest.approx(10.608, abs=0.15)
    assert first.start["external_push.torque"] == pytest.approx(-0.426, rel=0.3)


def test_when_it_began_and_ended_is_found_though_every_second_segment_is_held_out(bent):
    problem, fitted = fit_event(*bent, pushes(bent), free_names(bent[0], ()))
    values = fitted.of_log(0)
    for name, true in ((n.replace("__", "."), v) for n, v in PUSH.items()):
        assert abs(values[name] - true) < 4.0 * fitted.sigma(name)
    assert validation_residuals(problem, fitted)[0] < 1.02 * problem.floor


def test_segments_in_which_something_happens_are_fitted_and_the_others_take_turns(bent):
    problem = with_interleaved_validation(bent[0], [8.988, 10.608])
    log, held = problem.logs[0], problem.data.validation[0].part.bounds
    spans = [(log.t[a], log.t[b - 1]) for a, b in held]
    assert not any(a - 0.02 < moment < b + 0.02 for a, b in spans for moment in (8.988, 10.608))
    assert (len(held), len(problem.data.estimation[0].bounds)) == (
        19,
        21,
    )  # one of 20 that would be held out holds a moment
    assert not set(map(tuple, held)) & set(map(tuple, np.asarray(problem.data.estimation[0].bounds)))


def test_a_load_is_timed_to_the_sample_though_what_it_does_depends_on_a_command_that_jumps():
    log = simulated(seed=21, command="simple", payload_step__time=5.0504, payload_step__ratio=0.1)
    problem, start = best_start(prepare(Model.default(), [log]))
    fitted = fit_model(problem, start, free_names(problem, ()))
    places = [p for p in find_events(problem, fitted, fitted.error) if p.effect.name == "payload_step"]
    around, found = fit_event(problem, fitted, places, free_names(problem, ()))
    assert found.of_log(0)["payload_step.time"] == pytest.approx(5.0504, abs=0.0007)
    assert found.of_log(0)["payload_step.ratio"] == pytest.approx(0.1, abs=4.0 * found.sigma("payload_step.ratio"))
    assert validation_residuals(around, found)[0] < 1.02 * problem.floor


def test_a_fit_in_the_noise_is_not_searched_from_every_start(bent):
    problem, fitted = bent
    assert len(find_events(problem, fitted, 1.0)) < len(find_events(problem, fitted, fitted.error))
