"""What is left to chance, in words."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from derive.effects import find
from wheelpend import Model
from wheelpend.diagnosis.likelihood.remaining import ImpossibleLaw
from wheelpend.diagnosis.likelihood.repeatability import FORCE_KIND, READING_KIND, RepeatingFunction
from wheelpend.diagnosis.likelihood.resonance import Resonance
from wheelpend.diagnosis.likelihood.slow_sources import SlowSource
from wheelpend.diagnosis.structures import Structure
from wheelpend.estimation.estimate import Estimate
from wheelpend.identification.remainder import Remainder, RowForce, SensorError
from wheelpend.identification.remainder_warnings import is_mostly_chance
from wheelpend.identification.widening import Widening
from wheelpend.model.units import plant_units_of
from wheelpend.reports.text.effect_sizes import moved_size_text
from wheelpend.reports.text.force_ranges import missing_force_text
from wheelpend.reports.text.remainder import NOT_SEARCHED, remainder_sentences, widening_sentences
from wheelpend.reports.text.unexplained import unexplained_sentences
from wheelpend.reports.text.verdict import (
    MOSTLY_CHANCE_SENTENCE,
    UNCERTAIN_SENTENCE,
    closing_sentence,
    evidence_text,
    repeating_text,
    verdict_beside_force_text,
)

MODEL = Model.default()


def force(place="drive", share=0.03, torque=35.1, at_bound=False, rms=0.21):
    return RowForce(rms, "V", torque, share, share, 0.12, place, at_bound)


def test_a_force_along_a_port_is_told_once():
    (line,) = remainder_sentences(Remainder({"wheel": force(), "body": force(share=0.02)}), MODEL)
    assert line == (
        "Left to chance: a random force of 0.21 V (35.1 N·m), 3 % of the drive, between wheel and body, "
        "correlation time 120 ms."
    )


def test_forces_on_two_rows_are_told_apart():
    lines = remainder_sentences(Remainder({"wheel": force("wheel"), "body": force("body")}), MODEL)
    assert ["on the wheel row" in lines[0], "on the body row" in lines[1]] == [True, True]
    assert [line.partition(" a random force")[0] for line in lines] == ["Left to chance:", "And"]


def test_where_one_row_of_a_port_feels_a_force_of_its_own_besides_the_port_is_told_once():
    lines = remainder_sentences(Remainder({"wheel": force(rms=0.34, share=0.37), "body": force(rms=0.302)}), MODEL)
    assert lines[0].startswith("Left to chance: a random force of 0.302 V"), "what both rows feel comes first"
    assert [", between wheel and body," in line for line in lines] == [True, False]
    assert "0.34 V (35.1 N·m), 37 % of the drive, on the wheel row in all," in lines[1]


@pytest.mark.parametrize(
    ("effects", "expected"), [((), "before any effect was looked for"), (("slope",), "before any further effect was")]
)
def test_before_a_search_it_is_said_that_it_is_of_the_model_as_it_stands(effects, expected):
    model = Model.default().with_effects(effects)
    (line,) = remainder_sentences(Remainder({"wheel": force()}), model, NOT_SEARCHED)
    assert line.startswith(f"Left to chance by the model as it stands, {expected}")


def test_without_a_force_sensor_noise_explains_the_rest():
    assert remainder_sentences(Remainder(), MODEL) == [
        "Nothing is left to chance: sensor noise explains what was fitted."
    ]
    assert remainder_sentences(None, MODEL) == []


def test_a_sensor_with_an_error_of_its_own_is_named():
    lines = remainder_sentences(Remainder(sensors={"theta_p": SensorError(9e-4, "rad", 2.1, 0.01, 0.3)}), MODEL)
    assert lines == [
        "No random force is left: what is not predicted is taken for errors of the sensors.",
        "theta_p has an error of its own of 0.9 mrad (2.1 σ), correlation time 300 ms: "
        "it was filtered, fused or drifts.",
    ]


def test_a_bound_that_binds_and_what_is_not_known_are_said():
    _, second = remainder_sentences(Remainder({"wheel": force("wheel", at_bound=True)}), MODEL)
    assert "longest that is allowed" in second and "rather a law" in second
    (line,) = remainder_sentences(Remainder({"wheel": force("wheel", share=np.inf, torque=None)}), MODEL)
    assert line.startswith("Left to chance: a random force of 0.21 V, on the wheel row")


@pytest.mark.parametrize(("share", "negligible"), [(0.0009, True), (0.0011, False)])
def test_a_force_below_a_thousandth_of_the_drive_is_negligible(share, negligible):
    (line,) = remainder_sentences(Remainder({"wheel": force("wheel", share=share)}), MODEL)
    assert line.endswith(": negligible.") == negligible


def test_intervals_that_the_correlation_time_widens_are_said_with_the_range():
    (line,) = widening_sentences(Widening({"X1": 1.0, "X2": 3.04, "X3": 2.0}, 0.01, 0.4))
    assert line == (
        "The intervals of X2, X3 are 2 to 3 times wider because they move with the correlation time that is assumed "
        "of the force (0.01 to 0.4 s)."
    )
    assert (
        "The interval of X2 is 3 times wider because it moves" in widening_sentences(Widening({"X2": 3.0}, 0.1, 1.0))[0]
    )
    assert widening_sentences(Widening({"X1": 1.4}, 0.01, 0.4)) == widening_sentences(None) == []


def test_a_sensor_behind_a_low_pass_filter_is_said_to_lag():
    lines = remainder_sentences(Remainder(sensors={"theta_p": SensorError(9e-6, "rad", 0.02, 1e-4, 0.02, 0.02)}), MODEL)
    assert lines[1:] == ["theta_p lags by 20 ms, as behind a low-pass filter."]


REPEATING = RepeatingFunction(FORCE_KIND, "drive", ("t", "v_in"), 0.37, 158.0, 1e-9, 700)
DRIVING = ImpossibleLaw("ground_viscous", {"coefficient": -0.002381}, 1e-6)
SLOW, RINGING = SlowSource("dtheta_p", False, 5.0, 14.8, 1e-5), Resonance("theta_w", 100.2, 0.01, 0.2, 1e-9)


def test_a_sensor_with_two_errors_is_told_with_both():
    error = SensorError(8.2e-5, "rad", 2.7, 0.01, 0.16, 0.0, 0.7, 5e-4)
    said = " ".join(remainder_sentences(Remainder(sensors={"theta_p": error}), MODEL))
    assert "theta_p has two errors of its own, of 0.082 mrad (2.7 σ) together, correlation time 160 ms, " in said
    assert "and 500 µs for 0.7 σ of it: a slow and a fast one." in said


@pytest.mark.parametrize(
    ("left", "text"),
    [
        (Remainder(repeating=(REPEATING,), slow=(SLOW,)), "A function of t and v_in, as a force between wheel and "
         "body, predicts a part of it, 37 % of its mean square, on stretches that it was not made from."),
        (Remainder(repeating=(RepeatingFunction(READING_KIND, "theta_p", (), 0.1, 40.0, 1e-5, 700),)),
         "A constant, as an offset of the reading theta_p, predicts a part of it on stretches that it was not made "
         "from: look at that sensor first."),
        (Remainder(slow=(SLOW,), resonances=(RINGING,)), "The error of dtheta_p that is left to chance is likelier the "
         "slower it may be (5 s and more): no chance, but an offset, a drift or a slow law that is missing: look at "
         "that sensor first."),
        (Remainder(slow=(SlowSource("wheel", True, 5.0, 80.0, 1e-9),)), "The force left to chance on the wheel row is "
         "likelier the slower it may be (5 s and more): no chance, but an offset, a drift or a slow law that is "
         "missing."),
        (Remainder(slow=(SlowSource("wheel", True, 0.6, 0.4, 0.3),), resonances=(RINGING,)), "It rings at 100 Hz."),
        (Remainder(impossible=(DRIVING,)), "Data follow the law of ground_viscous, but with a size that nothing has "
         "(coefficient -0.00238): something else that goes with the same signals is missing."),
        (Remainder(impossible=(DRIVING,), resonances=(RINGING,)), "It rings at 100 Hz."),
        (Remainder(), ""),
        (None, ""),
    ],
)  # fmt: skip
def test_the_likeliest_of_what_is_no_chance_is_told(left, text):
    assert repeating_text(left, MODEL.plant_signature) == text


@pytest.mark.parametrize(
    ("share", "at_bound", "slow"),
    [(0.07, True, True), (0.07, False, False), (0.0005, True, False), (None, True, False)],
)
def test_what_is_as_slow_as_a_log_allows_is_not_said_to_follow_no_law(share, at_bound, slow):
    left = Remainder({} if share is None else {"wheel": force(share=share, at_bound=at_bound)})
    last = SimpleNamespace(by_likelihood=True, named=(), remainder=left, determines_nothing=False, is_doubtful=False)
    said = closing_sentence(SimpleNamespace(last=last, verdict="nothing_missing"))
    assert ("so slow that these logs do not tell chance from a law" in said) == slow
    assert ("no law of these signals predicts it" in said) == (not slow and share is not None)
    assert said.startswith("Nothing more that repeats is missing; " if share else "Nothing more is missing.")
    found = SimpleNamespace(error=29.6, noise_floor=1.0, verdict="nothing_missing", remainder=left, is_doubtful=False)
    assert ("so slow that" in verdict_beside_force_text(found)) == slow
    last.remainder = replace(left, instead=("viscous_drive",))
    said = closing_sentence(SimpleNamespace(last=last, verdict="nothing_missing"))
    assert ("what remains may be chance or a law" in said) == (not slow and share is not None)
    assert "no law of these signals" not in said


def test_where_an_effect_is_likelier_than_none_no_sentence_says_that_nothing_is_missing():
    last = SimpleNamespace(
        by_likelihood=True, named=(), remainder=Remainder({"wheel": force(share=0.2)}), determines_nothing=False,
        error=3.0, noise_floor=1.0, verdict="nothing_missing", refitted=(), structures=(), replaces={},
        is_doubtful=True,
    )  # fmt: skip
    for said in (
        closing_sentence(SimpleNamespace(last=last, verdict="nothing_missing")),
        verdict_beside_force_text(last),
    ):
        assert "likelier that one is than that none is" in said and "Nothing" not in said
    last.is_doubtful = False
    assert closing_sentence(SimpleNamespace(last=last, verdict="nothing_missing")).startswith(
        "Nothing more that repeats"
    )


@pytest.mark.parametrize(
    ("share", "what"), [(0.26, "Something is missing"), (0.8, "Most of the motion is left to chance")]
)
def test_what_is_unexplained_names_the_effect_that_would_lower_the_error_most_as_uncertain(share, what):
    def tried(effect, error_after, is_possible=True):
        coefficients = dict.fromkeys(find(effect).parameters)
        return SimpleNamespace(
            effect=effect, error_after=error_after, is_possible=is_possible, coefficients=coefficients
        )

    def said(*refitted, structures=(), unknown=False):
        found = SimpleNamespace(
            error=35.0, noise_floor=1.0, verdict="unexplained", remainder=Remainder({"wheel": force(share=share)}),
            refitted=refitted, structures=structures, replaces={}, leaves_unknown=unknown, determines_nothing=False,
            horizon_s=0.5, problem=SimpleNamespace(plant=MODEL.plant_signature, model=MODEL),
        )  # fmt: skip
        return verdict_beside_force_text(found)

    best = said(tried("slope", 12.0), tried("viscous_drive", 8.0), tried("backlash", 2.0, is_possible=False))
    assert best.startswith(what) and ("improbable" in best) == (share < 0.5)
    assert "With viscous_drive the held-out error falls from 35 to 8" in best and "not certain" in best
    assert ("rather a law of these signals than chance" in said(unknown=True)) == (share < 0.5)
    assert "With" not in said(tried("slope", 30.0)) and "With" not in said()
    alike = said(tried("stribeck_drive", 7.99), tried("coulomb_asymmetry", 8.0), tried("coulomb_drive", 8.01))
    assert "With coulomb_drive the held-out error falls" in alike  # of equally good ones the simplest
    known = (Structure(("slope",), 0.7), Structure((), 0.3))
    probable = said(tried("slope", 30.0), tried("viscous_drive", 8.0), structures=known)
    assert "The likeliest is slope (70 %, alone and with others)" in probable and "With viscous_drive" not in probable
    outside = (Structure(("none_of_these",), 0.67), Structure(("slope",), 0.23), Structure(("cogging", "slope"), 0.06))
    told = said(tried("slope", 30.0), tried("viscous_drive", 8.0), structures=outside)
    assert "The likeliest is slope (29 % of 33 % for all of the library, alone and with others)" in told
    likely_nothing = (Structure((), 0.6), Structure(("none_of_these",), 0.4))
    assert ("further off than what was fitted" in said(structures=likely_nothing)) == (share < 0.5)
    hardly = (Structure(("none_of_these",), 0.95), Structure(("slope",), 0.05))
    assert "With viscous_drive" in said(tried("slope", 30.0), tried("viscous_drive", 8.0), structures=hardly)
    both = (Structure(("slope",), 0.4), Structure(("viscous_drive", "slope"), 0.6))
    assert "The likeliest is slope (100 %, alone and with others)" in said(
        tried("viscous_drive", 8.0), tried("slope", 9.0), structures=both
    )


def test_a_page_says_of_what_is_unexplained_what_a_terminal_says():
    last = SimpleNamespace(
        by_likelihood=True, named=(), remainder=Remainder({"wheel": force(share=0.8)}), refitted=(), error=35.0,
        structures=(), replaces={}, determines_nothing=False, problem=SimpleNamespace(plant=MODEL.plant_signature),
    )  # fmt: skip
    ladder = SimpleNamespace(verdict="unexplained", last=last, repeats=(), remainder=last.remainder)
    assert unexplained_sentences(ladder) == [MOSTLY_CHANCE_SENTENCE]
    assert unexplained_sentences(SimpleNamespace(**{**vars(ladder), "verdict": "nothing_missing"})) == []


def test_what_ends_a_ladder_says_what_is_uncertain_and_what_is_mostly_chance():
    def said(share, *, by_likelihood=True, error=35.0, verdict="unexplained", determines_nothing=False, left=None):
        last = SimpleNamespace(
            by_likelihood=by_likelihood, named=(), refitted=(),
            remainder=left or Remainder({"wheel": force(share=share)}),
            error=error, noise_floor=1.0, structures=(), replaces={}, leaves_unknown=False, is_doubtful=False,
            determines_nothing=determines_nothing,
            problem=SimpleNamespace(plant=MODEL.plant_signature, model=MODEL),
        )  # fmt: skip
        return closing_sentence(SimpleNamespace(verdict=verdict, last=last))

    assert said(0.8).startswith("Most of the motion is still left to chance.")
    assert said(0.2).startswith("Something is probably still missing.")
    fitted = said(0.0, left=Remainder(unpredicted=0.1))
    assert fitted.startswith("Something is probably still missing. What was fitted needs no random force, but")
    at_noise = said(0.0, left=Remainder(unpredicted=0.1), error=1.05)
    assert "missed by more than noise" not in at_noise
    assert said(0.2, determines_nothing=True).startswith("What is missing cannot be told. These logs determine no")
    assert said(0.2, by_likelihood=False, error=1.01) == UNCERTAIN_SENTENCE  # sensor noise is reached
    ambiguous = said(0.2, verdict="ambiguous")
    assert ambiguous.startswith(
        "Nothing more that repeats is missing, but a step was ambiguous; what remains is left to"
    )
    assert said(0.2, by_likelihood=False) == "Something is still missing that no effect of the library accounts for."


def test_a_step_that_the_final_fit_moved_says_what_it_is_there():
    step = SimpleNamespace(effect="slope", estimates={"angle": Estimate(0.03, 0.001, "rad")})

    def told(final):
        return moved_size_text(step, SimpleNamespace(parameters={"slope.angle": Estimate(final, 0.002, "rad")}))

    assert told(0.0309) == "" and told(0.035) == "In the final fit: angle 0.035 ± 0.002 rad."


def test_the_missing_force_on_a_row_has_the_unit_of_that_row():
    model = Model.parse('plant = "cart_pole"\n[input]\nunit = "N"\n')
    missing = SimpleNamespace(force=np.ones((10, 2)), sigma=np.full((10, 2), 0.1), log="")
    where = [SimpleNamespace(row="cart", state="x", low=0.0, high=1.0, share=0.9)]
    problem = SimpleNamespace(module=SimpleNamespace(ROWS=("cart", "pole")))
    found = SimpleNamespace(where=where, problem=problem, missing=[missing])
    said = list(missing_force_text(found, plant_units_of(model)))
    assert "on the cart row: 1 N rms" in said[-2] and "on the pole row: 1 N m rms" in said[-1]
    missing.force[:, 1] = 0.0  # nothing is said of a force that there is not
    assert list(missing_force_text(found, plant_units_of(model))) == said[:-1]


@pytest.mark.parametrize(("after", "gain", "told"), [(217.0, 230.0, True), (113.0, 230.0, False), (217.0, None, False)])
def test_a_step_that_raises_the_held_out_error_says_why_it_is_kept(after, gain, told):
    step = SimpleNamespace(
        p_value=1e-9, error_before=114.0, error_after=after, blocks_agree="19/20", held_out_gain=gain
    )
    assert ("likelier with it from row to row, by 230 nats" in evidence_text(step)) == told


def test_a_force_that_moves_next_to_nothing_is_not_most_of_the_motion():
    left = Remainder({"wheel": force(share=1.6)})
    shares = (None, 0.02, 0.24, 0.26, 4.0)
    found = [is_mostly_chance(replace(left, unpredicted=share)) for share in shares]
    assert found == [True, False, False, True, True] and not is_mostly_chance(Remainder({"wheel": force(share=0.4)}))
