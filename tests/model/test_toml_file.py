"""model.toml: what it may hold, what is refused, and that edits leave the rest of it alone."""

import math

import pytest

from derive.plants.wheel_pendulum import PLANT_ASSUMPTIONS, REFERENCE_PARAMETERS
from tests.support import ROOT
from wheelpend.errors import Failure
from wheelpend.logs.columns import ColumnMap
from wheelpend.model.record import Model

EXAMPLE = """\
plant = "wheel_pendulum"
effects = ["coulomb_drive"]            # in the order they were added

[assumptions]
ground_friction_reaction = "none"

[constants]
R = 0.2413

[parameters]
X1 = { nominal = 0.0392, identified = 0.0436, sigma = 0.0001 }  # from the first walk
X2 = 0.0178                            # a guess

# found on the bench
[effect.coulomb_drive]
torque = { identified = 0.3001, sigma = 0.0004 }

# about the sensors
[sensors]
encoder = "relative"
encoder_counts = 0

[columns]
theta_p = { column = "pitch_deg", unit = "deg" }
"""


def test_a_dynamic_motor_circuit_is_the_effect_winding_inductance():
    text = 'plant = "wheel_pendulum"\n[assumptions]\nmotor_circuit = "dynamic"\n'
    model = Model.parse(text)
    assert model.effects == ("winding_inductance",)
    assert model.with_effects([*model.effects, "slope"]).text.startswith(
        'plant = "wheel_pendulum"\neffects = ["slope"]'
    )
    with pytest.raises(Failure, match=r"motor_circuit|assumption"):
        model.with_effects([])


def failure(text):
    """The message with which a text is refused."""
    with pytest.raises(Failure) as caught:
        Model.parse(text)
    return str(caught.value)


def changed(before, after):
    """Lines that only the second model has."""
    return [line for line in after.dump().splitlines() if line not in before.dump().splitlines()]


# ---- reading


def test_the_example_is_read():
    model = Model.parse(EXAMPLE)
    assert model.effects == ("coulomb_drive",)
    assert [model.value(n) for n in ("X1", "X2", "X3", "coulomb_drive.torque")] == [0.0436, 0.0178, None, 0.3001]
    assert model.assumptions["ground_friction_reaction"] == "none"
    assert model.assumptions["encoder"] == "relative"
    wheel, pitch, _ = model.plant_signature.channels
    assert (model.sensors.step_of(wheel), model.sensors.noise_of(pitch)) == (None, None)
    assert model.columns == {"theta_p": ColumnMap("pitch_deg", "deg")}
    assert (model.controller, model.simulation) == (None, None)


def test_two_lines_are_a_model():
    model = Model.parse('plant = "wheel_pendulum"\neffects = []\n')
    assert model.assumptions == {a.name: a.default for a in PLANT_ASSUMPTIONS}
    assert model.parameters == {}


def test_a_plain_number_is_nominal_for_a_parameter_and_identified_for_an_effect():
    model = Model.parse(EXAMPLE.replace("torque = { identified = 0.3001, sigma = 0.0004 }", "torque = 1"))
    assert model.parameters["X2"].nominal == 0.0178
    assert model.effect_values["coulomb_drive.torque"].identified == 1.0


def test_values_of_an_effect_that_is_not_in_the_model_do_not_count():
    assert Model.parse(EXAMPLE.replace('["coulomb_drive"]', "[]")).value("coulomb_drive.torque") is None


def test_the_papers_model_is_complete_and_a_tenth_off():
    model = Model.default()
    assert {n: model.value(n) for n in REFERENCE_PARAMETERS} == pytest.approx(
        {n: 0.9 * v for n, v in REFERENCE_PARAMETERS.items()}
    )
    assert model.simulation == pytest.approx(
        {**REFERENCE_PARAMETERS, "pitch_noise": 0.00872665, "rate_noise": 0.00872665}
    )
    assert model.controller.gains == (-168.0, -800.0, -8.8)
    assert model.sensors.step_of(model.plant_signature.channel("theta_w")) == pytest.approx(2 * math.pi / 60000)
    assert max(map(len, model.dump().splitlines())) <= 120


def test_every_assumption_of_the_papers_model_stands_in_the_file():
    text = Model.default().dump()
    assert all(f"\n{a.name} = " in text for a in PLANT_ASSUMPTIONS)


def test_the_repository_holds_a_valid_model():
    assert Model.open(ROOT).plant == "wheel_pendulum"


# ---- refusals


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[constants]", "[constants", "line 7"),
        ("sigma = 0.0001", "sigam = 0.0001", "Known keys: nominal, identified, sigma. Did you mean 'sigma'?"),
        ("[sensors]", "[sensor]", "Did you mean 'sensors'?"),
        ("encoder_counts = 0", "encoder_count = 0", "Did you mean 'encoder_counts'?"),
        ('effects = ["coulomb_drive"]', 'effects = ["columb_drive"]', "Did you mean 'coulomb_drive'?"),
        ('effects = ["coulomb_drive"]', 'effects = ["slope", "slope"]', "slope is there twice"),
        ("[effect.coulomb_drive]", "[effect.coulomb]", "No effect named 'coulomb'"),
        ("torque = {", "torqe = {", "Did you mean 'torque'?"),
        ('reaction = "none"', 'reaction = "nobody"', "must be one of ['body', 'none'], not 'nobody'"),
        ("ground_friction_reaction", "ground_friction_reactoin", "Did you mean 'ground_friction_reaction'?"),
        ("[assumptions]", '[assumptions]\nencoder = "relative"', "set encoder in [sensors]"),
        ('"wheel_pendulum"', '"wheel_pendulums"', "No plant named 'wheel_pendulums'"),
        ("X2 = 0.0178", "x2 = 0.0178", "[parameters] holds X1, X2, ...; 'x2' is none of them"),
        ("X2 = 0.0178", "X2 = inf", "finite number"),
        ("X2 = 0.0178", 'X2 = { nominal = "0.0178" }', "parameters.X2.nominal: must be a number"),
        ("R = 0.2413", "R = nan", "constants.R: must be a finite number"),
        ("R = 0.2413", "radius = 0.2413", "Known constants: R, g, alpha, J_w"),
        ('"relative"', '"absolut"', "'absolute' or 'relative', not 'absolut'"),
        ("encoder_counts = 0", 'pitch_noise = "none"', "sensors.pitch_noise"),
        ("theta_p = {", "theta_pp = {", "Did you mean 'theta_p'?"),
        ('"deg"', '"degree"', "Did you mean 'deg'?"),
        ('plant = "wheel_pendulum"', "", "plant is missing"),
    ],
)
def test_a_mistake_is_refused_in_words(old, new, says):
    assert EXAMPLE.count(old)
    assert says in failure(EXAMPLE.replace(old, new, 1))


def test_a_folder_without_a_model_is_refused_with_the_way_to_start_one(tmp_path):
    with pytest.raises(Failure, match="wheelpend new"):
        Model.open(tmp_path)


# ---- editing


def test_a_fit_changes_its_own_lines_and_no_other():
    before = Model.parse(EXAMPLE)
    after = before.with_fit({"X1": (0.05, 0.002), "X2": (0.02, None), "coulomb_drive.torque": (0.4, 0.1)})
    assert changed(before, after) == [
        "X1 = { nominal = 0.0392, identified = 0.05, sigma = 0.002 }  # from the first walk",
        "X2 = { nominal = 0.0178, identified = 0.02 }                            # a guess",
        "torque = { identified = 0.4, sigma = 0.1 }",
    ]
    assert before.value("X1") == 0.0436


def test_a_parameter_that_the_file_lacks_is_added_to_its_table():
    text = Model.parse(EXAMPLE).with_fit({"X3": (0.1, 0.01)}).dump()
    assert "# a guess\nX3 = { identified = 0.1, sigma = 0.01 }\n\n# found on the bench\n" in text


def test_a_header_with_a_comment_is_found():
    model = Model.default().with_fit({"X8": (0.1, 0.01)})
    assert "X7 = { nominal = 0.65304 }\nX8 = { identified = 0.1, sigma = 0.01 }\n" in model.dump()


def test_a_fit_without_a_standard_error_leaves_no_old_one():
    model = Model.parse(EXAMPLE).with_fit({"X1": (0.05, float("inf"))})
    assert model.parameters["X1"].sigma is None


def test_a_fit_that_is_not_finite_is_refused():
    with pytest.raises(Failure, match="X1 came out as nan"):
        Model.parse(EXAMPLE).with_fit({"X1": (float("nan"), 0.1)})


@pytest.mark.parametrize("form", ["[parameters.X1]\nnominal = 0.0392\n", "parameters.X1.nominal = 0.0392\n"])
def test_other_forms_of_a_table_can_be_fitted_too(form):
    model = Model.parse(f'plant = "wheel_pendulum"\n{form}').with_fit({"X1": (0.05, 0.1), "X2": (1.0, 0.1)})
    assert (model.parameters["X1"].nominal, model.value("X1"), model.value("X2")) == (0.0392, 0.05, 1.0)


def test_a_removed_effect_takes_its_table_and_nothing_else():
    before = Model.parse(EXAMPLE)
    after = before.with_effects(["slope"])
    gone = [line for line in before.dump().splitlines() if line not in after.dump().splitlines()]
    assert gone == [
        'effects = ["coulomb_drive"]            # in the order they were added',
        "[effect.coulomb_drive]",
        "torque = { identified = 0.3001, sigma = 0.0004 }",
    ]
    assert after.effects == ("slope",)


def test_adding_fitting_and_removing_an_effect_gives_the_first_file_back():
    model = Model.default()
    added = model.with_effects(["slope", "coulomb_drive"]).with_fit({"slope.angle": (0.1, 0.1)})
    assert (added.effects, added.value("slope.angle")) == (("slope", "coulomb_drive"), 0.1)
    assert added.with_effects([]).dump() == model.dump()


@pytest.mark.parametrize(
    "form",
    [
        "[effect]\nslope = { angle = 0.1 }\n[sensors]\n[effect.cogging]\nsine = 1.0\n",
        "[effect.slope]\nangle = 0.1\n\n[sensors]\n\n[effect.cogging]\nsine = 1.0",
        "effect.slope.angle = 0.1\neffect.cogging.sine = 1.0\n",
        "[effect.slope.angle]\nidentified = 0.1\n[effect.cogging]\nsine = 1.0\n",
    ],
)
def test_effects_are_removed_in_whatever_form_they_are_written(form):
    text = f'plant = "wheel_pendulum"\neffects = [\n  "slope",  # hill\n  "cogging",\n]\n{form}'
    model = Model.parse(text).with_effects(["cogging"])
    assert (model.effects, model.effect_values.keys()) == (("cogging",), {"cogging.sine"})
    assert "slope" not in model.dump()


def test_effects_can_be_added_to_a_file_that_has_no_list():
    model = Model.parse('plant = "wheel_pendulum"\n# sensors\n[sensors]\n').with_effects(["slope"])
    assert model.effects == ("slope",)
    assert "# sensors" in model.dump()


def test_an_unknown_effect_cannot_be_added():
    with pytest.raises(Failure, match="Known effects: "):
        Model.default().with_effects(["gremlins"])


def test_a_saved_model_is_opened_from_its_folder_or_its_file(tmp_path):
    saved = Model.parse(EXAMPLE.replace("\n", "\r\n")).save(tmp_path)
    assert saved.path == tmp_path / "model.toml"
    assert saved.workspace == tmp_path
    assert Model.open(tmp_path).dump() == Model.open(saved.path).dump() == saved.dump()
    assert [p.name for p in tmp_path.iterdir()] == ["model.toml"]


def test_windows_line_ends_survive_an_edit():
    model = Model.parse(EXAMPLE.replace("\n", "\r\n")).with_fit({"X3": (0.1, 0.1), "X1": (0.1, 0.1)})
    text = model.with_effects([]).dump()
    assert text.count("\n") == text.count("\r\n")


@pytest.mark.parametrize(("old", "new", "says"), [
    ("R = 0.2413", "R = true", "constants.R: must be a number, not True"),
    ("X2 = 0.0178", "X2 = { nominal = false }", "parameters.X2.nominal: must be a number, not False"),
    ("R = 0.2413", "R = 1e999", "finite number"),
])  # fmt: skip
def test_a_switch_and_infinity_are_no_numbers(old, new, says):
    assert says in failure(EXAMPLE.replace(old, new, 1))


def test_a_list_of_effects_keeps_its_comments_where_one_leaves():
    text = 'plant = "wheel_pendulum"\neffects = [\n  "coulomb_drive",  # the gearbox\n  "slope",\n]\n'
    assert "# the gearbox" in Model.parse(text).with_effects(["coulomb_drive"]).text
