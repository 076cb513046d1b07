"""Effects added in turn, and taken out again where others have made them needless."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model
from wheelpend.diagnosis import stepwise
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import validation_residuals

HIDDEN = {"coulomb_drive__torque": 0.3, "slope__angle": 0.02}


@pytest.fixture(scope="module")
def begun():
    return best_start(prepare(Model.default(), [simulated(seed=2, duration=10.0, **HIDDEN)]))


def climbed(begun, *effects, near=()):
    """A climb that has added these effects, near some sizes, the last round of which names nothing more."""
    problem, start = begun[0].with_effects(effects), {**begun[1], **dict(near)}
    fitted = fit_model(problem, start, free_names(problem, effects))
    error = validation_residuals(problem, fitted)[0]
    below = [SimpleNamespace(named=(SimpleNamespace(effect=e, equivalent_to=()),)) for e in effects]
    accounted = error <= MAX_EXPLAINED_ERROR_RATIO * problem.floor
    last = SimpleNamespace(named=(), error=error, problem=problem, fit=fitted, is_explained=accounted)
    last.by_likelihood = False
    return [*below, last]


def test_an_effect_that_later_ones_make_needless_is_told(begun):
    assert (
        stepwise.find_redundant_effect(climbed(begun, "quadratic_drive", "coulomb_drive", "slope"), print)
        == "quadratic_drive"
    )


def test_a_shape_that_bends_to_more_is_needless_where_a_simpler_one_does_as_well_beside_the_others(begun):
    near = {"stribeck_drive.static": 0.35, "stribeck_drive.sliding": 0.3, "stribeck_drive.speed": 1.0}
    rounds = climbed(begun, "stribeck_drive", "slope", near=near)
    assert stepwise.find_redundant_effect(rounds, print) == "stribeck_drive"


def test_a_shape_is_needed_where_the_simpler_one_does_not_do():
    curve = {"stribeck_drive.static": 0.5, "stribeck_drive.sliding": 0.2, "stribeck_drive.speed": 1.0}
    hidden = {name.replace(".", "__"): size for name, size in curve.items()}
    log = simulated(seed=2, duration=10.0, slope__angle=0.02, **hidden)
    rounds = climbed(best_start(prepare(Model.default(), [log])), "stribeck_drive", "slope", near=curve)
    assert rounds[-1].is_explained and stepwise.find_redundant_effect(rounds, print) is None


def beside(rounds):
    """The same rounds, the last of which ends a little beside the likeliest values, as a filter of friction does."""
    last = rounds[-1]
    last.fit = replace(last.fit, values={n: 1.02 * v for n, v in last.fit.values.items()})
    return rounds


def test_what_ends_beside_the_likeliest_values_is_taken_down_to_the_noise(begun):
    found = stepwise.down_to_noise(beside(climbed(begun, "coulomb_drive", "slope")), lambda rounds: True, print)
    last = found[-1]
    assert len(found) == 3 and last.verdict == "nothing_missing" and not last.by_likelihood
    assert last.error <= MAX_EXPLAINED_ERROR_RATIO * last.noise_floor
    assert last.fit.values["coulomb_drive.torque"] == pytest.approx(0.3, abs=0.02)


def test_what_leaves_more_than_noise_stays_as_the_likelihood_had_it(begun):
    rounds = beside(climbed(begun, "coulomb_drive"))
    assert stepwise.down_to_noise(rounds, lambda found: True, print) is rounds


def test_effects_that_are_all_there_are_all_needed(begun):
    assert stepwise.find_redundant_effect(climbed(begun, "coulomb_drive", "slope"), print) is None


def test_what_does_not_reach_the_noise_is_left_as_it_is(begun):
    rounds = climbed(begun, "quadratic_drive", "slope")
    assert not rounds[-1].is_explained and stepwise.find_redundant_effect(rounds, print) is None


def of_sizes(effect, count):
    return SimpleNamespace(effect=effect, coefficients=dict.fromkeys(range(count), 0.1), equivalent_to=())


@pytest.mark.parametrize(("error", "redundant"), [(1.0, "quadratic_drive"), (1.3, None)])
def test_an_effect_is_exchanged_for_a_simpler_one_of_its_round_that_does_as_well(begun, monkeypatch, error, redundant):
    rounds = climbed(begun, "quadratic_drive", "coulomb_drive", "slope")
    rounds[0].named = (of_sizes("quadratic_drive", 2), of_sizes("viscous_asymmetry", 1))
    monkeypatch.setattr(stepwise, "nested_effects", lambda problem, effect: [])
    best = stepwise.best_result(rounds).error

    def reduced(problem, effects, fitted):
        left = error if "viscous_asymmetry" in effects else 2.0  # without any in its place it is needed
        return stepwise.Result(left * best, problem, fitted)

    monkeypatch.setattr(stepwise, "reduced_model", reduced)
    assert stepwise.find_redundant_effect(rounds, print) == redundant


@pytest.mark.parametrize(("floor_share", "redundant"), [(0.95, "stribeck_drive"), (1.0, None)])
def test_a_shape_that_contains_a_simpler_one_is_doubted_where_it_leaves_more_than_noise(
    begun, monkeypatch, floor_share, redundant
):
    rounds = climbed(begun, "coulomb_drive", "slope")
    rounds[0].named, rounds[0].problem = (of_sizes("stribeck_drive", 3), of_sizes("coulomb_drive", 3)), begun[0]
    last = rounds[-1]
    last.problem = last.problem.with_effects(["stribeck_drive", "slope"])
    result = stepwise.Result(1.0, SimpleNamespace(floor=floor_share, model=last.problem.model), last.fit)
    monkeypatch.setattr(stepwise, "best_result", lambda rounds: result)
    result.problem.with_effects = last.problem.with_effects
    monkeypatch.setattr(stepwise, "reduced_model", lambda problem, effects, fitted: result._replace(error=2.0))
    assert stepwise.find_redundant_effect(rounds, print) == redundant


def test_a_climb_begins_anew_without_a_needless_effect_only_if_it_then_gets_as_far(begun, monkeypatch):
    whole = climbed(begun, "quadratic_drive", "coulomb_drive", "slope")
    barred = []

    def one_climb(first, enough, progress):
        barred.append(first)
        return whole if not first else after

    monkeypatch.setattr(stepwise, "first_round", lambda problem, start, progress: problem.redundant_effects)
    monkeypatch.setattr(stepwise, "forward_pass", one_climb)
    after = climbed(begun, "coulomb_drive", "slope")
    assert stepwise.stepwise(*begun, lambda rounds: False) is after
    assert barred == [(), ("quadratic_drive",)]
    after = [SimpleNamespace(named=(), error=2.0, problem=begun[0], fit=None, is_explained=False)]
    likely = after

    def by_likelihood(problem, start, enough, progress):
        barred.append(problem.redundant_effects)
        return likely

    monkeypatch.setattr(stepwise, "rounds_by_likelihood", by_likelihood)
    assert stepwise.stepwise(*begun, lambda rounds: False) is whole
    for excluded in barred[-2:]:  # last, only what is not needless may be named, by what it leaves and by likelihood
        assert {e.name for e in begun[0].candidates()} - set(excluded) == {"coulomb_drive", "slope"}
    likely = climbed(begun, "coulomb_drive", "slope")
    assert stepwise.stepwise(*begun, lambda rounds: False) is likely


@dataclass(frozen=True)
class Problem:
    redundant_effects: tuple[str, ...]
    only_lasting: bool = False
    floor: float = 0.95


def ended(*effects, verdict="nothing_missing", by_likelihood=False):
    """Rounds that have added these effects and end with a verdict."""
    below = [
        SimpleNamespace(named=(SimpleNamespace(effect=e),), verdict="effect_missing", is_explained=False)
        for e in effects
    ]
    explained = verdict == "nothing_missing"
    last = SimpleNamespace(named=(), verdict=verdict, is_explained=explained, by_likelihood=by_likelihood)
    return [*below, last]


def by_likelihood_alone(monkeypatch, likely):
    """A search by likelihood that ends so, of logs in which nothing outside moves the machine."""
    monkeypatch.setattr(stepwise, "likely_model", lambda *rest: None)
    monkeypatch.setattr(stepwise, "_rounds_aside", lambda *rest: [])
    monkeypatch.setattr(stepwise, "rounds_from", lambda *rest: likely)
    monkeypatch.setattr(stepwise, "_way_of", lambda rounds: None)
    monkeypatch.setattr(stepwise, "down_to_noise", lambda rounds, *rest: rounds)


@pytest.mark.parametrize(
    ("likely", "tried"),
    [
        (ended(by_likelihood=True), False),  # what is left is chance
        (ended("coulomb_drive", verdict="unexplained", by_likelihood=True), False),  # a part is found
        (ended(verdict="unexplained", by_likelihood=True), True),
    ],
)
def test_two_effects_that_hide_each_other_are_sought_where_likelihood_finds_none_and_something_repeats(
    likely, tried, monkeypatch
):
    (first,), pair = ended(verdict="unexplained"), ended("slope", "coulomb_drive")
    seen = []
    monkeypatch.setattr(stepwise, "first_round", lambda problem, start, progress: first)
    monkeypatch.setattr(stepwise, "_with_backlash_instead", lambda rounds, *rest: rounds)
    by_likelihood_alone(monkeypatch, likely)
    monkeypatch.setattr(stepwise, "with_partner", lambda found, progress: seen.append(found) or pair[0])
    monkeypatch.setattr(stepwise, "next_round", lambda found, progress: pair[pair.index(found) + 1])
    monkeypatch.setattr(stepwise, "find_redundant_effect", lambda rounds, progress: None)
    monkeypatch.setattr(stepwise, "_with_what_shows_later", lambda rounds, *rest: rounds)
    found = stepwise.stepwise(None, {}, lambda rounds: False)
    assert seen == ([first] if tried else [])
    assert found == (pair if tried else likely)


QUIET, FOUND, OTHER = (ended(*e, by_likelihood=True) for e in ((), ("coulomb_drive",), ("slope",)))
LEFT = ended("coulomb_drive", verdict="unexplained", by_likelihood=True)


@pytest.mark.parametrize(
    ("calm", "likely", "is_calmer", "answer", "searched"),
    [
        (FOUND, OTHER, False, "calm", False),  # it names and explains: the logs as they are need no search
        (QUIET, OTHER, False, "likely", True),  # a delay of a few steps would look like this
        (QUIET, OTHER, True, "likely", True),
        (QUIET, LEFT, True, "calm", True),
        (QUIET, LEFT, False, "likely", True),
        (LEFT, OTHER, False, "likely", True),
        ([], OTHER, True, "likely", True),
    ],
)
def test_logs_without_the_times_of_a_force_from_outside_count_where_they_explain_or_leave_far_less(
    calm, likely, is_calmer, answer, searched, monkeypatch
):
    (first,), asked = ended(verdict="unexplained"), []
    monkeypatch.setattr(stepwise, "first_round", lambda problem, start, progress: first)
    monkeypatch.setattr(stepwise, "_with_backlash_instead", lambda rounds, *rest: rounds)
    monkeypatch.setattr(stepwise, "likely_model", lambda *rest: None)
    monkeypatch.setattr(stepwise, "_rounds_aside", lambda *rest: calm)
    monkeypatch.setattr(stepwise, "rounds_from", lambda *rest: asked.append(rest) or likely)
    monkeypatch.setattr(stepwise, "_way_of", lambda rounds: None)
    monkeypatch.setattr(stepwise, "down_to_noise", lambda rounds, *rest: rounds)
    monkeypatch.setattr(stepwise, "is_far_calmer", lambda found, before: is_calmer)
    assert stepwise.stepwise(None, {}, lambda rounds: False) is {"calm": calm, "likely": likely}[answer]
    assert bool(asked) is searched


def test_a_pair_is_sought_behind_backlash_that_explains_a_part_and_once_more_without_a_needless_effect(monkeypatch):
    (first,), pair, backlash = ended(verdict="unexplained"), ended("slope", "coulomb_drive"), ended("backlash")[0]
    (again,) = ended(verdict="unexplained")
    backlash.is_explained = False
    begun, seen, needless = iter([first, again]), [], iter(["slope", None])
    monkeypatch.setattr(stepwise, "first_round", lambda problem, start, progress: next(begun))
    monkeypatch.setattr(stepwise, "_with_backlash_instead", lambda rounds, *rest: [backlash])
    by_likelihood_alone(monkeypatch, ended(verdict="unexplained"))
    monkeypatch.setattr(stepwise, "with_partner", lambda found, progress: seen.append(found) or pair[0])
    monkeypatch.setattr(stepwise, "next_round", lambda found, progress: pair[pair.index(found) + 1])
    monkeypatch.setattr(stepwise, "find_redundant_effect", lambda rounds, progress: next(needless))
    monkeypatch.setattr(stepwise, "best_result", lambda rounds: stepwise.Result(1.0, None, None))
    monkeypatch.setattr(stepwise, "_with_what_shows_later", lambda rounds, *rest: rounds)
    problem = Problem(redundant_effects=())
    assert stepwise.stepwise(problem, {}, lambda rounds: False) == pair
    assert seen == [first, again]


@pytest.mark.parametrize(
    ("reached", "likely", "error", "answer"),
    [
        (ended(), None, 1.0, "reached"),  # no random force is left
        (ended(), QUIET, 1.0, "reached"),  # one is, and nothing can be said of it
        (ended(), FOUND, 1.0, "likely"),
        (ended(), LEFT, 1.0, "likely"),
        (ended(), LEFT, 1.1, "reached"),  # what predicts worse than sensor noise says less
        (ended(), FOUND, 1.1, "reached"),
        (ended("slope"), FOUND, 1.0, "likely"),  # the name had been that of what resembles it
        (ended("slope"), FOUND, 1.1, "reached"),  # which predicts worse
        (ended("slope"), FOUND, 1.004, "likely"),  # by no more than makes a step
        (ended("slope"), LEFT, 1.0, "reached"),  # and does not explain the rest
        (ended("slope"), OTHER, 1.0, "reached"),  # the same once more
    ],
)
def test_where_sensor_noise_hides_what_lasts_likelihood_judges_it(reached, likely, error, answer, monkeypatch):
    monkeypatch.setattr(stepwise, "first_round", lambda problem, start, progress: reached[0])
    monkeypatch.setattr(stepwise, "forward_pass", lambda first, is_done, progress: reached)
    monkeypatch.setattr(stepwise, "find_redundant_effect", lambda rounds, progress: None)
    monkeypatch.setattr(stepwise, "leaves_what_lasts", lambda *rest: likely is not None)
    fitted = SimpleNamespace(of_log=lambda number: {})
    monkeypatch.setattr(stepwise, "best_result", lambda r: stepwise.Result(error if r is likely else 1.0, None, fitted))
    asked = []

    def by_likelihood(problem, *rest):
        asked.append(problem.only_lasting)
        return likely

    told = []
    monkeypatch.setattr(stepwise, "rounds_by_likelihood", by_likelihood)
    monkeypatch.setattr(stepwise, "_with_warnings", lambda rounds, lines: told.extend(lines) or rounds)
    found = stepwise.stepwise(Problem(()), {}, lambda rounds: False)
    assert found is {"reached": reached, "likely": likely}[answer]
    assert asked == ([] if likely is None else [True])
    worse = error > 1.05 and likely in (FOUND, LEFT)  # and names what is not named without it
    assert [line.partition(",")[0] for line in told] == ["A search with random forces adds coulomb_drive"] * worse


def test_where_no_filter_can_follow_the_model_the_answer_of_the_horizon_stands_with_a_warning(monkeypatch):
    def fails(*rest):
        raise np.linalg.LinAlgError

    @dataclass(frozen=True)
    class Last:
        warnings: tuple[str, ...] = ("first",)
        by_likelihood: bool = False

    monkeypatch.setattr(
        stepwise, "best_result", lambda rounds: stepwise.Result(1.0, None, SimpleNamespace(of_log=lambda number: {}))
    )
    monkeypatch.setattr(stepwise, "leaves_what_lasts", fails)
    one, last = stepwise._with_what_shows_later(["one", Last()], None, {}, lambda rounds: False, lambda text: None)
    assert one == "one" and last.warnings[0] == "first"
    assert last.warnings[1].startswith("What sensor noise hides could not be sought: ")


def test_the_way_that_a_search_went_has_the_values_of_each_log_and_no_effect_that_a_wider_one_replaced(monkeypatch):
    values = [{"imu_bias.bias": 0.03}, {"imu_bias.bias": -0.01}]
    fitted = SimpleNamespace(of_log=lambda number: values[number])
    larger = SimpleNamespace(model=SimpleNamespace(effects=("imu_bias", "stribeck_drive")), logs=values)
    rounds = [SimpleNamespace(named=[SimpleNamespace(effect=e)])
              for e in ("coulomb_drive", "imu_bias", "stribeck_drive")]  # fmt: skip
    monkeypatch.setattr(stepwise, "best_result", lambda found: stepwise.Result(1.0, larger, fitted))
    way = stepwise._way_of([*rounds, SimpleNamespace(named=[])])
    assert way.rounds == rounds[1:] and way.problem is larger
    assert way.log_values == values


def test_there_is_room_for_two_more_effects_only_where_both_may_be_added():
    def done(count):
        return stepwise.selection_done([SimpleNamespace(by_likelihood=True)] * count)

    assert not done(3) and done(4) and done(5)


def test_a_needless_effect_is_said_not_to_be_judged(begun):
    problem = replace(begun[0], redundant_effects=("slope",))
    assert "slope" not in [e.name for e in problem.candidates()]
    assert "beside" in problem.why_not_testable(next(e for e in begun[0].candidates() if e.name == "slope"))


def test_behind_sensor_noise_what_moves_inside_is_said_to_be_judged_over_the_horizon(begun):
    moving = [e for e in begun[0].candidates() if e.releases]
    lasting = replace(begun[0], only_lasting=True)
    assert "slosh" in [e.name for e in moving]
    assert {e.name for e in begun[0].candidates()} - {e.name for e in lasting.candidates()} == {e.name for e in moving}
    assert all("over the horizon" in lasting.why_not_testable(e) for e in moving)


def fitted_with(begun, *effects):
    problem = begun[0].with_effects(effects)
    fitted = fit_model(problem, begun[1], free_names(problem, effects))
    return stepwise.Result(validation_residuals(problem, fitted)[0], problem, fitted)


def test_a_simpler_result_is_as_good_where_data_do_not_tell_and_none_that_misses_what_repeats_is(begun):
    whole, part = fitted_with(begun, "coulomb_drive", "slope"), fitted_with(begun, "coulomb_drive")
    larger = fitted_with(begun, "coulomb_drive", "slope", "air_drag")
    assert part.error > 1.01 * whole.error and not stepwise.is_as_good(part, whole)
    slightly_worse = whole._replace(error=1.008 * larger.error)  # beyond a step, and within what is told apart
    assert stepwise.is_as_good(slightly_worse, larger)
    assert not stepwise.is_as_good(whole._replace(error=1.02 * larger.error), larger)
    assert not stepwise.is_as_good(larger._replace(error=1.008 * whole.error), whole)  # it is not simpler
    assert not stepwise.is_as_good(part._replace(error=1.008 * whole.error), whole)  # data tell
