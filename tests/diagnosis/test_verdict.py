"""The verdict on refitted effects: what is named, what is equivalent, and what these data would have shown."""

from dataclasses import make_dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import derive
from tests.support import X, simulated
from wheelpend import Model, diagnose
from wheelpend.diagnosis.evidence import Comparisons, ValidatedFit, evaluate_candidate
from wheelpend.diagnosis.explain import overall_verdict, step_between, told_apart
from wheelpend.diagnosis.ranking import rank_candidates
from wheelpend.diagnosis.score_test import ScoreTest, find_twins, score_test
from wheelpend.diagnosis.stepwise import selection_done
from wheelpend.diagnosis.verdict import (
    conclude,
    detectable,
    revise_verdict,
    structurally_equivalent,
    verdict_on,
    where_chance_does_not_explain,
    where_nothing_is_determined,
    with_steps,
    with_structures,
)
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.identification.remainder import Remainder

TORQUE = "coulomb_drive.torque"
LOST, KNOWN = Estimate(0.8, 0.6, ""), Estimate(0.8, 0.06, "")


def screened(log):
    """A problem, the fit of its model as it is, and what the score test says of every effect."""
    problem = prepare(Model.default(), [log], horizon=0.2)
    fitted = fit_segments(problem, problem.data.estimation, X, problem.base, rounds=30)
    return problem, fitted, score_test(problem, fitted, problem.data.estimation, {})


@pytest.fixture(scope="module")
def complete():
    """A log of the model itself."""
    return screened(simulated(duration=8.0, seed=1))


@pytest.fixture(scope="module")
def rough():
    """A log with dry friction, the base fit, and the evidence for the friction."""
    problem, fitted, tests = screened(simulated(duration=8.0, seed=1, coulomb_drive__torque=0.02))
    better = fit_segments(problem, problem.data.estimation, {**X, TORQUE: 0.02}, [*problem.base, TORQUE])
    base = ValidatedFit.of(problem, fitted)
    effect = derive.effects.find("coulomb_drive")
    return problem, base, evaluate_candidate(problem, effect, better, base, Comparisons(30, 1)), tests


NOTHING = ScoreTest((), {})


# ---- the size that these data would have shown


def test_a_detectable_size_is_five_standard_errors_of_a_fit_with_the_effect(complete):
    problem, fitted, tests = complete
    values = problem.data.values
    factor = max(5.0, np.sqrt(2 * 0.005 * values))
    sizes = detectable(problem, tests)
    for name in (TORQUE, "slope.angle", "voltage_offset.offset", "gyro_scale.scale"):
        effect, _, parameter = name.partition(".")
        beside = fit_segments(problem, problem.data.estimation, fitted.values, [*problem.base, name], rounds=10)
        assert sizes[effect][parameter] == pytest.approx(factor * beside.sigma(name), rel=0.05)


@pytest.mark.slow
def test_what_is_hidden_beyond_its_detectable_size_is_found_and_what_is_half_as_large_is_not():
    size = diagnose(Model.default(), [simulated(seed=1)]).detectable["coulomb_drive"]["torque"]
    large, small = (diagnose(Model.default(), [simulated(seed=1, coulomb_drive__torque=k * size)]) for k in (1.3, 0.5))
    assert large.named[0].effect == "coulomb_drive"
    assert (small.verdict, small.named) == ("nothing_missing", ())


def test_an_expected_gain_is_the_one_that_a_refit_has(rough):
    _, base, candidate, tests = rough
    found = next(c for c in tests.candidates if c.effect.name == "coulomb_drive")
    scatter = base.fit.cost / base.fit.count  # in variances of the residual as it is
    assert found.gain * scatter == pytest.approx(base.fit.cost - candidate.fit.cost, rel=0.05)
    assert found.starts[0].values[TORQUE] == pytest.approx(0.02, rel=0.1)
    assert tests.candidates[0].gain == max(c.gain for c in tests.candidates)
    assert "coulomb_drive" in [c.effect.name for c in tests.candidates[:3]]


# ---- what is named


def test_an_effect_that_lowers_the_error_is_missing_and_one_that_does_not_is_not(rough):
    problem, base, candidate, _ = rough
    found = conclude(problem, base, [candidate], NOTHING)
    assert (found.verdict, found.named) == ("effect_missing", (candidate,))
    assert (found.error, found.noise_floor, found.detectable) == (base.error, problem.floor, {})
    useless = replace(candidate, error_after=base.error)
    left = conclude(problem, base, [useless], NOTHING)
    assert (left.verdict, left.candidates, left.refitted) == ("unexplained", (), (useless,))


def test_an_effect_that_is_certain_and_changes_next_to_nothing_is_said_and_not_named(rough):
    problem, base, candidate, _ = rough
    quiet = base._replace(error=problem.floor)
    small, smaller = (replace(candidate, error_after=k * quiet.error) for k in (0.997, 0.999))
    found = conclude(problem, quiet, [small, replace(smaller, effect="rolling_resistance")], NOTHING)
    assert (found.verdict, found.candidates) == ("nothing_missing", ())
    (told,) = (w for w in found.warnings if "too small to matter" in w)
    assert "coulomb_drive (torque 0.02" in told and "V); so, alone, is rolling_resistance." in told
    for other in (replace(small, p_value=0.5), replace(small, physical=False), replace(small, error_after=quiet.error)):
        assert not any("too small" in w for w in conclude(problem, quiet, [other], NOTHING).warnings)


def test_an_impossible_effect_is_listed_and_not_named(rough):
    problem, base, candidate, _ = rough
    impossible = replace(candidate, physical=False)
    found = conclude(problem, base, [impossible], NOTHING)
    assert (found.candidates, found.named, found.verdict) == ((impossible,), (), "unexplained")


def test_each_source_alone_names_an_equivalent(rough):
    problem, base, candidate, _ = rough
    by_data = conclude(problem, base, [candidate], ScoreTest((), {"coulomb_drive": ("slope",)}))
    assert by_data.named[0].equivalent_to == ("slope",)
    offset = replace(candidate, effect="com_offset")
    by_equations = conclude(problem, base, [offset], NOTHING)
    assert by_equations.named[0].equivalent_to == ("imu_bias",)
    close, far = (replace(candidate, effect="slope", error_after=k * candidate.error_after) for k in (1.009, 1.02))
    assert conclude(problem, base, [candidate, close], NOTHING).named[0].equivalent_to == ("slope",)
    assert conclude(problem, base, [candidate, far], NOTHING).named[0].equivalent_to == ()
    assert by_data.verdict == by_equations.verdict == "ambiguous"


def test_twins_of_the_equations_count_only_where_both_have_a_value_in_as_many_logs(rough):
    problem, _, candidate, _ = rough
    two = replace(problem, noise=2 * problem.noise)
    assert structurally_equivalent(problem, replace(candidate, effect="com_offset")) == {"imu_bias"}
    assert structurally_equivalent(two, replace(candidate, effect="com_offset")) == {"imu_bias"}
    assert structurally_equivalent(two, replace(candidate, effect="imu_bias")) == set()
    assert structurally_equivalent(problem, replace(candidate, effect="slope")) == set()


def test_twins_of_the_data_are_parallel_sensitivities():
    a = np.array([1.0, 2.0, 0.0])
    rows = np.array([a, -3.0 * a, [1.0, 2.0, 1e-3], [1.0, 2.0, 0.1], 1e-9 * a])
    names = ("slope", "voltage_offset", "gyro_bias", "body_damping", "air_drag")
    information = rows @ rows.T
    found = find_twins({n: [k] for k, n in enumerate(names)}, information, np.full(5, 5.0))
    assert found["slope"] == ("gyro_bias", "voltage_offset") and found["body_damping"] == ()
    assert "air_drag" not in found


def test_a_verdict_asks_for_validation_data_and_for_an_error_above_the_noise(rough):
    problem, _, candidate, _ = rough
    assert verdict_on(problem, [], 1.09 * problem.floor) == "nothing_missing"
    assert verdict_on(problem, [], 1.11 * problem.floor) == "unexplained"
    assert verdict_on(problem, [candidate], 9.0) == "effect_missing"
    assert verdict_on(replace(problem, data=replace(problem.data, validation=())), [candidate], 9.0) == "ambiguous"


def test_an_effect_that_leaves_a_rest_is_the_answer_only_where_more_effects_explain_it(rough):
    problem, base, candidate, _ = rough
    floor = problem.floor
    full = conclude(problem, base, [replace(candidate, error_after=1.09 * floor)], NOTHING)
    partial = conclude(problem, replace_error(base, 9.0), [replace(candidate, error_after=1.2 * floor)], NOTHING)
    assert full.is_explained and not partial.is_explained
    assert revise_verdict(partial, full) is partial
    assert revise_verdict(partial, partial).verdict == "unexplained"
    slow = conclude(problem, replace_error(base, 1.3), [replace(candidate, error_after=1.2)], NOTHING)
    assert selection_done([partial, slow]) and not selection_done([partial])
    assert selection_done([full]) and selection_done(4 * [partial]) and not selection_done(3 * [partial])


def replace_error(base, error):
    return base._replace(error=error)


def told_with_structures(nats, verdict="nothing_missing", after_another=False, by_likelihood=True, replacing=False):
    """Verdict, and what would have been shown, of a search with this evidence for an effect that is not certain."""
    tried = SimpleNamespace(effect="link_scale", evidence=np.full(20, nats / 20), is_possible=True)
    rest = [SimpleNamespace(name=f"other_{k}") for k in range(12)]
    problem = SimpleNamespace(replaced=lambda name: (), candidates=lambda: [SimpleNamespace(name="link_scale"), *rest])
    searched = SimpleNamespace(refitted=(tried,), named=(), problem=problem, p_value_of_rest=1.0, replaces={})
    other = SimpleNamespace(effect="other_0", evidence=np.full(20, 3.0), is_possible=True)
    own = SimpleNamespace(**vars(problem))
    first = SimpleNamespace(refitted=(other,), named=(other,), problem=own, p_value_of_rest=1.0, replaces={})
    fields = {"verdict": verdict, "by_likelihood": by_likelihood, "named": (), "detectable": {"slope": {}},
              "warnings": (), "problem": problem}  # fmt: skip
    blank = make_dataclass("Blank", [*fields, "structures", "candidates", "is_doubtful"])(
        *fields.values(), (), (), False
    )
    better = SimpleNamespace(effect="other_1", evidence=np.full(20, 3.0), is_possible=True)
    takes = SimpleNamespace(
        replaced=lambda name: ("other_0",) if name == "other_1" else (), candidates=problem.candidates
    )
    second = SimpleNamespace(refitted=(better,), named=(better,), problem=takes, p_value_of_rest=1.0)
    second.replaces = {"other_1": ("other_0",)}
    found = with_structures(blank, [*([first] if after_another else []), *([second] if replacing else []), searched])
    return found.verdict, found.detectable


def test_where_nothing_is_certain_but_nothing_missing_improbable_something_is_unexplained():
    assert told_with_structures(20.0) == ("unexplained", {})
    assert told_with_structures(2.0) == ("nothing_missing", {"slope": {}})
    assert told_with_structures(20.0, by_likelihood=False)[0] == "unexplained"  # though held-out data are at rest
    assert told_with_structures(20.0, after_another=True)[0] == "unexplained"
    assert told_with_structures(2.0, after_another=True)[0] == "nothing_missing"  # what was named is likely, and alone
    assert told_with_structures(20.0, after_another=True, replacing=True)[0] == "unexplained"  # one is left of two
    assert told_with_structures(2.0, verdict="unexplained")[0] == "unexplained"


@pytest.mark.parametrize(
    ("table", "error", "named", "verdict"),
    [
        ({"X1": LOST}, 20.0, (), "unexplained"),
        ({"X1": LOST, "coulomb_drive.torque": LOST}, 20.0, (), "unexplained"),
        ({"X1": LOST, "coulomb_drive.torque": KNOWN}, 20.0, (), "nothing_missing"),  # at constant speed it shows
        ({"X1": LOST, "encoder_scale.scale": KNOWN}, 20.0, (), "unexplained"),  # a sensor's error is not the machine's
        ({"X1": LOST, "X2": KNOWN}, 20.0, (), "nothing_missing"),
        ({"X1": LOST}, 1.05, (), "nothing_missing"),  # only noise is left
        ({"X1": LOST}, 0.88, (), "nothing_missing"),  # by chance
        ({"X1": LOST}, 0.3, (), "unexplained"),  # far less than that: its noise is not known
        ({"X1": LOST}, 20.0, ("slope",), "nothing_missing"),
    ],
)
def test_logs_that_determine_nothing_do_not_say_that_nothing_is_missing(table, error, named, verdict):
    part = SimpleNamespace(bounds=[(0, 100)], values=100)
    data = SimpleNamespace(held_out=[part])
    module = SimpleNamespace(NQ=1)
    problem = SimpleNamespace(plant=Model.default().plant_signature, floor=1.0, data=data, module=module)
    fields = {"verdict": "nothing_missing", "error": error, "noise_floor": 1.0, "named": named, "problem": problem,
              "detectable": {"slope": {}}, "determines_nothing": False}  # fmt: skip
    found = where_nothing_is_determined(make_dataclass("Blank", [*fields])(*fields.values()), table)
    assert (found.verdict, found.determines_nothing) == (verdict, verdict == "unexplained")


@pytest.mark.parametrize(
    ("left", "error", "verdict"),
    [
        (Remainder(), 2.4, "unexplained"),
        (Remainder(), 1.05, "nothing_missing"),
        (Remainder(force={"wheel": None}), 2.4, "nothing_missing"),  # a random force may do that
        (Remainder(sensors={"theta_p": None}), 2.4, "nothing_missing"),
        (None, 2.4, "nothing_missing"),  # and of this nothing is known
    ],
)
def test_where_nothing_is_left_to_chance_held_out_data_are_predicted_or_something_is_unexplained(left, error, verdict):
    fields = {"verdict": "nothing_missing", "error": error, "noise_floor": 1.0, "named": (), "remainder": left,
              "detectable": {}}  # fmt: skip
    found = where_chance_does_not_explain(make_dataclass("Blank", [*fields])(*fields.values()))
    assert found.verdict == verdict


@pytest.mark.parametrize(("nats", "rest_p", "warned"), [(1.0, 1.0, True), (15.0, 1.0, False), (1.0, 1e-40, False)])
def test_an_effect_that_is_less_likely_than_nothing_is_named_with_a_warning(nats, rest_p, warned):
    tried = SimpleNamespace(effect="link_scale", evidence=np.full(20, nats / 20), is_possible=True)
    rest = [SimpleNamespace(name=f"other_{k}") for k in range(12)]
    problem = SimpleNamespace(replaced=lambda name: (), candidates=lambda: [SimpleNamespace(name="link_scale"), *rest])
    searched = SimpleNamespace(refitted=(tried,), named=(tried,), problem=problem, p_value_of_rest=rest_p, replaces={})
    fields = {"verdict": "effect_missing", "by_likelihood": True, "named": (tried,), "warnings": ("a gap",)}
    blank = make_dataclass("Blank", [*fields, "structures", "candidates", "is_doubtful"])(
        *fields.values(), (), (), False
    )
    found = with_structures(blank, [searched, SimpleNamespace(**{**vars(searched), "named": (), "refitted": ()})])
    assert found.warnings[0] == "a gap" and found.verdict == "effect_missing"
    assert any("link_scale is significant, but" in w for w in found.warnings) == warned


def test_a_diagnosis_says_which_effects_its_search_added_and_what_they_leave():
    def one(name, error):
        return SimpleNamespace(named=(SimpleNamespace(effect=name),), error=error)

    blank = make_dataclass("Blank", [("steps", tuple), ("error_with_steps", float)])((), None)
    last = SimpleNamespace(named=(), error=3.0)
    found = with_steps(blank, [one("viscous_drive", 9.0), one("coulomb_drive", 5.0), last])
    assert (found.steps, found.error_with_steps) == (("viscous_drive", "coulomb_drive"), 3.0)
    alone = with_steps(blank, [one("viscous_drive", 9.0)])
    assert (alone.steps, alone.error_with_steps) == ((), None)


def test_a_ladder_is_unexplained_where_its_last_rung_is_and_ambiguous_where_one_is():
    sure, unsure = SimpleNamespace(equivalent_to=()), SimpleNamespace(equivalent_to=("slope",))
    done = SimpleNamespace(verdict="nothing_missing", error=1.09, noise_floor=1.0, by_likelihood=False, named=())
    assert overall_verdict([sure], done) == "nothing_missing"
    assert overall_verdict([sure, unsure], done) == "ambiguous"
    for left in ({"verdict": "unexplained"}, {"error": 1.11}):
        assert overall_verdict([sure], SimpleNamespace(**{**vars(done), **left})) == "unexplained"


def test_beside_a_random_force_a_ladder_is_unexplained_where_something_is_left_to_name_however_large_the_error():
    done = SimpleNamespace(verdict="nothing_missing", error=50.0, noise_floor=1.0, by_likelihood=True, named=())
    assert overall_verdict([], done) == "nothing_missing"
    assert overall_verdict([], SimpleNamespace(**{**vars(done), "named": ("slope",)})) == "unexplained"


def test_the_lower_error_comes_first_and_the_simpler_effect_where_it_is_contained_and_alike(rough):
    problem, _, candidate, _ = rough
    sizes = {name: Estimate(1.0, 0.1, "V") for name in ("static", "sliding", "speed")}
    stribeck = replace(candidate, effect="stribeck_drive", estimates=sizes)
    slope = replace(candidate, effect="slope", error_after=1.5)
    dry = replace(candidate, error_after=1.005)
    order = rank_candidates(problem, [slope, dry, replace(stribeck, error_after=1.0)])
    assert [c.effect for c in order] == ["coulomb_drive", "stribeck_drive", "slope"]
    order = rank_candidates(problem, [replace(dry, error_after=1.02), replace(stribeck, error_after=1.0)])
    assert [c.effect for c in order] == ["stribeck_drive", "coulomb_drive"]


@pytest.mark.parametrize(
    ("lead", "error", "first"),
    [
        ([3.0, -2.0, 4.0, -3.0], 1.5, "encoder_zero"),  # no lead beside its scatter
        ([3.0, 2.0, 4.0, 3.0], 1.5, "cogging"),
        ([3.0, -2.0, 4.0, -3.0], 1.0, "cogging"),  # where noise is all that is left no such scatter counts
        ([-3.0, -2.0, -4.0, -3.0], 1.0, "encoder_zero"),  # less, once the price of its freedom is paid
    ],
)
def test_the_simpler_of_two_that_data_do_not_tell_apart_comes_first(rough, lead, error, first):
    problem, _, candidate, _ = rough
    sizes = {name: Estimate(1.0, 0.1, "") for name in ("sine", "cosine", "periods")}
    many = replace(candidate, effect="cogging", estimates=sizes, error_after=error, evidence=np.array(lead))
    one = replace(candidate, effect="encoder_zero", error_after=1.002 * error, evidence=np.zeros(4))
    assert rank_candidates(problem, [many, one])[0].effect == first
    apart = replace(one, error_after=1.02 * error)  # a difference of the error that data do tell
    assert rank_candidates(problem, [many, apart])[0].effect == "cogging"


@pytest.mark.parametrize(
    ("hidden", "twin", "size"),
    [("com_offset.angle", "imu_bias.bias", 0.02), ("voltage_offset.offset", "coulomb_asymmetry.torque", 0.2)],
)
def test_a_twin_fits_as_well_with_the_opposite_size(hidden, twin, size):
    log = simulated(duration=6.0, seed=2, **{hidden.replace(".", "__"): size})
    problem = prepare(Model.default(), [log])
    true, other = (
        fit_segments(problem, problem.data.estimation, {**X, n: s}, [*problem.base, n], rounds=20)
        for n, s in ((hidden, size), (twin, -size))
    )
    assert other.cost == pytest.approx(true.cost, rel=1e-6)
    assert abs(true.of_log(0)[hidden] - size) < 4.0 * true.sigma(hidden) < 0.2 * size
    assert other.of_log(0)[twin] == pytest.approx(-true.of_log(0)[hidden], rel=1e-4)


def test_an_effect_of_an_impossible_size_is_no_rival_of_a_simpler_one(rough):
    problem, _, candidate, _ = rough
    far = 50.0 * problem.floor
    sizes = {name: Estimate(1.0, 0.1, "V") for name in ("torque", "stiffness")}
    impossible = replace(candidate, effect="stribeck_drive", estimates=sizes, error_after=0.2 * far, physical=False)
    larger = replace(candidate, effect="presliding_drive", estimates=sizes, error_after=far)
    simple = replace(candidate, effect="viscous_drive", error_after=1.01 * far)
    order = rank_candidates(problem, [larger, simple, impossible])
    assert [c.effect for c in order if c.physical] == ["viscous_drive", "presliding_drive"]


@pytest.mark.parametrize(("by_likelihood", "error_after"), [(True, 6.0), (False, 4.0)])
def test_a_step_beside_a_random_force_leaves_the_error_of_the_model_fitted_to_its_end(by_likelihood, error_after):
    unknown = ("estimates", "p_value", "equivalent_to", "per_log", "blocks_agree", "held_out_gain")
    told = {**dict.fromkeys(unknown), "effect": "slope", "error_after": 4.0, "fit": SimpleNamespace(values={"X1": 2.0})}
    rest = {"problem": SimpleNamespace(base=("X1",)), "remainder": None, "by_likelihood": by_likelihood}
    before = SimpleNamespace(named=[SimpleNamespace(**told)], error=9.0, **rest)
    step = step_between(before, SimpleNamespace(error=6.0, fit=SimpleNamespace(values={"X1": 3.0}), **rest))
    assert (step.error_before, step.error_after, step.force_after) == (9.0, error_after, None)
    assert step.parameters == {"X1": 3.0 if by_likelihood else 2.0}


def test_of_effects_that_are_both_steps_neither_is_said_to_be_hard_to_tell_from_the_other():
    Named = make_dataclass("Named", ["effect", "equivalent_to"])
    Found = make_dataclass("Found", ["named", "candidates", "verdict", "problem"])
    held_out = SimpleNamespace(data=SimpleNamespace(validation=[1]))

    def found(effect, *others, further=()):
        named = [Named(effect, others), *further]
        return Found(named, tuple(named), "ambiguous" if others else "effect_missing", held_out)

    last = Found([], (), "nothing_missing", held_out)
    beside = Named("slope", ("coulomb_drive",))
    rounds = told_apart([found("coulomb_drive", "viscous_drive", further=[beside]), found("viscous_drive"), last])
    assert [r.candidates[0].equivalent_to for r in rounds[:2]] == [(), ()] and rounds[0].candidates[1] == beside
    assert [r.verdict for r in rounds] == ["effect_missing", "effect_missing", "nothing_missing"]
    unclear = told_apart([found("coulomb_drive", "slope", "viscous_drive"), found("viscous_drive"), last])
    assert unclear[0].candidates[0].equivalent_to == ("slope",) and unclear[0].verdict == "ambiguous"
