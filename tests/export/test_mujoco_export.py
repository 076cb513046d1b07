"""The robot in MuJoCo moves as identified; what the scene lacks is said."""

import json
import re

import numpy as np
import pytest

from tests.export.exporting import interpreted, model_with
from tests.support import X, simulated
from wheelpend import Model, simulate
from wheelpend.errors import Failure
from wheelpend.export.export import export_model
from wheelpend.export.exported_model import exported_model
from wheelpend.export.mujoco_target import mujoco_carried, mujoco_files, mujoco_notes, scene_values
from wheelpend.simulation.hidden import base_parameter_names


def alike(*effects):
    """A model whose drive is damped alike both ways."""
    return model_with(*effects).with_fit({"X6": (0.7, 1e-4), "X7": (0.7, 1e-4)})


def test_a_scene_has_masses_that_are_positive_and_give_the_parameters_back():
    exported = exported_model(alike())
    v, x = scene_values(exported), dict(zip(exported.module.PARAMETERS, exported.parameters, strict=True))
    scale, radius = v["scale"], v["radius"]
    assert min(v["wheel_mass"], v["body_mass"], v["body_inertia"]) > 0.0
    assert (v["wheel_mass"] + v["body_mass"]) * radius**2 == pytest.approx(scale * x["X1"])
    assert v["body_mass"] * v["above"] * radius == pytest.approx(scale * x["X3"])
    assert v["body_inertia"] + v["body_mass"] * v["above"] ** 2 == pytest.approx(scale * x["X4"])
    assert v["body_mass"] * v["above"] * v["gravity"] == pytest.approx(scale * x["X5"])


def test_a_scene_reads_a_gyro_only_where_the_model_has_one():
    with_gyro = alike()
    text = with_gyro.dump().replace("gyro = true", "gyro = false")
    bare = Model.parse("".join(line for line in text.splitlines(keepends=True) if not line.startswith("rate_noise")))
    for model, count in ((with_gyro, 1), (bare, 0)):
        scene = mujoco_files(exported_model(model))["robot.xml"]
        assert scene.count("jointvel") == count and scene.count("<jointpos") == 1


@pytest.mark.extras
@pytest.mark.parametrize("effects", [(), ("body_damping",), ("ground_viscous",), ("voltage_offset",), ("com_offset",)])
def test_the_scene_accelerates_as_the_model(effects):
    mujoco = pytest.importorskip("mujoco")
    exported = exported_model(alike(*effects))
    kernels, radius = interpreted(exported.text), scene_values(exported)["radius"]
    model = mujoco.MjModel.from_xml_string(mujoco_files(exported)["robot.xml"])
    data, random = mujoco.MjData(model), np.random.default_rng(4)
    for _ in range(5):
        wheel, pitch, rate, pitch_rate, voltage = random.normal(size=5) * 0.3
        data.qpos[:], data.qvel[:], data.ctrl[:] = (radius * wheel, pitch), (radius * rate, pitch_rate), voltage
        mujoco.mj_forward(model, data)
        now, rates = np.zeros(exported.size), np.zeros(4)
        now[:4] = wheel, pitch, rate, pitch_rate
        kernels.machine_rates(0.0, now, voltage, exported.parameters, rates)
        np.testing.assert_allclose(data.qacc / (radius, 1.0), rates[2:], rtol=1e-6, atol=1e-6)


@pytest.mark.extras
def test_a_log_of_a_robot_with_friction_is_replayed_there():
    pytest.importorskip("mujoco")
    log = simulated(duration=3.0, seed=5, coulomb_drive__torque=0.3)
    ledger = export_model(model_with("coulomb_drive"), "mujoco", log).ledger
    assert (
        ledger.effects["coulomb_drive"].carried == "approximately" and "yields" in ledger.effects["coulomb_drive"].note
    )
    assert "run by MuJoCo" in ledger.replayed
    assert 0.5 * ledger.error < ledger.error_in_target < 3.0 * ledger.error


def test_what_the_scene_has_not_is_said():
    exported = exported_model(model_with("cogging", "imu_bias", "body_damping"))
    assert {n: c.carried for n, c in mujoco_carried(exported).items()} == {
        "cogging": "not", "imu_bias": "not", "body_damping": "exactly",
    }  # fmt: skip
    assert mujoco_notes(exported_model(alike())) == []
    uneven = alike().with_fit({"X7": (0.6, 1e-4)})
    assert "MuJoCo damps the drive alike both ways" in mujoco_notes(exported_model(uneven))[0]


def test_another_plant_and_masses_that_cannot_be_are_refused():
    with pytest.raises(Failure, match="An MJCF is made of wheel_pendulum alone, but the model is a slide"):
        mujoco_files(exported_model(model_with(plant="slide")))
    with pytest.raises(Failure, match="X1 X4 must then be above X3²"):
        scene_values(exported_model(alike().with_fit({"X3": (5.0, 1e-3)})))


def assuming(**assumptions):
    """The plain robot with its reference values, under other assumptions; one value of damping both ways."""
    default = Model.default()
    damping = dict.fromkeys(("X6", "X7", "X8", "X9", "X10"), (0.7, 0.0001))
    own = {n: (p, 1e-4) for n, p in X.items()} | damping
    text = default.dump()
    for name, value in assumptions.items():
        text = re.sub(rf"^{name} = \S+", f"{name} = {json.dumps(value)}", text, flags=re.MULTILINE)
    own_table = r"^\[(?:simulation|parameters)\].*\n(?:(?!\[).*\n?)*"
    text = re.sub(own_table, "", text, flags=re.MULTILINE)
    model = Model.parse(re.sub(r"^rate_noise.*\n", "", text, flags=re.MULTILINE))
    return model.with_fit({n: v for n, v in own.items() if n in base_parameter_names(model)})


@pytest.mark.parametrize(
    ("assumptions", "element"),
    [
        ({"encoder": "relative"}, '<tendonpos name="theta_w" tendon="drive"/>'),
        ({"encoder": "absolute"}, '<tendonpos name="theta_w" tendon="theta_w"/>'),
        ({"rate_sensor": True}, '<tendonvel name="dtheta_w" tendon="theta_w"/>'),
    ],
)
def test_the_sensors_of_a_scene_read_what_the_channels_do(assumptions, element):
    exported = exported_model(assuming(**assumptions))
    scene = mujoco_files(exported)["robot.xml"]
    assert element in scene and scene.partition("<sensor>")[2].count(" name=") == exported.module.NY


@pytest.mark.slow
@pytest.mark.extras
@pytest.mark.parametrize(
    "assumptions",
    [
        {"encoder": "relative"},
        {"gyro": False},
        {"rate_sensor": True},
        {"rotor_inertia": False},
        {"ground_friction": False},
    ],
)
def test_a_scene_replays_a_log_of_the_machine_that_is_assumed(assumptions):
    pytest.importorskip("mujoco")
    model = assuming(**assumptions)
    ledger = export_model(model, "mujoco", simulate(model, duration=1.0, seed=2)).ledger
    assert "run by MuJoCo" in ledger.replayed
    assert ledger.error_in_target == pytest.approx(ledger.error, rel=0.02)


def test_a_robot_that_turns_is_refused():
    with pytest.raises(Failure, match=r"keeps its heading \(planar = true\)"):
        scene_values(exported_model(assuming(planar=False)))
