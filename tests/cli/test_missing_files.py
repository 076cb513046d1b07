"""A file that is missing or cannot be read is named before anything is derived or compiled, by every command."""

import json

import pytest

import wheelpend.export.export  # noqa: F401  (what it takes from kernels.load is not to be what a test puts there)
from tests.support import run, simulated
from wheelpend import Model, save_log
from wheelpend.cli.app import LOG_PARAMETERS
from wheelpend.cli.commands import app

NO_MODEL = {"view"}  # which starts a workspace where there is none
NO_INPUT = {"demo", "verify", "reproduce"}  # commands that read no file
LOGS = {  # a command line per measurement file that a command takes, with LOG in its place
    "inspect": ["inspect LOG"],
    "split": ["split LOG --from 0 --to 1"],
    "new": ["new robot --from LOG"],
    "identify": ["identify LOG", "identify log.csv LOG", "identify LOG --save", "identify LOG --tau auto"],
    "residuals": ["residuals LOG"],
    "compare": ["compare LOG", "compare log.csv --holdout LOG"],
    "diagnose": ["diagnose LOG", "diagnose log.csv --holdout LOG", "diagnose LOG --accept mine"],
    "add": ["add slope LOG", "add slope --data LOG", "add slope log.csv --holdout LOG"],
    "remove": ["remove coulomb_drive LOG", "remove coulomb_drive --data LOG",
               "remove coulomb_drive log.csv --holdout LOG"],
    "explain": ["explain LOG", "explain log.csv --holdout LOG", "explain LOG --save"],
    "report": ["report LOG", "report log.csv --holdout LOG"],
    "design": ["design LOG", "design --between slope,com_offset LOG"],
    "simulate": ["simulate -o x.csv --command LOG"],
    "export": ["export c LOG", "export json log.csv --holdout LOG"],
    "campaign": ["campaign LOG", "campaign LOG --do diagnose"],
    "view": ["view LOG --no-browser", "view log.csv --holdout LOG --no-browser"],
}  # fmt: skip
MODELS = [
    "inspect log.csv", "identify log.csv", "residuals log.csv", "compare log.csv", "diagnose log.csv", "add slope",
    "remove slope", "explain log.csv", "report log.csv", "history", "design log.csv", "simulate -o x.csv",
    "campaign log.csv", "campaign --simulate", "effects", "equations", "generate", "warm", "export json",
    "set sensors.encoder=relative", "split log.csv --from 0 --to 1",
]  # fmt: skip
LINES = [(line, f"{kind}.csv") for lines in LOGS.values() for line in lines for kind in ("nowhere", "folder", "empty")]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A workspace, a log, and what is none; whatever derives or loads kernels says so by an error that nobody words."""

    def worked(*arguments, **options):
        raise RuntimeError("derived or compiled")

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WHEELPEND_TRACEBACK")
    (tmp_path / "model.toml").write_text(Model.default().with_effects(["coulomb_drive"]).text, encoding="utf-8")
    save_log(tmp_path / "log.csv", simulated(duration=2.0))
    (tmp_path / "empty.csv").touch()
    (tmp_path / "folder.csv").mkdir()
    for name in ("_cached_module_text", "load_module"):
        monkeypatch.setattr(f"wheelpend.kernels.load.{name}", worked)
    monkeypatch.setattr("derive.compose", worked)
    monkeypatch.setattr("wheelpend.kernels.compilers.compile_elsewhere", worked)
    return tmp_path


def said(line):
    """What a command that fails says, in one line."""
    text = " ".join(run(*line.split(), code=1).output.split())
    assert "derived or compiled" not in text
    return text


def test_the_list_holds_every_command_that_takes_a_file():
    paths = {}
    for command in app.registered_commands:
        name = command.name or command.callback.__name__
        hints = command.callback.__annotations__
        paths[name] = {p for p in hints if p in LOG_PARAMETERS} | ({"model"} & set(hints))
    assert {name for name, read in paths.items() if read & set(LOG_PARAMETERS)} == set(LOGS) - {"simulate"}
    assert {name for name, read in paths.items() if "model" in read} - NO_MODEL == {line.split()[0] for line in MODELS}
    assert {name for name, read in paths.items() if not read} == NO_INPUT


@pytest.mark.parametrize(("line", "log"), LINES)
def test_a_log_that_cannot_be_read_is_named_first(here, line, log):
    assert log in said(line.replace("LOG", log))


@pytest.mark.parametrize("line", MODELS)
def test_a_model_or_a_plant_that_is_not_there_is_named_first(here, line):
    assert "There is no model at other/model.toml" in said(f"{line} --model other/model.toml")
    assert "none at nowhere.py" in said(f"{line} --plant nowhere.py")


@pytest.mark.parametrize("line", ["new robot --plant nowhere.py", "equations --diff nowhere/model.toml"])
def test_so_is_another_plant_and_another_model(here, line):
    assert "nowhere" in said(line)


@pytest.mark.parametrize(
    "line",
    [
        *(f"{line} --json nowhere/x.json" for line in MODELS if line.split()[0] not in
          ("add", "remove", "simulate", "equations", "generate", "warm", "set")),
        "add slope log.csv --json nowhere/x.json", "verify --json nowhere/x.json", "verify --page nowhere/x.md",
        "reproduce --json nowhere/x.json", "reproduce --out log.csv", "simulate -o nowhere/x.csv",
        "report log.csv -o nowhere/x.html", "design log.csv -o nowhere/x.csv", "campaign log.csv -o nowhere/x.csv",
        "split log.csv --from 0 --to 1 -o nowhere",
        "identify log.csv --method filtered --tau auto --tau-map nowhere/x.png", "new log.csv/robot",
        "demo --out log.csv",
    ],
)  # fmt: skip
def test_what_cannot_be_written_is_named_first(here, line):
    assert any(words in said(line) for words in ("cannot be written", "must be a folder that can be written to"))


def test_a_workspace_that_is_there_already_is_named_first(here):
    assert "must not hold a model yet" in said("new .")
    assert "must not hold a model yet" in said("new . --from log.csv")


def test_of_many_logs_one_may_be_missing_and_is_named_before_the_others_are_analysed(here):
    result = run("campaign", "log.csv", "nowhere.csv", code=1)
    warning, work = (result.output.index(text) for text in ("none at nowhere.csv. The other logs go on.", "derived or"))
    assert warning < work


def test_the_failure_is_json_where_that_is_asked_for(here):
    said("identify nowhere.csv --json found.json")
    assert "nowhere.csv" in json.loads((here / "found.json").read_text())["failure"]
