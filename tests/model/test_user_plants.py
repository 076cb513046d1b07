"""A plant of one's own: used only where its file is named, and refused with a reason."""

import json
import py_compile
import textwrap
from importlib.util import cache_from_source

import pytest
import sympy as sp
from typer.testing import CliRunner

import derive
from tests.support import run
from wheelpend import Failure
from wheelpend.cli.commands import app
from wheelpend.model.user_effects import effects_from_text
from wheelpend.model.user_plants import load_plant


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
    assert derive.effects.in_plant_units(row, slide) is row
    derive.effects.USER_EFFECTS.pop(row.name)


FLYWHEEL = """
import sympy as sp
from derive.records import Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "flywheel"
REFERENCE_PARAMETERS = {"X1": 0.02, "X2": 0.5}
KNOWN_CONSTANTS = {"alpha": 0.05}
CONTROLLER_GAINS = (2.0, 0.0, 0.5)

def build(assumptions, free=()):
    wheel = coordinate("phi", "wheel")
    J, K, alpha = sp.symbols("J K alpha", positive=True)
    V = sp.Symbol("v_in", real=True)
    return Plant(
        name=PLANT_NAME, sentence="A flywheel on a motor.", coordinates=(wheel,),
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
    derive.plants.KNOWN_PLANTS.pop("flywheel", None)


def test_a_plant_of_ones_own_is_used_only_where_its_file_is_named(flywheel, tmp_path):
    run = CliRunner().invoke
    folder = tmp_path / "workspace"
    assert run(app, ["new", str(folder), "--plant", str(flywheel)]).exit_code == 0
    derive.plants.KNOWN_PLANTS.pop("flywheel")
    refused = run(app, ["equations", "--model", str(folder)])
    assert refused.exit_code == 1 and "--plant FILE.py" in refused.output
    named = run(app, ["equations", "--model", str(folder), "--plant", str(flywheel)])
    assert named.exit_code == 0 and "wheel row" in named.output


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('PLANT_NAME = "flywheel"', 'TITLE = "flywheel"', "must state PLANT_NAME"),
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


def test_only_the_text_of_a_named_file_is_run_not_bytecode_that_lies_beside_it(flywheel, tmp_path):
    evil = tmp_path / "evil.py"
    evil.write_text("raise SystemExit('ran')")
    unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(evil), cfile=cache_from_source(str(flywheel)), invalidation_mode=unchecked)
    flywheel.write_text(f"{flywheel.read_text()}\n# a text that was not run before\n")
    assert load_plant(flywheel) == "flywheel"


def test_the_worked_example_of_the_docs_is_a_plant_of_at_most_forty_lines():
    page = (derive.files.DERIVE_FOLDER.parent / "docs" / "plants.md").read_text()
    code = page.split("```python\n", 1)[1].split("```", 1)[0]
    assert len(code.splitlines()) <= 40
    scope: dict = {}
    exec(compile(textwrap.dedent(code), "docs/plants.md", "exec"), scope)
    plant = scope["build"]({})
    assert isinstance(plant.scale, sp.Expr) and plant.name == scope["PLANT_NAME"]


@pytest.mark.parametrize(
    "code",
    [
        "raise SystemExit(0)",
        "class Own(BaseException): pass\nraise Own",
        "class Own(KeyboardInterrupt): pass\nraise Own",
        "def f(): f()\nf()",
        "class Own(Exception):\n  def __str__(self): raise ValueError\nraise Own",
    ],
)
def test_whatever_a_file_raises_is_a_failure_that_names_it(code, tmp_path):
    (tmp_path / "mine.py").write_text(f"print('hello')\n{code}\n")
    (tmp_path / "log.csv").write_text("t\n0\n")
    result = run("inspect", tmp_path / "log.csv", "--plant", tmp_path / "mine.py", "--json", "-", code=1)
    assert "mine.py must state a plant, but line" in " ".join(result.stderr.split())
    assert "mine.py must state a plant" in json.loads(result.stdout)["failure"]
