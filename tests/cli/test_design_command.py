"""`wheelpend design` as a user types it."""

import json

import pytest

from tests.support import run, simulated
from wheelpend import Model, save_log


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Model.default().save(tmp_path / "model.toml")
    return tmp_path


def test_what_design_writes_simulate_plays(workspace):
    found = json.loads(run("design", "--between", "slope,com_offset", "--duration", 4, "--sample", 0.004, "-o", "d.csv",
                           "--json", "-").stdout)  # fmt: skip
    assert (found["schema"], found["between"], found["file"]) == (1, ["slope", "com_offset"], "d.csv")
    assert found["separation"]["designed"] >= found["separation"]["builtin"]
    assert (workspace / "d.csv").read_text().splitlines()[0] == "t,theta_ref,dtheta_ref"
    run("simulate", "-o", "log.csv", "--command", "d.csv")
    assert len((workspace / "log.csv").read_text().splitlines()) == 4002


def test_without_a_log_the_logs_of_the_last_change_are_used(workspace, monkeypatch):
    save_log(workspace / "log.csv", simulated("simple", seed=1, duration=5.0))
    (workspace / "history.json").write_text(
        '[{"change": "add slope", "logs": ["log.csv"]}, {"change": "remove slope"}]'
    )
    said = run("design", "--between", "slope,com_offset", "--duration", 2, "--sample", 0.01)
    found = said.stdout
    assert "wheelpend simulate -o log.csv --command designed.csv" in said.stderr  # the next step
    assert "Beside log.csv" in found and "does not show in the logs" in found


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--between", "slope,com_ofset"), "Did you mean 'com_offset'?"),
        (("--between", "slope"), "two different effects"),
        (("--between", "viscous_drive,slope"), "is part of X6, X7"),
        (("--between", "com_offset,imu_bias"), "Turn the pitch sensor round"),
        (("--between", "coulomb_drive,stribeck_drive"), "--between stribeck_drive,coulomb_drive"),
        (("--voltage-limit", 2), "standing still alone takes"),
        (("--pitch-limit", 20), "between 0 and π/2"),
        (("--duration", 0.5), "2 to 600 s"),
        (("-o", "x.parquet"), "must end in .csv"),
    ],
)
def test_what_cannot_be_designed_is_refused_with_a_cure(workspace, arguments, said):
    assert said in run("design", *arguments, "--json", "-", code=1).output


def test_a_model_without_values_needs_a_log(workspace):
    text = Model.default().text
    start, end = text.index("[parameters]"), text.index("[sensors]")
    (workspace / "model.toml").write_text(text[:start] + text[end : text.index("[simulation]")])
    assert "give a LOG to fit" in run("design", code=1).output
