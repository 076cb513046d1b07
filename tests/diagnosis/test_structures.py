"""Probabilities of what is missing: shared by twins, uncertain where few moments decide, honest about the unknown."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.diagnosis.block_evidence import evidence_in_blocks, p_value_of_rest
from wheelpend.diagnosis.structures import (
    NONE_OF_THESE,
    PRIOR_OF_COUNT,
    UNSEEN_SHARE,
    RoundEvidence,
    Structure,
    probability_of,
    probability_of_none,
    probability_of_nothing_seen,
    structures,
)
from wheelpend.diagnosis.verdict import and_what_replaced
from wheelpend.reports.text.structures import structures_text

LIBRARY = [*"abc", *(f"other_{k}" for k in range(27))]


def even(nats, blocks=20):
    return np.full(blocks, nats / blocks)


def known(*rounds, p_rest=1.0):
    """Probabilities by structure: of those that are seen if it is one of them, and of none of these."""
    found = structures([RoundEvidence(*r) for r in rounds], LIBRARY, p_rest)
    assert sum(s.probability for s in found) == pytest.approx(1.0, abs=1e-2)
    seen = {s.effects: s.probability - s.unseen for s in found if s.probability > s.unseen}
    other = seen.pop((NONE_OF_THESE,))
    return {n: p / sum(seen.values()) for n, p in seen.items()} | {(NONE_OF_THESE,): other}


def test_without_evidence_the_prior_of_what_would_be_seen_stands():
    found = known(({"a": even(0.0)}, ""))
    prior = PRIOR_OF_COUNT[1] * (1.0 - UNSEEN_SHARE) / len(LIBRARY)
    assert found["a",] / found[()] == pytest.approx(prior / PRIOR_OF_COUNT[0])


def test_where_nothing_is_seen_each_effect_may_be_too_small():
    found = {s.effects: s for s in structures([RoundEvidence({"a": even(-6.0)}, "")], LIBRARY, 1.0)}
    odds = UNSEEN_SHARE * PRIOR_OF_COUNT[1] / len(LIBRARY) / PRIOR_OF_COUNT[0]
    assert found["c",].probability / found[()].probability == pytest.approx(odds)
    assert found["c",].unseen == found["c",].probability and found[()].unseen == 0.0
    assert found["a",].unseen == pytest.approx(found["c",].unseen) and found["a",].probability > found["a",].unseen
    assert 0.4 < found[()].probability < 0.6


def test_beside_what_is_certain_another_may_be_too_small():
    found = {s.effects: s for s in structures([RoundEvidence({"a": even(50.0)}, "a")], LIBRARY, 1.0)}
    beside = sum(s.probability for n, s in found.items() if len(n) == 2)
    assert 0.1 < beside / found["a",].probability < 0.5
    assert probability_of(["a"], [*found.values()]) > 0.9


def test_nothing_is_seen_where_each_effect_may_be_too_small_and_none_is_likely():
    def nothing(nats):
        return probability_of_nothing_seen(structures([RoundEvidence({"a": even(nats)}, "")], LIBRARY, 1.0))

    assert nothing(-6.0) == pytest.approx(1.0 - probability_of_none(1.0), abs=0.05)
    assert 0.3 < nothing(3.5) < 0.7 and nothing(20.0) < 1e-3
    both = structures([RoundEvidence({"a": even(50.0)}, "a"), RoundEvidence({"b": even(20.0)}, "")], LIBRARY, 1.0)
    assert probability_of_nothing_seen(both) < probability_of_nothing_seen(both, ["a"]) < 1e-3
    assert probability_of_nothing_seen(both, ["a", "b"]) == pytest.approx(1.0 - probability_of_none(1.0), abs=0.05)


def test_a_wider_law_in_the_place_of_a_named_one_is_more_and_another_law_is_not():
    known = structures([RoundEvidence({"a": even(50.0), "b": even(56.0)}, "")], LIBRARY, 1.0)
    assert probability_of_nothing_seen(known, ["a"]) > 0.5
    assert probability_of_nothing_seen(known, ["a"], {"b": ("a",)}) < 0.05
    assert probability_of_nothing_seen(known, ["b"], {"b": ("a",)}) > 0.5
    even_at_zero = structures([RoundEvidence({"a": even(50.0), "b": even(46.0)}, "")], LIBRARY, 1.0)
    assert probability_of_nothing_seen(even_at_zero, ["a"], {"b": ("a",)}) > 0.5


def test_an_effect_needs_evidence_for_the_size_of_the_library_too():
    assert known(({"a": even(1.0)}, ""))["a",] < 0.2
    assert known(({"a": even(8.0)}, ""))["a",] > 0.9


def test_twins_share_their_probability():
    found = known(({"a": even(50.0), "b": even(50.0)}, "a"))
    assert found["a",] == pytest.approx(found["b",]) and found["a",] > 0.45


def test_a_lead_that_one_moment_decides_is_no_certainty():
    steady, moment = even(12.0), np.zeros(20)
    moment[3] = 12.0
    assert known(({"a": steady}, ""))["a",] > 0.95
    assert 0.1 < known(({"a": moment}, ""))["a",] < 0.85


def test_two_effects_of_two_rounds_are_one_structure_with_the_evidence_of_both():
    found = known(({"a": even(20.0), "c": even(3.0)}, "a"), ({"b": even(30.0)}, "b"), ({}, ""))
    assert found["a", "b"] > 0.95 and ("b",) not in found
    hidden = known(({"a": even(-2.0)}, "a"), ({"b": even(30.0)}, "b"), ({}, ""))  # neither pays alone
    assert hidden["a", "b"] > 0.95


def test_three_effects_have_the_evidence_of_all_rounds_and_no_other():
    lost = known(({"a": even(-30.0)}, "a"), ({"b": even(5.0)}, "b"), ({"c": even(12.0)}, "c"))
    assert lost[()] > 0.9 and ("a", "b", "c") not in lost


def test_what_repeats_is_probably_none_of_these():
    assert known(({}, ""), p_rest=1e-6)[NONE_OF_THESE,] > 0.99
    assert 0.1 < known(({}, ""), p_rest=1.0)[NONE_OF_THESE,] < 0.2  # it may be too small, or look like another
    rising = [probability_of_none(p) for p in (1.0, 0.1, 1e-2, 1e-3, 1e-300, 0.0)]
    assert rising == sorted(rising) and rising[-1] <= 1.0


def test_blocks_that_came_in_another_number_count_as_much():
    found = known(({"a": even(20.0)}, "a"), ({"b": even(30.0, blocks=7)}, ""))
    assert found["a", "b"] > 0.95


def test_what_diverges_is_no_candidate():
    worse = np.full(20, -np.inf)
    assert known(({"a": worse, "b": np.full(20, np.nan)}, "")).keys() == {(), (NONE_OF_THESE,)}  # of what is seen


def test_an_effects_probability_is_that_of_all_structures_with_it():
    found = structures([RoundEvidence({"a": even(20.0)}, "a"), RoundEvidence({"b": even(3.0)}, "")], LIBRARY, 1.0)
    with_a, other = (sum(s.probability for s in found if n in s.effects) for n in ("a", NONE_OF_THESE))
    assert probability_of(["a"], found) == pytest.approx(with_a + 0.5 * other * with_a / (1.0 - other))
    known_rest = structures([RoundEvidence({"a": even(20.0)}, "a")], LIBRARY, 0.0)  # certainly more than a
    assert probability_of(["a"], known_rest) == pytest.approx(0.5, abs=0.01)


def fit(cost, free, count=1000):
    return SimpleNamespace(cost=cost, free=(None,) * free, count=count)


def test_evidence_is_the_rise_of_likelihood_of_all_data_less_what_freedom_is_worth():
    before, after = np.full((500, 2), 1.1), np.full((500, 2), 1.0)
    found = evidence_in_blocks(fit(1200.0, 7), fit(1000.0, 8), [before], [after])
    assert len(found) == 10
    assert found.sum() == pytest.approx(0.5 * 0.21 * 1000 + 0.5 * (200.0 - np.log(1000)))
    elsewhere = evidence_in_blocks(fit(1200.0, 7), fit(1000.0, 8, count=900), [before], [after])
    assert elsewhere.sum() == pytest.approx(0.5 * 0.21 * 1000)


@pytest.mark.parametrize(("error", "low", "high"), [(1.0, 0.05, 0.95), (1.1, 0.0, 1e-3), (0.9, 0.95, 1.0)])
def test_a_rest_is_one_where_its_mean_square_is_above_that_of_noise(error, low, high):
    residual = error * np.random.default_rng(5).normal(size=(6000, 3))
    residual[::3, 1] = np.nan  # a channel that is not always read
    assert low <= p_value_of_rest([residual], 1.0) <= high


def test_sigma_itself_is_known_to_a_percent_only():
    residual = 1.01 * np.random.default_rng(5).normal(size=(400_000, 3))
    assert 0.05 < p_value_of_rest([residual], 1.0) < 0.4


def test_the_likeliest_are_said_in_percent():
    (sentence,) = structures_text(structures([RoundEvidence({"a": even(50.0), "b": even(49.0)}, "a")], LIBRARY, 1.0))
    assert sentence.startswith("Probabilities: a 48 %, b 18 %, something that is not among these 15 %")
    assert sentence.endswith("a with another too small to be seen here 14 %.")
    (empty,) = structures_text(structures([RoundEvidence({}, "")], LIBRARY, 1.0))
    assert empty.startswith("Probabilities: nothing is missing 50 %, an effect too small to be seen here 35 %")
    (beside,) = structures_text(structures([RoundEvidence({}, "")], LIBRARY, 1.0), beside_force=True)
    assert beside.startswith("Probabilities: nothing that repeats is missing 50 %")
    assert not list(structures_text(()))


def test_what_replaces_an_effect_is_not_beside_it():
    first = RoundEvidence({"a": even(50.0), "b": even(60.0)}, "a")
    second = RoundEvidence({"b": even(18.0), "c": even(1.0)}, "b", {"b": ("a",)})
    found = known(first, second)
    assert ("a", "b") not in found and found[("b",)] > 0.8  # the better of the two refits that led to it


def test_an_effect_whose_place_another_took_has_its_probability():
    def found(effect, *replaced):
        problem = SimpleNamespace(replaced=lambda name: replaced if name == effect else ())
        return SimpleNamespace(named=[SimpleNamespace(effect=effect)], problem=problem)

    rounds = [found("rigid"), found("other"), found("elastic", "rigid"), SimpleNamespace(named=[])]
    assert and_what_replaced("rigid", rounds) == {"rigid", "elastic"}
    assert and_what_replaced("other", rounds) == {"other"}
    told = [Structure(("elastic", "other"), 0.7), Structure((), 0.3)]
    assert probability_of(and_what_replaced("rigid", rounds), told) == pytest.approx(0.7)
