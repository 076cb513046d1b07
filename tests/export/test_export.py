"""`wheelpend export`: files with a ledger, which replace none that somebody else wrote."""

import json
import shutil

import numpy as np
import pytest
import sympy as sp

from tests.export.exporting import interpreted, model_with
from tests.support import run, simulated
from wheelpend import identify, save_log, simulate
from wheelpend.errors import Failure
from wheelpend.export.c_replay import replay_in_c
from wheelpend.export.compensation import compensation_of, lowered
from wheelpend.export.export import export_model, write_export
from wheelpend.export.exported_model import exported_model
from wheelpend.export.javascript_replay import replay_in_javascript
from wheelpend.export.json_target import json_files
from wheelpend.model import workspace
from wheelpend.model.record import Model


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A workspace with friction in its model, and a log of it."""
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path)
    model_with("coulomb_drive").save(tmp_path / "model.toml")
    save_log(tmp_path / "log.csv", simulated(duration=2.0, seed=1, coulomb_drive__torque=0.3))
    return tmp_path


def test_the_ledger_names_every_effect_and_both_errors(here):
    made = json.loads(run("export", "c", "log.csv", "-o", "out", "--json", "-").output)
    assert made["schema"] == 1 and made["target"] == "c"
    assert made["effects"] == {"coulomb_drive": {"carried": "exactly", "note": ""}}
    assert json.loads((here / "out/EXPORT.json").read_text()) == made
    text = (here / "out/EXPORT.md").read_text()
    assert "Dry friction in motor and gearbox" in text and "exactly" in text
    assert set(made["files"]) == {
        "src/wheelpend_model.h", "src/wheelpend_model.c", "CMakeLists.txt", "library.properties",
        "examples/balance/balance.ino", "examples/desktop/balance.c",
    }  # fmt: skip
    if shutil.which("cc"):
        assert made["error_in_target"] == pytest.approx(made["error"], rel=1e-9)
        assert f"{made['error']:.4g} σ in the target (compiled with cc, in double precision)" in text


def test_what_cannot_run_here_is_said_and_not_guessed(here, monkeypatch):
    monkeypatch.setenv("PATH", "/nonexistent")
    monkeypatch.delenv("CC", raising=False)
    for target, missing in (("c", "no C compiler is installed here"), ("js", "Node.js is not installed here")):
        ledger = export_model(Model.open(), target, ["log.csv"]).ledger
        assert ledger.error_in_target is None and ledger.replayed == missing
        assert f"In the target: not known, {missing}." in ledger.text()


def test_the_model_as_numbers_has_units_errors_and_equations(here):
    run("export", "json")
    written = json.loads((here / "export-json/model.json").read_text())
    assert written["parameters"]["coulomb_drive.torque"] == {
        "value": 0.3, "sigma": pytest.approx(0.006), "unit": "V", "identified": True,
    }  # fmt: skip
    assert written["parameters"]["X5"]["unit"] == "V" and not any("missing" in n for n in written["parameters"])
    assert written["covariance"]["names"] == ["coulomb_drive.torque"]
    assert any("wheel row" in title for title in written["equations"])


def test_what_is_written_as_equations_accelerates_as_the_kernels_do():
    exported = exported_model(model_with("coulomb_drive", "voltage_dead_zone"))
    written = json.loads(json_files(exported)["model.json"])
    meant = {"Sign": sp.sign, "Magnitude": sp.Abs, "Ramp": lambda x: sp.Max(x, 0)}
    rates = dict(zip(written["states"], (0.3, 0.05, 0.4, -0.2), strict=True)) | {"v_in": 0.9}
    numbers = {n: p["value"] for n, p in written["parameters"].items()} | rates
    [surface] = written["dry_friction"]
    slip = np.dot([*surface["weights"].values()], [rates["dtheta_w"], rates["dtheta_p"]])
    numbers[surface["direction"]] = float(np.sign(slip))
    friction = sp.sympify(surface["law_sympy"], locals=meant)
    rows = [
        (sp.sympify(text, locals=meant) + surface["weights"][row] * friction)
        for row, text in written["equations_sympy"].items()
    ]
    known = {s: numbers[s.name] for row in rows for s in row.free_symbols if s.name in numbers}
    found = sp.solve([row.subs(known) for row in rows])
    expected = interpreted(exported.text).acceleration(
        0.0, np.array([0.3, 0.05, 0.4, -0.2]), 0.9, np.asarray(exported.parameters)
    )
    assert [float(v) for _, v in sorted(found.items(), key=lambda e: e[0].name, reverse=True)] == pytest.approx(
        expected
    )


def test_what_the_equations_do_not_hold_stands_beside_them():
    names = ("actuator_delay", "winding_inductance", "imu_bias", "imu_lag", "presliding_drive")
    written = json.loads(json_files(exported_model(model_with(*names)))["model.json"])
    assert written["input"]["delay"] == "actuator_delay.delay"
    assert written["input"]["lag"] == "winding_inductance.time_constant" and "v_in" in written["input"]["drive_sympy"]
    assert "imu_bias.bias" in written["sensors_sympy"]["theta_p"]
    assert written["sensor_delay"]["delay"] == "imu_lag.delay" and "theta_p" in written["sensor_delay"]["channels"]
    [force] = written["hysteresis"]
    assert "presliding_drive.stiffness" in force["law_sympy"]
    assert any(force["force"] in row for row in written["equations_sympy"].values())


def test_a_machine_that_nothing_drives_has_no_drive():
    written = json.loads(json_files(exported_model(model_with(plant="pendulum")))["model.json"])
    assert written["inputs"] == [] and written["input"] == {"delay": "", "lag": "", "drive_sympy": ""}


def test_a_log_gives_the_numbers_their_correlations(here):
    run("identify", "log.csv", "--save")
    run("export", "json", "log.csv")
    written = json.loads((here / "export-json/model.json").read_text())
    names, matrix = written["covariance"]["names"], np.array(written["covariance"]["matrix"], dtype=float)
    assert np.diag(matrix) == pytest.approx([written["parameters"][n]["sigma"] ** 2 for n in names])
    fitted = identify(Model.open(), "log.csv").covariance
    assert names == [n for n in fitted.names if n in names]
    own, expected = np.sqrt(np.diag(matrix)), np.sqrt(np.diag(fitted.matrix))
    assert matrix / np.outer(own, own) == pytest.approx(fitted.matrix / np.outer(expected, expected), abs=1e-6)
    assert np.abs(matrix[0, 1:]).max() > 0.0


def test_a_second_export_replaces_the_first_and_nothing_that_somebody_wrote(here):
    run("export", "js")
    run("export", "js")
    module = here / "export-js/wheelpend_model.mjs"
    module.write_text(module.read_text() + "// mine\n")
    said = " ".join(run("export", "js", code=1).output.split())
    assert "must not overwrite what it did not write" in said and "was changed since" in said
    assert module.read_text().endswith("// mine\n")
    (here / "mine").mkdir()
    (here / "mine/model.json").write_text("{}")
    said = " ".join(run("export", "json", "-o", "mine", code=1).output.split())
    assert "is none of its files" in said and (here / "mine/model.json").read_text() == "{}"
    (here / "other").mkdir()
    (here / "other/EXPORT.md").write_text("# mine")
    assert "EXPORT.md is there" in " ".join(run("export", "json", "-o", "other", code=1).output.split())


@pytest.mark.parametrize("ledger", ["", "[]", "{}", '{"files": 3}', '{"files": {"../model.toml": "0"}}', "[" * 9999])
def test_a_ledger_that_is_none_protects_what_is_there(here, ledger):
    (here / "out").mkdir()
    (here / "out/EXPORT.json").write_text(ledger)
    assert "must not overwrite" in " ".join(run("export", "json", "-o", "out", code=1).output.split())
    assert (here / "out/EXPORT.json").read_text() == ledger


@pytest.mark.parametrize(("line", "words"), [
    ("export matlab", "The target must be one of c, js, fmu, mujoco, json, not 'matlab'"),
    ("export jsn", "Did you mean"),
    ("export c --period 0", "--period must be the seconds between two samples"),
    ("export c --period nan", "--period must be the seconds between two samples"),
    ("export c -o log.csv", "log.csv is a file"),
    ("export c missing.csv", "missing.csv"),
])  # fmt: skip
def test_what_cannot_be_exported_is_refused_in_words(here, line, words):
    assert words in " ".join(run(*line.split(), code=1).output.split())


def test_a_model_without_values_is_not_exported():
    text = Model.default().dump()
    bare = Model.parse("\n".join(line for line in text.splitlines() if not line.startswith("X1")))
    with pytest.raises(Failure, match="X1 must have a value to be exported"):
        exported_model(bare)


@pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler")
def test_a_log_with_delays_gaps_and_jitter_is_replayed_as_we_predict_it(tmp_path):
    from wheelpend.export.replay import replay_of

    log = simulated(duration=3.0, seed=2, coulomb_drive__torque=0.3, actuator_delay__delay=0.0035)
    model = model_with("coulomb_drive", "actuator_delay")
    exported = exported_model(model, log)
    replay = replay_of(exported, model, log, (), lambda text: None)
    found, how = replay_in_c(exported, replay)
    assert found == pytest.approx(replay.error, rel=0.02) and "double" in how  # a delay cuts the steps elsewhere
    if shutil.which("node"):
        assert replay_in_javascript(exported, replay)[0] == pytest.approx(found, rel=1e-9)


def test_a_robot_is_sampled_as_its_log_is_unless_another_period_is_asked_for():
    log = simulate(Model.default(), duration=1.0, sample=0.005)
    assert exported_model(Model.default(), log).period == pytest.approx(0.005)
    assert exported_model(Model.default(), log, period=0.002).period == 0.002
    assert exported_model(Model.default()).period == 0.001


# -- the compensator


def compensated(model, wanted, speed, **state):
    exported = exported_model(model)
    kernels, c = interpreted(exported.text), compensation_of(exported)
    now = np.zeros(exported.size)
    now[2], now[4:] = speed, state.get("memory", 0.0)
    return kernels.compensate(0.0, wanted, now, c.forces, c.absent, c.maps, c.shares, c.least_slip, c.least_input)


def test_dry_friction_is_taken_away_by_less_than_it_is():
    friction = model_with("coulomb_drive").with_fit({"coulomb_drive.torque": (0.3, 0.02)})
    assert compensated(friction, 1.0, 2.0) == pytest.approx(1.26)
    assert compensated(friction, 1.0, -2.0) == pytest.approx(0.74)
    assert compensated(friction, 0.5, 0.0) == pytest.approx(0.76)  # at rest it acts against what is wanted
    assert compensated(friction, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert lowered(exported_model(friction), 7) == pytest.approx(0.26)


def test_a_coefficient_that_may_be_nothing_is_not_compensated():
    doubtful = model_with("coulomb_drive").with_fit({"coulomb_drive.torque": (0.3, 0.2)})
    assert compensated(doubtful, 1.0, 2.0) == pytest.approx(1.0)


def test_a_dead_zone_and_an_offset_are_turned_around():
    zone = model_with("voltage_dead_zone").with_fit({"voltage_dead_zone.threshold": (0.2, 0.01)})
    assert compensated(zone, 1.0, 0.0) == pytest.approx(1.18, abs=1e-9)
    assert compensated(zone, -1.0, 0.0) == pytest.approx(-1.18, abs=1e-9)
    offset = model_with("voltage_offset").with_fit({"voltage_offset.offset": (0.1, 0.01)})
    assert compensated(offset, 1.0, 0.0) == pytest.approx(0.92, abs=1e-9)


def test_a_force_with_a_memory_is_taken_away_as_the_observer_knows_it():
    bristles = model_with("presliding_drive").with_fit({"presliding_drive.torque": (0.3, 0.03)})
    assert compensated(bristles, 1.0, 2.0, memory=0.2) == pytest.approx(1.16)


def test_effects_that_no_command_can_act_against_are_left():
    assert compensation_of(exported_model(model_with("imu_bias"))) is None
    assert compensation_of(exported_model(model_with("voltage_saturation"))) is None


def test_an_export_into_a_folder_that_cannot_be_made_is_refused(here):
    (here / "file").write_text("")
    made = export_model(Model.open(), "json")
    with pytest.raises((Failure, OSError)):
        write_export(made, here / "file" / "deeper")
