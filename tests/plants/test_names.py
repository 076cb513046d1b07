"""Coordinates and inputs may have any name: none that the generated code uses is taken from them."""

import sys
from types import ModuleType

import numpy as np
import pytest

import derive
from derive import emit, plants
from derive.model import compose
from derive.printing import local_name, reserved_names
from tests.plants import lever
from tests.support import ROOT, run


@pytest.fixture(autouse=True)
def known_plants():
    """Plants that a test makes known are forgotten after it."""
    known = dict(plants.KNOWN_PLANTS)
    yield
    plants.KNOWN_PLANTS.clear()
    plants.KNOWN_PLANTS.update(known)
    plants._built.cache_clear()


def module_with(name, command, monkeypatch):
    """Kernels of the lever with its angle and its input called so, as plain Python."""
    text = (ROOT / "tests" / "plants" / "lever.py").read_text()
    text = text.replace('coordinate("phi"', f'coordinate("{name}"').replace('"tau", real', f'"{command}", real')
    plant = ModuleType("plant_of_any_name")
    exec(text.replace('"lever"\n', f'"lever_{name}"\n'), vars(plant))
    plant.__file__ = lever.__file__
    monkeypatch.setitem(plants.KNOWN_PLANTS, plant.PLANT_NAME, plant)
    plants._built.cache_clear()
    model = compose(plant.PLANT_NAME, {}, ("coulomb_drive", "viscous_asymmetry", "actuator_delay"))
    module, numba = ModuleType("generated"), ModuleType("numba")
    numba.njit = lambda *functions, **options: functions[0] if functions else lambda function: function
    monkeypatch.setitem(sys.modules, "numba", numba)
    exec(emit.render(model), vars(module))
    return module


def motion(module):
    t, values = np.arange(12) * 0.02, np.array([0.05, 1.2, 0.4, 0.1, 0.02, 0.0])
    voltage = np.sin(9 * t)
    states, by = module.sensitivities(t, voltage, np.array([0.1, 0.2]), values, np.arange(3), 0.02)[:2]
    regressor = module.filter_regressor(t, states, voltage, values, 0.1, 0.1, True, states[0])
    return np.concatenate([np.ravel(x) for x in (states, by, *regressor)])


@pytest.mark.parametrize(
    ("name", "command"),
    [("phi", "tau"), ("x", "v"), ("state", "states"), ("parameters", "voltage"), ("sigma", "u"), ("c1", "c0"),
     ("lambda", "rate"), ("step", "np"), ("i", "k"), ("h", "now"), ("angle", "start")],
)  # fmt: skip
def test_a_coordinate_may_have_any_name(name, command, monkeypatch):
    module = module_with(name, command, monkeypatch)
    assert ((name, f"d{name}"), (command,)) == (module.STATES, module.INPUTS)
    np.testing.assert_allclose(motion(module), motion(module_with("q", "w", monkeypatch)), rtol=1e-9, atol=1e-12)


def test_names_of_shipped_plants_and_effects_stay_as_they_are():
    taken = reserved_names()
    for name in ("wheel_pendulum", "slide", "pendulum", "cart_pole"):
        plant = plants.build(name, plants.complete_assumptions(name, {}))
        assert not taken & {s.name for c in plant.moving for s in (c.q, c.dq, c.ddq)}
    assert not taken & {local_name(n) for e in derive.effects.EFFECT_LIBRARY.values() for n in e.full_names}


@pytest.mark.parametrize("name", ["t", "X1", "load", "two-words"])
def test_a_name_that_means_something_in_every_model_is_refused(name, tmp_path):
    text = (ROOT / "tests" / "plants" / "lever.py").read_text().replace('"lever"\n', '"other"\n')
    text = text.replace('coordinate("phi"', f'coordinate("{name}"')
    (tmp_path / "lever.py").write_text(text)
    assert name in run("new", tmp_path / "w", "--plant", tmp_path / "lever.py", code=1).stderr
