"""What is no measurement is left out of a log, quickly, and what is one stays."""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests import faulty_logs as faulty
from tests.support import CHANNELS
from wheelpend import Log, Model, load_log
from wheelpend.logs.faults import readings_at_ceiling
from wheelpend.logs.recording import cured

TABLE = Model.default().table


def forward_only(offset=0.0):
    """A rate in steps that starts and stops sharply, forwards alone, with the angle that belongs to it."""
    t = np.arange(4000) * 5e-3
    rate = np.where(t % 4 < 2, 3.0 + np.sin(5 * t), 0.0)
    return t, np.round((rate + offset) / 0.002) * 0.002, np.cumsum(rate) * 5e-3


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_a_rate_that_only_goes_forward_is_not_saturated_at_rest(offset):
    _, rate, _ = forward_only(offset)
    assert not readings_at_ceiling(rate, rate)[0].any()
    assert readings_at_ceiling(np.minimum(rate, 3.5), rate)[0].sum() == (rate >= 3.5).sum()


def test_an_angle_at_which_the_machine_stops_is_not_saturated_though_it_stops_hard():
    t = np.arange(4000) * 5e-3
    angle = np.minimum(1.037 * np.abs((t % 4) - 2) + 0.01 * np.sin(7 * t), 1.5)  # against a stop
    rate = np.where(1.037 * np.abs(t % 4 - 2) < 1.5, np.sign(t % 4 - 2), 0.0)
    assert readings_at_ceiling(angle)[0].any() and not readings_at_ceiling(angle, rate)[0].any()
    still_moving = np.sign(t % 4 - 2)
    assert readings_at_ceiling(angle, still_moving)[0].any()


def test_a_log_whose_gyro_rests_at_nought_keeps_its_standstills():
    log = faulty.clean()
    rate = np.round(np.where(log.t % 4 < 2, 1.0 + np.abs(faulty.column(log, "dtheta_p")), 0.0) / 0.002) * 0.002
    log = replace(faulty.with_columns(log, dtheta_p=rate), faults=())
    left = cured(log, TABLE)
    assert "saturation" not in [f.kind for f in left.faults] and np.isfinite(left.measured[:, 2]).all()


def long_log(samples=300_000):
    """A long log whose encoder stands, its pitch known in every second sample only."""
    random, t = np.random.default_rng(0), np.arange(samples) * 1e-3
    pitch = np.where(np.arange(samples) % 2 > 0, np.nan, 0.1 * np.sin(3 * t) + 0.003 * random.standard_normal(samples))
    rate = 0.3 * np.cos(3 * t) + 0.003 * random.standard_normal(samples)
    return Log("long", t, np.sin(t), np.column_stack([0.01 * (t // 40), pitch, rate]), CHANNELS)


def test_a_long_log_with_an_angle_in_every_second_sample_takes_no_quadratic_time():
    log = long_log()
    begin = process_time()
    assert not cured(log, TABLE).faults and process_time() - begin < 2.0


def test_more_recordings_than_twenty_are_cut_apart_in_a_long_log():
    log = faulty.joined(faulty.clean(), faulty.clean(1))
    other = np.arange(len(log)) // 1500 % 2  # every 1.5 s the other of two machines
    wheel, pitch = faulty.column(log, "theta_w") + other, faulty.column(log, "theta_p") + 0.2 * other
    left = cured(faulty.with_columns(log, theta_w=wheel, theta_p=pitch), TABLE)
    assert set(range(1500, len(log), 1500)) <= set(left.breaks) and 26 <= len(left.breaks) <= 27


def test_a_machine_that_lies_is_found_though_its_pitch_is_known_in_every_second_sample_only():
    log = faulty.on_the_floor(faulty.clean(), 5, 12)
    pitch = np.where(np.arange(len(log)) % 2 > 0, np.nan, faulty.column(log, "theta_p"))
    left = cured(faulty.with_columns(log, theta_p=pitch), TABLE)
    assert [f.kind for f in left.faults] == ["lying"] and left.faults[0].size == pytest.approx(7.0, abs=0.5)


def swing(held: float, *, noise: float = 2e-4, friction: float = 0.0) -> dict[str, np.ndarray]:
    """Columns of a pendulum that is held at 0.6 rad for a time [s], and then swings freely."""
    t = np.arange(0.0, 8.0, 0.01)

    def rates(now, state):
        return [state[1], -30.0 * np.sin(state[0]) - friction * np.tanh(state[1] / 1e-3)] if now >= held else [0.0, 0.0]

    angle = solve_ivp(rates, (0.0, 8.0), [0.6, 0.0], t_eval=t, max_step=2e-3).y[0]
    return {"t": t, "theta_1": angle + noise * np.random.default_rng(0).normal(size=len(t))}


PENDULUM = Model.parse('plant = "pendulum"\n').table


@pytest.mark.parametrize("held", [0.3, 1.0, 3.0])
def test_a_pendulum_that_is_held_at_first_is_judged_from_where_it_is_let_go(held):
    log = load_log(swing(held), table=PENDULUM, name="held")
    assert [f.kind for f in log.faults] == ["held"] and held < log.faults[0].size < held + 0.1
    assert f"until t = {log.faults[0].size:.4g} s" in log.faults[0].sentence
    left_out = np.isnan(log.voltage)
    assert left_out[log.t < held].all() and not left_out[log.t > held + 0.1].any()


@pytest.mark.parametrize("noise", [2e-4, 2e-3, 2e-2])
@pytest.mark.parametrize("friction", [0.0, 12.0])  # of 17 that pull at first
def test_one_that_is_let_go_from_rest_as_the_log_begins_is_not_held(noise, friction):
    assert not load_log(swing(0.0, noise=noise, friction=friction), table=PENDULUM, name="free").faults


def test_a_speed_that_flickers_between_two_counts_is_at_no_ceiling():
    steady = 50.0 * np.floor(np.cumsum(np.full(80, 9.75)) % 1.0 + 9.75)  # of 9.75 counts in each row
    steady[np.flatnonzero(steady < 500.0)[::3]] += 4.5  # a row that came early
    speed = np.concatenate([np.zeros(10), [100.0, 300.0, 400.0, 450.0], steady])
    assert not readings_at_ceiling(speed, speed)[0].any()
    swing = np.clip(700.0 * np.sin(0.12 * np.arange(400)), -500.0, 500.0)
    assert readings_at_ceiling(swing, swing)[0].any()


@pytest.mark.parametrize(("size", "noise"), [(255.0, 4.0), (260.0, 8.0), (280.0, 16.0)])
def test_noise_takes_no_clipped_reading_from_its_ceiling(size, noise):
    random = np.random.default_rng(9)
    swing = size * np.sin(0.05 * np.arange(4000)) + noise * random.standard_normal(4000)
    clipped = np.clip(np.round(swing / 0.03) * 0.03, -250.0, 250.0)
    assert readings_at_ceiling(clipped, clipped)[0].sum() == np.sum(np.abs(clipped) == 250.0)
