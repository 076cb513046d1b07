"""`wheelpend set`: entries of model.toml changed from the command line, or not at all."""

import pytest

from tests.support import run
from wheelpend import Model
from wheelpend.model import workspace
from wheelpend.model.toml_edits import with_entry
from wheelpend.model.toml_file import parse_toml

TEXT = """plant = "wheel_pendulum"  # mine
[sensors]  # of the robot
encoder = "absolute"   # what?

[columns]
# of the log
theta_p = { column = "p q", unit = "deg" }  # pitch
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A workspace, the current folder."""
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path, text=TEXT)
    return tmp_path


def test_an_entry_is_set_and_every_comment_stays(here):
    run("set", "columns.theta_p.sign=-1", "columns.theta_w.unit=deg")
    text = (here / "model.toml").read_text()
    assert 'theta_p = { column = "p q", unit = "deg", sign = -1 }  # pitch\n' in text
    assert all(comment in text for comment in ("# mine", "# of the robot", "# what?", "# of the log"))
    read = Model.open(here).columns
    assert (read["theta_p"].sign, read["theta_w"].column, read["theta_w"].unit) == (-1, "theta_w", "deg")


GUESSED_TEXT = """plant = "wheel_pendulum"

[columns]
theta_w = { column = "enc", scale = 0.001 }  # guessed: counts
t = { column = "ms", scale = 0.02 }  # guessed: rows
v_in = { column = "?" }  # not recognised: put one of a, b in its place
theta_p = { column = "tilt" }  # guessed: mine, and kept
"""


@pytest.mark.parametrize(
    "setting", ["theta_w.scale=0.002", "theta_w.scale=0.001", 'theta_w={ column = "e", scale = 2 }']
)
def test_what_is_set_is_marked_as_guessed_no_more(tmp_path, monkeypatch, setting):
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path, text=GUESSED_TEXT)
    run("set", "columns.theta_p.sign=-1", "columns.v_in.column=a", f"columns.{setting}")
    lines = (tmp_path / "model.toml").read_text().splitlines()
    marked = [line.split(" ")[0] for line in lines if "guessed" in line or "recognised" in line]
    assert marked == ["t", "theta_p"], "a sign says nothing of how a column was guessed to be read"
    assert not any(line.endswith(" ") or line.endswith("#") for line in lines)


SENSORS_TEXT = """plant = "wheel_pendulum"

[sensors]
encoder_counts = 1000  # guessed: with the scale of theta_w
pitch_noise = 0.01

[sensors.noise]
dtheta_p = 0.1  # measured

[sensors.step]
theta_p = 0.002

[columns]
theta_w = { column = "enc", scale = 0.001 }
theta_p = { column = "tilt" }
dtheta_p = { column = "gyro" }
"""


def test_what_is_stated_of_a_sensor_follows_the_unit_and_the_scale_of_its_column(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path, text=SENSORS_TEXT)
    told = run("set", "columns.theta_w.scale=0.002", "columns.dtheta_p.unit=deg/s").output
    sensors = Model.open(tmp_path).sensors
    assert sensors.of_plant["encoder_counts"] == 500 and sensors.noise == {"dtheta_p": 0.00174533}
    assert (sensors.step, sensors.of_plant["pitch_noise"]) == ({"theta_p": 0.002}, 0.01), "their column is as it was"
    assert "sensors.encoder_counts" in told and "sensors.noise.dtheta_p" in told
    assert "dtheta_p = 0.00174533  # measured" in (tmp_path / "model.toml").read_text()


def test_what_is_stated_of_a_sensor_beside_its_columns_scale_stays_as_it_is_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path, text=SENSORS_TEXT)
    run("set", "columns.theta_p.scale=2", "sensors.step.theta_p=0.003", "sensors.pitch_noise=auto")
    sensors = Model.open(tmp_path).sensors
    assert (sensors.step["theta_p"], sensors.of_plant["pitch_noise"]) == (0.003, "auto")


@pytest.mark.parametrize(
    ("setting", "step"),
    [
        ("columns.theta_p.scale=0.5", 0.001),
        ("columns.theta_p.scale=", 0.002),  # it had none
        ("columns.theta_p.sign=-1", 0.002),
        ("columns.theta_p.column=other columns.theta_p.scale=7", 0.002),  # another sensor
    ],
)
def test_a_step_follows_a_scale_alone(tmp_path, monkeypatch, setting, step):
    monkeypatch.chdir(tmp_path)
    scale = ", scale = 1.0" if setting.endswith("scale=") else ""
    text = SENSORS_TEXT.replace('{ column = "tilt" }', '{ column = "tilt"' + scale + " }")
    workspace.create(tmp_path, text=text.replace("1000  # guessed: with the scale of theta_w", "1000"))
    run("set", *setting.split(" "), "columns.theta_w.unit=deg")
    sensors = Model.open(tmp_path).sensors
    assert sensors.step == {"theta_p": step} and sensors.of_plant["encoder_counts"] == 1000, "as its data sheet says"


def test_the_step_of_a_place_is_none_of_a_speed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tables = '[sensors]\nnoise = { x = 0.1 }\nstep = { x = 0.1122 }\n\n[columns]\nx = { column = "y" }\n'
    workspace.create(tmp_path, text=f'plant = "slide"\n{tables}')
    said = run("set", "columns.x.unit=m/s").output
    sensors = Model.open(tmp_path).sensors
    assert sensors.step == {} and "x" not in sensors.noise and "sensors.step.x" in said
    run("set", "sensors.step.x=0.01")
    run("set", "columns.x.unit=cm/s")
    assert Model.open(tmp_path).sensors.step == {"x": pytest.approx(0.0001)}


def test_a_step_in_whole_numbers_becomes_what_it_is_and_what_is_taken_out_is_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    columns = 'x = { column = "a", scale = 0.001 }'
    workspace.create(tmp_path, text=f'plant = "slide"\n[sensors.step]\nx = 1\n\n[columns]\n{columns}\n')
    run("set", "columns.x.scale=0.0002")
    assert Model.open(tmp_path).sensors.step == {"x": 0.2}
    run("set", "columns.x.scale=")
    assert Model.open(tmp_path).sensors.step == {"x": 1000.0}


def test_a_unit_of_another_kind_is_corrected(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path, text=TEXT.replace('unit = "deg"', 'unit = "V"'))
    run("set", "columns.theta_p.unit=rad")
    assert Model.open(tmp_path).columns["theta_p"].unit == "rad"


def test_nothing_behind_the_sign_takes_the_entry_out(here):
    run("set", "columns.theta_p.unit=")
    assert Model.open(here).columns["theta_p"].unit == ""
    run("set", "columns.theta_p=")
    assert "theta_p" not in Model.open(here).columns


def test_a_whole_entry_is_set_as_a_table_and_keeps_its_comment(here):
    run("set", 'columns.theta_p={ column = "r", sign = -1 }', 'columns.theta_w={ column = "w" }')
    text = (here / "model.toml").read_text()
    assert 'theta_p = { column = "r", sign = -1 }  # pitch\ntheta_w = { column = "w" }\n' in text
    run("set", "sensors.noise={ theta_w = 0.1 }")
    assert Model.open(here).sensors.noise == {"theta_w": 0.1}


def test_generated_code_follows_where_the_equations_change_and_is_left_alone_where_not(here):
    stamps = [p.stat().st_mtime_ns for p in sorted((here / "generated").iterdir())]
    run("set", "columns.theta_p.sign=-1")
    assert stamps == [p.stat().st_mtime_ns for p in sorted((here / "generated").iterdir())]
    assert "regenerated" in run("set", "sensors.encoder=relative").output
    run("generate", "--check")
    assert Model.open(here).assumptions["encoder"] == "relative"


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("columns.theta_p.sign=2", "columns.theta_p.sign: must be 1 or -1, not 2"),
        ("columns.theta_p.unit=degs", "Did you mean 'deg/s'?"),
        ("columns.theta_p.unit=V", "must have a unit that turns into rad (rad, mrad, deg, rev), not 'V'"),
        ("columns.thetap.sign=1", "Did you mean 'theta_p'?"),
        ("columns.theta_p.column=", "columns.theta_p.column is missing"),
        ("columns.theta_p=3", "Name one of them: columns.theta_p.column=VALUE"),
        ("columns.theta_p.unit={ a = 1 }", "No unit named"),
        ("sensors.noise.theta_p={ a = 1 }", "must be one value, not a table"),
        ("sensors.encoder.kind=3", "Set sensors.encoder itself"),
        ("sensors.encoder=turned", "must be 'absolute' or 'relative', not 'turned'"),
        ("sensors.pitch_noise=nan", "sensors.pitch_noise: must be a finite number"),
        ("sensors.noise.theta_w=", "must be there to be taken away, but model.toml has no sensors.noise.theta_w"),
        ("effects=slope", "wheelpend add EFFECT"),
        ("effect.coulomb_drive.torque=0.3", "wheelpend identify LOG --save"),
        ("plant=slide", "wheelpend new FOLDER --plant NAME"),
        ("column.theta_p.sign=1", "Did you mean 'columns'?"),
        ("columns.theta_p.sign", "must be KEY=VALUE"),
        ("columns.theta p.sign=1", "must be SECTION.NAME or SECTION.NAME.KEY"),
    ],
)
def test_what_cannot_be_is_refused_in_words_and_nothing_is_written(here, setting, said):
    before = (here / "model.toml").read_bytes()
    result = run("set", "columns.theta_w.sign=-1", setting, code=1)
    assert said in " ".join(result.output.split())
    assert (here / "model.toml").read_bytes() == before


@pytest.mark.parametrize("column", ["1e5", "true", "[1]", 'a "b" = c', "<b>ü</b>", "a\nb\n[sensors]", "\x1b[31m"])
def test_a_column_may_be_called_anything(here, column):
    run("set", f"columns.theta_w.column={column}")
    assert Model.open(here).columns["theta_w"].column == column


def test_one_setting_twice_is_refused_and_one_that_holds_already_changes_nothing(here):
    assert "is there twice" in run("set", "sensors.encoder=absolute", "sensors.encoder=relative", code=1).output
    before = (here / "model.toml").stat().st_mtime_ns
    assert "Nothing to change" in " ".join(run("set", "sensors.encoder=absolute").output.split())
    assert (here / "model.toml").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "text",
    [
        "",
        "columns = { a = { column = 'x' } }  # c\n",
        "[columns]  # c\na = { column = 'x' }",
        "[columns]\r\na = { column = 'x' }  # c\r\n",
        "[columns]\na.column = 'x'  # c\n",
        "[columns.a]\ncolumn = 'x'  # c\n\n[sensors]\nk = 1\n",
        "columns.a.column = 'x'  # c\n",
    ],
)
@pytest.mark.parametrize("place", [("columns", "a", "sign"), ("columns", "b", "sign"), ("constants", "g")])
def test_every_form_of_a_table_takes_an_entry_and_gives_it_back(text, place):
    there = parse_toml(text)
    written = with_entry(text, place, -1)
    found = parse_toml(written)
    for key in place:
        found = found[key]
    assert found == -1 and ("# c" in written or "# c" not in text)
    back = parse_toml(with_entry(written, place, None))
    assert back.get("columns", {}).get("a", {}) == there.get("columns", {}).get("a", {})
    assert place[-1] not in back.get(place[0], {}).get(place[1], {}) if len(place) == 3 else back.get("constants") == {}


@pytest.mark.parametrize("entry", ['theta_p = { column = "theta_p" }', ""], ids=["an entry of its own name", "none"])
def test_a_stated_noise_follows_a_unit_whether_its_column_has_an_entry_or_not(tmp_path, monkeypatch, entry):
    monkeypatch.chdir(tmp_path)
    text = f'plant = "wheel_pendulum"\n[sensors]\npitch_noise = 0.1\n[columns]\n{entry}\n'
    workspace.create(tmp_path, text=text)
    run("set", "columns.theta_p.unit=deg")
    assert Model.open(tmp_path).sensors.of_plant["pitch_noise"] == pytest.approx(0.00174533, rel=1e-5)
    run("set", "columns.theta_p=")  # all of it taken out: rad again
    assert Model.open(tmp_path).sensors.of_plant["pitch_noise"] == pytest.approx(0.1, rel=1e-5)
