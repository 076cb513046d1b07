"""What inspection proposes becomes settings, a click cures a fault, and what a user chooses is what is read."""

import json
import subprocess
import sys
import tomllib

import numpy as np
import polars as pl
import pytest

from tests.support import ROOT
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving
from wheelpend.logs.columns import ColumnMap
from wheelpend.model.record import Model
from wheelpend.model.settings import Setting, with_settings
from wheelpend.view.corrections import changed_settings, cures_of, proposed_settings

PROPOSAL = """\
[columns]
theta_p = { column = "pitch \\"x\\"", unit = "deg", scale = 0.5, sign = -1 }

[sensors]
encoder = "relative"

[sensors.noise]
theta_p = 0.01
"""


def test_a_proposal_as_settings_makes_just_the_entries_that_it_proposes():
    settings = proposed_settings(PROPOSAL)
    assert list(settings) == ["columns.theta_p", "sensors.encoder", "sensors.noise.theta_p"]
    made = tomllib.loads(with_settings(Model.default(), list(map(Setting.parse, settings.values()))).text)
    wanted = tomllib.loads(PROPOSAL)
    assert made["columns"] == wanted["columns"]
    assert made["sensors"]["encoder"] == "relative" and made["sensors"]["noise"] == {"theta_p": 0.01}


def test_a_fault_is_cured_by_its_own_channels_alone():
    settings = proposed_settings(PROPOSAL)
    assert cures_of({"kind": "flipped_sign", "channel": "theta_p"}, settings) == [settings["columns.theta_p"]]
    assert cures_of({"kind": "relative_encoder", "channel": "theta_w"}, settings) == [settings["sensors.encoder"]]
    assert cures_of({"kind": "gap", "channel": "t"}, settings) == []
    assert len(cures_of({"kind": "swapped_channels", "channel": "theta_p and dtheta_p"}, settings)) == 1


def test_only_what_is_chosen_otherwise_than_the_model_file_says_becomes_a_setting():
    stated = {"theta_p": ColumnMap("pitch", "deg"), "theta_w": ColumnMap("w", offset=1.0)}
    assert changed_settings(dict(stated), stated) == []
    chosen = {"theta_p": ColumnMap("theta_p"), "theta_w": ColumnMap("w", sign=-1, scale=2.0, offset=1.0)}
    gone, turned = changed_settings(chosen, stated)
    assert gone == "columns.theta_p="
    entry = tomllib.loads(f"x = {turned.partition('=')[2]}")["x"]
    assert entry == {"column": "w", "sign": -1, "scale": 2.0, "offset": 1.0}
    assert changed_settings({"v_in": ColumnMap("v_in")}, {}) == []


@pytest.fixture
def odd_workspace(tmp_path):
    """A workspace and a log of the demo whose pitch is in degrees, the other way round, under another name."""
    table = pl.read_csv(ROOT / "data" / "demo.csv")
    table = table.with_columns((-np.degrees(table["theta_p"])).alias("lean angle")).drop("theta_p")
    table.write_csv(tmp_path / "odd.csv")
    for words in (["new", "."], ["set", "columns.theta_p.column=lean angle"]):
        subprocess.run([sys.executable, "-m", "wheelpend", *words], cwd=tmp_path, capture_output=True, check=True)
    return tmp_path


def test_the_signals_are_written_as_they_are_read_with_how_that_is(odd_workspace):
    def asked():
        command = [sys.executable, "-m", "wheelpend.view.signals", "odd.csv", "--json", "told.json"]
        subprocess.run(command, cwd=odd_workspace, check=True, capture_output=True)
        return json.loads((odd_workspace / "told.json").read_text()), np.load(odd_workspace / "signals.npy")

    told, series = asked()
    assert told["logs"][0]["names"] == ["v_in", "theta_w", "theta_p", "dtheta_p"] and series.shape[1] == 5
    assert told["maps"]["theta_p"]["column"] == "lean angle" and not told["maps"]["theta_p"]["guessed"]
    assert "lean angle" in told["columns"] and 10.0 < np.abs(series[:, 3]).max() < 40.0  # degrees, read as rad
    (odd_workspace / "model.toml").unlink()
    assert asked()[0]["maps"]["theta_p"]["unit"] == "deg"  # as inspection proposes it


@needs_nicegui
@needs_browser
@pytest.mark.slow
def test_a_click_cures_a_fault_and_the_comments_of_the_model_file_stay(odd_workspace):
    model = odd_workspace / "model.toml"
    before = model.read_text()
    with serving(odd_workspace, "odd.csv") as (address, _), browsing(address) as (window,):
        window.press("Inspect the log")
        window.until(lambda: "it looks like degrees" in window.panel("open"), "the fault")
        window.press("Cure theta_p")
        window.until(lambda: "Nothing is wrong with the log." in window.panel("open"), "the cure")
        assert "wheelpend set 'columns.theta_p=" in window.panel("go_on")
        assert window.complaints() == []
    after = model.read_text()
    entry = tomllib.loads(after)["columns"]["theta_p"]
    assert entry == {"column": "lean angle", "unit": "deg", "sign": -1}
    kept = [line for line in before.splitlines() if "lean angle" not in line]
    assert [line for line in after.splitlines() if "lean angle" not in line] == kept and len(kept) > 50
