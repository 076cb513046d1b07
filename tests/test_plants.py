"""Plants beyond the first: their equations against textbooks, and every stage behind the derivation on each of them."""

import textwrap
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import derive
from derive.effects import suited
from wheelpend import Failure, Model, diagnose, explain, identify, simulate
from wheelpend.cli.main import app
from wheelpend.estimation.state_reconstruction import measured_states, states_from
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log
from wheelpend.model.user_effects import effects_from_text
from wheelpend.model.user_plants import load_plant

G = 9.81
EVERY = [
    ("slide", {}),
    ("pendulum", {}),
    ("pendulum", {"driven": True}),
    ("pendulum", {"links": 2}),
    ("pendulum", {"links": 2, "driven": True, "second_encoder": "absolute"}),
    ("cart_pole", {}),
    ("wheel_pendulum", {"encoder": "relative"}),
]


def double_pendulum(t, y, m1, m2, l1, l2):
    """Two point masses on massless rods, as in the textbooks, without the project's Lagrangian."""
    a, b, da, db = y
    d = a - b
    mass = np.array([[(m1 + m2) * l1, m2 * l2 * np.cos(d)], [l1 * np.cos(d), l2]])
    force = [-m2 * l2 * db**2 * np.sin(d) - (m1 + m2) * G * np.sin(a), l1 * da**2 * np.sin(d) - G * np.sin(b)]
    return [da, db, *np.linalg.solve(mass, force)]


def test_two_links_swing_as_the_textbooks_double_pendulum_does():
    m1, m2, l1, l2 = 1.2, 0.7, 0.9, 0.5
    gravity = (m1 + m2) * l1 * G  # forces are counted in units of what holds the level first link
    values = {"X1": (m1 + m2) * l1**2, "X2": m2 * l1 * l2, "X3": m2 * l2**2, "X4": m2 * l2 * G}
    module = kernels.model_module("pendulum", {"links": 2}, ())
    parameters = np.array([values[n] / gravity for n in module.PARAMETERS])
    t, start = np.arange(0.0, 3.0, 1e-3), np.array([1.2, -0.6, 0.3, 0.0])
    ours = module.simulate(t, np.zeros_like(t), start, parameters, 5e-4)
    theirs = solve_ivp(double_pendulum, (0, 3), start, t_eval=t, rtol=1e-10, atol=1e-12, args=(m1, m2, l1, l2)).y.T
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def cart_and_pole(state, force, M, m, l, J, K):
    """Accelerations by Newton's laws for cart and pole, with a force on the cart and its back-EMF."""
    _, theta, dx, dtheta = state
    matrix = np.array([[M + m, m * l * np.cos(theta)], [m * l * np.cos(theta), J + m * l**2]])
    return np.linalg.solve(matrix, [force - K * dx + m * l * dtheta**2 * np.sin(theta), m * G * l * np.sin(theta)])


def test_cart_and_pole_accelerate_as_newton_says():
    M, m, l, J, K, gain = 0.8, 0.2, 0.4, 0.01, 3.0, 2.0
    values = {"X1": (M + m) / gain, "X2": m * l / gain, "X3": (J + m * l**2) / gain, "X4": m * G * l / gain, "X5": K}
    module = kernels.model_module("cart_pole", {}, ())
    parameters = np.array([values[n] for n in module.PARAMETERS])
    for state in np.random.default_rng(1).normal(size=(20, 4)):
        expected = cart_and_pole(state, gain * 1.7, M, m, l, J, gain * K)
        np.testing.assert_allclose(module.acceleration(0.0, state, 1.7, parameters), expected, rtol=1e-10)


def test_a_freely_swinging_pendulum_keeps_its_energy_until_friction_takes_it():
    module = kernels.library_module("pendulum", {})
    t = np.arange(0.0, 20.0, 1e-3)
    bare = np.array([{"X1": 0.07}.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    rubbing = bare.copy()
    rubbing[module.PARAMETERS.index("coulomb_drive.torque")] = 0.05
    free, stopped = (module.simulate(t, np.zeros_like(t), np.array([1.5, 0.0]), p, 1e-3) for p in (bare, rubbing))
    energy = 0.07 * free[:, 1] ** 2 / 2 - np.cos(free[:, 0])
    assert np.ptp(energy) < 1e-7
    assert abs(stopped[-1, 1]) < 1e-12 and abs(np.sin(stopped[-1, 0])) < 0.05  # it sticks where gravity cannot move it


@pytest.mark.parametrize(("plant", "assumptions"), EVERY)
def test_every_plant_has_a_library_that_the_templates_can_write(plant, assumptions):
    model = derive.library_model(plant, assumptions)
    compile(derive.render(model), plant, "exec")
    assert {e.name for e in model.effects} >= {"coulomb_drive", "quadratic_drive", "stribeck_drive"}


@pytest.mark.parametrize(("plant", "assumptions"), EVERY)
def test_states_come_back_from_ideal_readings(plant, assumptions):
    module = kernels.model_module(plant, assumptions, ())
    states = np.random.default_rng(3).normal(size=(8, module.NX))
    values = states @ module.READS.T
    slopes = states[:, module.NQ :] @ module.READS[:, : module.NQ].T
    np.testing.assert_allclose(states_from(module, values, slopes), states, atol=1e-12)


def test_a_gyro_that_is_missing_is_replaced_by_the_slope_of_the_pitch():
    module = kernels.model_module("wheel_pendulum", {}, ())
    found = states_from(module, np.array([[0.1, 0.2, np.nan]]), np.array([[1.0, 2.0, np.nan]]))
    np.testing.assert_allclose(found, [[0.1, 0.2, 1.0, 2.0]])


def test_rates_that_no_sensor_reads_are_differences_of_what_one_does():
    module = kernels.model_module("pendulum", {"links": 2}, ())
    t = np.arange(200) * 0.01
    measured = np.column_stack([np.sin(t), np.cos(t) - np.sin(t)])  # the second encoder reads against the first link
    states = measured_states(module, Log("x", t, np.zeros(200), measured, module.OUTPUTS))
    np.testing.assert_allclose(states[1:-1], np.column_stack([np.sin(t), np.cos(t), np.cos(t), -np.sin(t)])[1:-1],
                               atol=1e-4)  # fmt: skip


def test_a_law_has_the_units_and_numbers_of_the_part_on_which_it_acts():
    slide, robot, free = (derive.plants.build(n, derive.plants.settle(n, {})).plant_signature
                          for n in ("slide", "wheel_pendulum", "pendulum"))  # fmt: skip
    row = derive.effects.find("presliding_drive")
    assert [p.unit for p in suited(row, robot).parameters] == ["V", "V/rad"]
    assert [p.unit for p in suited(row, slide).parameters] == ["V", "V/m"]
    assert [p.unit for p in suited(row, free).parameters] == ["1", "1/rad"]
    assert suited(row, slide).parameters[1].maximum == 100 * row.parameters[1].maximum  # 0.01 m counts as a rad
    viscous, cubic = derive.effects.find("viscous_drive"), derive.effects.find("quadratic_drive")
    assert [suited(e, slide).parameters[0].unit for e in (viscous, cubic)] == ["V s/m", "V s²/m²"]


def test_effects_act_on_parts_and_not_on_plants():
    def fitting(name, **assumptions):
        plant = derive.plants.build(name, derive.plants.settle(name, assumptions)).plant_signature
        return {e.name for e in derive.effects.possible_on(plant)}

    assert "voltage_offset" not in fitting("pendulum") and "voltage_offset" in fitting("pendulum", driven=True)
    assert "load_friction" not in fitting("pendulum") and "load_friction" in fitting("slide")
    assert "coulomb_joint" in fitting("cart_pole") and "coulomb_joint" not in fitting("slide")
    assert "rolling_resistance" in fitting("wheel_pendulum") and "rolling_resistance" not in fitting("cart_pole")
    assert "imu_bias" in fitting("cart_pole") and "gyro_bias" not in fitting("cart_pole")


def test_without_ground_friction_the_two_dampings_are_one():
    lean = derive.compose("wheel_pendulum", {"ground_friction": False}, [])
    assert len(lean.grouping.names) == 6
    damping = [p for p in lean.fitted if p.unit == "V s/rad"]
    assert len(damping) == 1


def model_of(plant: str, **changes: str) -> Model:
    text = Model.default(plant).text
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return Model.parse(text)


def test_friction_hidden_in_a_free_pendulum_is_found_and_sized():
    log = simulate(model_of("pendulum"), command="upright", duration=12.0, hide={"coulomb_drive": 0.03}, seed=2)
    assert log.channels == ("theta_1",) and not log.voltage.any()
    found = explain(model_of("pendulum"), [log])
    assert found.steps[0].effect == "coulomb_drive" and found.error < 1.05
    assert found.parameters["coulomb_drive.torque"]["value"] == pytest.approx(0.03, rel=0.05)
    assert found.parameters["X1"]["value"] == pytest.approx(0.068, rel=0.01)


def test_a_free_pendulum_is_identified_from_nothing():
    log = simulate(model_of("pendulum"), command="upright", duration=10.0, seed=4)
    found = identify(Model.parse('plant = "pendulum"\n'), [log])
    assert found.parameters["X1"]["value"] == pytest.approx(0.068, rel=0.002) and found.error < 1.05


def test_two_free_links_are_identified_from_nothing():
    text = 'plant = "pendulum"\n[assumptions]\nlinks = 2\n'
    truth = {"X1": 0.15, "X2": 0.03, "X3": 0.03, "X4": 0.3}
    machine = "[simulation]\ntheta_1 = 1.0\ntheta_2 = 0.4\n" + "".join(f"{n} = {v}\n" for n, v in truth.items())
    log = simulate(Model.parse(text + machine), command="upright", duration=10.0, seed=4)
    found = identify(Model.parse(text), [log])
    assert {n: found.parameters[n]["value"] for n in truth} == pytest.approx(truth, rel=0.01)


def test_missing_stretches_do_not_bend_inverse_dynamics():
    model = model_of("slide")
    log = simulate(model, command="simple", duration=8.0, noise=False)
    whole = identify(model, [log], method="inverse")
    measured = log.measured.copy()
    measured[3000:3700] = np.nan
    cut = identify(model, [replace(log, measured=measured)], method="inverse")
    assert cut.parameters["X1"]["value"] == pytest.approx(whole.parameters["X1"]["value"], rel=0.01)


def test_ripples_along_a_length_are_looked_for_in_its_own_measure():
    model = model_of("slide")
    log = simulate(model, command="simple", duration=10.0, seed=2,
                   hide={"cogging.sine": 2.0, "cogging.cosine": 0.0, "cogging.periods": 300.0})  # fmt: skip
    found = diagnose(model, [log])
    assert found.candidates[0].effect == "cogging"
    assert found.candidates[0].coefficients["periods"] == pytest.approx(300.0, rel=0.001)


def test_an_effect_of_ones_own_keeps_its_numbers_on_a_carriage():
    slide = derive.plants.build("slide", {}).plant_signature
    text = """[stiction_hump]
family = "drive"
sentence = "A hump."
on = "drive"
law = "size*tanh(speed/width)"
[stiction_hump.parameters]
size = { unit = "V", typical = 0.3 }
width = { unit = "m/s", typical = 0.04, starts = [0.01, 0.04], minimum = 0.001 }
"""
    (row,) = effects_from_text(text, slide)
    derive.effects.register([row])
    assert derive.effects.suited(row, slide) is row
    derive.effects.OWN.pop(row.name)


def test_a_log_of_a_plant_without_input_needs_no_column_for_one(tmp_path):
    model = model_of("pendulum")
    log = simulate(model, command="upright", duration=2.0, seed=1)
    save_log(tmp_path / "swing.csv", log, table=model.table)
    assert (tmp_path / "swing.csv").read_text().splitlines()[0] == "t,theta_1"
    assert load_log(tmp_path / "swing.csv", table=model.table).voltage.tolist() == [0.0] * len(log)


def test_the_regression_of_a_free_pendulum_takes_gravity_for_the_left_side():
    model = model_of("pendulum")
    log = simulate(model, command="upright", duration=8.0, noise=False)
    for method, tau in (("inverse", None), ("filtered", (0.1, 0.2))):
        found = identify(model, [log], method=method, tau=tau, test_bias=False)
        assert found.parameters["X1"]["value"] == pytest.approx(0.068, rel=0.002), method


# ---- a plant of one's own

FLYWHEEL = """
import sympy as sp
from derive.records import Body, Channel, Load, Parameter, Plant, Port, coordinate

NAME = "flywheel"
REFERENCE = {"X1": 0.02, "X2": 0.5}
CONSTANTS = {"alpha": 0.05}
GAINS = (2.0, 0.0, 0.5)

def build(assumptions, free=()):
    wheel = coordinate("phi", "wheel")
    J, K, alpha = sp.symbols("J K alpha", positive=True)
    V = sp.Symbol("v_in", real=True)
    return Plant(
        name=NAME, sentence="A flywheel on a motor.", coordinates=(wheel,),
        bodies=(Body("wheel", sp.Integer(0), sp.zeros(3, 1), J, wheel.dq),), gravity=sp.zeros(3, 1),
        loads=(Load("motor", "drive", alpha * (V - K * wheel.dq)),),
        ports=(Port("drive", wheel.q, "between motor and frame"),), channels=(Channel("phi", wheel.q, "rad"),),
        input=V, input_unit="V", scale=alpha, substitutions={},
        constants=(Parameter("alpha", "N m/V", "torque per volt"),), controlled=("phi", ""), reference="phi_ref",
    )
"""


@pytest.fixture
def flywheel(tmp_path):
    path = tmp_path / "flywheel.py"
    path.write_text(FLYWHEEL)
    yield path
    derive.plants.PLANTS.pop("flywheel", None)


def test_a_plant_of_ones_own_is_used_only_where_its_file_is_named(flywheel, tmp_path):
    run = CliRunner().invoke
    folder = tmp_path / "workspace"
    assert run(app, ["new", str(folder), "--plant", str(flywheel)]).exit_code == 0
    derive.plants.PLANTS.pop("flywheel")
    refused = run(app, ["equations", "--model", str(folder)])
    assert refused.exit_code == 1 and "--plant FILE.py" in refused.output
    named = run(app, ["equations", "--model", str(folder), "--plant", str(flywheel)])
    assert named.exit_code == 0 and "wheel row" in named.output


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('NAME = "flywheel"', 'TITLE = "flywheel"', "must state NAME"),
        ('Load("motor", "drive"', 'Load("motor", "wing"', "must act on one of the ports drive"),
        ('controlled=("phi", "")', 'controlled=("psi", "")', "'psi' is none"),
        ("J, K, alpha = sp", "J, K = sp", "raises ValueError"),
        ('coordinate("phi", "wheel")', 'coordinate("phi", "wheel", "deg")', "must be in rad or m"),
        ("import sympy as sp", "import simpy as sp", "simpy"),
        ('Channel("phi", wheel.q', 'Channel("phi", sp.sin(wheel.q)', "must be a sum of coordinates"),
        ('controlled=("phi", ""), ', "", "reference is the commanded value"),
    ],
)
def test_a_file_that_is_no_plants_is_refused_with_a_reason(flywheel, old, new, reason):
    assert old in FLYWHEEL
    flywheel.write_text(FLYWHEEL.replace(old, new))
    with pytest.raises(Failure, match=reason):
        load_plant(flywheel)


def test_the_worked_example_of_the_docs_is_a_plant_of_at_most_forty_lines():
    page = (derive.files.HERE.parent / "docs" / "plants.md").read_text()
    code = page.split("```python\n", 1)[1].split("```", 1)[0]
    assert len(code.splitlines()) <= 40
    scope: dict = {}
    exec(compile(textwrap.dedent(code), "docs/plants.md", "exec"), scope)
    plant = scope["build"]({})
    assert isinstance(plant.scale, sp.Expr) and plant.name == scope["NAME"]


def test_every_method_that_needs_no_controller_identifies_a_plant_with_a_single_parameter():
    model = model_of("slide")
    log = simulate(model, command="simple", duration=6.0, seed=3)
    for method in ("shooting", "filtered", "differentiation", "energy", "recursive", "inverse"):
        tau = (0.1, 0.2) if method in ("filtered", "recursive") else None
        found = identify(model, [log], method=method, tau=tau)
        assert found.parameters["X1"]["value"] > 0.0, method
