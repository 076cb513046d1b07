"""The command line as a user types it."""

import io
import json
import re
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
import typer
from rich.console import Console

from tests.support import DATA, ROOT, SPARSE_S, app, run, simulated
from wheelpend import Model, save_log
from wheelpend.campaigns.summary import LargestDeviation, ParameterAgreement
from wheelpend.cli.next_step import (
    Asked,
    say_after_campaign,
    say_after_diagnosis,
    say_after_identification,
    say_after_report,
)
from wheelpend.identification.remainder import Remainder, RowForce
from wheelpend.identification.remainder_warnings import remainder_warnings, say_that_something_is_missing
from wheelpend.reports import console


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")
    save_log(tmp_path / "log.csv", simulated(duration=8.0, sample=SPARSE_S, coulomb_drive__torque=0.3))
    return tmp_path


@pytest.mark.slow
def test_a_workspace_lives_from_new_to_history(workspace):
    run("diagnose", "log.csv", "--json", "diagnosis.json")
    diagnosis = json.loads((workspace / "diagnosis.json").read_text())
    assert (diagnosis["schema"], diagnosis["verdict"]) == (1, "effect_missing")
    assert diagnosis["candidates"][0]["effect"] == "coulomb_drive"
    added = json.loads(run("add", "coulomb_drive", "--data", "log.csv", "--json", "-").stdout)
    assert added["error_after"] < 1.05 * added["noise_floor"] < 10 < added["error_before"]
    run("generate", "--check")
    assert Model.open(workspace).effects == ("coulomb_drive",)
    assert "coulomb_drive.torque" in (workspace / "generated" / "wheel_pendulum.py").read_text()
    removed = json.loads(run("remove", "coulomb_drive", "--data", "log.csv", "--json", "-").stdout)
    assert removed["error_before"] < 1.05 * removed["noise_floor"] < 10 < removed["error_after"], "refitted"
    assert [e["change"] for e in json.loads(run("history", "--json", "-").stdout)["history"]] == [
        "add coulomb_drive", "remove coulomb_drive"]  # fmt: skip


@pytest.mark.slow
def test_what_is_wrong_with_a_held_out_log_is_said_too(workspace):
    log = pl.read_csv("log.csv").with_columns(-pl.col("v_in"))
    log.write_csv("turned.csv")
    for command in ("compare", "diagnose"):
        assert "turned.csv: v_in counts the other way" in run(command, "log.csv", "--holdout", "turned.csv").stderr


def test_explain_prints_json_with_the_documented_keys_and_nothing_else(workspace):
    data = json.loads(run("explain", "log.csv", "--json", "-").stdout)
    assert {"schema", "verdict", "nominal_error", "base_error", "steps", "effects", "error", "noise_floor", "horizon_s",
            "parameters"} <= set(data)  # fmt: skip
    assert {"effect", "coefficients", "sigma", "p_value", "equivalent_to", "error_before", "error_after"} <= set(
        data["steps"][0]
    )
    assert data["effects"] == ["coulomb_drive"]
    assert abs(data["parameters"]["X6"]["value"] - 0.7268) < 1e-3
    (step,) = data["steps"]
    assert step["coefficients"]["torque"] == pytest.approx(0.3, abs=5 * step["sigma"]["torque"])
    assert data["nominal_error"] > data["base_error"] == step["error_before"] > 10 > step["error_after"]
    assert step["error_after"] == data["error"] == pytest.approx(data["noise_floor"], rel=0.05)
    assert data["base_error"] > 5 * data["error"] and step["p_value"] < 1e-6


def test_compare_prints_error_horizons_and_places(workspace):
    data = json.loads(run("compare", "log.csv", "--json", "-").stdout)
    assert data["error"] > 10
    assert {"theta_w", "theta_p", "dtheta_p"} == set(data["fit_percent"]) == set(data["rmse"])
    assert {"seconds", "error", "diverged"} <= set(data["horizons"][0])
    assert {"row", "state", "from", "to", "share"} <= set(data["where"][0])
    assert {h["seconds"]: h["error"] for h in data["horizons"]}[0.5] == pytest.approx(data["error"], rel=1e-3)
    assert max(data["fit_percent"].values()) < 100.0
    assert 0.01 < data["rmse"]["theta_p"] < np.pi
    assert all(w["from"] < w["to"] and 0.0 < w["share"] <= 1.0 for w in data["where"])


def test_identify_saves_values_that_explain_the_log(workspace):
    run("add", "coulomb_drive")
    run("identify", "log.csv", "--save")
    assert abs(Model.open(workspace).value("coulomb_drive.torque") - 0.3) < 1e-3
    assert json.loads(run("compare", "log.csv", "--json", "-").stdout)["error"] < 1.05


def test_an_assumption_that_is_switched_changes_every_kernel(workspace):
    text = (workspace / "model.toml").read_text()
    changed = re.sub(r'ground_friction_reaction = "body"', 'ground_friction_reaction = "none"', text)
    (workspace / "model.toml").write_text(changed)
    assert "stale" in run("generate", "--check", code=1).stderr
    run("generate")
    assert "ground_friction_reaction=none" in (workspace / "generated" / "wheel_pendulum.py").read_text()
    assert "X7*dtheta_w" in run("equations", "--diff", ROOT / "model.toml").stdout


@pytest.mark.parametrize(
    ("switch", "change"),
    [
        ("ground_friction_reaction=none", "new   - X7*dtheta_w"),
        ("rotor_inertia=false", "gone  X2 = "),
        ("rotor_speed=world", "only what the parameters stand for changes"),
        ("gear_ratio_in_back_emf=twice", "K_b*alpha*epsilon"),
        ("motor_circuit=dynamic", "winding_inductance.time_constant dU/dt = v_in - U"),
        ("encoder=relative", "theta_w: theta_w  ->  -theta_p + theta_w"),
        ("encoder=absolute", "the same equations"),
    ],
)
def test_the_diff_of_a_switch_names_the_terms_that_change(workspace, switch, change):
    assert change in run("equations", "--diff", switch).stdout


@pytest.mark.parametrize(
    "name", ["drive_compliance", "backlash", "wheel_slip", "slosh", "presliding_drive", "coulomb_drive"]
)
def test_the_equations_of_a_model_with_whatever_effect_are_printed(workspace, name):
    text = (workspace / "model.toml").read_text()
    (workspace / "model.toml").write_text(re.sub(r"effects = \[.*?\]", f'effects = ["{name}"]', text))
    said = run("equations").stdout
    rows = re.findall(r"Equation of motion, (.*) row: 0", said)
    added = {"drive_compliance": 1, "backlash": 1, "wheel_slip": 1, "slosh": 1}.get(name, 0)
    assert rows[:2] == ["wheel", "body"] and len(set(rows)) == len(rows) == 2 + added
    assert f"{name}." in said.partition("Equation of motion")[2]  # its parameters, in some law


def next_steps(said):
    return [line.partition(": ")[2] for line in said.stderr.splitlines() if line.startswith("Next, ")]


def test_every_command_says_what_to_do_next_with_a_command_line_that_is_one(workspace):
    made = run("simulate", "-o", "my log.csv", "--duration", "1", "--hide", "coulomb_drive=0.3")
    assert next_steps(made) == ["wheelpend compare 'my log.csv'"]
    shutil.copyfile("log.csv", "my log.csv")  # with as much friction, and less dense
    compared = run(*shlex.split(next_steps(made)[0])[1:])
    assert next_steps(compared) == ["wheelpend diagnose 'my log.csv'"]
    assert compared.stderr.count("--holdout LOG judges that on another log") == 1
    diagnosed = run(*shlex.split(next_steps(compared)[0])[1:])
    assert next_steps(diagnosed) == ["wheelpend add coulomb_drive 'my log.csv'"]
    added = run(*shlex.split(next_steps(diagnosed)[0])[1:])
    assert next_steps(added) == ["wheelpend diagnose 'my log.csv'"]
    again = run("diagnose", "my log.csv")
    assert next_steps(again) == ["wheelpend identify --save 'my log.csv'"]
    assert next_steps(run(*shlex.split(next_steps(again)[0])[1:])) == ["wheelpend compare 'my log.csv'"]
    assert next_steps(run("remove", "coulomb_drive")) == ["wheelpend history"]


def test_the_next_step_asks_the_same_question(workspace):
    left_out = ("--without", "cogging", "--max-effects", "1")
    keep, show = next_steps(run("explain", "log.csv", *left_out))
    assert keep == "wheelpend explain --without cogging --max-effects 1 --save log.csv"
    assert show == "wheelpend report --without cogging --max-effects 1 log.csv"


@pytest.mark.parametrize(
    ("law", "line"),
    [
        (False, "wheelpend diagnose --without cogging --law log.csv --holdout other.csv"),
        (True, "wheelpend report --without cogging --law log.csv --holdout other.csv"),
    ],
)
def test_what_is_unexplained_is_asked_for_a_law_once(capsys, law, line):
    files = Asked([Path("log.csv")], [Path("other.csv")])
    say_after_diagnosis(
        files, SimpleNamespace(verdict="unexplained", steps=(), determines_nothing=False), ["cogging"], law
    )
    assert line in " ".join(capsys.readouterr().err.split())


def test_what_is_explained_in_part_is_added_step_by_step_first(capsys):
    found = SimpleNamespace(verdict="unexplained", steps=("viscous_drive", "coulomb_drive"), determines_nothing=False)
    say_after_diagnosis(Asked([Path("log.csv")]), found, [], law=False)
    assert "step by step: wheelpend explain log.csv" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(("plant", "designs"), [("wheel_pendulum", True), ("pendulum", False)])
def test_a_command_is_designed_only_for_a_machine_that_is_held_upright(capsys, plant, designs):
    model = Model.parse(f'plant = "{plant}"')
    step = SimpleNamespace(effect="coulomb_drive", equivalent_to=("quadratic_drive",))
    say_after_report(
        Asked([Path("log.csv")]), SimpleNamespace(steps=[step], verdict="ambiguous", model=model), [], True
    )
    found = {"verdict": "ambiguous", "candidates": [step], "problem": SimpleNamespace(plant=model.plant_signature)}
    say_after_diagnosis(Asked([Path("log.csv")]), SimpleNamespace(**found), [], law=False)
    assert capsys.readouterr().err.count("design --between coulomb_drive,quadratic_drive") == (2 if designs else 0)


def test_no_next_step_is_said_to_a_program(workspace):
    save_log(workspace / "other.csv", simulated(duration=4.0, sample=SPARSE_S, seed=3))
    assert next_steps(run("compare", "log.csv", "--json", "-")) == []
    (said,) = next_steps(run("compare", "log.csv", "--holdout", "other.csv", "--json", "out.json"))
    assert said == "wheelpend diagnose log.csv --holdout other.csv"


@pytest.mark.slow
def test_the_report_takes_what_explain_takes(workspace):
    options = ["--max-effects", "1", "--without", "cogging", "--save"]
    said = run("report", "log.csv", *options, "--json", "report.json", "--out", "page.html")
    found = json.loads((workspace / "report.json").read_text())
    assert found["effects"] == ["coulomb_drive"] and "nominal_error" in found
    assert Model.open(workspace).effects == tuple(found["effects"])
    assert "Wrote page.html." in said.stdout
    assert "wheelpend report --without cogging --max-effects 1 log.csv" in (workspace / "page.html").read_text()


def test_the_help_lists_every_command_once_by_the_way_of_working(workspace):
    said = run("--help").stdout
    listed = re.findall(r"^  ([a-z]+)  +[A-Z]", said, re.MULTILINE)
    assert sorted(listed) == sorted(typer.main.get_command(app).commands)
    assert listed.index("compare") < listed.index("diagnose") < listed.index("add") < listed.index("report")
    assert max(map(len, said.splitlines())) <= 80


def test_an_unknown_switch_lists_the_known_ones(workspace):
    assert "motor_circuit" in run("equations", "--diff", "motor_circut=dynamic", code=1).stderr
    assert "must be one of static, dynamic" in run("equations", "--diff", "motor_circuit=fast", code=1).stderr


def test_the_committed_code_is_what_the_model_derives_to():
    run("generate", "--check", "--model", ROOT / "model.toml")


def test_new_refuses_a_folder_that_has_a_model(workspace):
    assert "Choose another folder" in run("new", code=1).stderr


def test_an_unknown_effect_lists_the_known_ones(workspace):
    result = run("add", "columb_drive", "--json", "-", code=1)
    assert "coulomb_drive" in json.loads(result.stdout)["failure"]


def test_a_log_may_not_be_on_both_sides(workspace):
    assert "both sides" in run("diagnose", "log.csv", "--holdout", "log.csv", code=1).stderr


def test_a_missing_column_is_named(workspace):
    (workspace / "bad.csv").write_text("t,v_in,pitch\n" + "".join(f"{k / 100},{k % 3},0\n" for k in range(100)))
    assert "theta_w" in run("compare", "bad.csv", code=1).stderr


def test_a_wrong_command_line_is_exit_code_2(workspace):
    run("simulate", code=2)
    run("nonsense", code=2)


def test_an_interrupted_write_leaves_the_old_workspace_whole(workspace, monkeypatch):
    before = {p: p.read_bytes() for p in workspace.rglob("*") if p.is_file()}

    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", interrupted)
    with pytest.raises(BaseException):  # noqa: B017
        run("add", "slope")
    assert before == {p: p.read_bytes() for p in workspace.rglob("*") if p.is_file()}


def test_a_change_whose_files_were_not_all_moved_is_finished_by_the_next_command(workspace, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", interrupted)
        with pytest.raises(BaseException):  # noqa: B017
            run("add", "slope")
    run("generate", "--check")
    assert Model.open().effects == ("slope",) and not [p for p in workspace.iterdir() if p.name.startswith(".wheel")]


def test_hidden_effects_are_read_as_name_value_or_parameters(workspace):
    run(
        "simulate",
        "-o",
        "a.parquet",
        "--duration",
        "2",
        "--hide",
        "cogging=sine:0.1,cosine:0,periods:12",
        "--hide",
        "slope=0.01",
    )
    assert "--hide cogging=sine:VALUE" in run("simulate", "-o", "b.csv", "--hide", "cogging=0.1", code=1).stderr


@pytest.fixture
def measured(workspace):
    """The measured log of a balancing robot, and a workspace for it."""
    log = DATA / "mini_segway" / "balancing.csv"
    if not log.exists():
        pytest.skip(f"the measured log is not at {log}; set WHEELPEND_DATA")
    (workspace / "model.toml").write_text('plant = "wheel_pendulum"\n[sensors]\nencoder = "relative"\n')
    return log


@pytest.mark.slow
def test_the_real_robots_log_goes_through(measured):
    run("inspect", measured)
    added = json.loads(run("add", "coulomb_drive", "--data", measured, "--json", "-").stdout)
    assert added["error_after"] < 0.8 * added["error_before"]


@pytest.mark.slow
def test_dry_friction_is_among_what_the_real_robot_may_miss(measured):
    diagnosis = json.loads(run("diagnose", measured, "--json", "-").stdout)
    assert {"coulomb_drive", "presliding_drive"} & {c["effect"] for c in diagnosis["candidates"]}


def test_after_an_identification_that_lacks_something_comes_a_diagnosis(capsys):
    files = Asked([Path("log.csv")])
    for lacking, command in ((True, "diagnose"), (False, "compare")):
        say_after_identification(files, lacking)
        assert capsys.readouterr().err.endswith(f": wheelpend {command} log.csv\n")
    large = RowForce(9.0, "V", None, 0.8, 0.8, 0.1, "drive")
    assert say_that_something_is_missing(
        remainder_warnings(Remainder({"wheel": large}), Model.default().plant_signature)
    )
    assert not say_that_something_is_missing(["X1 stopped at its bound of 0: the log does not ask for this effect."])


@pytest.mark.parametrize(
    ("steps", "verdict", "saved", "lines"),
    [
        (["cogging"], "nothing_missing", False, ["explain --without slope --save log.csv --holdout other.csv"]),
        (["cogging"], "nothing_missing", True, []),
        (["cogging"], "unexplained", True, ["report --without slope --law log.csv --holdout other.csv"]),
        ([], "nothing_missing", False, ["identify --save log.csv"]),
        (["cogging", "slosh"], "ambiguous", True, ["design --between cogging,slosh log.csv"]),
    ],
)
def test_after_a_report_comes_what_it_leaves_open(capsys, steps, verdict, saved, lines):
    made = [SimpleNamespace(effect=s, equivalent_to=("slosh",) if verdict == "ambiguous" else ()) for s in steps[:1]]
    files = Asked([Path("log.csv")], [Path("other.csv")])
    found = SimpleNamespace(steps=made, verdict=verdict, model=Model.default())
    say_after_report(files, found, ["--without", "slope"], saved)
    said = [line.partition(": wheelpend ")[2] for line in capsys.readouterr().err.splitlines()]
    assert said == lines


@pytest.mark.parametrize(
    ("do", "disagreeing", "lines"),
    [
        ("identify", ("X1",), ["inspect b.csv", "campaign --do diagnose --out missing.csv a.csv b.csv"]),
        ("compare", (), ["campaign --do diagnose --out missing.csv a.csv b.csv"]),
        ("diagnose", (), ["add cogging a.csv b.csv"]),
    ],
)
def test_after_a_campaign_comes_what_the_logs_have_in_common_or_the_one_that_is_off(capsys, do, disagreeing, lines):
    off = ParameterAgreement(2, 1.0, 0.1, 0.1, 0.1, 9.0, 1, 0.001, LargestDeviation("b.csv", 5.0))
    named = {"cogging": 2, "slope": 1} if do == "diagnose" else {}
    summary = SimpleNamespace(parameters={"X1": off}, disagreeing=disagreeing, named=named)
    files = Asked([Path("a.csv"), Path("b.csv")])
    say_after_campaign(files, SimpleNamespace(do=do, summary=summary, simulated=None))
    assert [line.partition(": wheelpend ")[2] for line in capsys.readouterr().err.splitlines()] == lines
    say_after_campaign(files, SimpleNamespace(do=do, summary=summary, simulated=object()))
    assert capsys.readouterr().err == ""


def test_a_command_to_copy_is_on_one_line_on_a_terminal_that_is_too_narrow_for_the_sentence(monkeypatch):
    shown = io.StringIO()
    monkeypatch.setattr(console, "err", Console(file=shown, force_terminal=True, width=60, soft_wrap=True))
    command = "wheelpend diagnose 'a log with a long name.csv' --holdout another.csv"
    console.print_command_hint("Next, which physical effect is missing:", command)
    plain = re.sub(r"\x1b\[[0-9;]*m", "", shown.getvalue())
    assert plain.splitlines() == ["Next, which physical effect is missing:", f"  {command}"]
    shown.truncate(0)
    console.print_command_hint("Next, a reason that is a good deal longer than the terminal is wide:", command)
    assert "the terminal\n  is wide:\n  wheelpend" in re.sub(r"\x1b\[[0-9;]*m", "", shown.getvalue())


def test_generate_and_verify_say_what_comes_next(workspace):
    assert next_steps(run("generate")) == ["wheelpend identify LOG --save"]
    assert next_steps(run("generate", "--check")) == []
    assert next_steps(run("verify")) == ["wheelpend reproduce"]
    assert next_steps(run("verify", "--json", "-")) == []
