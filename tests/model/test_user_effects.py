"""A user's own effect behaves as any other; a hostile file is refused and executes nothing."""

from time import process_time

import numpy as np
import pytest
import sympy as sp

from derive import plants
from tests.support import run
from wheelpend import Failure, Model, explain, simulate
from wheelpend.model.user_effects import effects_from_text

PLANT = plants.build("wheel_pendulum", plants.complete_assumptions("wheel_pendulum", {})).plant_signature
BRUSHES = """
[worn_brushes]
family = "drive"
sentence = "Brushes that drag more, the faster they go, up to a limit."
on = "drive"
law = "torque*tanh(speed/width)"
dissipates = true
[worn_brushes.parameters]
torque = { unit = "V", minimum = 0, typical = 0.3 }
width = { unit = "rad/s", minimum = 0.05, typical = 3.0, starts = [1.0, 3.0, 8.0] }
"""
OTHERS = """
[hot_driver]
family = "actuator"
sentence = "The driver gives less as it warms up, and levels off."
on = "input"
law = "v_in*(1 - loss*(1 - exp(-t/20)))"
parameters.loss = { unit = "", minimum = 0, maximum = 0.9, typical = 0.05 }

[bent_scale]
family = "sensor"
sentence = "The pitch sensor is not linear."
on = "theta_p"
law = "reading + bend*reading^3"
parameters.bend = { unit = "1/rad²", typical = 0.1 }

[one_way_brake]
family = "ground"
sentence = "A brake that grips forwards, more so when leaning."
on = "ground"
law = "grip*positive(dtheta_w)*(1 + theta_p^2)"
parameters.grip = { unit = "V s/rad", minimum = 0, typical = 0.05 }
"""


def broken(old, new):
    return BRUSHES.replace(old, new)


@pytest.fixture
def workspace(tmp_path):
    (tmp_path / "effects.toml").write_text(BRUSHES + OTHERS, encoding="utf-8")
    return Model.default().save(tmp_path)


def test_an_effect_of_ones_own_is_found_on_a_carriage_with_its_inner_parameter(tmp_path):
    text = (
        broken('unit = "rad/s", minimum = 0.05', 'unit = "m/s", minimum = 0.005')
        .replace("3.0", "0.1")
        .replace("[1.0, 0.1, 8.0]", "[0.03, 0.1, 0.3]")
    )
    (tmp_path / "effects.toml").write_text(text, encoding="utf-8")
    model = Model.default("slide").save(tmp_path)
    hidden = {"worn_brushes.torque": 0.5, "worn_brushes.width": 0.1}
    result = explain(model, [simulate(model, command="simple", hide=hidden, duration=8.0, seed=1)])
    assert result.effects == ("worn_brushes",) and result.error < 1.05 * result.noise_floor
    for name, truth in hidden.items():
        assert result.parameters[name].value == pytest.approx(truth, rel=0.05)


@pytest.mark.slow
def test_an_effect_of_ones_own_is_simulated_found_and_refitted_with_its_inner_parameter(workspace):
    hidden = {"worn_brushes.torque": 0.5, "worn_brushes.width": 3.0}
    log = simulate(workspace, hide=hidden, duration=12.0, seed=1)
    result = explain(workspace, [log])
    assert result.effects == ("worn_brushes",)
    assert result.error < 1.05 * result.noise_floor
    step = result.steps[0]
    for name, truth in hidden.items():
        parameter = name.partition(".")[2]
        assert abs(step.coefficients[parameter] - truth) < max(0.02 * truth, 3 * step.sigma[parameter])


def test_an_effect_on_the_input_a_sensor_or_a_port_enters_there(workspace):
    plain = simulate(workspace, duration=2.0, noise=False)
    for name, value in (("hot_driver.loss", 0.5), ("bent_scale.bend", 0.5), ("one_way_brake.grip", 0.2)):
        assert np.abs(simulate(workspace, hide={name: value}, duration=2.0, noise=False).measured
                       - plain.measured).max() > 1e-3  # fmt: skip


def test_the_kernel_of_an_own_law_has_its_value(workspace):
    model = workspace.with_effects(["worn_brushes"])
    from wheelpend.kernels import load as kernels

    module = kernels.model_module(model.plant, model.assumptions, model.effects)
    known = {**model.simulation, "worn_brushes.torque": 0.5, "worn_brushes.width": 3.0}
    with_it = np.array([known.get(n, 1.0) for n in module.PARAMETERS])
    without = with_it.copy()
    without[module.PARAMETERS.index("worn_brushes.torque")] = 0.0
    state, force = np.array([0.1, 0.05, 2.0, -0.4]), 0.5 * np.tanh(2.4 / 3.0)
    expected = module.acceleration(0.0, state, 1.0 - force, without)  # between wheel and body, as the drive's voltage
    assert module.acceleration(0.0, state, 1.0, with_it) == pytest.approx(expected, rel=1e-12)


def test_an_effect_of_another_workspace_is_not_tried_in_this_one(workspace):
    from wheelpend.model import model_kernels

    assert "worn_brushes.torque" in model_kernels.library_module_of(workspace).PARAMETERS
    assert "worn_brushes.torque" not in model_kernels.library_module_of(Model.default()).PARAMETERS


@pytest.mark.parametrize(("text", "why"), [
    (broken("torque*tanh(speed/width)", "__import__('os').system('touch /tmp/pwned')"), "not part of an expression"),
    (broken("torque*tanh(speed/width)", "torque*speed.real"), "not part of an expression"),
    (broken("torque*tanh(speed/width)", "torque*exec(speed)"), "No function named 'exec'"),
    (broken("torque*tanh(speed/width)", "torque*rate"), "Known names: angle, speed"),
    (broken("torque*tanh(speed/width)", "torque*width/speed"), "finite value at every motion"),
    (broken("torque*tanh(speed/width)", "torque + width*speed"), r"must be 0 while torque = 0"),
    (broken("torque*tanh(speed/width)", "9^9^9^9*torque"), "exponent"),
    (broken("torque =", "speed ="), "must not be called speed"),
    (broken("worn_brushes", "slope"), "is in the library"),
    (broken("[worn_brushes", '["__class__"').replace('"__class__".parameters', '"__class__".parameters'), "TOML|name"),
    (broken('on = "drive"', 'on = "wing"'), "on must be drive, axle, ground, body, outside, input"),
    (broken('family = "drive"', 'family = "magic"'), "worn_brushes.family"),
    (broken('sentence = "Brushes', 'run = "x"\nsentence = "Brushes'), "No key named 'run'"),
    (broken("minimum = 0,", "minimum = 1,"), "must be able to be 0"),
    (broken("typical = 0.3", "typical = inf"), "typical"),
    (broken("typical = 0.3", 'typical = "0.3"'), "typical"),
    (broken("torque*tanh(speed/width)", "torque*exp(exp(exp(exp(speed/width))))"), "finite value at every motion"),
    (broken("torque*tanh(speed/width)", "speed*(sin(width)^2 + cos(width)^2) + torque"), "must be 0 while torque = 0"),
    ("[" * 5000, "not valid TOML"),
    ("a = " + "[" * 100000, "not valid TOML"),
])  # fmt: skip
def test_what_cannot_be_an_effect_is_refused_with_a_reason(text, why):
    with pytest.raises(Failure, match=why):
        effects_from_text(text, PLANT)


def test_a_broken_file_says_where_it_is(tmp_path):
    Model.default().save(tmp_path)
    (tmp_path / "effects.toml").write_text(broken("tanh", "tnah"), encoding="utf-8")
    with pytest.raises(Failure, match=r"effects\.toml: \[worn_brushes\]: No function named 'tnah'"):
        Model.open(tmp_path)


@pytest.mark.parametrize("law", ["+".join(f"sin({k}*speed)" for k in range(1, 61)), "sin(speed)^2+cos(speed)^2-1"])
def test_a_long_law_is_read_at_once_and_what_cancels_counts_as_nothing(law):
    text = f"torque*({law}) + width*(1 - sin(angle)^2 - cos(angle)^2)"
    begin = process_time()
    effects_from_text(broken("torque*tanh(speed/width)", text), PLANT)
    assert process_time() - begin < 2.0


@pytest.mark.parametrize("name", ["self", "lambda", "values", "t2"])
def test_a_parameter_may_have_any_name_that_the_law_does_not_know(name):
    (row,) = effects_from_text(broken("torque", name), PLANT)
    law = row.enters.law(*sp.symbols("angle speed", real=True), **row.symbols)
    assert row.symbols[name] in law.free_symbols


def test_a_file_of_effects_becomes_the_workspaces_all_of_it_or_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Model.default().save(tmp_path)
    (tmp_path / "mine.toml").write_text(BRUSHES + OTHERS, encoding="utf-8")
    assert "worn_brushes" in run("effects", "--define", "mine.toml").output
    assert set(Model.open(tmp_path).own) >= {"worn_brushes", "hot_driver", "bent_scale"}
    before = (tmp_path / "effects.toml").read_bytes()
    (tmp_path / "more.toml").write_text(BRUSHES.replace("worn_brushes", "new_brushes") + BRUSHES, encoding="utf-8")
    assert "worn_brushes is in" in " ".join(run("effects", "--define", "more.toml", code=1).output.split())
    for text, words in (("", "must name an effect"), ("[a]\nlaw = 1", "a.law"), ("[", "TOML")):
        (tmp_path / "wrong.toml").write_text(text, encoding="utf-8")
        assert words in " ".join(run("effects", "--define", "wrong.toml", code=1).output.split())
    assert (tmp_path / "effects.toml").read_bytes() == before
