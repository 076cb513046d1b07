"""Every effect of the library, hidden alone, is found and sized."""

import pytest

import derive
from tests.support import SPARSE_S, simulated
from wheelpend import Model, explain
from wheelpend.benchmarks.hidden_effects.cases import benchmark_plant
from wheelpend.kernels import load as kernels

HIDDEN = {
    "coulomb_drive": {"torque": 0.3},
    "coulomb_asymmetry": {"torque": 0.1},
    "viscous_asymmetry": {"coefficient": 0.02},
    "stribeck_drive": {"static": 0.5, "sliding": 0.2, "speed": 0.5},
    "quadratic_drive": {"coefficient": 0.01},
    "cogging": {"sine": 0.2, "cosine": 0.1, "periods": 12.0},
    "load_friction": {"share": 0.15},
    "ground_viscous": {"coefficient": 0.05},
    "rolling_resistance": {"torque": 0.2},
    "slope": {"angle": 0.02},
    "wheel_runout": {"sine": 0.1, "cosine": 0.05},
    "air_drag": {"coefficient": 0.01},
    "com_offset": {"angle": 0.02},
    "tether_spring": {"stiffness": 0.05},
    "actuator_delay": {"delay": 0.0043},
    "winding_inductance": {"time_constant": 0.01},
    "voltage_saturation": {"limit": 10.0},
    "voltage_dead_zone": {"threshold": 0.3},
    "voltage_asymmetry": {"ratio": 0.05},
    "voltage_sag": {"rate": 0.005},
    "voltage_offset": {"offset": 0.2},
    "coasting_driver": {"rate": 0.005},
    "imu_bias": {"bias": 0.02},
    "gyro_bias": {"bias": 0.05},
    "gyro_scale": {"scale": 0.1},
    "pitch_scale": {"scale": 0.05},
    "encoder_eccentricity": {"sine": 0.01, "cosine": 0.005},
    "presliding_drive": {"torque": 0.3, "stiffness": 20.0},
    "body_damping": {"coefficient": 0.1},
    "imu_lag": {"delay": 0.0043},
    "accelerometer_tilt": {"gain": 0.01, "time_constant": 1.0},
    "payload_step": {"time": 8.03, "ratio": 0.1},
    "external_push": {"start": 5.03, "end": 5.51, "torque": 0.5},
    "drive_compliance": {"stiffness": 50.0, "damping": 0.1},
    "wheel_slip": {"stiffness": 20.0, "limit": 5.0},
    "slosh": {"mass_ratio": 0.05, "height": 0.5, "frequency": 8.0, "damping": 0.3},
}
FAST = {  # at least one for each way to enter: a force, a state, a lag, a delay, a geometry, a sensor, a ripple
    "ground_viscous", "presliding_drive", "winding_inductance", "actuator_delay",
    "com_offset", "imu_bias", "imu_lag", "gyro_bias", "encoder_eccentricity",
}  # fmt: skip


def hidden_log(effect, seed=3):
    seconds = 8.0 if effect in FAST else 20.0 if effect == "payload_step" else 12.0
    return simulated(
        seed=seed, duration=seconds, sample=SPARSE_S, **{f"{effect}__{p}": v for p, v in HIDDEN[effect].items()}
    )


def test_every_effect_of_the_library_is_tried_here():
    absorbed = {n.partition(".")[0] for n in kernels.library_module("wheel_pendulum", {}).ABSORBED}
    assert set(HIDDEN) == {e.name for e in derive.effects.applicable_to(benchmark_plant())} - absorbed - {
        "encoder_scale",
        "backlash",
    }


@pytest.mark.parametrize(
    "effect", [pytest.param(e, marks=[] if e in FAST else pytest.mark.slow) for e in sorted(HIDDEN)]
)
def test_a_hidden_effect_is_found_and_the_error_falls_to_the_noise(effect):
    result = explain(Model.default(), [hidden_log(effect)])
    first = result.steps[0]
    assert effect in (first.effect, *first.equivalent_to)
    assert len(result.steps) == 1
    assert result.error < 1.05 * result.noise_floor
    if first.effect == effect:
        for name, truth in HIDDEN[effect].items():
            assert abs(first.coefficients[name] - truth) < max(0.02 * abs(truth), 3 * first.sigma[name])
