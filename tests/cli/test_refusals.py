"""What cannot be used is refused at once, in words: no traceback, no waiting for what never ends."""

import json
import os
import socket
import subprocess
import sys

import numpy as np
import pytest

from tests.support import ROOT, run, simulated
from wheelpend import Failure, Log, Model, identify, save_log
from wheelpend.model import workspace


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a workspace and a log, the current one."""
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path)
    save_log(tmp_path / "log.csv", simulated(duration=2.0))
    return tmp_path


def said(*command, code=1):
    """What a command that fails says, in one line."""
    result = run(*command, code=code)
    assert "Traceback" not in result.output
    return " ".join(result.output.split())


@pytest.mark.parametrize("command", ["identify", "compare", "diagnose", "explain", "inspect"])
def test_a_pipe_a_socket_and_a_device_are_no_logs(here, command):
    os.mkfifo("pipe.csv")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket.csv")
        for name, words in (("pipe.csv", "a pipe"), ("socket.csv", "a socket"), ("/dev/zero", "a device")):
            assert f"{name} must be a file, but it is {words}. Save what it gives" in said(command, name)


@pytest.mark.parametrize("name", ["model.toml", "effects.toml", "history.json"])
def test_a_pipe_in_the_place_of_a_workspaces_file_is_refused(here, name):
    (here / name).unlink(missing_ok=True)
    os.mkfifo(name)
    assert f"{name} must be a file, but it is a pipe" in said("add", "slope")


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "-o", "model.toml"),
        ("simulate", "-o", "generated/wheel_pendulum.py"),
        ("design", "-o", "effects.toml"),
        ("history", "--json", "history.json"),
        ("identify", "log.csv", "--json", "log.csv"),
        ("report", "log.csv", "-o", "log.csv"),
        ("campaign", "log.csv", "--out", "campaign.csv", "--json", "campaign.csv"),
        ("campaign", "log.csv", "--out", "model.toml"),
        ("identify", "log.csv", "--model", "other.toml", "--json", "other.toml"),
    ],
)
def test_no_command_writes_over_what_it_reads_or_over_a_file_of_a_workspace(here, command):
    (here / "other.toml").write_bytes((here / "model.toml").read_bytes())
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    assert "Name another." in said(*command)
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_times_in_another_unit_are_refused_with_that_unit(here, factor, unit):
    log = simulated(duration=2.0)
    rows = np.column_stack([log.t * factor, log.voltage, log.measured])
    np.savetxt("other.csv", rows, delimiter=",", header=",".join(["t", "v_in", *log.channels]), comments="")
    for command in ("identify", "compare", "diagnose", "explain"):
        text = said(command, "other.csv")
        assert "Samples must be at most 0.5 s apart" in text and f't = {{ column = "t", unit = "{unit}" }}' in text
    assert f'unit = "{unit}"' in " ".join(run("inspect", "other.csv").output.split())
    with pytest.raises(Failure, match=r"at most 0.5 s apart"):
        identify(Model.default(), [Log(log.name, log.t * factor, log.voltage, log.measured, log.channels)])


def test_times_that_are_mapped_to_a_wrong_unit_are_refused_with_the_right_one(here):
    log = simulated(duration=2.0)
    rows = np.column_stack([log.t * 1e6, log.voltage, log.measured])
    np.savetxt("other.csv", rows, delimiter=",", header=",".join(["time", "v_in", *log.channels]), comments="")
    text = (here / "model.toml").read_text(encoding="utf-8")
    text = text.replace("# theta_p = {", 't = { column = "time", unit = "ms" }\n# theta_p = {', 1)
    (here / "model.toml").write_text(text, encoding="utf-8")
    assert "If t is in us, say so" in said("identify", "other.csv")


@pytest.mark.parametrize(("factor", "words"), [(1e-12, "at least 1e-06 s apart"), (1e300, "Check the unit of t")])
def test_times_that_no_unit_explains_are_refused(here, factor, words):
    log = simulated(duration=2.0)
    with pytest.raises(Failure, match=words):
        identify(Model.default(), [Log(log.name, log.t * factor, log.voltage, log.measured, log.channels)])


def test_a_simulation_lasts_a_day_at_most_and_seeds_count_from_zero(here):
    for duration in ("1e9", "nan", "0", "-1", "inf"):
        assert "must be a positive time in s, a day (86400) at most" in said(
            "simulate", "-o", "x.csv", "--duration", duration
        )
    assert "-1 is not in the range x>=0" in said("simulate", "-o", "x.csv", "--seed", "-1", code=2)


@pytest.mark.parametrize("log", ["log.csv", "no_log.csv"])
@pytest.mark.parametrize("place", ["nowhere/result.json", ".", "/dev/full"])
def test_json_that_cannot_be_written_is_a_failure_before_any_work(here, log, place, monkeypatch):
    def worked(*arguments, **options):
        raise AssertionError("work was done")

    monkeypatch.setattr("wheelpend.identification.identify.identify", worked)
    text = said("identify", log, "--json", place)
    assert f"{place} cannot be written" in text and "no_log" not in text


def test_a_failure_whose_json_cannot_be_written_any_more_says_both(here, monkeypatch):
    def full(data, json_file):
        raise Failure("result.json cannot be written: No space left on device.")

    monkeypatch.setattr("wheelpend.reports.console.emit_json", full)
    text = said("identify", "no_log.csv", "--json", "result.json")
    assert "there is none at no_log.csv" in text and "No space left on device" in text


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError("Unable to allocate 7 TiB"), "needs more memory than there is (Unable to allocate 7 TiB)"),
        (PermissionError(13, "Permission denied", "log.csv"), "log.csv cannot be used: Permission denied"),
    ],
)
def test_what_the_system_refuses_is_said_in_words_and_in_json(here, monkeypatch, error, words):
    def refused(*arguments, **options):
        raise error

    monkeypatch.setattr("wheelpend.identification.identify.identify", refused)
    assert words in said("identify", "log.csv", "--json", "result.json")
    assert words in json.loads((here / "result.json").read_text())["failure"]


@pytest.mark.parametrize(
    ("command", "options"),
    [("simulate", []), ("report", ["log.csv"]), ("design", []), ("campaign", ["log.csv"]), ("verify", [])],
)
def test_a_result_that_cannot_be_written_is_a_failure_before_any_work(here, command, options, monkeypatch):
    def worked(*arguments, **options):
        raise AssertionError("work was done")

    monkeypatch.setattr("wheelpend.model.record.Model.open", worked)
    monkeypatch.setattr("wheelpend.paper.verification.verify", worked)
    option = {"campaign": "--out", "verify": "--page"}.get(command, "-o")
    for place in ("nowhere/x.csv", ".", "/dev/full", "x" * 300 + ".csv", "log.csv/x.csv"):
        assert "cannot be written" in said(command, *options, option, place)


@pytest.mark.parametrize("name", ["model.toml", "effects.toml", "history.json"])
def test_a_file_that_is_a_folder_or_no_text_is_said_by_name(here, name):
    (here / name).unlink(missing_ok=True)
    (here / name).write_bytes(b"\xff\xfe\x00")
    assert f"{name} must be UTF-8 text" in said("add", "slope")
    (here / name).unlink()
    (here / name).mkdir()
    assert f"{name} cannot be read: Is a directory" in said("add", "slope")


def test_a_name_that_is_no_utf_8_is_written_as_escapes(here):
    name = os.fsdecode(b"caf\xe9.csv")
    assert "there is none at caf" in said("identify", name, "--json", "result.json")
    assert "caf\\udce9.csv" in (here / "result.json").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 10_000 + "]" * 10_000, "nests too deeply"),
        ("a" + ".a" * 100_000 + " = 1", "no line may have more than 1000 dots"),
        ("a = " + "9" * 10_000, "not valid TOML: Exceeds the limit"),
        ("[constants]\nR = 0x" + "f" * 10_000, "R: must be a finite number, not a value that is too long"),
        ("[constants]\nalpha = nan", "alpha: must be a finite number"),
        ("[constants]\nalpha = 1e300", "alpha: must be at most 1e+100 in size"),
        ("[constants]\nalpha = 0", "numbers that a machine has, from 1e-12 to 1e+12 in size, but alpha is 0 N m/V"),
    ],
)
def test_numbers_and_nesting_without_end_are_refused_in_both_toml_files(here, text, words):
    (here / "model.toml").write_text(f'plant = "wheel_pendulum"\neffects = []\n{text}\n', encoding="utf-8")
    assert words in said("history")


@pytest.mark.parametrize(("column", "factor"), [(1, 1e300), (1, 1e-300), (2, 1e150), (3, 1e-300), (4, 1e300)])
def test_values_that_nobody_measured_are_refused_with_their_column(here, column, factor):
    log = simulated(duration=2.0)
    rows = np.column_stack([log.t, log.voltage, log.measured])
    rows[:, column] *= factor
    names = ["t", "v_in", *log.channels]
    np.savetxt("other.csv", rows, delimiter=",", header=",".join(names), comments="")
    for command in ("identify", "diagnose", "inspect"):
        text = said(command, "other.csv")
        assert "between 1e-12 and 1e+12 in size" in text and f"but {names[column]} reaches" in text


@pytest.mark.parametrize("factor", [1e-310, 1e-20, 1e300])
def test_times_that_are_none_are_refused_by_inspect_too(here, factor):
    log = simulated(duration=2.0)
    rows = np.column_stack([log.t * factor, log.voltage, log.measured])
    np.savetxt("other.csv", rows, delimiter=",", header=",".join(["t", "v_in", *log.channels]), comments="")
    assert "t must be a time" in said("inspect", "other.csv")


@pytest.mark.parametrize("options", [("slope=1e300",), ("actuator_delay=-1",), ("backlash=-0.1",), ("slope=5",)])
def test_an_effect_that_no_machine_has_is_not_hidden(here, options):
    assert "to be hidden, not" in said("simulate", "-o", "x.csv", "--duration", 1, "--hide", *options)


@pytest.mark.parametrize("tau", ["1e-320,0.1", "1e300,0.1", "0,1", "nan,1"])
def test_time_constants_that_no_filter_has_are_refused(here, tau):
    assert "positive" in said("identify", "log.csv", "--method", "recursive", "--tau", tau)


def test_what_nobody_foresaw_is_said_with_its_place(here, monkeypatch):
    def broken(*arguments, **options):
        return {}["missing"]

    monkeypatch.delenv("WHEELPEND_TRACEBACK")
    monkeypatch.setattr("wheelpend.model.workspace.history", broken)
    assert "KeyError: 'missing'" in said("history", "--json", "result.json")
    assert "please report it" in json.loads((here / "result.json").read_text())["failure"]


def entry_point(*arguments, **options):
    """The command in a process of its own."""
    command = [sys.executable, "-m", "wheelpend", *arguments]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONWARNINGS"} | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, env=environment, stderr=subprocess.PIPE, text=True, **options)


def test_output_that_cannot_be_written_is_a_failure(here):
    with open("/dev/full", "w") as full:
        result = entry_point("effects", stdout=full)
    assert result.returncode == 1 and result.stderr.startswith("Failure: ") and "No space" in result.stderr
    assert result.stderr.count("\n") == 1


def test_no_warning_of_python_reaches_the_user(here):
    (here / "plant.py").write_text("import warnings\nwarnings.warn('look')\nraise ValueError('enough')\n")
    result = entry_point("new", "robot", "--plant", "plant.py", stdout=subprocess.PIPE)
    assert result.returncode == 1 and "look" not in result.stderr and "enough" in result.stderr


def test_a_reader_that_ends_before_the_command_is_no_fault_of_it(here):
    """As in `wheelpend inspect log.csv | head -1`: nothing is said of it."""
    command = [sys.executable, "-P", "-m", "wheelpend", "inspect", "log.csv"]
    environment = {n: v for n, v in os.environ.items() if n != "WHEELPEND_TRACEBACK"} | {"PYTHONPATH": str(ROOT)}
    reads, writes = os.pipe()
    with subprocess.Popen(command, stdout=writes, stderr=subprocess.PIPE, cwd=here, env=environment) as process:
        os.close(writes)
        os.close(reads)  # before anything is written
        said_on_error = process.stderr.read().decode()
    assert said_on_error == "", said_on_error
    assert process.returncode == 1
