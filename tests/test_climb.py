"""Effects added in turn, and taken out again where others have made them needless."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from tests.conftest import simulated
from wheelpend import Model
from wheelpend.diagnosis import stepwise
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import EXPLAINED
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import held_residuals

HIDDEN = {"coulomb_drive__torque": 0.3, "slope__angle": 0.02}


@pytest.fixture(scope="module")
def begun():
    return best_start(prepare(Model.default(), [simulated(seed=2, duration=10.0, **HIDDEN)]))


def climbed(begun, *effects):
    """A climb that has added these effects, the last round of which names nothing more."""
    study, start = begun[0].having(effects), begun[1]
    fitted = fit_model(study, start, free_names(study, effects))
    error = held_residuals(study, fitted)[0]
    below = [SimpleNamespace(named=(SimpleNamespace(effect=e),)) for e in effects]
    accounted = error <= EXPLAINED * study.floor
    return [*below, SimpleNamespace(named=(), error=error, study=study, fit=fitted, accounted=accounted)]


def test_an_effect_that_later_ones_make_needless_is_told(begun):
    assert (
        stepwise.find_needless(climbed(begun, "quadratic_drive", "coulomb_drive", "slope"), print) == "quadratic_drive"
    )


def test_effects_that_are_all_there_are_all_needed(begun):
    assert stepwise.find_needless(climbed(begun, "coulomb_drive", "slope"), print) is None


def test_what_does_not_reach_the_noise_is_left_as_it_is(begun):
    rounds = climbed(begun, "quadratic_drive", "slope")
    assert not rounds[-1].accounted and stepwise.find_needless(rounds, print) is None


def test_a_climb_begins_anew_without_a_needless_effect_only_if_it_then_gets_as_far(begun, monkeypatch):
    whole = climbed(begun, "quadratic_drive", "coulomb_drive", "slope")
    barred = []

    def one_climb(first, enough, progress):
        barred.append(first)
        return whole if not first else after

    monkeypatch.setattr(stepwise, "first_round", lambda study, start, progress: study.needless)
    monkeypatch.setattr(stepwise, "one_climb", one_climb)
    after = climbed(begun, "coulomb_drive", "slope")
    assert stepwise.climb(*begun, lambda rounds: False) is after
    assert barred == [(), ("quadratic_drive",)]
    after = [SimpleNamespace(named=(), error=2.0, study=begun[0], fit=None, accounted=False)]
    assert stepwise.climb(*begun, lambda rounds: False) is whole


def test_a_needless_effect_is_said_not_to_be_judged(begun):
    study = replace(begun[0], needless=("slope",))
    assert "slope" not in [e.name for e in study.missable()]
    assert "beside" in study.lacking(next(e for e in begun[0].missable() if e.name == "slope"))
