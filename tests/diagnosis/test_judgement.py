"""Beside a random force an effect needs evidence, and must lower the error or the force; one of them is enough."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.diagnosis.evidence import CandidateFit, wald_p_value
from wheelpend.diagnosis.likelihood import judgement
from wheelpend.diagnosis.likelihood.judgement import (
    Judged,
    agreement,
    certain_within,
    falls_of_force,
    most_telling_first,
    not_led,
    wald_p_value_of_ratio,
    with_likelier_besides,
)
from wheelpend.diagnosis.negligible import instead_of_chance_sentences
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.identification.remainder import modelled_forces
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

BEHIND_ONE_FILTER = np.zeros(0)
CLEAR_RISE = (-0.2, -0.1, -0.15)  # of the error: in all segments


def judged(error_after=100.0, less_force=0.0, less_on_row=None, falls=(-2.0, 1.0, 1.5), relative=CLEAR_RISE, **changed):
    told = {
        "p_value": 1e-6,
        "p_discovery": 0.02,
        "p_confirmation": 1e-3,
        "physical": True,
        "determined": True,
        "error_after": error_after,
        **changed,
    }
    told["is_possible"] = told["physical"] and told["determined"]
    on_row = less_force if less_on_row is None else less_on_row
    gains, falls = np.linspace(-1.0, 3.0, 20), np.array(falls)
    relative = np.array(relative)
    forces = (less_force, on_row)
    return Judged(
        SimpleNamespace(**told),
        None,
        None,
        gains,
        50.0,
        *forces,
        np.zeros(1),
        falls,
        relative,
        BEHIND_ONE_FILTER,
    )


@pytest.mark.parametrize(
    ("error_after", "less_force", "supported"),
    [(99.0, 0.0, True), (103.0, 0.1, True), (95.0, -0.2, True), (99.8, 0.004, False), (103.0, 0.0, False)],
)
def test_an_effect_lowers_the_error_or_the_force(error_after, less_force, supported):
    assert judged(error_after, less_force).is_supported(100.0) == supported


def test_an_effect_whose_size_is_not_told_from_none_is_certain_by_no_likelihood():
    assert judged(90.0).is_certain and not judged(90.0, determined=False).is_certain
    assert judged(90.0, determined=False).is_followed, "its p-values are as they are"


@pytest.mark.parametrize(("size", "correlation", "told"), [(2.0, 0.999, True), (2.0, 0.0, False), (0.02, 0.999, False)])
def test_a_size_is_told_by_its_ratio_to_an_inertia_where_nothing_tells_their_scale(size, correlation, told):
    sigma = np.array([4.0, 20.0])  # twice the values: neither is told from nothing alone
    covariance = np.outer(sigma, sigma) * np.array([[1.0, correlation], [correlation, 1.0]])
    free = (FreeParameter("force"), FreeParameter("inertia"))
    at = Fit.at({"force": size, "inertia": 10.0})
    fitted = replace(at, free=free, covariance=covariance, robust=covariance, blocks=20, cost=1.0)
    deviation = np.array([size])
    assert wald_p_value(fitted, free[:1], deviation, parts=100) > 0.5
    assert (wald_p_value_of_ratio(fitted, free[:1], deviation, free[1], 100) < 0.01) == told


def test_an_error_may_rise_by_less_than_the_force_falls():
    assert judged(109.0, 0.1).is_supported(100.0) and not judged(112.0, 0.1).is_supported(100.0)
    lag = judged(200.0, 0.47)  # that half of the force went into
    assert not lag.is_supported(100.0) and not lag.improves(100.0) and judged(155.0, 0.6).improves(100.0)
    assert judged(320.0, 0.95).improves(100.0)  # without it nothing but the force had moved the machine
    assert not judged(320.0, 0.65).improves(100.0) and judged(320.0, 1.0).improves(100.0)


def test_what_spares_the_random_force_is_likelier_possible_and_leaves_a_tenth_of_it():
    assert judged(100.0, 0.95).spares_force(100.0) and not judged(100.0, 0.85).spares_force(100.0)
    assert not judged(100.0, 0.95, physical=False).spares_force(100.0)
    assert not judged(100.0, 0.95)._replace(in_sample=-1.0).spares_force(100.0)
    assert not judged(9000.0, 0.95).spares_force(100.0)


def test_what_spares_the_random_force_is_told_with_its_size():
    sizes = {"viscous_drive": 0.00055, "quadratic_drive": 8.6e-05}
    found = [
        SimpleNamespace(effect=name, estimates={"coefficient": SimpleNamespace(value=v, sigma=v / 5.0, unit="s/rad")})
        for name, v in sizes.items()
    ]
    assert instead_of_chance_sentences([]) == ()
    (both,), (one,) = instead_of_chance_sentences(found), instead_of_chance_sentences(found[:1])
    assert both.startswith("With viscous_drive (coefficient 0.00055 ± 0.0001 s/rad) or quadratic_drive (")
    assert one.startswith("With viscous_drive (coefficient 0.00055 ± 0.0001 s/rad) hardly any random force is needed")


def test_an_error_that_rises_by_chance_is_no_argument_against_a_law_that_lowers_the_force():
    by_chance = (-0.4, 0.1, -0.2, 0.2, 0.1)
    assert judged(104.0, 0.02, relative=by_chance).is_supported(100.0)
    assert not judged(104.0, 0.0, relative=by_chance).is_supported(100.0)  # it lowers nothing
    assert judged(104.0, 0.0, relative=by_chance).is_negligible(100.0)
    assert not judged(104.0, 0.0).is_negligible(100.0)  # wrong over the horizon
    assert not judged(104.0, 0.02, relative=(-0.1,)).is_supported(100.0)  # one segment has no scatter


def test_the_force_of_one_row_counts_where_another_rows_hides_it():
    quiet = judged(100.1, less_force=0.0004, less_on_row=0.9)  # 7 mV on the body beside 250 mV on the wheel
    assert quiet.is_supported(100.0) and not quiet.is_negligible(100.0)
    assert not judged(101.0, 0.0004, 0.9).is_supported(100.0)  # all force together hardly falls: nor may the error rise
    assert not judged(100.1, -0.1, 0.9).is_supported(100.0)  # it went into another row
    assert judged(100.1, 0.0004).is_negligible(100.0) and not judged(100.1, 0.0004, p_value=0.1).is_negligible(100.0)


def test_what_makes_a_thousandth_of_the_drive_or_held_out_data_likelier_has_weight(monkeypatch):
    shares = {"small": 0.5e-3, "large": 2e-3}
    monkeypatch.setattr(judgement, "share_of_drive", lambda model, effect: shares[effect])
    small, large = (judged(100.1, 0.0004, effect=name) for name in shares)
    assert small.is_negligible(100.0) and small.has_weight, "of 20 blocks 15 are likelier"
    chance = np.tile([-2.0, 2.1], 10)
    assert not small._replace(gains=chance).has_weight and large._replace(gains=chance).has_weight


def test_what_data_do_not_tell_from_an_effect_with_weight_is_named_with_it(monkeypatch):
    monkeypatch.setattr(judgement, "share_of_drive", lambda model, effect: 2e-3 * (effect == "com_offset"))
    chance = np.tile([-2.0, 2.1], 5)
    tilt, bias = (rival(name, 20.0, chance, chance, BLOCKS) for name in ("com_offset", "imu_bias"))
    other = rival("slope", 20.0, chance, chance, 5.0 * BLOCKS)  # of which data of the fit say far more
    assert [j.candidate.effect for j in judgement.with_weight([bias, other, tilt])] == ["imu_bias", "com_offset"]
    assert judgement.with_weight([bias, other]) == []
    assert "imu_bias" in most_telling_first(judgement.with_weight([tilt, bias]))[0].candidate.equivalent_to


@pytest.mark.parametrize(("torque", "share"), [(0.2, 0.2 / np.hypot(2.0, 0.2)), (1e-4, 0.5e-4)])
def test_the_share_of_an_effect_is_that_of_its_force_along_the_motion(torque, share):
    model = Model.parse('plant = "slide"\neffects = ["coulomb_drive"]\n')
    t = 0.01 * np.arange(600)
    volts = 2.0 * np.sign(np.sin(3.0 * t + 0.1))
    log = Log.from_arrays(t, table=model.table, v_in=volts, x=np.sin(3.0 * t))
    problem = prepare(model, [log])
    acting = SimpleNamespace(problem=problem, log_values=[{"X1": 0.1, "coulomb_drive.torque": torque}])
    drives = modelled_forces(problem.module, problem.logs, acting.log_values[0]).together
    found = judgement.share_of_drive(SimpleNamespace(**vars(acting), row_drives=drives), "coulomb_drive")
    assert found == pytest.approx(share, rel=0.15)


def test_blocks_are_those_of_the_kind_that_agrees_more():
    likelier, nearer = np.array([1.0, -1.0, -1.0, -1.0]), np.array([1.0, 1.0, -1.0])
    assert agreement(likelier, nearer) == "2/3" and agreement(likelier) == "1/4"
    assert agreement(np.ones(4), np.ones(2)) == "4/4" and agreement(likelier, np.zeros(0)) == "1/4"


def test_the_falls_of_a_force_are_those_of_all_rows_and_of_the_best():
    def force(*squares, drives=(6.0, 6.0, 6.0)):
        return SimpleNamespace(row_forces_squared=np.array(squares), row_drives=np.array(drives[: len(squares)]))

    total, on_row = falls_of_force(force(0.09, 4e-4, 0.0), force(0.09, 1e-4, 0.0))
    assert on_row == pytest.approx(0.5) and total == pytest.approx(1.0 - np.sqrt(0.0901 / 0.0904))
    total, on_row = falls_of_force(force(0.0625, 1e-8), force(0.0631, 4e-9))  # 0.1 mV of 6 V, which wanders
    assert total < 0.0 and on_row == pytest.approx(total, abs=1e-3) and on_row < 0.0
    assert falls_of_force(force(0.0, 0.0), force(0.0, 0.0)) == (0.0, 0.0)


def test_the_force_of_a_row_is_measured_by_the_drive_on_that_row_whatever_the_unit_is():
    def force(cart, pole):  # V, and V m on a pole of a tenth of a metre
        return SimpleNamespace(row_forces_squared=np.array([cart, pole]) ** 2, row_drives=np.array([0.5, 2e-3]))

    total, on_row = falls_of_force(force(0.063, 3.7e-4), force(0.0633, 1.6e-4))
    assert on_row == pytest.approx(1.0 - 1.6 / 3.7) and 0.3 < total < 0.4


@pytest.mark.parametrize(
    "changed",
    [
        {"p_value": 1e-3},
        {"p_discovery": 0.06},
        {"p_confirmation": 0.06},
        {"physical": False},
        {"p_value": 1e-3, "p_discovery": 0.005, "p_confirmation": 0.06},
        {"p_discovery": None},
    ],
)
def test_an_effect_needs_significance_confirmation_and_a_possible_size(changed):
    assert judged(90.0, 0.1).is_supported(100.0) and not judged(90.0, 0.1, **changed).is_supported(100.0)


def test_just_enough_in_each_part_of_the_data_is_enough():
    assert judged(90.0, 0.1, p_value=2e-3, p_discovery=0.0025, p_confirmation=0.048).is_supported(100.0)


def test_the_data_of_the_fit_and_all_data_must_be_likelier_than_the_freedom_is_worth():
    lost = judged(90.0, 0.1)._replace(in_sample=-14.0, gains=np.full(20, 0.5))  # a refit that went elsewhere
    assert lost.evidence > 0.0 and not lost.is_supported(100.0)
    assert lost._replace(in_sample=14.0).is_supported(100.0)
    assert not lost._replace(in_sample=14.0, gains=np.r_[np.ones(11), np.full(9, -5.0)]).is_supported(100.0)


def test_most_blocks_must_be_likelier_or_better_predicted():
    few = judged(90.0, 0.1, falls=(-1.0, -1.0, 5.0))._replace(gains=np.r_[np.full(11, -0.1), np.full(9, 5.0)])
    assert few.evidence > 0.0 and not few.is_supported(100.0)
    assert few._replace(falls=np.array([1.0, 1.0, -1.5])).is_supported(100.0)
    assert few._replace(follows=np.r_[np.ones(11), np.full(9, -0.2)]).is_supported(100.0)  # behind one filter


def rival(effect, in_sample, likelihood, falls, rises=0.0):
    """A judged effect whose held-out blocks have this log-likelihood over the model without it, and these falls."""
    candidate = CandidateFit(effect, {}, "drive", 1e-6, "", 1.0, (), True, None, p_discovery=1e-6)
    prediction = SimpleNamespace(log_likelihood=np.array(likelihood))
    module = SimpleNamespace(CONTAINS={"stribeck_drive": {"coulomb_drive": ()}})
    model = SimpleNamespace(problem=SimpleNamespace(module=module))
    rises = rises * np.ones(len(likelihood))
    falls = np.array(falls)
    gains = np.array(likelihood)
    return Judged(
        candidate, model, prediction, gains, in_sample, 0.0, 0.0, rises, falls, falls / 1e3, BEHIND_ONE_FILTER
    )


BLOCKS = np.linspace(0.9, 1.1, 10)


def test_the_simple_law_comes_before_the_one_that_has_it_in_it():
    simple = rival("coulomb_drive", 20.0, 2.0 * BLOCKS, 10.0 * BLOCKS, BLOCKS)
    elastic = rival("presliding_drive", 300.0, 40.0 * BLOCKS, 90.0 * BLOCKS, 15.0 * BLOCKS)
    other = rival("viscous_drive", 250.0, BLOCKS, BLOCKS, 12.0 * BLOCKS[::-1])
    order = most_telling_first([other, elastic, simple])
    assert [j.candidate.effect for j in order] == ["coulomb_drive", "presliding_drive", "viscous_drive"]
    assert [j.candidate.effect for j in most_telling_first([other, simple])] == ["viscous_drive", "coulomb_drive"]
    assert most_telling_first([]) == []


def test_a_friction_comes_before_its_difference_between_directions_where_it_does_as_well():
    plain = rival("coulomb_drive", 20.0, 2.0 * BLOCKS, 10.0 * BLOCKS, BLOCKS)
    one_way = rival("coulomb_asymmetry", 20.2, 2.01 * BLOCKS[::-1], 10.0 * BLOCKS[::-1], BLOCKS[::-1])
    names = [j.candidate.effect for j in most_telling_first([one_way, plain])]
    assert names == ["coulomb_drive", "coulomb_asymmetry"]
    clear = rival("coulomb_asymmetry", 80.0, 9.0 * BLOCKS, 30.0 * BLOCKS, 9.0 * BLOCKS)
    assert most_telling_first([plain, clear])[0].candidate.effect == "coulomb_asymmetry"


def test_a_law_that_predicts_no_better_than_the_simple_one_in_it_is_left_out():
    simple = rival("coulomb_drive", 200.0, 20.0 * BLOCKS, 10.0 * BLOCKS)
    elastic = rival("presliding_drive", 300.0, 20.0 * BLOCKS[::-1], 10.0 * BLOCKS)
    assert [j.candidate.effect for j in most_telling_first([elastic, simple])] == ["coulomb_drive"]


def test_effects_are_alike_where_likelihood_and_horizon_are():
    one = rival("coulomb_drive", 200.0, 20.0 * BLOCKS, 10.0 * BLOCKS)
    alike = rival("load_friction", 150.0, 20.0 * BLOCKS[::-1], 10.0 * BLOCKS[::-1])
    nearer = rival("load_friction", 150.0, 20.0 * BLOCKS[::-1], 50.0 * BLOCKS)
    assert [j.candidate.equivalent_to for j in most_telling_first([one, alike])] == [
        ("load_friction",),
        ("coulomb_drive",),
    ]
    assert [j.candidate.equivalent_to for j in most_telling_first([one, nearer])] == [("coulomb_drive",), ()]
    less = nearer._replace(in_sample=250.0)  # more evidence too
    assert [j.candidate.equivalent_to for j in most_telling_first([one, less])] == [(), ()]


def test_of_laws_with_much_evidence_that_comes_first_which_no_other_clearly_leads():
    wobble = np.resize([30.0, -30.0], 10)
    slow = rival("coulomb_drive", 400.0, 62.0 * BLOCKS + wobble, 10.0 * BLOCKS)  # likelier, but for that lead by chance
    lawful = rival("load_friction", 380.0, 60.0 * BLOCKS - wobble, 50.0 * BLOCKS)
    assert [j.candidate.effect for j in most_telling_first([slow, lawful])] == ["load_friction", "coulomb_drive"]
    certain = slow._replace(predicted=SimpleNamespace(log_likelihood=90.0 * BLOCKS), gains=90.0 * BLOCKS)
    assert not lawful.clearly_leads(certain) and not certain.clearly_leads(lawful)  # one is better in either way
    assert [j.candidate.effect for j in most_telling_first([certain, lawful])] == ["coulomb_drive", "load_friction"]
    assert not lawful._replace(rises=-5.0 * BLOCKS).clearly_leads(slow)  # clearly less likely in sample


def test_effects_that_the_data_of_the_fit_tell_apart_are_not_alike():
    wobble = np.resize([0.3, -0.3], 10)
    offset, bias, tilt = (
        rival(e, 200.0, 20.0 * BLOCKS, 10.0 * BLOCKS, rises)
        for e, rises in zip("abc", (wobble, -wobble, 3.0 * wobble + 5.0), strict=True)
    )
    assert offset.is_like(bias) and bias.is_like(offset)
    assert not tilt.is_like(offset) and not bias.is_like(tilt)


def test_laws_that_are_hardly_apart_are_alike_though_one_is_ahead_in_every_block():
    offset = rival("voltage_offset", 85.7, 40.0 * BLOCKS, 300.0 * BLOCKS, 42.0 * BLOCKS)
    one_way = rival("coulomb_asymmetry", 85.7, 40.0 * BLOCKS + 1e-3, 300.0 * BLOCKS + 2e-3, 42.0 * BLOCKS + 1e-3)
    assert offset.is_like(one_way) and not one_way.clearly_leads(offset)
    ahead = rival("coulomb_asymmetry", 85.7, 40.0 * BLOCKS + 0.5, 300.0 * BLOCKS + 2e-3, 42.0 * BLOCKS + 1e-3)
    assert not offset.is_like(ahead) and ahead.clearly_leads(offset)


def test_a_lesser_law_does_not_stand_in_for_one_that_clearly_leads_it_and_is_not_worth_a_step():
    spring = rival("tether_spring", 9.0, 0.7 * BLOCKS, 1.5 * BLOCKS)
    friction = rival("coulomb_drive", 190.0, 6.5 * BLOCKS, 1.5 * BLOCKS[::-1], 9.0 * BLOCKS)
    assert not_led([spring], [spring, friction]) == [] and not_led([friction], [spring, friction]) == [friction]
    both = [spring, friction]
    assert not_led(both, both) == both  # which comes first is another question
    elastic = rival("stribeck_drive", 400.0, 9.0 * BLOCKS, 1.5 * BLOCKS[::-1], 19.0 * BLOCKS)
    assert not_led([friction], [friction, elastic]) == [friction]  # the simple law within it
    impossible = friction._replace(candidate=replace(friction.candidate, physical=False))
    lesser = friction._replace(gains=0.01 * BLOCKS, in_sample=5.0)  # ahead in places, with less evidence
    assert not_led([spring], [spring, lesser]) == [spring]
    unlikely = friction._replace(in_sample=-1.0)
    assert not_led([spring], [spring, impossible, unlikely]) == [spring]


def test_a_law_that_held_out_data_contradict_stands_in_for_one_that_holds_there():
    """On a motor that rests at first: dry friction explains the rest, and is off by a thousandfold where it runs."""
    resting = rival("coulomb_drive", 318.0, -2.0 * BLOCKS, [-2e8, 1e5], 16.0 * BLOCKS)
    resting = resting._replace(relative_falls=np.array([-0.4, 0.6]))
    lawful = rival("viscous_drive", 92.0, 4.0 * BLOCKS, [1.5e8, 2e5], 5.0 * BLOCKS[::-1])
    lawful = lawful._replace(relative_falls=np.array([0.99997, 0.9997]))
    both = [resting, lawful]
    assert resting.evidence > lawful.evidence and lawful.overrules(resting) and not resting.overrules(lawful)
    assert not_led(both, both) == [lawful]
    near = lawful._replace(relative_falls=np.array([0.3, 0.6]))
    less_likely = lawful._replace(predicted=SimpleNamespace(log_likelihood=-3.0 * BLOCKS[::-1]))
    alike = lawful._replace(rises=16.0 * BLOCKS[::-1])  # no contradiction: which leads is told by evidence
    for other in (near, less_likely, alike):
        assert not_led([resting, other], [resting, other]) == [resting, other]


def test_a_simple_law_is_certain_where_one_that_has_it_in_it_is_and_it_clearly_leads():
    elastic = rival("presliding_drive", 90.0, 9.0 * BLOCKS, 15.0 * BLOCKS, 9.0 * BLOCKS)
    simple = rival("coulomb_drive", 90.0, 30.0 * BLOCKS, 50.0 * BLOCKS, 9.0 * BLOCKS)
    simple = simple._replace(candidate=replace(simple.candidate, p_confirmation=0.04), less_force=0.2, less_on_row=0.2)

    def found(one, supported=(elastic,)):
        return certain_within([elastic, one], list(supported), 1.0)

    assert found(simple) == [simple]
    assert found(simple, [elastic, simple]) == []  # by its own tests
    assert found(simple, []) == []
    other = simple._replace(candidate=replace(simple.candidate, effect="viscous_drive"))
    assert found(other) == []  # not of that family
    no_better = simple._replace(predicted=elastic.predicted, falls=elastic.falls)
    unconfirmed, impossible = (replace(simple.candidate, **c) for c in ({"p_confirmation": 0.06}, {"physical": False}))
    for other in (
        no_better,
        simple._replace(candidate=unconfirmed),
        simple._replace(candidate=impossible),
        simple._replace(in_sample=-1.0),
        simple._replace(less_force=0.0, less_on_row=0.0),
    ):
        assert found(other) == []


def test_what_is_likelier_but_not_certain_is_told_beside_what_is_certain():
    """On a motor that runs one way a dead zone and dry friction are one force, and chance decides which is certain."""
    dead_zone = rival("voltage_dead_zone", 60.0, 5.0 * BLOCKS, 10.0 * BLOCKS)
    dead_zone = dead_zone._replace(candidate=replace(dead_zone.candidate, equivalent_to=("voltage_offset",)))
    friction = rival("coulomb_drive", 130.0, 6.0 * BLOCKS, 10.0 * BLOCKS)
    uncertain = replace(friction.candidate, p_value=0.002, p_discovery=0.02, p_confirmation=0.06)
    friction = friction._replace(candidate=uncertain, less_force=0.2, less_on_row=0.2)

    def beside(other):
        return with_likelier_besides([dead_zone], [dead_zone, other], 1.0)[0].candidate.equivalent_to

    assert beside(friction) == ("coulomb_drive", "voltage_offset")
    told_of_none = friction._replace(candidate=replace(uncertain, p_value=0.06))
    wider = friction._replace(candidate=replace(uncertain, effect="stribeck_drive"))
    impossible = friction._replace(candidate=replace(uncertain, physical=False))
    for other in (
        told_of_none,
        wider,
        impossible,
        friction._replace(in_sample=50.0, gains=dead_zone.gains),
        friction._replace(
            predicted=SimpleNamespace(log_likelihood=-6.0 * BLOCKS), rises=9.0 * BLOCKS, relative_falls=-0.9 * BLOCKS
        ),
        friction._replace(less_force=0.0, less_on_row=0.0),
    ):
        assert beside(other) == ("voltage_offset",)
