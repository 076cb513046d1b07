"""Machines at any angle, with sensors of rates: swing-ups are used whole, rates have noise and faults of their own."""

from dataclasses import replace

import numpy as np
import pytest

import derive
from tests.plants.machines import LEVER, LEVER_FILE, log_of, model_of
from wheelpend import Log, Model, compare, identify, load_log, save_log
from wheelpend.estimation.segments import Segments
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.kernels import load as kernels
from wheelpend.logs.noise import sensor_noise

CART = {"X1": 1.1, "X2": 0.05, "X3": 0.0333, "X4": 0.49, "X5": 4.0}
ROBOT = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256}
SIGMA = {"rad": 1e-3, "m": 1e-4, "rad/s": 1e-2, "m/s": 1e-2}
MACHINES = {
    "cart_pole": (
        'plant = "cart_pole"\n[assumptions]\nrange = "{}"\nrate_sensor = "both"\n[constants]\ngain = 1.0\n',
        CART,
    ),
    "wheel_pendulum": ('plant = "wheel_pendulum"\n[assumptions]\nrange = "{}"\nrate_sensor = true\n', ROBOT),
}


def model_with(plant, at="any", scale=0.9):
    """A model with nominal values a tenth too small."""
    text, values = MACHINES[plant]
    lines = (f"{n} = {scale * v}\n" for n, v in values.items())
    return Model.parse(text.format(at) + "[parameters]\n" + "".join(lines))


def swing_up(plant, seed=0):
    """A log that begins hanging down and goes once over the top, wrapped into one turn as an IMU reports it."""
    model, values = model_with(plant), MACHINES[plant][1]
    module = kernels.model_module(plant, model.assumptions, ())
    parameters = np.array([values[n] for n in module.PARAMETERS])
    t, random = np.arange(0.0, 8.0, 0.005), np.random.default_rng(seed)
    volts = np.interp(t, np.arange(0.0, 8.2, 0.2), random.normal(size=41) * 8.0)
    start = np.zeros(module.NX)
    start[1], start[3] = np.pi, 9.0  # thrown over the top
    states = module.simulate(t, volts, start, parameters, 1e-3)
    units = [model.plant_signature.channel(c).unit for c in module.OUTPUTS]
    noise = random.normal(size=(len(t), module.NY)) * [SIGMA[u] for u in units]
    measured = states @ module.OUTPUT_MATRIX.T + noise
    assert np.ptp(measured[:, 1]) > np.pi
    measured[:, 1] = (measured[:, 1] + np.pi) % (2 * np.pi) - np.pi
    return Log("swing.csv", t, volts, measured, tuple(module.OUTPUTS), rates=model.table.rates, range_channel="")


@pytest.mark.slow
@pytest.mark.parametrize("plant", list(MACHINES))
def test_a_swing_up_is_used_whole_where_any_angle_is_allowed(plant, tmp_path):
    save_log(tmp_path / "swing.csv", swing_up(plant), table=model_with(plant).table)
    free, upright = (load_log(tmp_path / "swing.csv", table=model_with(plant, at).table) for at in ("any", "upright"))
    assert not any("left out" in w or "degrees" in w for w in free.warnings)
    assert any("fell over" in w for w in upright.warnings)
    assert np.abs(np.diff(free.measured[:, 1])).max() < 1.0  # it is continuous
    found = identify(model_with(plant), [tmp_path / "swing.csv"])
    for name, value in MACHINES[plant][1].items():
        estimate = found.parameters[name]
        assert abs(estimate.value - value) < 5 * estimate.sigma + 1e-6 * value, name
        assert estimate.sigma < 0.05 * value, name


@pytest.mark.slow
def test_predictions_beyond_upright_do_not_diverge_at_any_angle(tmp_path):
    save_log(tmp_path / "swing.csv", swing_up("cart_pole"), table=model_with("cart_pole").table)
    result = compare(model_with("cart_pole", scale=1.0), [tmp_path / "swing.csv"])
    short = [h for h in result.horizons if h.seconds < 0.6]
    assert short and not any(h.diverged for h in short)
    assert 0.9 < result.error < 1.1


def test_a_prediction_is_lost_ten_measured_ranges_away():
    log = swing_up("cart_pole")
    segments = Segments(log, np.ones(4), np.array([[0, 100]]))
    reach = np.ptp(log.measured[:, 0])
    residual = np.zeros((len(log.t), 4))
    residual[50, 0], residual[60, 1] = 9.9 * reach, np.nan
    assert not segments.are_lost(residual)
    residual[50, 0] = 10.1 * reach
    assert segments.are_lost(residual)


def test_rates_have_noise_from_the_log_and_are_known_as_rates():
    log = swing_up("cart_pole")
    assert log.rates == {"dtheta_p": "theta_p", "dx": "x"}
    found = sensor_noise(replace(log, measured=np.unwrap(log.measured, axis=0)), {}, {})
    np.testing.assert_allclose(found.sigma[2:], 1e-2, rtol=0.1)


@pytest.mark.parametrize(("plant", "assumptions", "rates"), [
    ("slide", {"rate_sensor": True}, {"dx": "x"}),
    ("pendulum", {"rate_sensor": True}, {"dtheta_1": "theta_1"}),
    ("pendulum", {"links": 2, "rate_sensor": "both", "second_encoder": "absolute"},
     {"dtheta_1": "theta_1", "dtheta_2": "theta_2"}),
    ("pendulum", {"links": 2, "rate_sensor": "second"}, {"dtheta_2": ""}),  # a gyro reads against the vertical
    ("cart_pole", {"rate_sensor": True}, {"dtheta_p": "theta_p"}),
    ("cart_pole", {"rate_sensor": "cart"}, {"dx": "x"}),
    ("wheel_pendulum", {"rate_sensor": True}, {"dtheta_w": "theta_w", "dtheta_p": "theta_p"}),
    ("wheel_pendulum", {"gyro": False}, {}),
    ("wheel_pendulum", {"rate_sensor": True, "encoder": "relative"}, {"dtheta_w": "theta_w", "dtheta_p": "theta_p"}),
])  # fmt: skip
def test_any_shipped_plant_may_have_sensors_of_its_rates(plant, assumptions, rates):
    channels = derive.plants.build(plant, assumptions).plant_signature.channels
    assert {c.name: c.rate_of for c in channels if c.unit.endswith("/s")} == rates


def test_a_gyros_zero_and_scale_are_effects_wherever_there_is_a_gyro():
    def sensed(plant, **assumptions):
        rows = derive.effects.applicable_to(derive.plants.build(plant, assumptions).plant_signature)
        return {e.name for e in rows if "gyro" in e.name}

    assert sensed("pendulum") == sensed("cart_pole", rate_sensor="cart") == sensed("slide", rate_sensor=True) == set()
    assert sensed("pendulum", rate_sensor=True) == sensed("cart_pole", rate_sensor=True) == {"gyro_bias", "gyro_scale"}
    assert sensed("wheel_pendulum") and not sensed("wheel_pendulum", gyro=False)
    assert len(sensed("pendulum", links=2, rate_sensor="both")) == 4
    model = derive.compose("pendulum", {"links": 2, "rate_sensor": "both"}, ["gyro_bias", "second_gyro_scale"])
    read = dict(zip([c.name for c in model.plant.channels], map(str, model.readings), strict=True))
    assert read["dtheta_1"] == "dtheta_1 + gyro_bias.bias" and "second_gyro_scale.scale" in read["dtheta_2"]
    assert model.effects[0].equation == "measured dtheta_1 = true + b"


def test_choices_that_do_not_go_together_are_refused():
    for choice in ('driven = "both"', 'driven = "second"', 'rate_sensor = "second"'):
        with pytest.raises(Exception, match="needs links = 2, but links is 1"):
            Model.parse(f'plant = "pendulum"\n[assumptions]\n{choice}\n')


def test_a_rate_channel_of_ones_own_plant_is_known_as_one_and_its_fault_is_found():
    plant = model_of(LEVER).plant_signature
    assert plant.channel("spin").rate_of == "phi" and LEVER_FILE.exists()
    log = log_of(LEVER)
    wrong = replace(log, measured=log.measured * [1.0, 180 / np.pi])
    assert [f.kind for f in inspect_for_model(model_of(LEVER), wrong).findings] == ["wrong_unit"]
