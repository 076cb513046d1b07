"""A log's signals beside how each is read: faults are cured by a click, and what is chosen is what is read."""

import json
import subprocess
import sys

import numpy as np
import polars as pl
import pytest

from tests.support import ROOT, run
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving
from wheelpend import Model
from wheelpend.inspection.inspect import inspect_file
from wheelpend.model.settings import Setting, with_settings
from wheelpend.view.corrections import changed, cures, setting_words, settings_of

FAULTS = {  # kind: (what is done to the log, the settings that cure it)
    "wrong_unit": (pl.col("theta_p").degrees(), {"columns.theta_p.unit": "deg"}),
    "flipped_sign": (-pl.col("dtheta_p"), {"columns.dtheta_p.sign": -1}),
    "relative_encoder": (pl.col("theta_w") - pl.col("theta_p"), {"sensors.encoder": "relative"}),
}


def faulty(path, *kinds):
    """The demo's log with faults."""
    pl.read_csv(ROOT / "data" / "demo.csv").with_columns([FAULTS[kind][0] for kind in kinds]).write_csv(path)
    return path


@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_says_what_set_takes_and_that_cures_it(kind, tmp_path):
    model, path = Model.default(), faulty(tmp_path / "log.csv", kind)
    (finding,) = inspect_file(model, path)[1].findings
    assert (finding.kind, finding.settings) == (kind, FAULTS[kind][1])
    cured = with_settings(model, [Setting.parse(words) for words in setting_words(finding.settings)])
    assert inspect_file(cured, path)[1].findings == ()


def test_a_sign_that_the_model_turned_wrongly_is_turned_back(tmp_path):
    model = with_settings(Model.default(), [Setting.parse("columns.dtheta_p.sign=-1")])
    (finding,) = inspect_file(model, ROOT / "data" / "demo.csv")[1].findings
    assert finding.settings == {"columns.dtheta_p.sign": 1}


def test_a_stretch_that_stands_still_has_no_setting(tmp_path):
    table = pl.read_csv(ROOT / "data" / "demo.csv").filter((pl.col("t") < 4.0) | (pl.col("t") > 5.0))
    table.write_csv(tmp_path / "gap.csv")
    findings = inspect_file(Model.default(), tmp_path / "gap.csv")[1].findings
    assert [(f.kind, f.settings) for f in findings] == [("gap", {})]


def test_a_column_that_was_guessed_is_not_stated_yet(here):
    table = pl.read_csv(ROOT / "data" / "demo.csv").rename({"theta_p": "pitch_deg"})
    table.with_columns(pl.col("pitch_deg").degrees()).write_csv(here / "log.csv")
    told = {q["name"]: q for q in readings(here, here / "log.csv")[0]["quantities"]}
    guessed = told["theta_p"]
    assert guessed["is_guessed"] and (guessed["column"], guessed["unit"]) == ("pitch_deg", "deg")
    assert (guessed["stated"]["column"], guessed["stated"]["unit"]) == ("theta_p", "")
    assert not told["theta_w"]["is_guessed"]


def test_settings_are_words_and_only_what_was_changed_is_set():
    assert setting_words({"a.b": None, "a.c": -1, "a.d": 0.5, "a.e": "x y"}) == ("a.b=", "a.c=-1", "a.d=0.5", "a.e=x y")
    assert changed({"a.b": "1.0", "a.c": None, "a.d": 2}, {"a.b": 1.0, "a.c": "deg", "a.d": 2}) == {"a.c": None}
    assert settings_of("[sensors.noise]\nx = 0.1\n[columns]\nx = { sign = -1 }") == {
        "sensors.noise.x": 0.1,
        "columns.x.sign": -1,
    }
    proposal = '[columns]\nx = { column = "x", unit = "deg" }\ny = { column = "z" }'
    assert cures([], proposal) == {"columns.x.unit": "deg", "columns.y.column": "z"}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A workspace, the current folder."""
    monkeypatch.chdir(tmp_path)
    run("new", ".")
    return tmp_path


def readings(folder, log):
    """What the process says of a log, and the series that it wrote."""
    command = [sys.executable, "-m", "wheelpend.view.readings", log, "--json", "told.json"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (told,) = json.loads((folder / "told.json").read_text())["logs"]
    return told, np.load(folder / told["file"])


def test_signals_are_drawn_as_they_are_read_and_as_they_are_where_no_model_reads_them(here):
    log = faulty(here / "log.csv", "wrong_unit")
    run("set", "columns.theta_p.unit=deg")
    told, series = readings(here, log)
    assert told["channels"] == ["v_in", "theta_w", "theta_p", "dtheta_p", "theta_ref"] and not told["refusal"]
    assert series.shape == (20001, 6) and 0.2 < np.abs(series[:, 3]).max() < 0.5  # rad
    pl.read_csv(log).rename({"theta_p": "<b>", "dtheta_p": "c", "theta_w": "d"}).write_csv(here / "odd.csv")
    told, series = readings(here, here / "odd.csv")
    assert "theta_w" in told["refusal"] and told["channels"] == ["v_in", "d", "<b>", "c", "theta_ref"]
    assert 10 < np.abs(series[:, 3]).max() < 30 and "<b>" in told["columns"]
    (here / "model.toml").unlink()
    told, series = readings(here, here / "odd.csv")
    assert not told["refusal"] and "quantities" not in told and series.shape == (20001, 6)


def test_a_place_may_have_the_unit_of_its_speed_and_a_pitch_none(here):
    units = {q["name"]: q["units"] for q in readings(here, faulty(here / "log.csv", "wrong_unit"))[0]["quantities"]}
    assert {"rad", "deg", "rpm", "rad/s"} <= set(units["theta_w"]) and "m/s" not in units["theta_w"]
    assert "rpm" not in units["theta_p"]


@needs_nicegui
@needs_browser
@pytest.mark.slow
@pytest.mark.extras
def test_a_click_cures_a_fault_and_only_then_noise_can_be_stated(here):
    log = faulty(here / "log.csv", "wrong_unit", "flipped_sign")
    with serving(here, log) as (address, _), browsing(address) as (window,):
        window.press("Inspect the log")
        window.until(lambda: "it looks like degrees" in window.panel("open"), "the fault")
        assert "State noise" not in window.panel("open")  # it would be in degrees
        window.press("Set columns.theta_p.unit=deg")
        window.until(lambda: "degrees" not in window.panel("open"), "the cure of the unit")
        window.press("Set columns.dtheta_p.sign=-1")
        window.until(lambda: "Nothing is wrong with the log." in window.panel("open"), "the cure of the sign")
        window.press("State noise and steps as this log shows them")
        window.until(lambda: "State noise" not in window.panel("open"), "that the noise is stated")
        assert "wheelpend set columns.dtheta_p.sign=-1" in window.text_of("commands")
        window.press("Read it so")
        window.until(lambda: "states this already" in window.driver.page_source, "that nothing is to be done")
        assert max(window.shot(here / f"{width}.png", width) for width in (1280, 420)) <= 0, "nothing sticks out"
        assert window.complaints() == []
    assert Model.open(here).sensors.of_plant["pitch_noise"] == pytest.approx(0.0087, rel=0.1)
    columns = Model.open(here).columns
    assert (columns["theta_p"].unit, columns["dtheta_p"].sign) == ("deg", -1)
