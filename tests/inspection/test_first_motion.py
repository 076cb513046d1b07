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
