"""The benchmark counts what it says, goes on after an interruption, and its small sample comes out right."""

from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import product
from time import sleep

import numpy as np
import pytest

import derive
from derive.effects.row import Effect, EffectParameter, Force
from wheelpend import Failure
from wheelpend.benchmarks.hidden_effects import Outcome, plan, run, summarise, try_case
from wheelpend.benchmarks.hidden_effects.cases import Case, benchmark_plant, draw_effect
from wheelpend.benchmarks.hidden_effects.page import page_text
from wheelpend.benchmarks.hidden_effects.trial import make_standing_log
from wheelpend.benchmarks.recording import from_journal
from wheelpend.model.record import Model
from wheelpend.parallel import results_as_completed
from wheelpend.serialise import plain_data

FOUND = Outcome(
    "a", "single", "simulator", 1.0, ("slope",), False, None, "effect_missing", ("slope",), ((),), "nothing_missing",
    3.0, 1.0, 1.0, 1.0, strength=50.0, deviations=(0.5, -2.5),
)  # fmt: skip
MISSED = replace(FOUND, key="b", named=("imu_bias",), deviations=())
EQUIVALENT = replace(FOUND, key="c", named=("imu_bias",), equivalents=(("slope",),), deviations=())
CLEAN = Outcome("d", "complete", "engine", 1.0, (), False, verdict="nothing_missing", true_error=1.0)


def test_an_answer_is_right_when_it_names_the_effect_or_declares_it_equivalent():
    found = summarise([FOUND, MISSED, EQUIVALENT])
    assert found.singles["simulator"] == (2, 3)
    assert found.equivalents == 0.5
    assert found.confusion["slope"] == {"imu_bias": 2, "slope": 1}


def test_an_effect_that_costs_hardly_anything_is_not_asked_for():
    assert summarise([replace(MISSED, base_error=1.02)]).singles == {}


def test_a_verdict_on_a_complete_model_is_a_false_alarm():
    assert summarise([CLEAN, replace(CLEAN, key="e", verdict="unexplained")]).false_alarms == (1, 2)


def test_both_effects_of_a_pair_must_be_named():
    pair = replace(FOUND, kind="pair", hidden=("slope", "cogging"), costs=(0.5, 0.5))
    both = replace(pair, named=("cogging", "slope"), equivalents=((), ()))
    assert summarise([pair, both]).pairs == (1, 2)


def test_a_left_out_effect_needs_unexplained_or_a_stand_in_that_reaches_the_noise():
    out = replace(FOUND, kind="left_out", named=("imu_bias",))
    wrong = replace(out, error=1.3)
    honest = replace(wrong, final="unexplained")
    found = summarise([out, wrong, honest])
    assert found.left_out == (2, 3) and found.overconfident == 1


def test_a_pair_counts_where_each_of_its_effects_costs_enough_beside_the_other():
    pair = replace(FOUND, kind="pair", hidden=("slope", "cogging"), named=("slope",), equivalents=((),))
    found = summarise([replace(pair, key=str(c), costs=(0.5, c)) for c in (0.049, 0.05, 2.0)])
    assert found.pairs == (0, 2) and found.faint == (0, 1)


def test_coverage_counts_every_parameter():
    assert summarise([FOUND]).coverage == (1, 2)


def test_the_spread_of_estimates_is_their_root_mean_square_error_in_standard_errors():
    outcomes = [replace(CLEAN, key=str(z), estimates=(("X1", z), ("X2", 1.0))) for z in (3.0, -4.0)]
    found = summarise([*outcomes, CLEAN])
    assert found.spread == {"X1": pytest.approx(np.sqrt(12.5)), "X2": 1.0} and found.estimated == 2


def test_friction_that_sticks_is_counted_apart_from_the_rest():
    stuck = replace(FOUND, kind="stick_slip", true_error=1.1)
    found = summarise([stuck, replace(stuck, key="s", named=())])
    assert found.stick_slip == (1, 2) and found.sticking == 1.1 and found.singles == {}


def test_jobs_under_way_when_the_time_is_over_are_waited_for_and_no_other_begins():
    done = list(results_as_completed([partial(sleep, 0.1)] * 50, seconds=0.05))
    assert 1 <= len(done) <= 8


def test_intervals_are_those_of_clopper_and_pearson():
    low, high = summarise([CLEAN] * 200).false_alarms.interval
    assert low == 0.0 and high == pytest.approx(1 - 0.025 ** (1 / 200), rel=1e-6)


def test_the_page_says_what_was_not_tried():
    text = page_text(summarise([FOUND, CLEAN, replace(CLEAN, key="f", failure="It fell.")]), 740)
    assert "3 of 740 logs" in text and "not tried" in text and "It fell." in text and "| slope | 1 of 1" in text


def test_outcomes_survive_being_written_down():
    assert from_journal(type(FOUND), plain_data(FOUND)) == FOUND


def test_the_plan_is_the_same_each_time_and_its_beginning_holds_every_kind():
    cases = plan()
    assert cases == plan()
    assert len({c.key for c in cases}) == len(cases)
    assert {c.kind for c in cases[:30]} == {"single", "pair", "triple", "complete", "left_out", "stick_slip"}
    assert sum(c.kind == "complete" for c in cases) >= 200
    assert len(cases) < 1000


def test_every_effect_that_a_log_can_show_is_hidden_alone():
    alone = {c.effects[0] for c in plan() if c.kind == "single"}
    assert alone == {e.name for e in derive.effects.applicable_to(benchmark_plant())} - {
        "viscous_drive"
    }  # which is part of X6 and X7


def test_a_third_of_the_plan_comes_from_the_engine_and_so_does_every_effect_under_either_command():
    cases = [c for c in plan() if c.kind != "stick_slip"]
    assert sum(c.source == "engine" for c in cases) == pytest.approx(len(cases) / 3, abs=10)
    single = Counter((c.effects[0], c.source) for c in cases if c.kind == "single")
    assert {n for (_, source), n in single.items() if source == "engine"} == {4}
    assert {(c.source, c.command) for c in cases} >= set(product(("engine", "simulator"), ("aggressive", "simple")))


def test_what_happens_at_a_moment_happens_inside_the_log_whatever_its_size():
    times = [EffectParameter("start", "s", scope="event"), EffectParameter("end", "s", scope="event")]
    push = Effect(
        "external_push", "body", "", "", (*times, EffectParameter("torque", "V", typical=0.5)), Force("", len)
    )
    for seed, size in enumerate((0.1, 1.0, 3.0)):
        (_, start), (_, end), (_, torque) = draw_effect(push, size, np.random.default_rng(seed))
        assert 4.0 <= start < end <= 14.0 and abs(torque) == pytest.approx(0.5 * size, rel=0.26)


def test_a_log_in_which_the_robot_would_fall_is_made_with_less_and_says_so():
    case = Case("single", (("coulomb_drive.torque", 6.0), ("voltage_saturation.limit", 3.0)), 1)
    assert case.with_smaller_effects().hide == (("coulomb_drive.torque", 4.2), ("voltage_saturation.limit", 4.28571))
    made, log = make_standing_log(replace(case, hide=case.hide[1:]), Model.default())
    assert made.hide[0][1] > 3.0 and len(log) == 20001 and made == make_standing_log(made, Model.default())[0]


SAMPLE = (
    Case("single", (("coulomb_drive.torque", 0.3),), 1),
    Case("complete", (), 5000),
    Case("left_out", (("imu_bias.bias", 0.02),), 2, without=("imu_bias",)),
)


@pytest.mark.slow
def test_a_small_sample_is_answered_and_an_interrupted_run_goes_on(tmp_path):
    said = []
    first = run(tmp_path, cases=SAMPLE[:2], progress=said.append)
    assert [o.named for o in first] == [("coulomb_drive",), ()]
    assert all(o.failure is None for o in first)
    assert [name for name, _ in first[1].estimates] == [f"X{k}" for k in range(1, 8)]
    assert max(abs(error) for _, error in first[1].estimates) < 4.5
    again = run(tmp_path, cases=SAMPLE, progress=said.append)
    assert again[:2] == first and "2 of them known" in said[-2]
    assert summarise(again).overconfident == 0 and again[2].named == ("com_offset",)


@pytest.mark.slow
@pytest.mark.extras
def test_the_engine_agrees_with_the_equations_and_shows_what_is_hidden_in_it():
    pytest.importorskip("mujoco")
    outcome = try_case(Case("single", (("slope.angle", 0.02),), 3, source="engine"))
    assert outcome.named == ("slope",) and outcome.error < 1.05 * outcome.floor
    assert np.abs(outcome.deviations).max() < 4.5


def test_what_the_engine_does_not_offer_is_refused():
    from wheelpend.benchmarks.hidden_effects.engine import engine_log

    with pytest.raises(Failure, match=r"viscous_drive\.coefficient is not among them"):
        engine_log({"viscous_drive.coefficient": 0.3})
