"""Errors of a comparison on a wrong model, where a square, a σ or a factor shows."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Model, compare, simulate
from wheelpend.diagnosis import horizons
from wheelpend.diagnosis.compare import rmse_of
from wheelpend.diagnosis.horizons import HorizonError, errors_at, errors_over, horizons_of
from wheelpend.diagnosis.replay import ClosedLoopReplay, replay_closed_loop, replayed_together
from wheelpend.estimation.data import prepare
from wheelpend.estimation.prediction import prediction_error
from wheelpend.logs.log import Log

WRONG = {**X, "X5": 0.9 * X["X5"], "X6": 1.1 * X["X6"]}


@pytest.fixture(scope="module")
def wrong():
    """A model with wrong values, and a log of the right one."""
    model = Model.default()
    return model.with_fit({n: (v, None) for n, v in WRONG.items()}), simulated(duration=4.0)


@pytest.fixture(scope="module")
def compared(wrong):
    return compare(wrong[0], [wrong[1]])


def test_an_error_per_channel_is_in_the_channels_unit(wrong, compared):
    problem = prepare(wrong[0], [wrong[1]], use_all=True)
    segments = problem.data.estimation[0]
    error, residual = prediction_error(problem.simulator, segments, WRONG)
    assert compared.error == pytest.approx(error, rel=1e-3) and error > 5.0
    for channel, number, sigma in zip(wrong[1].channels, residual.T, segments.sigma, strict=True):
        rms = sigma * np.sqrt(np.nanmean(number**2))
        assert compared.rmse[channel] == pytest.approx(rms, rel=1e-3)
    two = rmse_of([segments, segments], [np.ones_like(residual), np.full_like(residual, 7.0)])
    assert two == pytest.approx(dict(zip(wrong[1].channels, 5.0 * segments.sigma, strict=True)))  # √((1 + 49)/2)


def test_the_error_over_the_horizon_is_that_of_segments_as_long(wrong, compared):
    by_length = {h.seconds: h for h in compared.horizons}
    assert by_length[0.5].error == pytest.approx(compared.error, rel=1e-3)
    assert by_length[0.1].error < by_length[0.2].error < by_length[0.5].error < by_length[1.0].error
    assert [h.seconds for h in compared.horizons] == pytest.approx([0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0])
    assert horizons_of(wrong[1]) == tuple(h.seconds for h in compared.horizons)


def test_the_error_over_several_logs_is_the_mean_of_their_squares(wrong):
    problem = prepare(wrong[0], [wrong[1], wrong[1]], use_all=True)
    right, off = (errors_at(problem, problem.data.estimation[:1], [v], 0.2).error for v in (X, WRONG))
    both = errors_at(problem, problem.data.estimation, [X, WRONG], 0.2)
    assert both.error == pytest.approx(np.sqrt((right**2 + off**2) / 2), rel=1e-6)
    assert not both.diverged and off > 3.0 * right


def test_a_closed_loop_is_off_by_what_the_two_machines_differ(wrong):
    model, exact = wrong[0], simulated(duration=4.0, noise=False)
    machine = replace(Model.default(), simulation={**Model.default().simulation, **WRONG})
    other = simulate(machine, duration=4.0, noise=False)
    problem = prepare(model, [exact], use_all=True)
    first = replace(
        problem.data.estimation[0], bounds=np.array([[0, 12], [12, len(exact)]])
    )  # so short that the model does not bend its start
    found = replay_closed_loop(problem, first, WRONG)
    off = np.sqrt(np.mean((other.measured - exact.measured) ** 2, axis=0))
    assert found.rmse == pytest.approx(dict(zip(exact.channels, off, strict=True)), rel=0.05)
    assert found.rmse_input == pytest.approx(np.sqrt(np.mean((other.voltage - exact.voltage) ** 2)), rel=0.05)
    assert not found.diverged


def test_the_closed_loop_of_several_logs_is_off_by_what_all_their_samples_are():
    one, other = ClosedLoopReplay({"x": 3.0}, 1.0, False, 100), ClosedLoopReplay({"x": 1.0}, 2.0, False, 300)
    both = replayed_together([one, None, other])
    assert both is not None and both.samples == 400 and not both.diverged
    assert both.rmse["x"] == pytest.approx(np.sqrt(3.0)) and both.rmse_input == pytest.approx(np.sqrt(3.25))
    assert replayed_together([other, None, one]) == both and replayed_together([None]) is None
    lost = ClosedLoopReplay({}, float("nan"), True)
    assert replayed_together([one, lost]) is lost


def test_a_comparison_replays_every_log_whatever_their_order():
    logs = [simulated(duration=3.0, noise=False, seed=s, command=c) for s, c in ((1, "simple"), (2, "aggressive"))]
    model = Model.default().with_fit({n: (v, None) for n, v in WRONG.items()})
    found = [compare(model, order).closed_loop for order in (logs, logs[::-1])]
    assert found[0].rmse == pytest.approx(found[1].rmse, rel=1e-6) and found[0].samples == sum(map(len, logs))


def test_a_closed_loop_is_replayed_from_where_its_stretch_begins_though_segments_begin_later():
    """A held-out log's first third is not judged, and what comes before a command is another run."""
    whole = simulated(duration=4.0, noise=False)
    before = 50
    log = Log(
        "late",
        np.r_[whole.dt * np.arange(before), whole.dt * before + whole.t],
        np.r_[np.full(before, np.nan), whole.voltage],
        np.r_[np.repeat(whole.measured[:1], before, axis=0), whole.measured],
        whole.channels,
        reference=np.r_[np.zeros(before), whole.reference],
    )
    problem = prepare(Model.default().with_fit({n: (v, None) for n, v in X.items()}), [log], use_all=True)
    third = np.array([[200, 220], [220, 450]])
    found = replay_closed_loop(problem, replace(problem.data.estimation[0], bounds=third), X)
    assert max(found.rmse.values()) < 1e-3 and found.rmse_input < 0.01


def test_a_log_with_a_gap_offers_no_horizon_longer_than_its_longest_stretch():
    whole = simulated(duration=6.0)
    log = Log("gap", whole.t + 3.0 * (whole.t > 4.0), whole.voltage, whole.measured, whole.channels)
    longest = horizons_of(log)[-1]
    assert longest == pytest.approx(4.0, abs=2 * log.dt)
    assert not any(
        h.diverged for h in compare(Model.default().with_fit({n: (v, None) for n, v in X.items()}), [log]).horizons
    )


def test_a_held_out_log_is_compared_in_place_of_the_logs(wrong):
    model, log = wrong
    short = simulated("simple", duration=3.0)
    found = compare(model, [log], [short])
    segments = prepare(model, [log], [short]).data.validation[0].part
    error, _ = prediction_error(prepare(model, [log]).simulator, segments, WRONG)
    assert found.error == pytest.approx(error, rel=1e-3)
    assert abs(found.error / compare(model, [log]).error - 1.0) > 0.1


@pytest.mark.parametrize("interval", [0.001, 0.004, 0.01, 0.0100002, 0.0099998, 0.02])
def test_no_horizon_is_listed_twice(interval):
    log = replace(simulated(duration=1.0).part(0, 500), t=np.arange(500) * interval)
    listed = horizons_of(log)
    assert len({f"{h:.4g}" for h in listed}) == len(listed) and list(listed) == sorted(listed)
    assert listed[0] == pytest.approx(5 * interval) and listed[-1] == pytest.approx(499 * interval)


def test_a_short_prediction_whose_states_were_not_found_begins_where_a_longer_one_passes(wrong, compared, monkeypatch):
    problem = prepare(wrong[0], [wrong[1]], use_all=True)
    usual = horizons.initial_states

    def lost(module, segments):
        """States of which one is not found, in segments of a fifth of a second."""
        states = usual(module, segments)
        if np.diff(segments.bounds[0]) == 200:
            states[3] = np.nan
        return states

    monkeypatch.setattr(horizons, "initial_states", lost)
    rows = problem.data.estimation, [WRONG], (0.1, 0.2, 0.5)
    assert errors_at(problem, *rows[:2], 0.2).diverged
    found = errors_over(problem, *rows)
    assert [h.diverged for h in found] == [False] * 3
    assert found[1].error == pytest.approx({h.seconds: h.error for h in compared.horizons}[0.2], rel=5e-2)


def test_beyond_a_long_horizon_that_diverged_none_is_said_to_hold(monkeypatch):
    lost = {5.0, 10.0}

    def errors(problem, segments, values, horizon, motion=None):
        return HorizonError(horizon, None if horizon in lost else 2.0, horizon in lost, segments=1)

    monkeypatch.setattr("wheelpend.diagnosis.horizons.errors_at", errors)
    found = errors_over(None, [], [], (0.5, 1.0, 2.0, 5.0, 10.0, 30.0))
    assert [h.diverged for h in found] == [False, False, False, True, True, True]
    assert found[-1] == HorizonError(30.0, None, True, segments=1)
    lost.clear()
    assert not any(h.diverged for h in errors_over(None, [], [], (0.5, 5.0, 30.0)))
