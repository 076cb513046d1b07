"""Every option of a command reaches what it is for."""

import json
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import wheelpend
from tests.support import run, simulated
from wheelpend import Failure, Model, load_log, save_log
from wheelpend.cli import change
from wheelpend.model import workspace as folders
from wheelpend.serialise import plain_data
from wheelpend.simulation.hidden import parse_hidden


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(Model.default().text, encoding="utf-8")
    for seed in (0, 1):
        save_log(tmp_path / f"log{seed}.csv", simulated(duration=4.0, seed=seed))
    return tmp_path


class Enough(Failure):
    """What stops a command once it has been seen what it asks for."""


def asked_of_prepare(monkeypatch, *command):
    """The logs, the held-out logs and the options with which a command prepares its data, each time."""
    seen = []

    def stop(model, logs, holdout=(), **options):
        seen.append(([str(p) for p in logs], [str(p) for p in holdout], options))
        if holdout or command[0] != "compare":
            raise Enough("Enough.")
        return prepare(model, logs, **options)

    from wheelpend.estimation.data import prepare

    for room in ("stepwise", "explain", "change", "compare"):
        monkeypatch.setattr(f"wheelpend.diagnosis.{room}.prepare", stop)
    assert "Enough" in str(run(*command, code=1).stderr)
    return seen


@pytest.mark.parametrize(
    "command",
    [("diagnose", "log0.csv"), ("explain", "log0.csv"), ("compare", "log0.csv"), ("report", "log0.csv"),
     ("add", "slope", "--data", "log0.csv"), ("remove", "slope", "--data", "log0.csv"),
     ("add", "slope", "log0.csv"), ("remove", "slope", "log0.csv")],
    ids=" ".join,
)  # fmt: skip
def test_held_out_logs_are_held_out_by_every_command(command, workspace, monkeypatch):
    if command[0] == "remove":
        Model.open().with_effects(["slope"]).save()
    seen = asked_of_prepare(monkeypatch, *command, "--holdout", "log1.csv")
    assert seen[-1][:2] == (["log0.csv"], ["log1.csv"])


@pytest.mark.parametrize("command", ["diagnose", "explain"])
def test_an_effect_that_is_left_out_is_left_out_of_the_problem(command, workspace, monkeypatch):
    seen = asked_of_prepare(monkeypatch, command, "log0.csv", "--without", "slope", "--without", "slosh")
    assert list(seen[0][2]["without"]) == ["slope", "slosh"]


def test_a_seed_draws_another_noise_and_the_same_seed_the_same(workspace):
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        run("simulate", "-o", f"{name}.csv", "--duration", 1, "--seed", seed)
    a, b, c = (load_log(f"{name}.csv").measured for name in "abc")
    assert np.array_equal(a, b) and not np.array_equal(a, c)
    assert np.std(a[:, 1] - simulated(duration=1.0, seed=3).measured[:, 1]) < 1e-6


def test_a_command_a_duration_and_ideal_sensors_are_taken(workspace):
    run("simulate", "-o", "a.csv", "--duration", 1.5, "--command", "simple", "--no-noise", "--hide", "slope=0.01")
    exact = simulated("simple", duration=1.5, noise=False, slope__angle=0.01)
    assert np.abs(load_log("a.csv").measured - exact.measured).max() < 1e-6


def identified(*options):
    return json.loads(run("identify", "log0.csv", "--json", "-", *options).stdout)


def test_a_forgetting_factor_a_hold_and_time_constants_change_the_answer(workspace):
    plain = identified("--method", "recursive", "--tau", "0.14,0.18")
    assert (plain["forgetting"], plain["hold"], plain["tau"]) == (1.0, "zero", [0.14, 0.18])
    for option, value, kept in (
        ("forgetting", "0.999", 0.999),
        ("hold", "first", "first"),
        ("tau", "0.2,0.3", [0.2, 0.3]),
    ):
        other = identified("--method", "recursive", "--tau", "0.14,0.18", f"--{option}", value)
        assert other[option] == kept
        assert abs(other["parameters"]["X5"]["value"] / plain["parameters"]["X5"]["value"] - 1.0) > 1e-6


def test_identify_keeps_nothing_without_being_asked_to(workspace):
    before = (workspace / "model.toml").read_bytes()
    found = identified("--method", "inverse")["parameters"]["X6"]["value"]
    assert (workspace / "model.toml").read_bytes() == before
    identified("--method", "inverse", "--save")
    assert Model.open().parameters["X6"].identified == pytest.approx(found)


def test_an_explanation_that_is_saved_lists_its_steps_in_the_history(workspace, capsys):
    opened = Model.open()
    model = opened.with_effects(["slope", "coulomb_drive"])
    steps = [SimpleNamespace(effect=e, error_before=b, error_after=a)
             for e, b, a in (("slope", 9.0, 3.0), ("coulomb_drive", 3.0, 1.0))]  # fmt: skip
    result = SimpleNamespace(model=model, steps=steps)
    said = change.save_explanation(result, [Path("log0.csv")], [Path("log1.csv")], opened)
    assert said == "Saved model.toml and regenerated its kernels."
    entries = folders.history(workspace)
    assert [date.fromisoformat(entry.pop("date")).year >= 2026 for entry in entries] == [True, True]
    assert [entry.pop("parameters") for entry in entries] == [{}, model.estimates()]  # those of the final model
    assert entries == [
        {"change": "add slope", "error_before": 9.0, "error_after": 3.0, "logs": ["log0.csv", "log1.csv"]},
        {"change": "add coulomb_drive", "error_before": 3.0, "error_after": 1.0, "logs": ["log0.csv", "log1.csv"]},
    ]
    assert Model.open().effects == ("slope", "coulomb_drive")
    run("generate", "--check")


def test_logs_are_recorded_as_typed_in_the_workspace_and_whole_from_elsewhere(tmp_path, monkeypatch):
    (tmp_path / "robot").mkdir()
    (tmp_path / "elsewhere").mkdir()
    model = SimpleNamespace(workspace=tmp_path / "robot")
    monkeypatch.chdir(tmp_path / "robot")
    assert change.recorded(model, [Path("a.csv")]) == (Path("a.csv"),)
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert change.recorded(model, [Path("a.csv")]) == (tmp_path / "elsewhere" / "a.csv",)


def test_a_change_is_in_the_history_with_its_logs_and_errors():
    step = SimpleNamespace(error_before=2.0, error_after=float("inf"))
    fitted = Model.default().with_fit({"X1": (0.04, 0.001)})
    changed = SimpleNamespace(step=step, model=fitted)
    entry = plain_data(change.history_entry("slope", True, changed, [Path("a.csv")]))
    assert entry.pop("parameters")["X1"] == {"value": 0.04, "sigma": 0.001}
    assert entry == {"change": "remove slope", "error_before": 2.0, "error_after": None, "logs": ["a.csv"]}
    bare = plain_data(change.history_entry("slope", False, None, []))
    assert bare == {"change": "add slope", "error_before": None, "error_after": None, "logs": [], "parameters": {}}


@pytest.mark.parametrize(
    ("text", "hidden"),
    [
        ("slope=0.02", {"slope.angle": 0.02}),
        ("slope=angle:-0.02", {"slope.angle": -0.02}),
        ("cogging=sine:1,cosine:-2,periods:12", {"cogging.sine": 1.0, "cogging.cosine": -2.0, "cogging.periods": 12.0}),
    ],
)  # fmt: skip
def test_a_hidden_effect_has_the_sizes_that_were_typed(text, hidden):
    assert parse_hidden([text]) == hidden


@pytest.mark.parametrize("text", ["slope", "slope=steep", "slope=tilt:1", "slope=nan", "cogging=sine:0.1", "hill=1"])
def test_a_hidden_effect_without_its_sizes_is_refused(text):
    with pytest.raises(Failure):
        parse_hidden([text])


def test_the_version_is_said():
    assert run("--version").stdout.strip() == f"wheelpend {wheelpend.__version__}"
