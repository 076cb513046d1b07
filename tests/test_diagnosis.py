"""Hidden effects are found, and nothing is found where nothing is hidden."""

import json
from pathlib import Path

import pytest

import derive
from tests.conftest import simulated
from wheelpend import Model, diagnose, explain

HIDDEN = {
    "coulomb_drive": {"torque": 0.3},
    "quadratic_drive": {"coefficient": 0.01},
    "cogging": {"sine": 0.2, "cosine": 0.1, "periods": 12.0},
    "ground_viscous": {"coefficient": 0.05},
    "rolling_resistance": {"torque": 0.2},
    "slope": {"angle": 0.02},
    "air_drag": {"coefficient": 0.01},
    "com_offset": {"angle": 0.02},
    "tether_spring": {"stiffness": 0.05},
    "actuator_delay": {"delay": 0.0043},
    "winding_inductance": {"time_constant": 0.01},
    "voltage_dead_zone": {"threshold": 0.3},
    "voltage_asymmetry": {"ratio": 0.05},
    "voltage_sag": {"rate": 0.005},
    "voltage_offset": {"offset": 0.2},
    "imu_bias": {"bias": 0.02},
    "gyro_bias": {"bias": 0.05},
    "gyro_scale": {"scale": 0.1},
}


def hidden_log(effect, seed=3):
    seconds = 20.0 if effect == "cogging" else 12.0
    return simulated(seed=seed, duration=seconds, **{f"{effect}__{p}": v for p, v in HIDDEN[effect].items()})


def test_every_effect_of_the_library_is_tried_here():
    assert set(HIDDEN) == set(derive.effects.LIBRARY)


@pytest.mark.parametrize("effect", sorted(HIDDEN))
def test_a_hidden_effect_is_found_and_the_error_falls_to_the_noise(effect):
    result = explain(Model.default(), [hidden_log(effect)])
    first = result.steps[0]
    assert effect in (first.effect, *first.equivalent_to)
    assert len(result.steps) == 1
    assert result.error < 1.05 * result.noise_floor
    if first.effect == effect:
        for name, truth in HIDDEN[effect].items():
            assert abs(first.coefficients[name] - truth) < max(0.02 * abs(truth), 3 * first.sigma[name])


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize("seed", range(6))
def test_where_nothing_is_hidden_nothing_is_missing(command, seed):
    result = diagnose(Model.default(), [simulated(command, seed=100 + seed)])
    assert result.verdict == "nothing_missing"
    assert not result.candidates
    assert set(result.detectable) >= {"coulomb_drive", "slope", "voltage_dead_zone"}


def test_two_hidden_effects_are_both_found():
    log = simulated(seed=5, duration=12.0, voltage_dead_zone__threshold=0.4, slope__angle=0.02)
    result = explain(Model.default(), [log])
    assert set(result.effects) == {"voltage_dead_zone", "slope"}
    assert result.error < 1.05 * result.noise_floor


def test_the_shipped_log_tells_its_secret_without_nominal_values():
    data = Path(__file__).parent.parent / "data"
    truth = json.loads((data / "demo_truth.json").read_text())
    bare = Model.parse('plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n')
    result = explain(bare, [data / "demo.csv"], [data / "demo_holdout.csv"])
    assert result.base_error > 10
    assert result.error < 1.05 * result.noise_floor
    found = {n: v["value"] for n, v in result.parameters.items() if "." in n}
    assert found == pytest.approx(truth["effects"], rel=1e-3)


def test_explaining_writes_nothing(tmp_path):
    from wheelpend import workspace

    model = workspace.create(tmp_path)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    explain(model, [hidden_log("slope")])
    assert before == {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}


def test_a_base_fit_that_runs_astray_is_begun_again():
    result = diagnose(Model.default(), [simulated(winding_inductance__time_constant=0.01)])
    assert (result.verdict, result.candidates[0].effect) == ("effect_missing", "winding_inductance")
    assert result.candidates[0].coefficients["time_constant"] == pytest.approx(0.01, rel=1e-3)
