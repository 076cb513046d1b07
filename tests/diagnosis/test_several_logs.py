"""Ladders over several logs: a slope and a phase for every log, one amplitude for the machine."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from wheelpend import Model, add, compare, diagnose, explain, simulate
from wheelpend.estimation.validation import calibrated_values
from wheelpend.serialise import to_json

PHASES = (0.3, 2.4, -1.5)


@lru_cache
def log(seed, **hide):
    """6 s at 500 Hz; effects are hidden as effect__parameter=value."""
    hidden = {name.replace("__", "."): value for name, value in hide.items()}
    made = simulate(Model.default(), duration=6.0, hide=hidden, seed=seed, sample=0.002)
    return replace(made, name=f"log {seed}")


def logs(parameter, sizes):
    return [log(seed, **{parameter: size}) for seed, size in enumerate(sizes, 1)]


def rippled(effect, amplitude):
    return [
        log(seed, **{f"{effect}__sine": amplitude * np.cos(p), f"{effect}__cosine": amplitude * np.sin(p)})
        for seed, p in enumerate(PHASES, 1)
    ]


@pytest.fixture(scope="module")
def runout():
    first, second, third = rippled("wheel_runout", 0.15)
    return diagnose(Model.default(), [first, second], [third])


@pytest.fixture(scope="module")
def sloped():
    first, second, third = logs("slope__angle", (0.02, -0.015, 0.01))
    return explain(Model.default(), [first, second], [third])


@pytest.mark.slow
def test_a_ladder_over_two_logs_says_what_each_of_them_has(sloped):
    assert (sloped.verdict, sloped.effects) == ("nothing_missing", ("slope",))
    assert sloped.error < 1.05 * sloped.noise_floor
    rows = to_json(sloped)["parameters"]["slope.angle"]["per_log"]
    assert [r["log"] for r in rows] == ["log 1", "log 2"]
    assert [r["value"] for r in rows] == pytest.approx([0.02, -0.015], abs=3e-4)
    assert [o.log for o in sloped.steps[0].per_log] == ["log 1", "log 2"]


def test_a_model_is_compared_with_each_log_at_that_log_s_own_slope(sloped):
    first, second, third = logs("slope__angle", (0.02, -0.015, 0.01))
    assert compare(sloped.model, [first, second]).error < 1.05
    found = compare(sloped.model, [first], [third])
    assert found.error < 1.05
    assert found.per_log[0]["slope.angle"] == pytest.approx(0.01, abs=5e-4)


@pytest.mark.slow
def test_the_amplitude_of_a_ripple_is_the_machine_s_and_its_phase_the_log_s(runout):
    best = runout.candidates[0]
    assert (runout.verdict, best.effect) == ("effect_missing", "wheel_runout")
    assert best.error_after < 1.05 * runout.noise_floor
    pairs = [(o.coefficients["sine"], o.coefficients["cosine"]) for o in best.per_log]
    assert [np.hypot(*p) for p in pairs] == pytest.approx([np.hypot(*pairs[0])] * 2, rel=1e-9)
    assert np.hypot(*pairs[0]) == pytest.approx(0.15, rel=2e-3)
    assert [np.arctan2(b, a) for a, b in pairs] == pytest.approx(PHASES[:2], abs=0.01)


@pytest.mark.slow
def test_a_held_out_log_turns_the_phase_of_a_ripple_and_leaves_its_amplitude(runout):
    fitted, held = runout.candidates[0].fit, runout.problem.data.validation[0]
    values = calibrated_values(runout.problem, held.calibration, fitted.of_log(0), list(fitted.values))
    a, b = values["wheel_runout.sine"], values["wheel_runout.cosine"]
    known = fitted.of_log(0)
    assert np.hypot(a, b) == pytest.approx(np.hypot(known["wheel_runout.sine"], known["wheel_runout.cosine"]))
    assert np.arctan2(b, a) == pytest.approx(PHASES[2], abs=0.02)


def test_an_effect_is_added_over_two_logs_and_judged_on_a_third():
    change = add(Model.default(), "wheel_runout", rippled("wheel_runout", 0.15)[:2], rippled("wheel_runout", 0.15)[2:])
    assert change.step.error_before > 5 > 1.05 > change.step.error_after
    assert len(change.step.per_log) == 2
