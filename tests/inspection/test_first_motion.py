"""Which way a machine sets out from rest tells a sign that equations with unknown friction do not."""

import numpy as np
import pytest

from wheelpend import Model, load_log
from wheelpend.inspection.inspect import inspect_for_model

SLIDE = Model.parse('plant = "slide"\n')
DRIVEN = Model.parse('plant = "pendulum"\n\n[assumptions]\ndriven = true\n')


def step_of_current(sign: float, samples: int = 60):
    """A motor whose current falls as it gains speed: an exponential, which friction and a constant explain too."""
    t = 0.004 * np.arange(samples)
    current = 2.0 * np.exp(-t / 0.03)
    current[0] = 0.0
    place = np.round(500.0 * (t - 0.03 * (1.0 - np.exp(-t / 0.03)))) * 1e-3
    return {"t": t, "v_in": current, "x": sign * place}


def found_signs(model, columns):
    log = load_log(columns, table=model.table, name="made")
    found = inspect_for_model(model, log)
    return [f.channel for f in found.findings if f.kind == "flipped_sign"], found.proposal


@pytest.mark.parametrize(("sign", "found"), [(1.0, []), (-1.0, ["x"])])
def test_a_step_from_rest_tells_the_sign(sign, found):
    signs, proposal = found_signs(SLIDE, step_of_current(sign))
    assert signs == found and ('x = { column = "x", sign = -1 }' in proposal) == bool(found)


def test_nothing_is_said_where_it_moves_at_first_or_is_pushed_both_ways():
    columns = step_of_current(-1.0)
    moving = {n: v[30:] for n, v in columns.items()}
    assert found_signs(SLIDE, moving)[0] == []
    both = {**columns, "v_in": columns["v_in"] * np.where(np.arange(60) % 2, 1.0, -1.0)}
    assert found_signs(SLIDE, both)[0] == []


def test_a_pendulum_that_is_let_go_falls_against_nothing():
    t = 0.01 * np.arange(60)
    swing = 0.4 * np.cos(6.0 * t)  # a hand lets go of it, and the motor acts later
    assert found_signs(DRIVEN, {"t": t, "v_in": np.where(t < 0.4, 2.0, 1.0), "theta_1": swing})[0] == []


def test_a_hanging_pendulum_follows_the_change_of_its_torque():
    t = 0.01 * np.arange(100)
    push = np.where(t > 0.05, 1.0, 0.0)
    swing = np.where(t > 0.05, 0.1 * (1.0 - np.cos(6.0 * (t - 0.05))), 0.0)
    assert found_signs(DRIVEN, {"t": t, "v_in": push - 0.3, "theta_1": swing})[0] == []
    assert found_signs(DRIVEN, {"t": t, "v_in": push - 0.3, "theta_1": -swing})[0] == ["theta_1"]


def lift(rows: int):
    """A load of 5 N that is let down from rest, at 4 N, 4.5 N and then more: it sinks against what is commanded."""
    t = 0.01 * np.arange(rows)
    push = np.where(t < 0.03, 4.0, 4.5)
    push = np.where(t < 3.0, push, np.repeat(np.random.default_rng(1).uniform(3.0, 6.2, rows), 40)[:rows])
    place, speed = np.zeros(rows), 0.0
    for k in range(rows - 1):
        speed += 0.01 * (push[k] - 5.0 - 2.0 * speed)
        place[k + 1] = place[k] + 0.01 * speed
    return {"t": t, "v_in": push, "x": place + 1e-5 * np.random.default_rng(2).normal(size=rows)}


@pytest.mark.parametrize("rows", [90, 1500])
def test_a_load_that_is_let_down_has_no_wrong_sign(rows):
    assert found_signs(SLIDE, lift(rows))[0] == []


def test_where_the_equations_are_clear_a_start_is_not_asked():
    columns = lift(1500)
    columns["v_in"][0] = 0.0  # as if nothing had been commanded at first
    assert found_signs(SLIDE, columns)[0] == []
    short = {n: v[:90] for n, v in columns.items()}
    assert found_signs(SLIDE, short)[0] == ["x"], "the equations are not asked of so short a log"


def test_the_rate_of_a_place_is_turned_with_it():
    model = Model.parse('plant = "slide"\n\n[assumptions]\nrate_sensor = true\n')
    columns = step_of_current(-1.0)
    _, proposal = found_signs(model, {**columns, "dx": np.gradient(columns["x"], 0.004)})
    assert 'x = { column = "x", sign = -1 }' in proposal and 'dx = { column = "dx", sign = -1 }' in proposal


def test_a_constant_command_says_nothing_by_its_rounding():
    for seed in range(20):
        random = np.random.default_rng(seed)
        t = 0.01 * np.arange(180)
        place = 2.0 * (t - 0.1 * (1.0 - np.exp(-t / 0.1))) + 1e-4 * random.normal(size=180)
        assert found_signs(SLIDE, {"t": t, "v_in": np.full(180, 4.0), "x": place})[0] == []
