"""A command that is interrupted at any moment leaves whole files, old ones or new ones."""

import errno
import os
import shutil
import subprocess
import sys
from functools import partial

import pytest

from tests.support import ROOT, run, simulated
from wheelpend import Failure, Model, save_log
from wheelpend.model import workspace as folders
from wheelpend.model.transaction import MADE_FOLDER, PREPARED_FOLDER
from wheelpend.model.user_effects import write_user_effects
from wheelpend.simulation.references import save_trajectory

ENTRY = folders.HistoryEntry("add slope", None, None, ())


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


class Interruptions:
    """Lets so many files take their place, and interrupts before the next."""

    def __init__(self, monkeypatch, allowed):
        self.allowed, self.replaced, self.replace = allowed, [], os.replace
        monkeypatch.setattr("os.replace", self)

    def __call__(self, source, target):
        if len(self.replaced) == self.allowed:
            raise KeyboardInterrupt
        self.replaced.append(os.path.basename(target))
        self.replace(source, target)


class Kill:
    """Ends the process, as a kill does, before its so-manieth event that may change a file in a folder."""

    EVENTS = ("open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.truncate")

    def __init__(self, folder, number):
        self.folder, self.left = str(folder), number
        sys.addaudithook(self)

    def __call__(self, event, arguments):
        place = arguments[0] if event in self.EVENTS else None
        if isinstance(place, str | os.PathLike) and os.fspath(place).startswith(self.folder):
            if self.left == 0:
                os._exit(KILLED)
            self.left -= 1


KILLED = 77


def ends_killed(folder, number, work):
    """True where a process of its own is killed before its so-manieth event in a folder, else it gets through."""
    process = os.fork()
    if process == 0:
        try:
            Kill(folder, number)
            work()
        except BaseException:
            os._exit(1)
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    assert status in (0, KILLED), "what is to be killed must run without an error"
    return status == KILLED


def add_slope(folder):
    model = Model.open(folder)
    folders.save(model.with_effects(["slope"]), [ENTRY], opened=model)


@pytest.fixture(scope="module")
def old_and_new(tmp_path_factory):
    """The files of a workspace before and after an effect is added."""
    folder = tmp_path_factory.mktemp("workspace")
    folders.create(folder)
    before = contents(folder)
    add_slope(folder)
    return before, contents(folder)


def test_a_change_that_is_killed_anywhere_is_made_or_not_made_and_never_half(old_and_new, tmp_path):
    old, new = old_and_new
    found, number = [], 0
    while True:
        folder = tmp_path / str(number)
        for name, data in old.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        killed = ends_killed(folder, number, partial(add_slope, folder))
        model = Model.open(folder)  # as the next command does
        seen = {n: data for n, data in contents(folder).items() if not n.startswith(PREPARED_FOLDER)}
        assert seen in (old, new) and folders.generated_code_diff(model) == ""
        found.append(seen == new)
        if not model.effects:
            add_slope(folder)
            assert contents(folder) == new, "nothing of the killed one may be left"
        if not killed:
            break
        number += 1
    assert number > 20 and found == sorted(found) and {*found} == {False, True}


def test_a_first_model_that_is_killed_anywhere_is_there_or_is_not(tmp_path):
    number, folder = 0, tmp_path / "0"
    while ends_killed(folder, number, partial(folders.create, folder)):
        try:
            assert folders.generated_code_diff(Model.open(folder)) == ""
        except Failure:
            assert not (folder / "model.toml").exists()
            folders.create(folder)
        number += 1
        folder = tmp_path / str(number)
    assert number > 10


def test_a_change_into_linked_folders_of_another_file_system_is_whole_too(old_and_new, tmp_path, monkeypatch):
    elsewhere = tmp_path / "elsewhere"
    folders.create(tmp_path / "robot")
    (tmp_path / "robot" / "generated").rename(elsewhere)
    (tmp_path / "robot" / "generated").symlink_to(elsewhere)
    replace = os.replace

    def of_one_file_system(source, target):
        if (str(elsewhere) in str(source)) != (str(elsewhere) in str(target)):
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
        replace(source, target)

    monkeypatch.setattr("os.replace", of_one_file_system)
    add_slope(tmp_path / "robot")
    assert {p.name: p.read_bytes() for p in elsewhere.iterdir()} == {
        name.removeprefix("generated/"): data for name, data in old_and_new[1].items() if name.startswith("generated/")
    }


def test_a_change_that_somebody_else_left_reaches_nothing_outside_the_workspace(tmp_path):
    folder, home = tmp_path / "robot", tmp_path / "home"
    folders.create(folder)
    (home / "keys").mkdir(parents=True)
    (home / "keys" / "secret").write_text("mine")
    (folder / MADE_FOLDER).symlink_to(home / "keys")
    Model.open(folder)
    assert (home / "keys" / "secret").read_text() == "mine" and not (folder / "secret").exists()

    (folder / MADE_FOLDER).unlink()
    (folder / "out").symlink_to(home)
    (folder / MADE_FOLDER / "out").mkdir(parents=True)
    (folder / MADE_FOLDER / "out" / ".profile").write_text("echo theirs")
    (folder / MADE_FOLDER / "stolen").symlink_to(home / "keys" / "secret")
    before = contents(home)
    for command in (["generate", "--check"], ["add", "slope"]):
        said = " ".join(run(*command, "--model", folder, code=1).output.split())
        assert "some lead out of it" in said and "Remove that folder" in said
    assert contents(home) == before and not (folder / "stolen").exists()


@pytest.mark.parametrize("name", [".git/hooks/pre-commit", ".envrc", "sub/file", "generated/.hidden"])
def test_a_change_that_somebody_else_left_writes_nothing_but_what_changes_write(tmp_path, name):
    folders.create(tmp_path)
    (tmp_path / MADE_FOLDER / name).parent.mkdir(parents=True)
    (tmp_path / MADE_FOLDER / name).write_text("theirs")
    with pytest.raises(Failure, match="are none that a change writes"):
        Model.open(tmp_path)
    assert not (tmp_path / name).exists()


def test_what_stands_in_for_a_change_being_written_is_removed_and_never_followed(tmp_path):
    folder, home = tmp_path / "robot", tmp_path / "home"
    folders.create(folder)
    (home / "docs").mkdir(parents=True)
    (home / "docs" / "thesis").write_text("mine")
    (home / "key").write_text("mine too")
    before = contents(home)
    (folder / PREPARED_FOLDER).symlink_to(home)
    folders.generate(Model.open(folder))
    (folder / PREPARED_FOLDER).write_text("a file")
    folders.generate(Model.open(folder))
    (folder / PREPARED_FOLDER / "generated").mkdir(parents=True)
    (folder / PREPARED_FOLDER / "generated" / "out").symlink_to(home)
    folders.generate(Model.open(folder))
    assert contents(home) == before and not (folder / "key").exists() and not (folder / PREPARED_FOLDER).exists()


def test_what_a_killed_change_left_never_goes_with_another_change(tmp_path):
    folders.create(tmp_path)
    add_slope_as_killed = tmp_path / PREPARED_FOLDER
    add_slope_as_killed.mkdir()
    for name in ("model.toml", "history.json"):
        (add_slope_as_killed / name).write_text("of a change that was never made")
    before = contents(tmp_path)
    folders.generate(Model.open(tmp_path))
    kept = {name: data for name, data in before.items() if not name.startswith(PREPARED_FOLDER)}
    assert contents(tmp_path) == kept


def test_a_change_that_cannot_be_whole_is_not_begun(tmp_path):
    folders.create(tmp_path)
    shutil.rmtree(tmp_path / "generated")
    (tmp_path / "generated").write_text("a file")
    before = contents(tmp_path)
    with pytest.raises(Failure, match="cannot be written"):
        add_slope(tmp_path)
    assert contents(tmp_path) == before and Model.open(tmp_path).effects == ()


def test_links_in_a_circle_are_failures(tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    assert "cannot be" in run("generate", "--model", tmp_path / "loop" / "model.toml", code=1).output
    folders.create(tmp_path / "robot")
    shutil.rmtree(tmp_path / "robot" / "generated")
    (tmp_path / "robot" / "generated").symlink_to("generated")
    assert "cannot be" in run("add", "slope", "--model", tmp_path / "robot", code=1).output


HOLDER = """
import sys, time
from pathlib import Path
from wheelpend.model.transaction import held
with held(Path({folder!r})):
    print("held", flush=True)
    time.sleep(1000)
"""


def test_of_two_commands_that_change_a_workspace_the_second_says_who_is_at_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders.create(tmp_path)
    (tmp_path / "log.csv").write_text("t\n0\n")
    before = contents(tmp_path)
    script = HOLDER.format(folder=str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE, text=True) as holder:
        try:
            assert holder.stdout.readline() == "held\n"
            for command in (["add", "slope"], ["generate"], ["identify", "log.csv", "--save"]):
                refused = run(*command, code=1)
                said = " ".join(refused.output.split())
                assert "is being changed by" in said
                assert f"process {holder.pid} " in said or sys.platform != "linux"
            run("generate", "--check")  # who only reads is not refused
            assert contents(tmp_path) == before
        finally:
            holder.kill()
    run("add", "slope")


def test_what_was_found_for_a_model_that_has_changed_meanwhile_is_not_saved(tmp_path):
    opened = folders.create(tmp_path)
    edited = opened.text.replace("planar = true", "planar = true   # as ever")
    (tmp_path / "model.toml").write_text(edited, encoding="utf-8")
    with pytest.raises(Failure, match=r"changed meanwhile. Nothing was saved"):
        folders.save(opened.with_effects(["slope"]), [ENTRY], opened=opened)
    with pytest.raises(Failure, match=r"changed meanwhile. Nothing was saved"):
        folders.save_values(opened, opened.with_fit({"X1": (1.0, 0.1)}))
    assert (tmp_path / "model.toml").read_text(encoding="utf-8") == edited and folders.history(tmp_path) == []


@pytest.mark.parametrize("text", ["{}", "null", "[1]", "not json", ""])
def test_a_history_that_cannot_be_read_is_never_overwritten(text, tmp_path):
    folders.create(tmp_path)
    (tmp_path / "history.json").write_text(text, encoding="utf-8")
    before = contents(tmp_path)
    with pytest.raises(Failure, match="Move it away"):
        add_slope(tmp_path)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "command.csv", "effects.toml", "model.toml"])
def test_a_file_that_is_written_takes_its_place_when_it_is_whole(name, tmp_path, monkeypatch):
    def write():
        path = tmp_path / name
        if name == "effects.toml":
            table = {"family": "drive", "sentence": "", "on": "drive", "law": "c*speed^3", "parameters": {
                "c": {"unit": "V", "typical": 0.1}}}  # fmt: skip
            write_user_effects(tmp_path, {"own_drag": table}, Model.default().plant_signature)
        elif name == "model.toml":
            Model.default().save(path)
        elif name == "command.csv":
            save_trajectory(path, *(simulated(duration=1.0).t for _ in range(3)))
        else:
            save_log(path, simulated(duration=1.0))

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        Interruptions(patch, 0)
        write()
    assert list(tmp_path.iterdir()) == []
    write()
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_command_says_nothing_of_a_change_that_did_not_happen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")

    def interrupted(path, data):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("wheelpend.model.transaction._write_anew", interrupted)
        with pytest.raises(BaseException):  # noqa: B017
            run("add", "slope")
    assert Model.open().effects == () and folders.history(tmp_path) == []
