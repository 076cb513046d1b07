"""A plant of one's own with two inputs, as it stands in the docs."""

import numpy as np
import pytest

import derive
from tests.support import ROOT, run
from wheelpend import Failure, Model, identify, save_log
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log
from wheelpend.model.user_plants import load_plant

J_1, J_2, K_1, K_2, K_BELT, ALPHA = 0.004, 0.007, 0.06, 0.09, 1.3, 0.05
T = np.arange(0.0, 8.0, 0.005)


@pytest.fixture(scope="module")
def drums(tmp_path_factory):
    """The file of the plant, and a workspace beside it."""
    page = (ROOT / "docs" / "plants.md").read_text()
    code = next(b.split("```", 1)[0] for b in page.split("```python\n")[1:] if 'PLANT_NAME = "drums"' in b)
    folder = tmp_path_factory.mktemp("drums")
    (folder / "drums.py").write_text(code)
    load_plant(folder / "drums.py")
    (folder / "model.toml").write_text('plant = "drums"\n[constants]\nalpha = 0.05\n')
    yield folder
    derive.plants.KNOWN_PLANTS.pop("drums", None)


def true_values():
    derived = derive.compose("drums", {}, [])
    numbers = {"J_1": J_1, "J_2": J_2, "K_1": K_1, "K_2": K_2, "k": K_BELT, "alpha": ALPHA}
    pairs = zip(derived.grouping.names, derived.grouping.definitions, strict=True)
    return {n: float(d.subs({s: numbers[s.name] for s in d.free_symbols})) for n, d in pairs}


def recorded(seed=0):
    """A log in which each motor has its own voltage."""
    module, random = kernels.model_module("drums", {}, ()), np.random.default_rng(seed)
    steps = np.arange(0.0, 8.3, 0.25)
    volts = np.column_stack([np.interp(T, steps, random.normal(size=len(steps)) * 2.0) for _ in range(2)])
    parameters = np.array([true_values()[n] for n in module.PARAMETERS])
    states = module.simulate(T, volts, np.zeros(4), parameters, 1e-3)
    noise = random.normal(size=(len(T), 3)) * [1e-3, 1e-3, 1e-2]
    return Log("drums.csv", T, volts, states @ module.OUTPUT_MATRIX.T + noise, tuple(module.OUTPUTS), range_channel="")


def test_the_drums_of_the_docs_turn_as_newton_says(drums):
    module, values = kernels.model_module("drums", {}, ()), true_values()
    assert module.INPUTS == ("v_1", "v_2")
    state, volts = np.array([0.3, 0.1, 2.0, -1.0]), np.array([0.7, -0.4])
    belt = K_BELT * (state[1] - state[0])
    expected = [(ALPHA * (volts[0] - K_1 * 2.0) + belt) / J_1, (ALPHA * (volts[1] + K_2 * 1.0) - belt) / J_2]
    found = module.acceleration(0.0, state, volts, np.array([values[n] for n in module.PARAMETERS]))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("method", ["shooting", "filtered"])
def test_the_drums_of_the_docs_are_identified_from_two_inputs(drums, method):
    model = Model.open(drums)
    save_log(drums / "log.csv", recorded(), table=model.table)
    found = identify(model, [drums / "log.csv"], method=method).parameters
    for name, value in true_values().items():
        assert found[name].value == pytest.approx(value, rel=0.02 if method == "shooting" else 0.2), name


def test_a_log_without_the_second_input_is_refused_with_its_name(drums):
    save_log(drums / "log.csv", recorded(), table=Model.open(drums).table)
    lines = (drums / "log.csv").read_text().replace("v_2", "other")
    (drums / "short.csv").write_text(lines)
    with pytest.raises(Failure, match="v_2"):
        identify(Model.open(drums), [drums / "short.csv"])


def test_the_drums_are_a_workspace_on_the_command_line(drums, tmp_path):
    run("new", tmp_path / "new", "--plant", drums / "drums.py")
    shown = run("equations", "--model", tmp_path / "new", "--plant", drums / "drums.py").stdout
    assert "v_1" in shown and "v_2" in shown
    kinds = derive.plants.build("drums", {}).plant_signature
    assert kinds.channel("dphi_2").rate_of == "phi_2" and kinds.driven_ports == ("drive", "second_drive")
