"""Advice on an upright plant of one coordinate, in its own words."""

import pytest

import derive
from tests.plants.machines import LEVER, log_of, model_of
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.experiments.advice import advice
from wheelpend.simulation.hidden import machine_values


@pytest.mark.parametrize(("effect", "rival", "said"), [
    ("voltage_offset", "coulomb_asymmetry", "Swap the two leads"),
    ("voltage_dead_zone", "coulomb_drive", "Record"),
])  # fmt: skip
def test_a_lever_held_by_a_current_is_advised(effect, rival, said):
    model, name = model_of(LEVER), derive.effects.find(effect).full_names[0]
    problem = prepare(model, [log_of(LEVER, **{name.replace(".", "__"): 0.2})], use_all=True)
    start = {**machine_values(model, {}), name: 0.0}
    fitted = fit_segments(problem, problem.data.estimation, start, [*problem.base, name], rounds=40)
    sizes = {name.partition(".")[2]: Estimate(fitted.of_log(0)[name], 0.0, "")}
    found = CandidateFit(effect, sizes, "", 0.0, "5/5", fitted.error, (rival,), True, fitted)
    text = advice(problem, found)
    assert said in text
    assert not any(word in text for word in ("pitch", "robot", "wheel", " V,", "voltage "))
