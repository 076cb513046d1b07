"""A fast motor's steps from rest, from a simulator of their own: its speed comes and goes within the first moments."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wheelpend import Model, compare, explain, residuals

DT, SIGMA = 0.005, 2e-4  # s, m
MASS, DAMPING, FRICTION = 0.1, 2.0, 1.0  # V s²/m, V s/m, V


def step_log(volts: float, seed: int, lead: float) -> dict[str, np.ndarray]:
    """Columns of an axis with viscous and dry friction that rests for a lead [s], and is then driven by a step."""
    t = np.arange(0.0, 1.5, DT)

    def rates(now: float, state: np.ndarray) -> list[float]:
        driven = volts if now >= lead else 0.0
        return [state[1], (driven - DAMPING * state[1] - FRICTION * np.tanh(state[1] / 1e-3)) / MASS]

    x = solve_ivp(rates, (0.0, 1.5), [0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-10, max_step=1e-3).y[0]
    noisy = x + SIGMA * np.random.default_rng(seed).normal(size=len(t))
    return {"t": t, "v_in": np.where(t >= lead, volts, 0.0), "x": np.round(noisy, 5)}


# After a lead another effect is named first, which the frictions then make needless: by the error (seed 1) a sagging
# supply or a spring, by the likelihood (seed 0) drag.
@pytest.mark.parametrize(("lead", "seed"), [(0.0, 0), *(pytest.param(0.2, s, marks=pytest.mark.slow) for s in (0, 1))])
def test_steps_from_rest_tell_mass_and_frictions_and_nothing_else(lead, seed):
    logs = [step_log(6.0, seed, lead), step_log(3.0, seed + 1, lead)]
    found = explain(Model.parse('plant = "slide"\n'), logs, [step_log(-5.0, seed + 2, lead)])
    assert found.steps[0].effect == "viscous_drive" and len(found.steps) == 2
    assert found.steps[1].effect in ("coulomb_drive", "voltage_dead_zone")  # twins, where nothing turns back
    assert found.steps[-1].error_after < 1.05
    assert found.parameters["X1"].value == pytest.approx(MASS, rel=0.01)
    assert found.parameters["viscous_drive.coefficient"].value == pytest.approx(DAMPING, rel=0.01)
    assert not found.warnings


# With a lead the machine sticks at first, and what sticks is known to the last digit.
@pytest.mark.parametrize("lead", [0.0, 0.2])
def test_what_compares_no_effects_reads_a_step_from_rest_as_it_is(lead):
    text = 'plant = "slide"\neffects = ["viscous_drive", "coulomb_drive"]\n[parameters]\nX1 = { nominal = 0.1 }\n'
    known = f"[effect.viscous_drive]\ncoefficient = {{ nominal = {DAMPING} }}\n"
    model = Model.parse(f"{text}{known}[effect.coulomb_drive]\ntorque = {{ nominal = {FRICTION} }}\n")
    log = step_log(6.0, 0, lead)
    channel = residuals(model, [log]).channels["x"]
    assert channel.samples == len(log["t"]) and 0.9 < channel.sigma_ratio < 1.1
    assert compare(model, [log]).residual_tests.channels["x"].sigma_ratio == pytest.approx(channel.sigma_ratio, rel=0.1)
