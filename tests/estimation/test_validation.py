"""Validation: data that no fit has seen, and errors of a known size."""

from dataclasses import replace

import numpy as np
import pytest

from tests.plants.machines import log_of, model_of
from tests.support import X, simulated
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare, shortened_segments, with_interleaved_validation
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import RUNAWAY_RESIDUAL_SIGMAS, prediction_error, sum_of_squares
from wheelpend.estimation.segments import DataSplit, Segments
from wheelpend.estimation.validation import (
    calibrated_values,
    fit_percent,
    unpredicted_share,
    validation_residuals,
    with_amplitude,
)
from wheelpend.logs.log import Log


@pytest.fixture(scope="module")
def problem():
    """The problem of a true model with white noise of known size, in segments so short that their states count."""
    exact, sigma = simulated(duration=20.0, noise=False), np.array([1e-3, 1e-2, 1e-2])
    log = replace(exact, measured=exact.measured + sigma * np.random.default_rng(0).normal(size=exact.measured.shape))
    found = prepare(Model.default(), [log], horizon=0.02, lean=True)
    held = tuple(replace(v, part=replace(v.part, sigma=sigma)) for v in found.data.validation)
    return replace(found, data=DataSplit(tuple(replace(s, sigma=sigma) for s in found.data.estimation), held))


@pytest.fixture(scope="module")
def known(problem):
    """The fit that the true values are, nothing fitted but the initial states."""
    return fit_segments(problem, problem.data.estimation, X, (), rounds=5)


def samples(segments):
    return {k for a, b in segments.bounds for k in range(a, b)}


def test_the_last_third_of_a_log_is_held_out_and_no_sample_is_on_both_sides():
    problem = prepare(Model.default(), [simulated(duration=6.0), simulated(duration=4.0)], lean=True)
    for number, (fitted, held) in enumerate(zip(problem.data.estimation, problem.data.validation, strict=True)):
        size = len(fitted.log)
        assert max(samples(fitted)) < size * 2 // 3 <= min(samples(held.part))
        assert len(samples(fitted)) > 0.6 * size - 501 and len(samples(held.part)) > 0.3 * size
        assert (held.estimation_log, held.part.log) == (number, fitted.log)


def at_rest_from(stop, *, then=0.0):
    """A log of 6 s whose machine stands still from some time [s] on, and moves again in its last part [s]."""
    log = simulated(duration=6.0, noise=False)
    places = log.measured.copy()
    places[(log.t >= stop) & (log.t <= 6.0 - then)] = places[np.searchsorted(log.t, stop)]
    noise = np.array([1e-3, 1e-2, 1e-2]) * np.random.default_rng(1).normal(size=places.shape)
    return replace(log, measured=places + noise)


@pytest.mark.parametrize(("stop", "moving"), [(4.2, 4.2), (4.8, 4.8), (5.5, 6.0), (6.0, 6.0)])
def test_where_a_machine_stands_still_for_most_of_the_last_third_a_third_of_what_moves_is_held_out_too(stop, moving):
    log = at_rest_from(stop)
    problem = prepare(Model.default(), [log], lean=True)
    fitted, held = samples(problem.data.estimation[0]), samples(problem.data.validation[0].part)
    begin = log.t[min(held)]
    assert moving * 2 / 3 - 0.05 <= begin < moving * 2 / 3 + 0.52 and max(fitted) < min(held)
    assert 6.0 - log.t[max(held)] < 0.6  # the last third is held out whatever it does


@pytest.mark.parametrize("effects", [[], ["external_push"]])
def test_it_is_said_where_more_is_held_out_and_not_where_segments_take_turns(effects):
    model, log = Model.default().with_effects(effects), at_rest_from(4.2)
    said = [w for w in prepare(model, [log], lean=True).warnings if "stands still for most of the last third" in w]
    assert len(said) == (0 if effects else 1)
    assert not [w for w in prepare(Model.default(), [simulated(duration=6.0)], lean=True).warnings if "third" in w]


def swinging_until(stop, plant="pendulum"):
    """A log of 6 s of what nothing drives, or of a slide, that swings until some time [s]."""
    t = np.arange(0.0, 6.0, 0.01)
    place = 0.5 * np.cos(8.0 * np.minimum(t, stop)) + 1e-4 * np.random.default_rng(1).normal(size=len(t))
    return Log("swing.csv", t, np.zeros(len(t)), place[:, None], ("x" if plant == "slide" else "theta_1",))


@pytest.mark.parametrize(("stop", "end"), [(2.5, 3.0), (4.2, 4.7), (1.2, 6.0), (6.0, 6.0)])
def test_what_nothing_drives_is_judged_until_a_horizon_after_it_stops_if_it_moved_for_three(stop, end):
    log = swinging_until(stop)
    problem = prepare(Model.parse('plant = "pendulum"\n'), [log], lean=True)
    judged = {*samples(problem.data.estimation[0]), *samples(problem.data.validation[0].part)}
    assert end - 0.2 < log.t[max(judged)] <= end
    assert any("comes to rest before" in w for w in problem.warnings) == (end < 6.0)


def test_a_swing_that_is_lost_and_not_at_rest_is_judged_as_it_is():
    log = swinging_until(6.0)
    lost = replace(log, measured=np.where(log.t[:, None] > 4.0, np.nan, log.measured))
    assert not any(
        "comes to rest" in w for w in prepare(Model.parse('plant = "pendulum"\n'), [lost], lean=True).warnings
    )


@pytest.mark.parametrize(("held", "swings", "left"), [(2.0, 2.0, True), (2.0, 0.8, False)])
def test_of_a_swing_that_is_held_first_a_third_of_the_motion_is_held_out(held, swings, left):
    t = np.arange(0.0, 8.0, 0.01)
    place = 0.5 * np.cos(8.0 * np.clip(t - held, 0.0, swings)) + 1e-4 * np.random.default_rng(1).normal(size=len(t))
    problem = prepare(
        Model.parse('plant = "pendulum"\n'),
        [Log("held.csv", t, np.zeros(len(t)), place[:, None], ("theta_1",))],
        lean=True,
    )
    begin = t[min(samples(problem.data.validation[0].part))]
    assert held + 0.5 * swings < begin < held + 0.85 * swings
    assert any("comes to rest" in w for w in problem.warnings) == left


def test_a_swing_that_is_small_and_not_hidden_by_noise_is_judged_too():
    log = swinging_until(6.0)
    noise = 1e-4 * np.random.default_rng(1).normal(size=len(log))
    decaying = replace(log, measured=(0.5 * np.exp(-2.0 * log.t) * np.cos(8.0 * log.t) + noise)[:, None])
    problem = prepare(Model.parse('plant = "pendulum"\n'), [decaying], lean=True)
    judged = {*samples(problem.data.estimation[0]), *samples(problem.data.validation[0].part)}
    assert 3.4 < log.t[max(judged)] < 5.0  # a hundredth of its range is left at 2.3 s, its noise at 3.7 s


def test_a_driven_machine_that_stands_still_is_judged_to_the_end_of_its_log_as_that_tells_what_holds_it():
    log = swinging_until(4.2, plant="slide")
    held = prepare(Model.parse('plant = "slide"\n'), [log], lean=True).data.validation[0].part
    assert log.t[max(samples(held))] > 5.5


def at_rest_until(begin, noise=1.0):
    """A log of 6 s whose machine stands still until some time [s], with so many times the usual noise."""
    log = simulated(duration=6.0, noise=False)
    places = log.measured.copy()
    places[log.t < begin] = places[np.searchsorted(log.t, begin)] * [1.0, 0.0, 0.0]
    added = noise * np.array([1e-3, 1e-2, 1e-2]) * np.random.default_rng(1).normal(size=places.shape)
    return replace(log, measured=places + added)


@pytest.mark.parametrize(("begin", "held"), [(1.0, 4.0), (3.0, 5.0), (4.5, 5.5)])
def test_where_a_machine_stands_still_for_most_of_what_is_fitted_two_thirds_of_what_moves_are_fitted_too(begin, held):
    log = at_rest_until(begin)
    problem = prepare(Model.default(), [log], lean=True)
    first = log.t[min(samples(problem.data.validation[0].part))]
    assert held - 0.05 <= first < held + 0.3
    said = [w for w in problem.warnings if "stands still for most of the first two thirds" in w]
    assert len(said) == (begin > 2.0)


def test_a_motion_too_short_to_hold_out_a_third_of_it_is_refused_and_not_where_another_log_judges():
    log = at_rest_until(5.8, noise=0.01)
    with pytest.raises(Failure, match=r"stands still until t = 5\.8 s and moves for 0\.2 s.*--holdout"):
        prepare(Model.default(), [log], lean=True)
    assert prepare(Model.default(), [log], [simulated(duration=3.0, seed=1)], lean=True).data.validation
    quiet = prepare(Model.default(), [at_rest_until(5.8, noise=3.0)], lean=True)  # which noise may hide, or be a motion
    assert quiet.data.validation[0].part.bounds[0, 0] < 0.7 * len(log)


def test_a_short_motion_between_two_rests_is_not_left_out_of_what_is_judged():
    t = np.arange(0.0, 6.0, 0.01)
    place = 0.05 * np.clip((t - 3.0) / 0.2, 0.0, 1.0) + 1e-5 * np.random.default_rng(1).normal(size=len(t))
    log = Log("short.csv", t, np.where((t > 3.0) & (t < 3.2), 3.0, 0.0), place[:, None], ("x",))
    with pytest.raises(Failure, match=r"stands still until t = 3.*moves for 0\.[12]"):
        prepare(Model.parse('plant = "slide"\n'), [log], lean=True)
    creeping = replace(log, measured=log.measured + 2e-3 * np.sin(3.0 * t)[:, None])
    held = prepare(Model.parse('plant = "slide"\n'), [creeping], lean=True).data.validation[0].part.bounds
    assert np.ptp(creeping.measured[held[0, 0] : held[-1, 1]]) > 3e-3


def test_a_log_that_never_leaves_its_noise_by_much_is_divided_as_any_other():
    random = np.random.default_rng(2)
    t = np.arange(0.0, 6.0, 0.01)
    place = 1e-4 * random.normal(size=len(t)) + 2e-4 * np.sin(2.0 * t)
    log = Log("quiet.csv", t, np.sign(np.sin(2.0 * t)), place[:, None], ("x",))
    problem = prepare(Model.parse('plant = "slide"\n'), [log], lean=True)
    assert 3.9 < log.t[problem.data.validation[0].part.bounds[0, 0]] < 4.1


def test_one_that_moves_again_at_the_end_has_its_last_third_held_out():
    log = at_rest_from(4.2, then=0.3)
    problem = prepare(Model.default(), [log], lean=True)
    assert 4.0 <= log.t[min(samples(problem.data.validation[0].part))] < 4.6


def test_held_out_logs_take_no_part_in_the_fit_and_leave_it_the_whole_of_its_own():
    own, other = simulated(duration=6.0), simulated(duration=3.0, seed=1)
    problem = prepare(Model.default(), [own], [other], lean=True)
    assert [log.t is own.t for log in problem.logs] == [True]
    assert [v.part.log.t is other.t for v in problem.data.validation] == [True]
    assert max(samples(problem.data.estimation[0])) >= len(own) - 2
    held = problem.data.validation[0]
    assert max(samples(held.calibration)) < len(other) // 3 <= min(samples(held.part))
    assert held.estimation_log is None and len(problem.noise) == 2
    assert prepare(Model.default(), [own], use_all=True, lean=True).data.validation == ()


def test_every_log_is_judged_by_its_own_noise():
    own, other = simulated(duration=3.0), simulated(duration=3.0, noise=False)
    rough = replace(other, measured=other.measured + 0.05 * np.random.default_rng(0).normal(size=other.measured.shape))
    problem = prepare(Model.default(), [own], [rough], lean=True)
    assert problem.data.validation[0].part.sigma[1:] == pytest.approx([0.05, 0.05], rel=0.1)
    assert problem.data.validation[0].calibration.sigma[1:] == pytest.approx([0.05, 0.05], rel=0.1)
    assert problem.data.estimation[0].sigma[1:] == pytest.approx(np.radians([0.5, 0.5]), rel=0.1)


def test_every_second_segment_is_held_out_where_they_take_turns(problem):
    found = with_interleaved_validation(problem)
    assert not samples(found.data.estimation[0]) & samples(found.data.validation[0].part)
    assert len(samples(found.data.estimation[0]) | samples(found.data.validation[0].part)) > 0.97 * len(problem.logs[0])


def test_shorter_segments_stay_within_the_training_data_and_are_thinned(problem):
    (short,) = shortened_segments(problem, 0.01, max_segments=100)
    assert samples(short) <= samples(problem.data.estimation[0])
    assert 100 <= len(short.bounds) < 200 and set(np.diff(short.bounds, axis=1).ravel()) == {10}


def test_the_error_of_a_true_model_is_one_however_many_states_are_fitted(problem, known):
    held, residuals = validation_residuals(problem, known)
    count = problem.data.validation[0].part.values
    assert count - 4 * len(problem.data.validation[0].part.bounds) < 0.95 * count
    for found in (held, known.error):
        assert found == pytest.approx(1.0, abs=0.012)
    assert np.nansum(residuals[0] ** 2) < 0.95 * count
    segments = problem.data.validation[0].part
    assert prediction_error(problem.simulator, segments, X)[0] == pytest.approx(held, rel=1e-6)


def test_a_model_without_validation_data_has_the_error_of_its_fit(problem, known):
    assert validation_residuals(replace(problem, data=replace(problem.data, validation=())), known) == (known.error, [])


def test_a_fit_percentage_is_what_the_error_leaves_of_the_spread(problem):
    segments = problem.data.validation[0].part
    readings = np.full_like(segments.log.measured, np.nan)
    a, b = segments.bounds[0, 0], segments.bounds[-1, 1]
    readings[a:b] = segments.log.measured[a:b]
    residual = 0.25 * (readings - np.nanmean(readings, axis=0)) / segments.sigma
    assert fit_percent(problem, [residual]) == pytest.approx(dict.fromkeys(segments.log.channels, 75.0))
    assert fit_percent(problem, [0.0 * residual]) == pytest.approx(dict.fromkeys(segments.log.channels, 100.0))


def test_where_each_log_lies_is_no_spread_that_a_model_explains(problem):
    part = problem.data.validation[0]
    segments = part.part
    readings = np.full_like(segments.log.measured, np.nan)
    a, b = segments.bounds[0, 0], segments.bounds[-1, 1]
    readings[a:b] = segments.log.measured[a:b]
    residual = 0.25 * (readings - np.nanmean(readings, axis=0)) / segments.sigma
    elsewhere = replace(segments, log=replace(segments.log, measured=segments.log.measured + 1000.0))
    both = replace(problem, data=replace(problem.data, validation=(part, replace(part, part=elsewhere))))
    assert fit_percent(both, [residual, residual]) == pytest.approx(dict.fromkeys(segments.log.channels, 75.0))


def test_a_phase_is_one_logs_and_an_amplitude_the_others():
    found = with_amplitude({"a": 0.6, "b": -0.8}, {"a": 0.0, "b": 3.0}, [("a", "b")])
    assert found == pytest.approx({"a": 1.8, "b": -2.4})
    assert with_amplitude({"a": 0.0, "b": 0.0}, {"a": 1.0, "b": 3.0}, [("a", "b")]) == {"a": 1.0, "b": 3.0}


def test_a_logs_own_offset_is_estimated_on_it_and_what_is_shared_stays():
    log = simulated(duration=2.0, gyro_bias__bias=0.05)
    problem = prepare(Model.default().with_effects(["gyro_bias"]), [log], use_all=True)
    found = calibrated_values(
        problem, problem.data.estimation[0], {**X, "gyro_bias.bias": 0.0}, ["X1", "gyro_bias.bias"]
    )
    assert found["gyro_bias.bias"] == pytest.approx(0.05, abs=0.002)
    assert {n: found[n] for n in X} == X


def test_parameters_of_a_log_hold_its_values_and_absence_where_there_is_none(library):
    log = simulated(duration=2.0)
    log = replace(log, measured=log.measured + 0.25)
    found = dict(zip(library.PARAMETERS, kernel_parameters(library, {"X3": 0.5}, log), strict=True))
    absent = dict(zip(library.PARAMETERS, library.ABSENT, strict=True))
    assert found == {**absent, "X3": 0.5, "origin": log.measured[0, 0]}


def test_a_prediction_that_runs_away_is_no_number_and_no_warning(problem, known):
    wild = replace(known, values={**known.values, "X6": -50.0, "X7": -50.0})
    error, residuals = validation_residuals(problem, wild)
    assert error > 10.0 and all(np.nanmax(np.abs(r)) <= RUNAWAY_RESIDUAL_SIGMAS for r in residuals)
    assert sum_of_squares(np.array([[1.0, np.nan], [2.0, 3.0]])) == pytest.approx(14.0)
    assert sum_of_squares(np.array([[RUNAWAY_RESIDUAL_SIGMAS, 1.0]])) == np.inf
    assert sum_of_squares(np.full((2, 2), np.nan)) == np.inf


@pytest.mark.slow
def test_as_many_states_are_discounted_from_held_out_segments_as_a_prediction_discounts():
    for machine in ("slide", "turning"):
        model = model_of(machine)
        problem, values = prepare(model, [log_of(machine)], lean=True), known_values(model)
        error, _ = validation_residuals(problem, Fit.at(values))
        predicted, _ = prediction_error(problem.simulator, problem.data.validation[0].part, values)
        assert error == pytest.approx(predicted, rel=1e-6), machine


@pytest.mark.parametrize("held", [0.5, 3.0, 5.0])
def test_the_last_third_is_that_of_what_is_used_where_a_hand_holds_the_machine_at_first(held):
    t = np.arange(0.0, 8.0, 0.01)
    swung = 0.6 * np.cos(6.0 * np.clip(t - held, 0.0, None)) * np.exp(-0.1 * np.clip(t - held, 0.0, None))
    noisy = swung + 2e-4 * np.random.default_rng(0).normal(size=len(t))
    problem = prepare(Model.parse('plant = "pendulum"\n'), [{"t": t, "theta_1": noisy}], lean=True)
    (log,), first = problem.logs, held + (8.0 - held) * 2 / 3
    assert first - 0.1 < log.t[min(samples(problem.data.validation[0].part))] < first + 0.55
    assert held <= log.t[min(samples(problem.data.estimation[0]))] < held + 0.3


def test_the_share_of_the_motion_that_is_missed_leaves_out_what_goes_on_as_it_began():
    t = 0.01 * np.arange(200)
    swing = np.sin(6.0 * t)
    log = Log("made", t, np.zeros((200, 0)), np.column_stack([5.0 + 3.0 * t + swing]), ("x",), rates={})
    part = Segments(log, np.array([0.1]), np.array([[0, 100], [100, 200]]))
    straight = swing.copy()
    for a, b in part.bounds:
        straight[a:b] -= np.polyval(np.polyfit(t[a:b], swing[a:b], 1), t[a:b])
    for missed in (0.0, 0.5, 1.0):
        share = unpredicted_share([part], [missed * straight[:, None] / 0.1])
        assert share == pytest.approx(missed**2, abs=1e-12)
    assert unpredicted_share([], []) is None
