"""How large random forces and errors of sensors are in data that no fit has seen."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.test_likelihood import MODEL, NOISE_M, RANDOM_RMS, RANDOM_TIME_S, axis_log
from wheelpend import Model
from wheelpend.diagnosis.likelihood.filtered_model import filtered_model, moved_to, possible_sources
from wheelpend.diagnosis.likelihood.held_out import prediction, prediction_at
from wheelpend.estimation.data import prepare
from wheelpend.estimation.starts import best_start

TOO_LARGE = 3.0  # times the force that acts, and σ that an encoder without an error of its own is given


def predicted(holdout):
    """A model of an axis with a random force three times too large and an error that its encoder has not, and how it
    predicts what is held out.
    """
    problem, start = best_start(prepare(Model.parse(MODEL), [axis_log(0.0, 3)], holdout))
    model = filtered_model(problem, [start], lambda text: None)
    (force,), (error,) = possible_sources(problem)
    sources = (
        force.with_noise(TOO_LARGE * RANDOM_RMS, RANDOM_TIME_S),
        error.with_noise(TOO_LARGE * NOISE_M, 0.1),
    )
    wrong = moved_to(model, model.point._replace(sources=(sources,)))
    return wrong, wrong.fitted(), sources


def test_a_log_of_its_own_has_the_likeliest_sizes_of_forces_and_errors():
    model, fitted, sources = predicted([axis_log(0.0, 5)])
    found = prediction(model, fitted)
    force, error = found.sources[0]
    assert 0.5 * RANDOM_RMS < force.rms < 1.7 * RANDOM_RMS and force.correlation_time == RANDOM_TIME_S
    assert error.rms < 0.2 * NOISE_M
    at_found = prediction_at(model, fitted, [sources])
    assert found.log_likelihood.sum() > at_found.log_likelihood.sum() + 50.0


def test_what_is_held_out_of_an_estimation_log_has_its_errors_and_no_smaller_forces():
    model, fitted, sources = predicted(())
    assert prediction(model, fitted).sources == [sources]
    small = tuple(replace(s, rms=s.rms / 9.0) if s.is_force else s for s in sources)
    force, error = prediction(moved_to(model, model.point._replace(sources=(small,))), fitted).sources[0]
    assert force.rms == pytest.approx(RANDOM_RMS, rel=0.4) and error == sources[1]


def test_a_prediction_at_given_sizes_is_that_of_the_model_that_chose_them():
    model, fitted, _ = predicted([axis_log(0.0, 5)])
    found = prediction(model, fitted)
    again = prediction_at(model, fitted, found.sources)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(found.whitened, again.whitened, strict=True))
