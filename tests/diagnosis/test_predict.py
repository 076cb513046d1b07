"""The prediction of a log, sample by sample."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.support import X, simulated
from wheelpend import Failure, Model, compare, predict
from wheelpend.kernels.load import model_module

RIGHT = Model.default().with_fit({n: (v, None) for n, v in X.items()})
WRONG = RIGHT.with_fit({"X5": (0.95 * X["X5"], None)})


@pytest.fixture(scope="module")
def prediction():
    return predict(WRONG, simulated(duration=4.0))


def test_a_prediction_has_the_errors_of_the_comparison(prediction):
    compared = compare(WRONG, simulated(duration=4.0))
    assert prediction.error == compared.error
    frame = prediction.to_frame()
    for name in prediction.channels:
        off = (frame[name] - frame[f"{name}_predicted"]).drop_nulls().to_numpy()
        assert np.sqrt(np.mean(off**2)) == pytest.approx(compared.rmse[name], rel=1e-9)
    assert {name: rmse for name, rmse, _ in prediction.table().rows} == pytest.approx(compared.rmse)


def test_the_right_model_predicts_a_log_without_noise():
    log = simulated(duration=4.0, noise=False)
    found = predict(RIGHT, log)
    inside = found.segment >= 0
    np.testing.assert_allclose(found.predicted[inside], log.measured[inside], atol=3e-3)
    assert np.isnan(found.predicted[~inside]).all()
    np.testing.assert_array_equal(found.t, log.t)


def test_within_a_segment_the_model_runs_freely_on_the_logged_commands(prediction):
    module = model_module(WRONG.plant, WRONG.assumptions, ())
    values = {**WRONG.constants, **{n: WRONG.value(n) for n in X}}
    parameters = np.array([values.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    inside = np.flatnonzero(prediction.segment == 3)
    t, (wheel, pitch, rate) = prediction.t[inside], prediction.predicted[inside].T
    voltage = simulated(duration=4.0).voltage[inside]

    def free(wheel_rate):
        begin = np.array([wheel[0], pitch[0], wheel_rate, rate[0]])
        return module.simulate(t, voltage, begin, parameters, 1e-3)

    wheel_rate = brentq(lambda v: free(v)[-1, 0] - wheel[-1], -20.0, 20.0)  # no sensor reads it
    missed = np.abs(prediction.measured[inside, 1] - pitch).max()
    assert np.abs(free(wheel_rate)[:, 1] - pitch).max() < 1e-3 * missed


def test_segments_are_as_long_as_the_horizon(prediction):
    longer = predict(WRONG, simulated(duration=4.0), horizon=1.0)
    for found, samples in ((prediction, 500), (longer, 1000)):
        assert np.bincount(found.segment[found.segment >= 0])[0] == samples
    assert longer.error > prediction.error


def test_a_row_of_the_frame_is_a_sample(prediction):
    frame = prediction.to_frame()
    names = [column for c in prediction.channels for column in (c, f"{c}_predicted")]
    assert frame.columns == ["t", "segment", *names] and frame.height == len(prediction.t)
    assert frame["theta_w_predicted"].null_count() == (prediction.segment < 0).sum()


def test_a_value_that_was_not_measured_is_not_predicted():
    log = simulated(duration=4.0)
    measured = log.measured.copy()
    measured[2000, 1] = np.nan
    found = predict(WRONG, {"t": log.t, "v_in": log.voltage, **dict(zip(log.channels, measured.T, strict=True))})
    assert np.isnan(found.predicted[2000]).tolist() == [False, True, False]


def test_one_log_is_predicted_at_a_time():
    with pytest.raises(Failure, match=r"must be of one log, but 2 were given"):
        predict(WRONG, [simulated(duration=4.0)] * 2)
