"""Nothing is found where nothing is hidden; effects together, in place of each other, and with a rest."""

import json
from dataclasses import replace

import pytest

import derive
from tests.support import ROOT, SPARSE_S, simulated
from wheelpend import Model, diagnose, explain
from wheelpend.benchmarks.hidden_effects.cases import benchmark_plant

OTHERS = [
    "imu_lag",
    "slosh",
    "drive_compliance",
    "backlash",
    "wheel_slip",
    "load_friction",
]  # what explains late sensors, or takes long to say no


def test_a_wrong_encoder_scale_is_all_but_taken_up_by_the_parameters_and_no_size_is_claimed():
    result = diagnose(Model.default(), [simulated(seed=3, duration=12.0, sample=SPARSE_S, encoder_scale__scale=0.05)])
    assert result.verdict == "nothing_missing"
    assert "encoder_scale" not in result.detectable
    assert result.fit.values["X6"] == pytest.approx(0.7268 / 1.05, rel=1e-3)


def test_a_base_fit_that_has_not_arrived_is_no_sign_of_a_missing_effect():
    log = simulated("simple", seed=3, duration=12.0, sample=SPARSE_S, encoder_scale__scale=0.02)
    assert diagnose(Model.default(), [log]).verdict == "nothing_missing"


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 6))])
def test_where_nothing_is_hidden_nothing_is_missing(command, seed):
    result = diagnose(Model.default(), [simulated(command, seed=100 + seed, sample=SPARSE_S)])
    assert result.verdict == "nothing_missing"
    assert not result.candidates
    assert set(result.detectable) >= {"coulomb_drive", "slope", "voltage_dead_zone"}
    assert 2e-4 < result.detectable["coulomb_drive"]["torque"] < 2e-3
    assert 1e-4 < result.detectable["slope"]["angle"] < 1e-2


BOTH = {"voltage_dead_zone__threshold": 0.4, "slope__angle": 0.02}


@pytest.mark.slow
def test_two_hidden_effects_are_both_found():
    result = explain(Model.default(), [simulated(seed=5, duration=12.0, **BOTH)])
    assert set(result.effects) == {"voltage_dead_zone", "slope"}
    assert result.error < 1.05 * result.noise_floor


@pytest.mark.slow
def test_an_effect_is_the_answer_where_further_ones_explain_the_rest():
    result = diagnose(Model.default(), [simulated(seed=5, duration=12.0, **BOTH)])
    assert (result.verdict, result.candidates[0].effect) == ("effect_missing", "voltage_dead_zone")
    assert result.candidates[0].error_after > 1.1 * result.noise_floor


@pytest.mark.slow
def test_two_effects_that_hide_each_other_are_tried_together():
    result = explain(
        Model.default(), [simulated(seed=2, voltage_dead_zone__threshold=0.327, tether_spring__stiffness=0.0491)]
    )
    assert set(result.effects) == {"voltage_dead_zone", "tether_spring"}
    assert result.first.verdict == "effect_missing"
    assert result.error < 1.05 * result.noise_floor


def test_the_shipped_log_tells_its_secret_without_nominal_values():
    data = ROOT / "data"
    truth = json.loads((data / "demo_truth.json").read_text())
    bare = Model.parse('plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n')
    result = explain(bare, [data / "demo.csv"], [data / "demo_holdout.csv"])
    assert result.base_error > 10
    assert result.error < 1.05 * result.noise_floor
    found = {n: v.value for n, v in result.parameters.items() if "." in n}
    assert found == pytest.approx(truth["effects"], rel=1e-3)


def test_explaining_writes_nothing(tmp_path):
    from wheelpend.model import workspace

    model = workspace.create(tmp_path)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    explain(model, [simulated(seed=3, duration=5.0, sample=SPARSE_S, slope__angle=0.02)])
    assert before == {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_a_base_fit_that_runs_astray_is_begun_again():
    result = diagnose(Model.default(), [simulated(sample=SPARSE_S, winding_inductance__time_constant=0.01)])
    assert (result.verdict, result.candidates[0].effect) == ("effect_missing", "winding_inductance")
    assert result.candidates[0].coefficients["time_constant"] == pytest.approx(0.01, rel=1e-3)


@pytest.mark.slow
def test_an_effect_that_contains_one_of_the_model_takes_its_place():
    hidden = {"stribeck_drive__static": 0.5, "stribeck_drive__sliding": 0.2, "stribeck_drive__speed": 0.5}
    model = Model.default().with_effects(["coulomb_drive"])
    result = explain(model, [simulated(seed=5, duration=8.0, sample=SPARSE_S, **hidden)])
    assert result.effects == ("stribeck_drive",)
    assert result.steps[0].coefficients == pytest.approx({"static": 0.5, "sliding": 0.2, "speed": 0.5}, rel=0.02)


@pytest.mark.slow
def test_what_an_effect_of_the_model_contains_is_not_missing():
    model = Model.default().with_effects(["stribeck_drive"])
    result = diagnose(model, [simulated(seed=5, duration=12.0, sample=SPARSE_S, coulomb_drive__torque=0.3)])
    assert (result.verdict, result.candidates) == ("nothing_missing", ())


@pytest.fixture(scope="module")
def late_sensor():
    """Dry friction, and a pitch sensor that is 15 ms late, which no effect of the library is."""
    log = simulated(seed=5, duration=7.0, coulomb_drive__torque=0.3)
    late = log.measured.copy()
    late[15:, 1:] = log.measured[:-15, 1:]
    return replace(log, measured=late)


@pytest.fixture(scope="module")
def late_diagnosis(late_sensor):
    return diagnose(Model.default(), [late_sensor], without=OTHERS)


@pytest.mark.slow
def test_an_effect_that_leaves_a_rest_that_nothing_explains_is_not_the_answer(late_diagnosis):
    result = late_diagnosis
    assert (result.verdict, result.experiment) == ("unexplained", None)
    assert result.candidates[0].effect == "coulomb_drive"
    assert result.candidates[0].error_after > 1.1 * result.noise_floor
    assert result.where


@pytest.mark.slow
def test_a_ladder_that_leaves_a_rest_says_so_and_where_it_is(late_sensor):
    result = explain(Model.default(), [late_sensor], without=OTHERS)
    assert (result.verdict, result.first.verdict) == ("unexplained", "unexplained")
    assert result.last.where


@pytest.mark.slow
def test_an_effect_that_would_feed_energy_is_listed_as_impossible_and_not_named(late_diagnosis):
    impossible = [t for t in late_diagnosis.candidates if not t.physical]
    assert all(t not in late_diagnosis.named for t in impossible)
    assert any(c < 0 for t in impossible for c in t.coefficients.values())


def test_where_every_effect_is_left_out_the_rest_is_unexplained():
    every = [e.name for e in derive.effects.applicable_to(benchmark_plant())]
    found = diagnose(
        Model.default(), [simulated(seed=3, duration=5.0, sample=SPARSE_S, coulomb_drive__torque=0.3)], without=every
    )
    assert found.verdict == "unexplained" and not found.candidates and set(found.not_judged) == set(every)
