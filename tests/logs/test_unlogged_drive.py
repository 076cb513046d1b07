"""A machine that moves as nothing free does, though its log has no drive, is told; a free one is not."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wheelpend import Model, load_log
from wheelpend.logs.unlogged_drive import unlogged_drive

T = np.arange(0.0, 12.0, 0.01)
FREE = Model.parse('plant = "pendulum"\n')


def read(values, step=1e-3):
    return np.round(values / step) * step


def found(*places, t=T):
    return unlogged_drive(t[: len(places[0])], {f"theta_{k}": v for k, v in enumerate(places, 1)}, "pendulum")


def to_a_place(start, end, begin, duration=0.8):
    """A smooth way to a place, behind and before rest."""
    x = np.clip((T - begin) / duration, 0.0, 1.0)
    return start + (end - start) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def swing(amplitude, damping=0.1, friction=0.0, start=0.0):
    def slope(t, x):
        return [x[1], -30.0 * np.sin(x[0]) - damping * x[1] - friction * np.tanh(x[1] / 1e-3)]

    return solve_ivp(slope, (0.0, T[-1]), [amplitude, start], t_eval=T, rtol=1e-8, max_step=0.01).y[0]


def test_a_joint_that_rests_between_two_motions_is_driven():
    way = to_a_place(0.0, 1.0, 1.0) + to_a_place(0.0, -0.6, 4.0)
    assert not unlogged_drive(T, {}, "pendulum")
    holed = np.where(np.arange(T.size) % 7 == 3, np.nan, read(way))
    assert found(holed) and not found(np.full(T.size, np.nan)) and not found(np.zeros(T.size)) and not found(way[:20])
    (told,) = found(read(way), read(0.5 * way))
    assert told.kind == "unlogged_drive" and "stands still from t = 1.7" in told.sentence
    assert "map it as the input" in told.cure and told.size == pytest.approx(4.05, abs=0.15)


def test_it_must_rest_everywhere_at_once():
    one, other = to_a_place(0.0, 1.0, 1.0) + to_a_place(0.0, -0.6, 4.0), 0.3 * np.sin(5.0 * T)
    assert not found(read(one), read(other))


@pytest.mark.parametrize("step", [1e-4, 0.01, 0.03])
@pytest.mark.parametrize("swung", [swing(1.0), swing(3.1, 0.3), swing(0.8, friction=1.5), swing(0.0, start=9.0)])
def test_a_free_swing_is_not_whatever_its_sensor_resolves(swung, step):
    assert not found(read(swung, step))


def test_what_a_motor_sets_turning_is_driven_and_what_falls_is_not():
    turned = 8.0 * (T - 1.5 + 1.5 * np.exp(-T / 1.5))
    (told,) = found(read(turned))
    assert told.channel == "theta_1" and "goes on one way at a steady speed" in told.sentence
    uneven = T + 0.004 * np.sin(T / 0.3)
    assert found(read(np.interp(uneven, T, turned)), t=uneven)
    assert found(read(-turned)) and not found(read(turned[::-1]))  # a way that ends slowly is that of what coasts down
    assert not found(read(np.cos(0.5 * np.pi * T / T[-1])))  # and a quarter of a swing that of what falls


def test_it_is_told_with_the_log_and_only_where_no_input_is_logged():
    way = read(to_a_place(0.2, 1.0, 1.0) + to_a_place(0.0, -0.6, 4.0))
    log = load_log({"t": T, "theta_1": way}, table=FREE.table)
    assert [f.kind for f in log.faults if f.kind != "held"] == ["unlogged_drive"]
    driven = Model.parse('plant = "pendulum"\n\n[assumptions]\ndriven = true\n')
    driven_log = load_log({"t": T, "v_in": np.gradient(way), "theta_1": way}, table=driven.table)
    assert not [f for f in driven_log.faults if f.kind == "unlogged_drive"]
