"""From where on a machine stands still, and logs that begin with a step from rest."""

import numpy as np
import pytest

from wheelpend.logs.checks import runaway_warnings
from wheelpend.logs.log import Log
from wheelpend.logs.rest import led_by_rest, rest_begin, rest_end
from wheelpend.model.record import Model

T = np.arange(0.0, 20.0, 0.01)
SIGMA = 1e-3


def decaying(stop: float, seed: int = 0) -> np.ndarray:
    """An angle that swings with the amplitude of one that dry friction brakes, until it stands still; with noise."""
    swing = np.maximum(1.0 - T / stop, 0.0) * np.cos(4.0 * T)
    return swing + SIGMA * np.random.default_rng(seed).normal(size=len(T))


def log(*channels: np.ndarray) -> Log:
    measured = np.column_stack(channels)
    return Log("made", T, np.zeros((len(T), 0)), measured, tuple(f"theta_{k + 1}" for k in range(len(channels))))


@pytest.mark.parametrize("stop", [14.0, 16.0, 18.0])
def test_a_machine_rests_from_where_it_stays_within_its_noise_or_a_hundredth_of_its_range(stop):
    begin = rest_begin(log(decaying(stop)), [SIGMA])
    assert stop - 0.6 < T[begin] <= stop + 0.05


def test_one_that_swings_to_its_end_does_not_rest():
    assert T[-1] - T[rest_begin(log(decaying(30.0)), [SIGMA]) - 1] < 0.2


@pytest.mark.parametrize(("amplitude", "rests"), [(4.0, False), (0.5, True)])
def test_a_swing_within_the_spread_that_noise_may_have_is_no_rest(amplitude, rests):
    sigma = 0.02  # of a camera that holds its readings: from sample to sample they jump more than they are wrong
    noise = 0.25 * sigma * np.random.default_rng(2).normal(size=len(T))
    angle = np.where(T < 8.0, 0.3, amplitude * sigma) * np.cos(4.0 * T) + noise
    begin, end = rest_begin(log(angle), [sigma]), rest_end(log(angle[::-1]), [sigma])
    assert (T[min(begin, len(T) - 1)] < 8.5) == rests and (T[min(end, len(T) - 1)] > 11.5) == rests


def test_a_long_rest_may_drift():
    angle = np.where(T < 5.0, 0.1 * np.cos(4.0 * T), 7.5 * SIGMA * (T - 5.0) / 15.0)
    begin = rest_begin(log(angle + SIGMA * np.random.default_rng(3).normal(size=len(T))), [SIGMA])
    assert 4.5 < T[begin] < 10.0, "ten seconds of it are known for a rest"


def test_two_links_rest_when_both_do():
    begins = [rest_begin(log(*pair), [SIGMA] * len(pair))
              for pair in ([decaying(14.0)], [decaying(14.0), decaying(17.0, 1)], [decaying(17.0, 1)])]  # fmt: skip
    assert begins[0] < begins[1] == begins[2]


def test_one_that_is_moved_once_more_rests_from_then_on():
    angle = decaying(14.0)
    angle[1800:1805] += 0.1
    assert rest_begin(log(angle), [SIGMA]) == 1805


def test_missing_readings_are_no_motion_and_a_channel_without_any_is_at_rest():
    angle = decaying(14.0)
    whole = rest_begin(log(angle), [SIGMA])
    angle[1600:1700] = np.nan
    assert rest_begin(log(angle), [SIGMA]) == whole
    angle[1000:] = np.nan
    assert rest_begin(log(angle), [SIGMA]) >= 990


@pytest.mark.parametrize("stop", [14.0, 18.0])
def test_a_machine_has_rested_until_it_leaves_its_noise(stop):
    assert abs(T[rest_end(log(decaying(stop)[::-1]), [SIGMA])] - (20.0 - stop)) < 0.6
    assert T[rest_end(log(decaying(stop)[::-1], decaying(30.0)), [SIGMA] * 2)] < 0.2  # one channel moves at once
    assert rest_end(log(np.zeros(len(T))), [SIGMA]) == len(T)


def test_a_log_that_moves_in_its_last_sample_does_not_rest():
    angle = decaying(14.0)
    angle[-1] += 0.5
    assert rest_begin(log(angle), [SIGMA]) == len(T)


def test_of_a_long_log_the_place_is_told_to_a_few_samples():
    t = np.arange(0.0, 1500.0, 0.001)
    angle = np.where(t < 1200.0, np.sin(3.0 * t), 0.0)[:, None]
    begin = rest_begin(Log("long", t, np.zeros((len(t), 0)), angle, ("theta_1",)), [SIGMA])
    assert abs(t[begin] - 1200.0) < 0.01


AXIS = Model.parse('plant = "slide"\n').table
AXIS_T = np.arange(0.0, 1.5, 0.005)


def axis_log(x: np.ndarray, volts: np.ndarray, table=AXIS) -> Log:
    """A log of a linear axis, its place read to a hundredth of a millimetre."""
    return Log.from_arrays(AXIS_T, table=table, v_in=volts, **{table.channels[0]: np.round(x, 5)})


def after(begin: float) -> np.ndarray:
    """Place of a motor that gathers speed from a time [s] on."""
    on = np.maximum(AXIS_T - begin, 0.0)
    return on - 0.05 * (1.0 - np.exp(-on / 0.05))


def test_a_log_that_begins_with_a_step_from_rest_is_led_by_rest_where_the_machine_is_first_seen():
    log = axis_log(0.3 + after(0.0), np.full(len(AXIS_T), 6.0))
    led = led_by_rest(log, AXIS)
    assert 0.2 <= -led.t[0] < 0.2 + 2 * log.dt and np.allclose(np.diff(led.t), log.dt)
    assert not led.voltage[led.t < -1e-9].any() and (led.voltage[led.t > -1e-9] == 6.0).all()
    assert led.measured[0, 0] == 0.3 and np.isnan(led.measured[1 : led.lead]).all()
    assert np.array_equal(led.measured[led.lead :], log.measured)
    assert led.samples == len(log) and led.duration == log.duration
    assert led_by_rest(led, AXIS) is led and log.as_read() is log
    assert led.first_read == led.lead and log.first_read == 0
    assert np.array_equal(led.as_read().t, log.t) and led.as_read().lead == 0
    assert led.stretches[0].settled == 0 and log.stretches[0].settled > 0
    assert led.part(10, 200).lead == led.lead - 10 and led.part(100, 200).lead == 0


@pytest.mark.parametrize(
    ("x", "volts", "why"),
    [
        (AXIS_T + after(0.0), np.where(AXIS_T < 1.0, 6.0, 3.0), "it moves at first"),
        (after(0.5), np.where(AXIS_T < 0.5, 2.0, 6.0), "what holds it had been commanded"),
        (after(0.0), 6.0 * np.cos(AXIS_T), "what is commanded changes at once"),
        (after(0.0), np.where(AXIS_T < 0.5, 0.0, 6.0), "nothing is commanded at first"),
        (np.where(AXIS_T < 1.0, 0.4 * AXIS_T, 3.0 - 0.4 * AXIS_T), np.full(len(AXIS_T), 6.0), "it jumps, but moves"),
    ],
)
def test_a_log_that_begins_otherwise_is_left_as_it_is(x, volts, why):
    log = axis_log(x, volts)
    assert led_by_rest(log, AXIS) is log, why


@pytest.mark.parametrize(("before", "led"), [(0.0, True), (0.0015, True), (0.005, False), (0.01, False)])
def test_one_that_had_been_set_in_motion_a_row_before_the_first_is_not_led_by_rest(before, led):
    log = axis_log(after(-before), np.full(len(AXIS_T), 6.0))
    assert (led_by_rest(log, AXIS) is not log) == led


def test_what_is_commanded_later_says_nothing_of_the_first_steps():
    later = np.maximum(AXIS_T - 1.0, 0.0)
    log = axis_log(after(0.0) + 3.0 * later, np.where(AXIS_T < 1.0, 2.0, 8.0))
    assert led_by_rest(log, AXIS).lead > 0


@pytest.mark.parametrize("delay", [0.005, 0.02])
def test_one_that_waits_before_it_moves_is_led_by_rest(delay):
    log = axis_log(after(delay), np.full(len(AXIS_T), 6.0))
    assert led_by_rest(log, AXIS).lead > 0


def test_a_machine_that_must_be_balanced_never_begins_at_rest():
    table = Model.default().table
    turning = {"theta_p": 0.1 * after(0.0), "dtheta_p": np.gradient(0.1 * after(0.0), AXIS_T), "theta_w": after(0.0)}
    log = Log.from_arrays(AXIS_T, v_in=np.where(AXIS_T < 1.0, 6.0, 3.0), **turning)
    assert led_by_rest(log, table) is log


PENDULUM = Model.parse('plant = "pendulum"\n').table
DRIVEN = Model.parse('plant = "pendulum"\n\n[assumptions]\ndriven = true\n').table


@pytest.mark.parametrize(
    ("angle", "told"),
    [
        (12.0 * after(0.0), True),
        (3.0 * after(0.0), False),  # less than a turn
        (20.0 * np.sin(2.0 * AXIS_T) * AXIS_T, False),  # it comes back
        (12.0 * AXIS_T, False),  # it was thrown
    ],
)
def test_an_angle_that_turns_on_from_rest_is_driven_by_something(angle, told):
    log = Log.from_arrays(AXIS_T, table=PENDULUM, theta_1=angle)
    assert bool(runaway_warnings(log, PENDULUM)) == told
    driven = Log.from_arrays(AXIS_T, table=DRIVEN, v_in=np.cos(AXIS_T), theta_1=angle)
    assert runaway_warnings(driven, DRIVEN) == []
