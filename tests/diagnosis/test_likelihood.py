"""Effects judged with a random force in the likelihood, on an axis that a program of its own plays."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import erfc

import derive
from wheelpend import Log, Model
from wheelpend.diagnosis.likelihood import filter_response, one_round, pairs, relief, repeatability, search
from wheelpend.diagnosis.likelihood.filter_response import drift_responses
from wheelpend.diagnosis.likelihood.filtered_model import filtered_model
from wheelpend.diagnosis.likelihood.held_out import (
    Prediction,
    bounded_p_value,
    combined_p_value,
    following,
    gain_statistic,
    joint_p_value,
    one_sided_p_value,
)
from wheelpend.diagnosis.likelihood.judgement import Judged, JudgedModel, judge
from wheelpend.diagnosis.likelihood.pairs import RefittedPair, supported_pair
from wheelpend.diagnosis.likelihood.refits import settled, with_both
from wheelpend.diagnosis.likelihood.remaining import searched_remainder
from wheelpend.diagnosis.likelihood.repeatability import (
    FORCE_KIND,
    READING_KIND,
    FoldedDrifts,
    RepeatingFunction,
    likeliest_by_place,
    repeatable_share,
    what_repeats,
)
from wheelpend.diagnosis.likelihood.search import rounds_by_likelihood
from wheelpend.diagnosis.likelihood.slow_sources import slow_sources
from wheelpend.diagnosis.likelihood.whitened_scores import linear_effects, linear_scores
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.estimation.starts import best_start
from wheelpend.identification.filter_error_method import estimator_at

MASS, VISCOUS, DRY = 2.7, 6.0, 0.6  # V s²/m, V s/m, V
RANDOM_RMS, RANDOM_TIME_S = 0.1, 0.05  # V, s
STEP_S, EVERY, SAMPLES, NOISE_M = 1e-4, 40, 2500, 1e-5
SPRING = 8.0  # V/m
FRICTION = ("coulomb_drive", "stribeck_drive", "presliding_drive", "load_friction")
OTHERS = ("stribeck_drive", "presliding_drive", "load_friction", "quadratic_drive", "cogging")
MODEL = 'plant = "slide"\neffects = ["viscous_drive"]\n'


@lru_cache
def axis_log(
    dry: float, seed: int, spring: float = 0.0, rms: float = RANDOM_RMS, random_time: float = RANDOM_TIME_S
) -> Log:
    """An axis with viscous and dry friction, a spring [V/m] and a random force, ten seconds at 250 Hz.

    By semi-implicit steps.
    """
    random = np.random.default_rng(seed)
    decay = np.exp(-STEP_S / random_time)
    position, speed, force, rows = 0.0, 0.0, rms * random.standard_normal(), []
    for step in range(SAMPLES * EVERY):
        t = step * STEP_S
        if step % EVERY == 0:
            command = 2.0 * np.sin(2.0 * np.pi * 0.7 * t) + 1.5 * np.sin(2.0 * np.pi * 1.9 * t + 1.0)
            rows.append((t, command, position + NOISE_M * random.standard_normal()))
        force = decay * force + rms * np.sqrt(1.0 - decay**2) * random.standard_normal()
        free = (speed + STEP_S * (command + force - spring * position) / MASS) / (1.0 + STEP_S * VISCOUS / MASS)
        before, speed = speed, np.sign(free) * max(abs(free) - STEP_S * dry / MASS, 0.0)
        position += 0.5 * STEP_S * (before + speed)
    t, command, measured = np.array(rows).T
    return Log(f"axis {dry} {seed}", t, command, measured[:, None], ("x",), rates={})


def begun(dry: float, seed: int, without: tuple[str, ...] = ()):
    """The problem of a log, and a start."""
    return best_start(prepare(Model.parse(MODEL), [axis_log(dry, seed)], without=without))


@lru_cache
def searched(dry: float, seed: int = 1, without: tuple[str, ...] = ()):
    """Diagnoses of a log, with at most two effects added."""
    problem, start = begun(dry, seed, without)
    return rounds_by_likelihood(problem, start, lambda rounds: len(rounds) > 2, lambda text: None)


def filtered_with(effect: str):
    """The model with one effect more, refitted on that log."""
    problem, start = begun(DRY, 1)
    return filtered_model(problem.with_effects(["viscous_drive", effect]), [start], lambda text: None)


@pytest.fixture(scope="module")
def filtered():
    """The model with its random force, on a log with dry friction that it lacks."""
    problem, start = begun(DRY, 1)
    return filtered_model(problem, [start], lambda text: None)


def test_a_force_at_random_is_no_missing_effect():
    (found,) = searched(0.0)
    assert found.verdict == "nothing_missing" and not found.named
    assert found.remainder.repeatable_share == 0.0
    assert found.remainder.force["carriage"].rms == pytest.approx(RANDOM_RMS, rel=0.3)


def test_dry_friction_beside_it_is_named_first_and_with_its_size():
    first = searched(DRY)[0].named[0]
    assert first.effect == "coulomb_drive"
    assert first.coefficients["torque"] == pytest.approx(DRY, abs=4.0 * first.sigma["torque"])
    assert first.sigma["torque"] < 0.1 * DRY
    assert first.held_out_gain > 20.0


def test_an_effect_is_told_with_the_size_that_it_has_in_the_model_fitted_to_its_end(monkeypatch):
    ended = []

    def keep(model):
        ended.append(settled(model))
        return ended[-1]

    monkeypatch.setattr(one_round, "settled", keep)
    (found,) = rounds_by_likelihood(*begun(DRY, 1, OTHERS), lambda rounds: True, lambda text: None)
    first = found.named[0]
    assert first.coefficients["torque"] == ended[0].log_values[0]["coulomb_drive.torque"]
    assert any(c.fit is first.fit for c in found.refitted)


def test_with_the_friction_added_no_more_is_left_than_was_played():
    before, *_, after = searched(DRY)
    rms = [found.remainder.force["carriage"].rms for found in (before, after)]
    assert rms[1] == pytest.approx(RANDOM_RMS, rel=0.3) and rms[1] < 0.7 * rms[0]
    assert after.verdict == "nothing_missing"


@lru_cache
def pair_of(dry: float, spring: float):
    """The two effects that are supported together on a log, dry friction and a spring being tried."""
    problem, start = best_start(prepare(Model.parse(MODEL), [axis_log(dry, 1, spring)]))
    model = filtered_model(problem, [start], lambda text: None)
    (scores, *_) = linear_scores(model)
    names = ("coulomb_drive", "tether_spring")
    _, sizes = scores.together([e for e in linear_effects(model) if e.name in names])
    both = with_both(model, dict(zip(names, sizes, strict=True)))
    return supported_pair(JudgedModel.of(model), [RefittedPair(names, both)], 500)


def test_two_effects_that_are_there_are_supported_together_and_one_that_is_not_has_no_partner():
    found = pair_of(DRY, SPRING)
    assert {found.first.candidate.effect, found.second.candidate.effect} == {"coulomb_drive", "tether_spring"}
    sizes = found.second.model.fitted().values
    assert sizes["coulomb_drive.torque"] == pytest.approx(DRY, rel=0.15)
    assert sizes["tether_spring.stiffness"] == pytest.approx(SPRING, rel=0.15)
    assert found.second.candidate.error_after < found.with_first.validated.error
    first = found.first.candidate  # its size is that beside the other, its error that of the step
    assert first.coefficients == {n.split(".")[1]: v for n, v in sizes.items() if n.startswith(f"{first.effect}.")}
    assert first.error_after == found.with_first.validated.error
    assert pair_of(DRY, 0.0) is None and pair_of(0.0, SPRING) is None


def refit_of(effect: str, deviance: float, *, error: float = 1.0, lost: tuple[str, ...] = ()):
    """A refit with one effect, or two, of which some ended at a size that nothing has."""
    effects = tuple(effect.split("+"))
    problem = SimpleNamespace(
        model=SimpleNamespace(effects=effects),
        effect=derive.effects.find,
        replaced=lambda name: ("coulomb_drive",) if name == "stribeck_drive" else (),  # which is in the model
    )
    fitted = SimpleNamespace(error=error)
    return SimpleNamespace(deviance=deviance, lost=lost, problem=problem, fitted=lambda: fitted)


def test_behind_the_likeliest_refits_a_second_effect_is_looked_for_that_lowers_the_error_beside_it(monkeypatch):
    base = SimpleNamespace(model=refit_of("", 100.0), validated=SimpleNamespace(error=5.0))
    refits = {
        "stribeck_drive": refit_of("stribeck_drive", 50.0),  # which would take the place of dry friction
        "load_friction": refit_of("load_friction", 60.0, lost=("load_friction",)),  # of a size that nothing has
        "quadratic_drive": refit_of("quadratic_drive", 70.0),
        "coasting_driver": refit_of("coasting_driver", 80.0),
        "tether_spring": refit_of("tether_spring", 95.0),  # no likelier than chance would make it
    }
    behind = {
        "quadratic_drive": {
            "tether_spring": 50.0,
            "voltage_sag": 75.0,
            "stribeck_drive": 40.0,
            "coasting_driver": 30.0,
        },
        "coasting_driver": {"voltage_offset": 20.0, "quadratic_drive": 29.0},
    }

    def leading(refit, progress):
        (first,) = refit.problem.model.effects
        return {
            e: refit_of(f"{first}+{e}", deviance, error=9.0 if e == "tether_spring" else 2.0)
            for e, deviance in behind[first].items()
        }

    monkeypatch.setattr(pairs, "leading_pairs", lambda model: [])
    monkeypatch.setattr(pairs, "leading_refits", leading)
    monkeypatch.setattr(pairs, "without_meaning", lambda model: model.lost)
    monkeypatch.setattr(pairs, "ValidatedFit", SimpleNamespace(of=lambda problem, fitted: fitted))
    found = [pair.effects for pair in pairs.refitted_pairs(base, refits, lambda text: None)]
    assert found == [("coasting_driver", "voltage_offset"), ("coasting_driver", "quadratic_drive")]


@pytest.mark.slow
def test_where_no_single_effect_is_worth_a_step_a_pair_is_added_as_two(monkeypatch):
    problem, start = best_start(prepare(Model.parse(MODEL), [axis_log(DRY, 1, SPRING)], without=OTHERS))
    monkeypatch.setattr(one_round, "most_telling_first", lambda supported: [])
    rounds = search.rounds_by_likelihood(problem, start, lambda rounds: len(rounds) > 2, lambda text: None)
    assert {r.named[0].effect for r in rounds[:2]} == {"coulomb_drive", "tether_spring"}
    assert rounds[1].problem.model.effects == ("viscous_drive", rounds[0].named[0].effect)
    assert {*rounds[2].problem.model.effects} == {"viscous_drive", "coulomb_drive", "tether_spring"}
    (alone,) = search.rounds_by_likelihood(problem, start, lambda rounds: len(rounds) > 1, lambda text: None)
    assert not alone.named  # the first of a pair is worth no step where the second has no room


@pytest.mark.slow
def test_what_repeats_is_unexplained_where_the_library_does_not_hold_it():
    found = searched(DRY, 1, FRICTION)[-1]
    assert found.verdict == "unexplained"
    assert 0.0 < found.remainder.repeatable_share <= 1.0


def with_refits_that_lead_to(monkeypatch, relieved: float, added: float):
    """What a model of deviance 1000 ends with whose refits lead to another minimum, and from where they were made."""
    begun_from = []

    def refits(model, progress, only):
        begun_from.append(model.deviance)
        best = {"coulomb_drive": model.deviance - added, "voltage_offset": model.deviance + 1.0}
        if model.deviance == 1000.0:
            best["voltage_offset"] = relieved - 2.0
        return {e: SimpleNamespace(deviance=d, name=e) for e, d in best.items()}

    monkeypatch.setattr(relief, "leading_refits", refits)
    monkeypatch.setattr(relief, "_relieved", lambda model, refits, progress: SimpleNamespace(deviance=relieved))
    monkeypatch.setattr(relief, "_added_effect", lambda model: SimpleNamespace(name=model.name, releases=""))
    model, found = relief.with_refits(SimpleNamespace(deviance=1000.0), lambda text: None)
    return begun_from, model.deviance, {e: m.deviance for e, m in found.items()}


def test_refits_from_a_minimum_in_which_the_model_was_stuck_are_made_once_more(monkeypatch):
    begun_from, deviance, found = with_refits_that_lead_to(monkeypatch, relieved=400.0, added=50.0)
    assert begun_from == [1000.0, 400.0] and deviance == 400.0
    assert found == {"coulomb_drive": 350.0, "voltage_offset": 398.0}  # each from where it is likelier


@pytest.mark.parametrize(("relieved", "added"), [(993.0, 1.0), (900.0, 500.0)])
def test_a_little_relief_or_less_than_an_effect_adds_makes_no_refit_anew(monkeypatch, relieved, added):
    begun_from, deviance, _ = with_refits_that_lead_to(monkeypatch, relieved, added)
    assert begun_from == [1000.0] and deviance == relieved


@pytest.mark.parametrize(("ahead", "now", "led"), [(2.0, 3.0, True), (np.inf, np.inf, True), (np.inf, 3.0, False)])
def test_no_way_out_of_a_minimum_leads_to_where_nothing_can_be_predicted(monkeypatch, ahead, now, led):
    @dataclass
    class Place:
        error: float
        point: SimpleNamespace
        problem: SimpleNamespace
        deviance: float = 0.0

        def fitted(self):
            return self.error

    problem = SimpleNamespace(replaced=lambda effect: ())
    model = Place(now, SimpleNamespace(deviance=1000.0), problem)
    other = Place(ahead, SimpleNamespace(deviance=400.0), problem)
    monkeypatch.setattr(relief, "without_effect", lambda larger, effect: other)
    monkeypatch.setattr(relief, "validation_residuals", lambda problem, error: (error, ()))
    likelier = relief._relieved(model, {"coulomb_drive": other}, lambda text: None)
    assert likelier.error == (ahead if led else now)


@dataclass
class Ended:
    """What a round of a search came to, all of it explained but perhaps for what is held out."""

    named: list
    verdict: str
    error: float
    noise_floor: float = 4.9
    remainder: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(is_nothing=True))
    detectable: dict = field(default_factory=dict)


def with_rounds_of(monkeypatch, first: str, rest: str, rival: str, deviance: float, error: float, left: float = 5.0,
                   gain: float = 1.0):  # fmt: skip
    """Effects and verdict that a search ends with whose first effect has a rival, of a likelihood and error.

    Held-out data gain so much by the rival, and 1 by the first.
    """

    def found(effects, verdict, after):
        gains = {first: 1.0, rival: gain}
        return Ended([SimpleNamespace(effect=e, held_out_gain=gains[e]) for e in effects], verdict, after)

    def model(likely):
        problem = SimpleNamespace(model=SimpleNamespace(effects=()))
        return SimpleNamespace(deviance=likely, problem=problem)

    def instead():
        if not rival:
            return None
        return one_round.Round((found([rival], "effect_missing", 9.0),), model(1000.0), model(deviance))

    def a_round(before, added, goes_on, progress):
        if not added:
            return one_round.Round((found([first], "effect_missing", 9.0),), before, model(500.0), instead=instead)
        last = found([], rest, left) if added == [first] else found([], "nothing_missing", error)
        return one_round.Round((last,), model(0.5 * before.deviance), None)  # led out of a minimum

    monkeypatch.setattr(search, "one_round", a_round)
    rounds = search.rounds_from(model(1000.0), lambda rounds: len(rounds) > 3, lambda text: None)
    return [c.effect for r in rounds for c in r.named], rounds[-1].verdict


def beside_another_search(
    monkeypatch, rest: str, deviance: float, error: float, gain: float, needed: bool, follow=None
):
    """Effects and verdict of a search beside which another found dry friction and a tilt: so likely, with this error.

    By likelihood a dead zone was found, of a deviance of 500, an error of 5 and a gain of 1 on held-out data.
    """
    found_so = SimpleNamespace(model=SimpleNamespace(effects=("coulomb_drive", "accelerometer_tilt")))
    near = SimpleNamespace(deviance=deviance, problem=found_so, validated=SimpleNamespace(error=error), predicted=gain)
    alone = SimpleNamespace(effects=("voltage_dead_zone",))
    start = SimpleNamespace(deviance=1000.0, problem=SimpleNamespace(model=alone), predicted=0.0)

    def a_round(before, added, goes_on, progress):
        if before is near:
            assert added == ["coulomb_drive", "accelerometer_tilt"]
            return one_round.Round((Ended([], "nothing_missing", error),), near, None)
        if added:
            return one_round.Round((Ended([], rest, 5.0),), before, None)
        first = SimpleNamespace(effect="voltage_dead_zone", held_out_gain=1.0)
        larger = SimpleNamespace(deviance=500.0, problem=SimpleNamespace(model=alone))
        return one_round.Round((Ended([first], "effect_missing", 9.0),), before, larger)

    monkeypatch.setattr(search, "one_round", a_round)
    monkeypatch.setattr(search, "filtered_from", follow or (lambda problem, starts, progress: near))
    monkeypatch.setattr(search, "refitted", lambda model: model)
    monkeypatch.setattr(search, "_is_needed", lambda model, effect: needed)
    monkeypatch.setattr(search.JudgedModel, "of", lambda model: model)
    monkeypatch.setattr(search, "gain_in_blocks", lambda before, after: np.array([after - before]))
    other = [Ended([SimpleNamespace(effect=e, held_out_gain=None)], "effect_missing", 9.0)
             for e in ("coulomb_drive", "accelerometer_tilt")]  # fmt: skip
    way = search.OtherWay(other, found_so, [{}])
    rounds = search.rounds_from(start, lambda rounds: len(rounds) > 3, lambda text: None, way)
    return [c.effect for r in rounds for c in r.named], rounds[-1].verdict


TOGETHER, BY_LIKELIHOOD = ["coulomb_drive", "accelerometer_tilt"], ["voltage_dead_zone"]


@pytest.mark.parametrize(
    ("rest", "deviance", "error", "gain", "needed", "ends_with"),
    [
        ("unexplained", 400.0, 4.0, 2.0, True, (TOGETHER, "nothing_missing")),
        ("nothing_missing", 400.0, 4.0, 2.0, True, (BY_LIKELIHOOD, "nothing_missing")),  # nothing is left to ask about
        ("unexplained", 499.0, 4.0, 2.0, True, (BY_LIKELIHOOD, "unexplained")),  # hardly likelier
        ("unexplained", 400.0, 6.0, 2.0, True, (BY_LIKELIHOOD, "unexplained")),  # it predicts worse over the horizon
        ("unexplained", 400.0, 4.0, 0.5, True, (BY_LIKELIHOOD, "unexplained")),  # and here from row to row
        ("unexplained", 400.0, 4.0, 2.0, False, (BY_LIKELIHOOD, "unexplained")),  # one of its effects is not needed
    ],
)
def test_a_search_that_leaves_something_unexplained_goes_on_from_what_another_found_where_that_is_likelier(
    monkeypatch, rest, deviance, error, gain, needed, ends_with
):
    assert beside_another_search(monkeypatch, rest, deviance, error, gain, needed) == ends_with


def test_what_another_search_found_and_no_filter_can_follow_changes_nothing(monkeypatch):
    def fails(problem, starts, progress):
        raise np.linalg.LinAlgError

    ended = beside_another_search(monkeypatch, "unexplained", 400.0, 4.0, 2.0, True, fails)
    assert ended == (BY_LIKELIHOOD, "unexplained")


@pytest.mark.parametrize(
    ("rest", "deviance", "error", "ends_with"),
    [
        ("unexplained", 400.0, 4.0, ("load_friction", "nothing_missing")),
        ("unexplained", 400.0, 6.0, ("coulomb_drive", "unexplained")),  # it predicts worse
        ("unexplained", 600.0, 4.0, ("coulomb_drive", "unexplained")),  # it is less likely
        ("nothing_missing", 400.0, 4.0, ("coulomb_drive", "nothing_missing")),  # nothing is left to ask about
    ],
)
def test_a_rival_of_an_effect_is_tried_where_the_search_ends_with_something_unexplained(
    monkeypatch, rest, deviance, error, ends_with
):
    effects, verdict = with_rounds_of(monkeypatch, "coulomb_drive", rest, "load_friction", deviance, error)
    assert (effects, verdict) == ([ends_with[0]], ends_with[1])


@pytest.mark.parametrize(("left", "ends_with"), [(5.0, "coulomb_drive"), (6.0, "load_friction")])
def test_a_rival_is_tried_too_where_what_was_fitted_is_explained_and_what_is_held_out_leaves_more(
    monkeypatch, left, ends_with
):
    effects, _ = with_rounds_of(monkeypatch, "coulomb_drive", "nothing_missing", "load_friction", 400.0, 4.0, left)
    assert effects == [ends_with]


@pytest.mark.parametrize(
    ("leads", "likelier", "contains", "is_rival"),
    [(True, False, (), False), (True, True, (), True), (False, False, (), True), (False, True, ("first",), False)],
)
def test_a_rival_is_not_led_or_is_likelier_and_contains_no_first(monkeypatch, leads, likelier, contains, is_rival):
    first = SimpleNamespace(candidate=SimpleNamespace(effect="first"), clearly_leads=lambda other: leads)
    other = SimpleNamespace(candidate=SimpleNamespace(effect="other"), is_likelier_than=lambda one: likelier)
    monkeypatch.setattr(one_round, "simpler_than", lambda one: contains)
    assert one_round._is_rival(other, first) is is_rival


@pytest.mark.parametrize(("gain", "ends_with"), [(0.9, "coulomb_drive"), (1.1, "load_friction")])
def test_a_rival_with_which_held_out_data_are_less_likely_does_not_count(monkeypatch, gain, ends_with):
    found = with_rounds_of(monkeypatch, "coulomb_drive", "unexplained", "load_friction", 400.0, 4.0, gain=gain)
    assert found[0] == [ends_with]


def test_where_no_rival_can_stay_the_search_is_what_it_was(monkeypatch):
    effects, verdict = with_rounds_of(monkeypatch, "coulomb_drive", "unexplained", "", 400.0, 4.0)
    assert (effects, verdict) == (["coulomb_drive"], "unexplained")


def searched_where_nothing_lowers(monkeypatch, without=OTHERS, *, has_weight=False):
    """Diagnoses of a log with dry friction, of which no effect is let lower the error or the force, or have weight."""
    monkeypatch.setattr(Judged, "lowers", lambda self, error: False)
    monkeypatch.setattr(Judged, "has_weight", has_weight)
    monkeypatch.setattr(one_round, "refitted_pairs", lambda base, refits, progress: [])
    problem, start = begun(DRY, 1, without)
    return rounds_by_likelihood(problem, start, lambda rounds: len(rounds) > 2, lambda text: None)


@pytest.mark.slow
def test_an_effect_without_which_something_repeats_is_named_though_it_lowers_nothing(monkeypatch):
    named, last = searched_where_nothing_lowers(monkeypatch)
    assert named.named[0].effect == "coulomb_drive" and not named.warnings
    assert last.verdict == "nothing_missing" and last.problem.model.effects == ("viscous_drive", "coulomb_drive")
    told = {c.effect: c.evidence is not None for c in named.refitted}
    assert told["coulomb_drive"] and not all(told.values())  # what else was tried is not missing


@pytest.mark.slow
def test_an_effect_with_weight_is_named_last_though_it_lowers_nothing(monkeypatch):
    monkeypatch.setattr(one_round, "_without_rest", lambda one, progress: None)
    named, last = searched_where_nothing_lowers(monkeypatch, has_weight=True)
    assert named.named[0].effect == "coulomb_drive" and not any("too small to matter" in w for w in named.warnings)
    assert last.problem.model.effects == ("viscous_drive", "coulomb_drive")


def test_an_effect_that_leaves_what_repeats_and_lowers_nothing_is_only_told_of(monkeypatch):
    monkeypatch.setattr(one_round, "_without_rest", lambda one, progress: None)
    (alone,) = searched_where_nothing_lowers(monkeypatch)
    assert alone.verdict == "unexplained" and not alone.named
    assert "too small to matter: coulomb_drive" in alone.warnings[-1]


def test_where_nothing_repeats_a_small_effect_is_only_told_of_however_much_is_left_to_chance(monkeypatch):
    monkeypatch.setattr(one_round, "searched_remainder", lambda model, judged=(): model.remainder())
    monkeypatch.setattr(one_round, "is_mostly_chance", lambda left: True)
    (alone,) = searched_where_nothing_lowers(monkeypatch)
    assert alone.verdict == "unexplained" and not alone.named
    assert "too small to matter: coulomb_drive" in alone.warnings[-1]


@pytest.mark.parametrize(("sigma", "told"), [(0.01, ["viscous_drive"]), (0.2, [])])
def test_a_law_that_data_follow_with_an_impossible_size_repeats(filtered, sigma, told):
    of_dry = judge(JudgedModel.of(filtered), filtered_with("coulomb_drive"), "coulomb_drive", 40)
    size = Estimate(-0.1, sigma, "V s/m")
    driving = replace(of_dry.candidate, effect="viscous_drive", estimates={"coefficient": size}, physical=False)
    left = searched_remainder(filtered, [of_dry, of_dry._replace(candidate=driving)])
    assert [law.effect for law in left.impossible] == told
    assert [law in left.what_repeats for law in left.impossible] == [True] * len(told)
    quiet = of_dry._replace(candidate=replace(driving, p_confirmation=0.5))
    assert searched_remainder(filtered, [quiet]).impossible == ()  # of chance


def test_functions_do_not_predict_a_force_at_random_that_made_them():
    problem, start = begun(0.0, 3)
    found = what_repeats(filtered_model(problem, [start], lambda text: None))
    assert not any(f.repeats for f in found) and max(f.gain for f in found) < 30.0


def test_a_function_found_behind_a_smaller_force_must_make_up_for_that():
    random = np.random.default_rng(3)
    rows = random.standard_normal((20, 50, 1))
    innovations = 0.5 * rows + 0.3 * random.standard_normal((20, 50, 1))
    information, score = rows.swapaxes(1, 2) @ rows, (rows.swapaxes(1, 2) @ innovations)[:, :, 0]
    alone = FoldedDrifts(["slip"], 0, information, score, 1.0, None).predicted(["slip"], 1e-6)
    assert alone.size[0] == pytest.approx(0.5, abs=0.05) and alone.p_value < 1e-6
    behind = [FoldedDrifts(["slip"], 0, information, score, 1.0, np.full(20, lead)) for lead in (-1.0, -20.0)]
    cheap, dear = (folded.predicted(["slip"], 1e-6) for folded in behind)
    assert cheap.gains == pytest.approx(alone.gains - 1.0) and cheap.p_value < 1e-6
    assert dear.gains.sum() < 0.0 and dear.p_value > 0.99  # though the innovations follow it as before


def test_a_function_of_speed_is_what_repeats(filtered):
    first = what_repeats(filtered)[0]
    assert first.repeats and "dx" in first.depends_on


@pytest.mark.slow
@pytest.mark.parametrize(("crosstalk", "places"), [(4e-5, {(READING_KIND, "x", ("v_in",))}), (0.0, set())])
def test_what_the_direction_of_the_input_does_to_a_reading_repeats_in_that_reading(crosstalk, places):
    log = axis_log(0.0, 3)
    told = replace(log, measured=log.measured + crosstalk * np.sign(log.voltage)[:, None])
    problem, start = best_start(prepare(Model.parse(MODEL), [told]))
    found = what_repeats(filtered_model(problem, [start], lambda text: None))
    assert {(f.kind, f.row, f.depends_on) for f in found if f.repeats} == places
    assert repeatable_share(found) == 0.0  # of the force, which may mirror the reading
    assert [f.share > 0.5 for f in found if f.repeats and f.is_in_reading] == [True] * len(places)


@pytest.mark.slow
@pytest.mark.parametrize(("weakening", "repeats"), [(0.03, {"t", "v_in"}), (0.0, set())])
def test_a_product_of_two_variables_repeats_where_neither_says_anything_alone(weakening, repeats):
    played = axis_log(0.0, 3)
    told = replace(played, voltage=played.voltage / (1.0 - weakening * played.t))
    problem, start = best_start(prepare(Model.parse(MODEL), [told]))
    found = what_repeats(filtered_model(problem, [start], lambda text: None))
    assert {v for f in found if f.repeats for v in f.depends_on} == repeats


def test_each_source_alone_is_made_small_and_forces_together_smaller(filtered):
    force = filtered.point.kinds[0]
    error = replace(force, place="x", rows=(0.0,), readings=(1.0,), rms=2e-5)
    both = replace(filtered, point=filtered.point._replace(sources=((force, error),)))
    sizes = [[s.rms for s in own[0]] for own in repeatability.with_smaller_sources(both)]
    expected = [[0.6, 1.0], [0.3, 1.0], [0.1, 1.0], [1.0, 0.1]]
    assert np.array(sizes) == pytest.approx(np.array(expected) * [force.rms, 2e-5])
    alone = replace(filtered, point=filtered.point._replace(sources=((force,),)))
    assert len(repeatability.with_smaller_sources(alone)) == 2


@pytest.mark.parametrize(("offset", "rms", "is_slow"), [(0.3, 0.002, True), (0.0, 0.2, False)])
def test_a_constant_force_is_no_chance_and_one_at_random_as_slow_as_is_allowed_is(offset, rms, is_slow):
    played = axis_log(0.0, 2, rms=rms, random_time=0.05 * SAMPLES * EVERY * STEP_S)
    problem, start = best_start(prepare(Model.parse(MODEL), [replace(played, voltage=played.voltage - offset)]))
    model = filtered_model(problem, [start], lambda text: None)
    found = slow_sources(model)
    assert [(s.place, s.is_force) for s in found if s.repeats] == [("carriage", True)] * is_slow
    assert all(s.gain > 10.0 and s.correlation_time_s > 2.0 for s in found if s.repeats)
    assert model.point.kinds[0].correlation_time > 0.3


def test_nothing_is_said_to_repeat_where_no_filter_can_be_followed(filtered, monkeypatch):
    monkeypatch.setattr(repeatability, "drift_responses", lambda model, number: None)
    assert what_repeats(filtered) == ()


@pytest.mark.parametrize("rounding", [0.0, 1e-9])
def test_a_covariance_that_rounding_has_made_indefinite_is_followed(rounding):
    """Behind a force far larger than the machine: its covariance is 1e12 times that of a sensor's noise."""
    predicted = 1e12 * np.array([[1.0, 1.0 + rounding], [1.0 + rounding, 1.0]])
    filters = SimpleNamespace(
        module=SimpleNamespace(NX=2, NY=2, OUTPUT_MATRIX=np.eye(2)), segments=[SimpleNamespace(sigma=np.ones(2))]
    )
    track = SimpleNamespace(covariances=np.stack([predicted, predicted])[None])
    update = filter_response._Update.of(filters, 0, track, (), 2, np.ones((1, 2), dtype=bool))
    assert update.variance == pytest.approx(predicted.diagonal()[None], rel=1e-6)
    assert np.isfinite(update.gain).all() and np.isfinite(update.whitens).all()


def test_a_stretch_of_readings_begins_with_what_is_known_there(filtered):
    problem = filtered.problem
    (segments,) = problem.data.estimation
    segments = replace(segments, bounds=segments.bounds[[0, 1, 4]], weights=None)
    parted = replace(filtered, problem=replace(problem, data=problem.data.with_estimation([segments])))
    samples = np.concatenate([np.arange(*own) for own in segments.bounds])
    begins = np.r_[True, np.diff(samples) > 1]
    ago = segments.log.t[samples] - drift_responses(parted, 0).motion["t"]
    assert begins.sum() == 2 and np.all(ago[begins] == 0.0)
    assert ago[~begins] == pytest.approx(segments.log.dt)


def test_a_filter_responds_to_an_offset_of_a_reading_as_its_kernel_does(filtered):
    log = filtered.problem.logs[0]
    offset = 1e-6 * np.sin(7.0 * log.t)

    def innovations(log: Log) -> np.ndarray:
        problem, values = filtered.problem, filtered.log_values
        changed = replace(prepare(problem.model, [log]), noise=problem.noise)
        filters = estimator_at(changed, problem.module, (), values, lambda: values).problem
        return filters.innovations(np.zeros(0), filtered.point.sources)[0][..., 0]

    actual = innovations(replace(log, measured=log.measured + offset[:, None])) - innovations(log)
    response = drift_responses(filtered, 0)
    predicted = response.of_readings(offset[: len(response.whitened), None, None])[:, 0, 0]
    known = slice(100, len(predicted))  # behind the filter's start
    assert predicted[known] == pytest.approx(actual[known, 0], abs=0.02 * np.nanstd(actual))


def test_a_filter_responds_to_a_force_as_its_kernel_does(filtered):
    response = drift_responses(filtered, 0)
    module, values = filtered.problem.module, filtered.log_values[0]
    name = "viscous_drive.coefficient"
    step = 1e-4 * values[name]

    def innovations(value: float) -> np.ndarray:
        changed = [{**values, name: value}]
        filters = estimator_at(filtered.problem, module, (), changed, lambda: changed).problem
        found = filters.innovations(np.zeros(0), filtered.point.sources)[0][..., 0]
        return found[np.isfinite(found[:, 0])]

    change = (innovations(values[name] + step) - innovations(values[name])) / step
    own = [n for n in module.LINEAR if n in filtered.names]
    predicted = -response.of_own()[:, 0, own.index(name)]
    known = slice(50, len(predicted))  # behind the filter's start
    actual = change[known, 0]
    assert np.corrcoef(actual, predicted[known])[0, 1] > 0.98
    assert np.std(predicted[known]) == pytest.approx(np.std(actual), rel=0.05)


def test_gains_that_scatter_about_nothing_are_none():
    assert abs(gain_statistic(np.array([1.0, -1.0, 2.0, -2.0]))) < 1e-12
    assert gain_statistic(np.array([5.0, 5.5, 4.5, 5.2])) > 10.0
    assert gain_statistic(np.array([5.0, -np.inf])) == 0.0
    assert gain_statistic(np.ones(4)) == np.inf and gain_statistic(-np.ones(4)) == -np.inf
    assert gain_statistic(np.zeros(4)) == 0.0


def test_a_few_blocks_count_no_more_than_that_they_all_agree():
    nearly_alike = np.array([1.0, 1.0, 0.999, 1.0])  # errors that ran away without an effect in all four
    assert one_sided_p_value(nearly_alike) < 1e-9
    assert bounded_p_value(one_sided_p_value(nearly_alike), 4) == 0.0625 and bounded_p_value(0.3, 4) == 0.3


def test_data_follow_a_change_that_takes_their_errors_away_and_not_one_beside_them():
    random = np.random.default_rng(7)
    change = random.standard_normal((20, 50, 1))
    error = random.standard_normal((20, 50, 1))

    def along(part):
        before = Prediction(list(error + part * change), [], [])
        return following(before, Prediction(list(error + (part - 1.0) * change), [], []), 1.0)

    there, absent = along(1.0), along(0.0)
    assert there.p_value < 1e-10 and (there.gains > 0.0).sum() >= 18
    assert there.gains.sum() == pytest.approx(0.5 * 1000, rel=0.15)  # nats: half the change's square
    assert absent.p_value > 0.05 and (absent.gains > 0.0).sum() <= 2


def test_tests_that_agree_count_as_one_and_one_of_three_as_three_times_it():
    assert combined_p_value([0.04, 0.04, 0.04]) == pytest.approx(0.04)
    assert combined_p_value([1e-4, 0.5, 0.5]) == pytest.approx(3e-4, rel=0.01)
    assert 0.1 < combined_p_value([0.04, 0.5, 0.9]) < 0.3
    assert combined_p_value([1.0, 1.0]) == pytest.approx(0.9) and combined_p_value([0.005, 1.0, 1.0]) < 0.02
    assert combined_p_value([]) == 1.0
    random = np.random.default_rng(5)
    shared = random.standard_normal((20_000, 1)) + random.standard_normal((20_000, 3))  # they depend on each other
    p_values = 0.5 * erfc(shared / 2.0)
    found = np.mean([combined_p_value(p) < 0.05 for p in p_values])
    assert 0.03 < found < 0.06


def test_of_two_independent_tests_one_may_outweigh_the_other():
    assert joint_p_value(0.015, 3e-13) < 1e-12 and joint_p_value(1.0, 1.0) == 1.0 and joint_p_value(1.0, 0.01) > 0.05
    assert joint_p_value(0.0, 0.5) < 1e-290
    chances = np.random.default_rng(6).uniform(size=(20_000, 2))
    found = np.array([joint_p_value(*pair) for pair in chances])
    assert 0.046 < np.mean(found < 0.05) < 0.054 and 0.008 < np.mean(found < 0.01) < 0.012


def test_of_what_repeats_the_likeliest_place_comes_first_with_its_likeliest_function():
    found = [
        RepeatingFunction(FORCE_KIND, "body", (), 0.0, 0.0, 1.0, 90),
        RepeatingFunction(FORCE_KIND, "theta_w", ("v_in",), 0.2, 30.0, 1e-3, 90),
        RepeatingFunction(READING_KIND, "theta_w", ("t",), 0.3, 40.0, 0.28, 90),
        RepeatingFunction(FORCE_KIND, "theta_w", ("dtheta_w",), 0.5, 700.0, 1e-17, 90),
    ]
    told = [(f.kind, f.row, f.p_value) for f in likeliest_by_place(found)]
    assert told == [(FORCE_KIND, "theta_w", 1e-17), (READING_KIND, "theta_w", 0.28), (FORCE_KIND, "body", 1.0)]


def test_the_repeatable_share_is_that_of_forces_unless_a_readings_error_is_likelier():
    force = RepeatingFunction(FORCE_KIND, "wheel", ("v_in",), 0.2, 30.0, 1e-6, 90)
    reading = RepeatingFunction(READING_KIND, "theta_w", (), 0.9, 40.0, 1e-5, 90)
    chance = RepeatingFunction(FORCE_KIND, "body", ("t",), 0.7, 3.0, 0.5, 90)
    assert repeatable_share([force, reading, chance]) == 0.2
    assert repeatable_share([reading, force, chance]) == 0.0 and repeatable_share([chance]) == 0.0
