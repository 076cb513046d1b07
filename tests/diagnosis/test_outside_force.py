"""A hand that holds the machine, or a blow, does not hide what the rest of a log shows."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wheelpend import Log, Model, diagnose
from wheelpend.diagnosis import outside_force
from wheelpend.diagnosis.missing_force.estimate import MissingForce
from wheelpend.diagnosis.outside_force import (
    Span,
    begins_at_a_step,
    idle_ends,
    is_far_calmer,
    joined,
    log_without,
    spans_of,
)
from wheelpend.diagnosis.verdict import Diagnosis

INERTIA = 0.0244  # s²: of the link over the torque that gravity has on it where it is level
RATE_HZ, SPAN_S, HELD_S, NOISE_RAD, VISCOUS = 100.0, 12.0, 1.2, 0.003, 0.008
BLOW_S, BLOW_LASTS_S = 5.0, 0.06
MODEL = 'plant = "pendulum"\neffects = []\n'
HORIZON_S = 0.5


def swing(begin: float, state: tuple[float, float], end: float, push: float = 0.0) -> np.ndarray:
    """Angles and speeds (2, N) from a moment on, by SciPy's integrator, with a constant push."""

    def rates(_, now):
        return now[1], (push - np.sin(now[0]) - VISCOUS * now[1]) / INERTIA

    t = np.arange(begin, end + 0.5 / RATE_HZ, 1.0 / RATE_HZ)
    return solve_ivp(rates, (begin, t[-1]), state, "LSODA", t, rtol=1e-9, atol=1e-9, max_step=0.01).y


def log_of(angle: np.ndarray) -> Log:
    seen = angle + NOISE_RAD * np.random.default_rng(3).standard_normal(angle.size)
    t = np.arange(angle.size) / RATE_HZ
    return Log("bench", t, np.zeros(t.size), seen[:, None], ("theta_1",), rates={})


def held_log() -> Log:
    """A pendulum that a hand, which is not quite still, holds at about 52 degrees for 1.2 s and lets go."""
    held = 0.9 + 0.05 * np.sin(2.0 * np.pi * 1.25 * np.arange(round(HELD_S * RATE_HZ)) / RATE_HZ)
    return log_of(np.r_[held, swing(0.0, (0.9, 0.0), SPAN_S - HELD_S)[0]])


def struck_log() -> Log:
    """A pendulum that swings, and is struck once with twice the weight of its link."""
    before = swing(0.0, (0.9, 0.0), BLOW_S)
    during = swing(0.0, before[:, -1], BLOW_LASTS_S, push=2.0)
    after = swing(0.0, during[:, -1], SPAN_S - BLOW_S - BLOW_LASTS_S)
    return log_of(np.r_[before[0], during[0, 1:], after[0, 1:]])


@lru_cache
def diagnosed(make) -> Diagnosis:
    return diagnose(Model.parse(MODEL), [make()])


def span_told(found: Diagnosis) -> list[str]:
    return [w for w in found.warnings if "something outside the model moves it" in w]


@pytest.mark.parametrize("make", [pytest.param(held_log, marks=pytest.mark.slow), struck_log])
def test_damping_is_named_with_its_size_beside_a_force_from_outside_and_the_time_of_that_is_told(make):
    found = diagnosed(make)
    assert found.verdict == "effect_missing" and found.named[0].effect == "viscous_drive"
    assert found.named[0].coefficients["coefficient"] == pytest.approx(VISCOUS, rel=0.08)
    assert len(span_told(found)) == 1


@pytest.mark.slow
def test_a_blow_in_what_is_held_out_is_told_and_nothing_else_is_missing():
    """Between two thirds and the end nothing was fitted that could leave a random force."""
    random, rate, decay = np.random.default_rng(7), 0.01, np.exp(-0.01 * 2.0 / 0.5)  # 0.5 dv/dt = u + push - 2 v
    t = rate * np.arange(1200)
    u = np.repeat(random.uniform(-3.0, 3.0, 40), 30)
    push = np.where((t >= 9.5) & (t < 9.7), 2.0, 0.0)
    x, v = np.zeros(t.size), np.zeros(t.size)
    for k in range(t.size - 1):
        steady = (u[k] + push[k]) / 2.0
        v[k + 1] = steady + (v[k] - steady) * decay
        x[k + 1] = x[k] + steady * rate + (v[k] - steady) * (1.0 - decay) * 0.25
    log = Log("bench", t, u, (x + 1e-4 * random.standard_normal(t.size))[:, None], ("x",), rates={})
    model = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n')
    found = diagnose(model, [log], without=("external_push",))
    assert found.verdict == "nothing_missing" and found.error < 1.1 * found.noise_floor
    (said,) = span_told(found)
    begin, end = (float(word) for word in said.split(" s ")[0].split("Between ")[1].split(" and "))
    assert 9.2 < begin < 9.5 and 9.7 < end < 10.0


def test_the_time_that_is_left_out_holds_that_of_the_force_and_not_much_more():
    held = next(w for w in diagnosed(held_log).warnings if "Between 0.00 and" in w)
    end = float(held.split("Between 0.00 and ")[1].split(" s ")[0])
    assert HELD_S - 0.02 < end < HELD_S + 0.4
    struck = span_told(diagnosed(struck_log))[0].split("Between ")[1]
    begin, end = (float(part.split(" s ")[0]) for part in struck.split(" and ", 1))
    assert BLOW_S - 0.4 < begin < BLOW_S and BLOW_S + BLOW_LASTS_S < end < BLOW_S + 0.5


def missing(force: np.ndarray, dt: float = 0.01) -> MissingForce:
    t = np.arange(len(force)) * dt
    return MissingForce(t, np.atleast_2d(force.T).T, np.ones_like(force), {}, "log")


def spans(force: np.ndarray) -> list[Span]:
    found = missing(force)
    return spans_of(found, (0.0, float(found.t[-1])), HORIZON_S)


def random_force(samples: int = 2000) -> np.ndarray:
    """A Gaussian force of first order with a correlation time of 50 ms."""
    white = np.random.default_rng(5).standard_normal(samples)
    force = np.zeros(samples)
    for k in range(1, samples):
        force[k] = 0.82 * force[k - 1] + white[k]
    return force[:, None]


def test_a_gaussian_force_has_no_such_span_and_one_blow_on_it_has_one():
    assert spans(random_force()) == []
    struck = random_force()
    struck[600:620] += 40.0
    (span,) = spans(struck)
    assert 5.5 < span.begin <= 5.9 and 6.29 <= span.end < 6.7 and span.ratio > 15.0


def test_blows_that_come_again_and_again_or_last_are_how_the_force_is():
    often, long = random_force(), random_force()
    for first in range(100, 2000, 400):
        often[first : first + 20] += 40.0
    long[600:1000] += 40.0
    assert spans(often) == [] and spans(long) == []


def test_a_force_on_one_row_alone_is_found_behind_a_larger_one_that_is_always_there():
    both = np.column_stack([100.0 * random_force()[:, 0], random_force()[::-1, 0]])
    both[600:620, 1] += 40.0
    (span,) = spans(both)
    assert span.begin == pytest.approx(5.9, abs=0.3)


def test_peaks_that_are_no_larger_than_a_model_gone_astray_makes_count_too():
    often = random_force()
    often[600:620] += 60.0
    for first in range(100, 2000, 400):
        often[first : first + 10] += 22.0
    assert spans(often) == []


def test_spans_that_overlap_are_one():
    begun = [Span(2.0, 3.0, 9.0), Span(0.0, 1.0, 0.0), Span(0.5, 0.8, 12.0), Span(2.9, 3.5, 30.0)]
    assert joined(begun) == [Span(0.0, 1.0, 12.0), Span(2.0, 3.5, 30.0)]
    held, shaken = random_force(), random_force()
    held[600:700] += 30.0
    shaken[600:700] += 30.0
    shaken[620:630] += 80.0
    shaken[660:670] += 80.0
    assert len(spans(held)) == 1 and len(joined(spans(shaken))) == 1


def test_a_row_without_a_force_says_nothing():
    assert spans(np.c_[random_force(), np.zeros(2000)]) == [] and spans(np.zeros((2000, 1))) == []


@pytest.mark.parametrize(
    ("calm", "whole", "answer"),
    [(0.0, 0.5, True), (0.1, 0.5, True), (0.2, 0.5, False), (0.0, 0.0, False), (np.inf, np.inf, False)],
)
def test_far_calmer_is_what_leaves_less_than_a_third(calm, whole, answer):
    pair = ({"remainder": SimpleNamespace(share=s), "error": 2.0, "noise_floor": 1.0} for s in (calm, whole))
    found, before = (SimpleNamespace(**one) for one in pair)
    assert is_far_calmer(found, before) is answer


@pytest.mark.parametrize(("error", "whole", "answer"), [(1.05, 25.0, True), (1.05, 2.5, False), (4.0, 25.0, False)])
def test_far_calmer_is_what_reaches_the_noise_of_held_out_data_that_a_blow_spoils(error, whole, answer):
    pair = (SimpleNamespace(remainder=None, error=e, noise_floor=1.0) for e in (error, whole))
    assert is_far_calmer(*pair) is answer


def test_no_segment_of_the_log_that_is_left_reaches_into_the_span():
    log = held_log()
    left = log_without(log, [Span(2.0, 3.0, 20.0)])
    assert log_without(log, []) is log
    ranges = [(float(log.t[s.begin]), float(log.t[s.end - 1])) for s in left.stretches]
    assert ranges == [pytest.approx((0.0, 1.99)), pytest.approx((3.01, float(log.t[-1])))]
    assert np.isfinite(log.voltage).all() and "Between 2.00 and 3.00 s" in left.warnings[-1]


def test_a_span_that_holds_all_motion_is_left_in():
    fallen = log_of(np.r_[np.full(240, 0.9), 0.9 * np.exp(-10.0 * np.arange(60) / RATE_HZ), np.zeros(500)])
    let_go = log_without(fallen, [Span(0.0, 2.395, 20.0)])  # something holds it until then
    moving = Span(2.4, 3.1, 20.0)
    assert not outside_force._moves_without(let_go, [moving])
    assert outside_force._moves_without(let_go, [moving._replace(end=2.5)])
    assert outside_force._moves_without(held_log(), [Span(0.0, 1.3, 20.0)])


def test_what_begins_as_the_command_jumps_is_not_from_outside():
    log = held_log()
    stepped = replace(log, voltage=np.where(log.t < 4.0, 0.0, 2.0))
    assert begins_at_a_step(stepped, 4.02, 0.1) and begins_at_a_step(stepped, 3.93, 0.1)
    assert not begins_at_a_step(stepped, 3.8, 0.1)  # the controller answers what happened before
    assert not begins_at_a_step(stepped, 4.2, 0.1)
    assert not begins_at_a_step(replace(log, voltage=np.clip(log.t - 4.0, 0.0, 2.0)), 4.02, 0.1)
    assert not begins_at_a_step(log, 4.02, 0.1)
    unknown = replace(stepped, voltage=np.where(np.abs(log.t - 4.0) < 0.03, np.nan, stepped.voltage))
    assert begins_at_a_step(unknown, 4.02, 0.1)


def test_a_force_that_a_step_of_the_command_begins_stays_in_the_log():
    log = held_log()
    t, stepped = log.t, replace(log, voltage=np.where(log.t < 4.0, 1.0, 3.0))
    force = random_force(len(t))
    force[402:422] += 60.0
    late = MissingForce(t, force, np.ones_like(force), {}, "log")
    assert len(outside_force._spans_of_log(log, late, HORIZON_S)) == 1
    assert outside_force._spans_of_log(stepped, late, HORIZON_S) == []


def test_the_beginning_of_a_force_is_kept_where_the_span_goes_to_the_end_of_the_log():
    early = random_force()
    early[30:60] += 60.0
    (span,) = spans(early)
    assert span.begin == 0.0 and 0.2 < span.onset <= 0.3


def test_ends_at_which_it_moves_without_a_command_are_idle():
    log = held_log()
    switched = replace(log, voltage=np.where((log.t < 1.0) | (log.t > 11.2), 0.0, np.sin(7.0 * log.t)))
    begin, end = idle_ends(switched, HORIZON_S)
    assert (begin.begin, begin.end) == pytest.approx((0.0, 0.99)) and begin.ratio == 0.0
    assert (end.begin, end.end) == pytest.approx((11.21, float(log.t[-1])))
    left = log_without(switched, [begin])
    assert "nothing is commanded" in left.warnings[-1] and np.isfinite(left.voltage[100:]).all()
    assert idle_ends(switched, 1.1) == []  # neither lasts a horizon
    assert idle_ends(log, HORIZON_S) == []  # nothing drives it at all


def test_a_machine_that_rests_until_the_command_begins_is_not_held():
    log = held_log()
    at_rest = replace(log, measured=np.where(log.t[:, None] < 1.0, 0.9, log.measured))
    switched = replace(at_rest, voltage=np.where(log.t < 1.0, 0.0, 1.0))
    assert idle_ends(switched, HORIZON_S) == []
    noise = 0.05 * np.random.default_rng(2).standard_normal(log.measured.shape)  # 5 % of the swing, as of a gyro
    assert idle_ends(replace(switched, measured=at_rest.measured + noise), HORIZON_S) == []
    silent = np.where(log.t[:, None] < 1.0, np.nan, log.measured)  # a sensor that wakes with the motor
    assert idle_ends(replace(switched, measured=silent), HORIZON_S) == []


def test_one_that_comes_to_rest_behind_its_last_command_was_driven_by_it():
    log = held_log()
    last = int(np.searchsorted(log.t, 9.0))
    swung = log.measured.copy()
    coasts = np.exp(-(log.t - 9.0) / 0.1)[:, None]
    swung[last:] = swung[last] + (0.5 * (1.0 - coasts))[last:]
    switched = replace(log, measured=swung, voltage=np.where((log.t > 9.0) | (log.t < 0.02), 0.0, 1.0))
    assert idle_ends(switched, HORIZON_S) == []
    goes_on = replace(switched, measured=log.measured)
    assert [span.begin for span in idle_ends(goes_on, HORIZON_S)] == [pytest.approx(9.01)]


def test_a_time_in_which_the_command_does_most_of_what_it_does_is_not_from_outside():
    log = held_log()
    ramp = replace(log, voltage=np.clip(3.0 * (log.t - 4.0), 0.0, 2.0))
    assert outside_force.drives_within(ramp, Span(3.9, 4.5, 20.0)) and outside_force.drives_within(
        ramp, Span(4.2, 5.0, 20.0)
    )
    assert not outside_force.drives_within(ramp, Span(4.6, 5.5, 20.0))
    assert not outside_force.drives_within(log, Span(3.9, 4.5, 20.0))  # nothing is commanded
    swinging = replace(log, voltage=np.sin(3.0 * log.t))
    assert not outside_force.drives_within(swinging, Span(3.9, 5.0, 20.0))
