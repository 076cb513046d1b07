"""What is held out and further off than the model says is missing something, however much chance the fit leaves."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.raw_logs import way_of
from wheelpend import Model, diagnose, load_log
from wheelpend.diagnosis.likelihood.held_out import Prediction
from wheelpend.diagnosis.likelihood.one_round import MAX_SURPRISE, surprise_sentences
from wheelpend.diagnosis.structures import Structure, is_nothing_improbable, probability_of_none
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.data import prepare
from wheelpend.reports.text.verdict import SURPRISE_SENTENCE, verdict_text


def test_surprise_is_how_far_off_the_middle_block_is_and_1_of_a_right_model():
    random = np.random.default_rng(1)
    blocks = [s * random.standard_normal((400, 2)) for s in (1.0, 1.0, 1.0, 50.0)]
    nothing = np.full((10, 2), np.nan)
    assert Prediction([*blocks, nothing], [], []).surprise == pytest.approx(1.0, abs=0.1)
    assert Prediction([3.0 * b for b in blocks], [], []).surprise == pytest.approx(9.0, rel=0.1)
    assert Prediction([nothing], [], []).surprise == 0.0


def test_the_probabilities_know_of_what_is_held_out_and_further_off_than_the_model_says():
    random = np.random.default_rng(2)
    blocks = [s * random.standard_normal((100, 1)) for s in (1.7, 1.9, 1.8, 2.0, 1.8)]
    off, right = (
        Prediction(blocks, [], []),
        Prediction([b / s for b, s in zip(blocks, (1.7, 1.9, 1.8, 2.0, 1.8), strict=True)], [], []),
    )
    assert off.p_value_of_surprise < 1e-3 and 0.01 < right.p_value_of_surprise < 0.99
    for one in (np.full((100, 1), np.inf), 1e4 * blocks[0]):
        assert Prediction([*blocks, one], [], []).p_value_of_surprise < 0.1, "no wild block hides the others"
    left = SimpleNamespace(what_repeats=(), repeating=(SimpleNamespace(p_value=1.0),), slow=())
    found = SimpleNamespace(named=(), p_rest=off.p_value_of_surprise, remainder=left, by_likelihood=True)
    assert Diagnosis.p_value_of_rest.fget(found) == off.p_value_of_surprise, "no function of two signals predicts it"
    assert probability_of_none(off.p_value_of_surprise) > 0.9 > 0.4 > probability_of_none(right.p_value_of_surprise)


def test_it_is_said_from_twice_the_variance_on():
    assert not surprise_sentences(MAX_SURPRISE)
    assert "off by 2 times as much as the model says" in surprise_sentences(4.0)[0]


def test_what_is_held_out_and_far_off_is_unexplained(monkeypatch):
    random, t = np.random.default_rng(5), 0.005 * np.arange(2400)
    volts = 6.0 * np.sin(3.1 * t) + 4.0 * np.sin(7.7 * t + 1)
    pushes = lfilter([0.02], [1.0, -0.98], 8.0 * random.standard_normal(t.size))  # at random, with 0.25 s
    model = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n')
    place = way_of(volts + pushes) + 1e-5 * random.standard_normal(t.size)
    log = load_log({"t": t, "v_in": volts, "x": place}, table=model.table)
    others = [e.name for e in prepare(model, log).candidates() if e.name not in ("coulomb_drive", "voltage_offset")]
    calm = diagnose(model, log, without=others)
    assert calm.by_likelihood and calm.verdict == "nothing_missing"
    monkeypatch.setattr(Prediction, "surprise", property(lambda self: 9.0))
    far = diagnose(model, log, without=others)
    assert far.verdict == "unexplained" and any("off by 3 times as much" in w for w in far.warnings)
    assert SURPRISE_SENTENCE in verdict_text(far, model)


def test_nothing_is_improbable_beside_what_was_added():
    pair = Structure(("coulomb_drive", "slope"), 0.2, 0.15)
    known = (Structure(("coulomb_drive",), 0.6), pair, Structure((), 0.001))
    assert not is_nothing_improbable(known, ["coulomb_drive"], {}) and not is_nothing_improbable(
        known[:1], known[0].effects, {}
    )
    assert is_nothing_improbable(known, [], {}) and is_nothing_improbable((Structure(("none_of_these",), 1.0),), [], {})
