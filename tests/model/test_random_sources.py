"""[random_force.*] and [sensor_error.*]: what is read, what is refused, and that edits leave the rest alone."""

import random
import string

import pytest

from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.model.entries import RandomForce, SensorNoise

START = 'plant = "wheel_pendulum"\n'
TABLES = """
[random_force.wheel]   # rough ground
rms = 0.21             # V
correlation_time = 0.12
place = "drive"

# a fused pitch
[sensor_error.theta_p]
rms = 0.001
correlation_time = 0.3
"""
FORMS = (
    TABLES,
    'random_force = { wheel = { rms = 0.21, correlation_time = 0.12, place = "drive" } }\n'
    "sensor_error = { theta_p = { rms = 0.001, correlation_time = 0.3 } }\n",
    'random_force.wheel.rms = 0.21\nrandom_force.wheel.correlation_time = 0.12\nrandom_force.wheel.place = "drive"\n'
    "sensor_error.theta_p.rms = 0.001\nsensor_error.theta_p.correlation_time = 0.3\n",
    '[random_force]\nwheel = { rms = 0.21, correlation_time = 0.12, place = "drive" }\n'
    "[sensor_error]\ntheta_p = { rms = 0.001, correlation_time = 0.3 }\n",
)
DRIVE, PITCH = RandomForce(0.21, 0.12, "drive"), SensorNoise(0.001, 0.3)


@pytest.mark.parametrize("form", FORMS)
def test_random_sources_are_read_in_whatever_form_they_are_written(form):
    model = Model.parse(START + form)
    assert model.random_force == {"wheel": DRIVE}
    assert model.sensor_error == {"theta_p": PITCH}


@pytest.mark.parametrize("form", FORMS)
def test_random_sources_are_replaced_in_whatever_form_they_are_written(form):
    forces = {"wheel": RandomForce(0.5, 0.2), "body": RandomForce(0.1, 0.01, "drive")}
    model = Model.parse(START + form).with_random_sources(forces, {"theta_w": SensorNoise(1e-5, 0.1)})
    assert model.random_force == forces
    assert model.sensor_error == {"theta_w": SensorNoise(1e-5, 0.1)}


@pytest.mark.parametrize("form", FORMS)
def test_without_random_sources_their_tables_go(form):
    model = Model.parse(START + form).with_random_sources({}, {})
    assert not model.random_force and not model.sensor_error
    assert "rms" not in model.dump()


def test_an_edit_keeps_comments_and_the_rest_of_the_file():
    before = Model.default()
    after = Model.parse(before.dump() + TABLES).with_random_sources({"wheel": RandomForce(0.5, 0.2)}, {})
    assert after.dump().startswith(before.dump())
    assert "[random_force.wheel]   # rough ground\nrms = 0.5             # V\ncorrelation_time = 0.2\n" in after.dump()


def test_storing_a_force_and_removing_it_gives_the_first_file_back():
    model = Model.default()
    stored = model.with_random_sources({"wheel": DRIVE, "body": DRIVE}, {"theta_p": PITCH})
    assert stored.random_force == {"wheel": DRIVE, "body": DRIVE}
    assert stored.with_random_sources({}, {}).dump() == model.dump()


def test_a_change_of_effects_drops_what_was_left_to_chance_without_it():
    model = Model.default().with_random_sources({"wheel": DRIVE}, {"theta_p": PITCH})
    added = model.with_effects(["coulomb_drive"])
    assert not added.random_force and not added.sensor_error
    assert model.with_effects([]).random_force == {"wheel": DRIVE}


def test_a_fit_leaves_windows_line_ends():
    model = Model.parse((START + TABLES).replace("\n", "\r\n"))
    text = model.with_random_sources({"body": RandomForce(0.1, 0.1)}, {}).dump()
    assert text.count("\n") == text.count("\r\n")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "random_force.wheel]",
            "random_force.wheels]",
            "No row named 'wheels' in [random_force]. Known rows: wheel, body",
        ),
        ("sensor_error.theta_p]", "sensor_error.theta]", "No channel named 'theta' in [sensor_error]"),
        (
            'place = "drive"',
            'place = "body"',
            "No place named 'body' in [random_force.wheel]. Known places: wheel, drive",
        ),
        ("rms = 0.21", "rms = -0.21", "random_force.wheel.rms: must be at least 0, not -0.21"),
        ("rms = 0.21", "rms = nan", "random_force.wheel.rms: must be a finite number"),
        ("rms = 0.21", 'rms = "large"', "random_force.wheel.rms: must be a number"),
        ("rms = 0.21", "rsm = 0.21", "Did you mean 'rms'?"),
        ("rms = 0.21 ", "# ", "random_force.wheel.rms is missing"),
        (
            "correlation_time = 0.12",
            "correlation_time = 0",
            "random_force.wheel.correlation_time: must be greater than 0",
        ),
        ("correlation_time = 0.3", "correlation_time = inf", "sensor_error.theta_p.correlation_time: must be a finite"),
        ("correlation_time = 0.3", "", "sensor_error.theta_p.correlation_time is missing"),
        ('place = "drive"', "place = 3", "random_force.wheel.place: must be text"),
    ],
)
def test_a_mistake_is_refused_in_words(old, new, says):
    assert TABLES.count(old)
    with pytest.raises(Failure) as caught:
        Model.parse(START + TABLES.replace(old, new, 1))
    assert says in str(caught.value)


@pytest.mark.parametrize("section", ["random_force", "sensor_error"])
@pytest.mark.parametrize("value", ["3", '"wheel"', "[]", "{ wheel = 3 }", "{ theta_p = [1] }"])
def test_what_is_no_table_is_refused(section, value):
    with pytest.raises(Failure, match=section):
        Model.parse(f"{START}{section} = {value}\n")


def test_random_text_is_read_or_refused_and_never_a_traceback():
    rng = random.Random(1)
    alphabet = string.ascii_letters + string.digits + '.=[]{}"\n# -_'
    for _ in range(300):
        text = list(START + TABLES)
        for _ in range(rng.randint(1, 6)):
            text[rng.randrange(len(text))] = rng.choice(alphabet)
        try:
            Model.parse("".join(text)).with_random_sources({"body": RandomForce(1.0, 0.1)}, {})
        except Failure:
            continue
