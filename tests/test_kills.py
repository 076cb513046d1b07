"""A kill at any change of a file, by whatever writes: each file is the old or the new one, and all goes on."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from tests.killing import half_written, read_state, states_of_kills, write_state
from tests.support import run, simulated
from wheelpend import Failure, Model, save_log
from wheelpend.campaigns.journal import Journal
from wheelpend.campaigns.manifest import Listed
from wheelpend.campaigns.one_log import LogResult
from wheelpend.campaigns.result_set import ResultSet, key_of
from wheelpend.cli import change, demo
from wheelpend.files import write_bytes, write_text
from wheelpend.kernels import cache, generated_text
from wheelpend.model import workspace
from wheelpend.model.transaction import MADE_FOLDER, PREPARED_FOLDER
from wheelpend.model.user_effects import effect_table_text, write_user_effects
from wheelpend.reports.ladder import draw_ladder
from wheelpend.reports.page import page
from wheelpend.reproduction import files as reproduction_files
from wheelpend.simulation.references import save_trajectory

OWN_EFFECT = {"own_drag": {"family": "drive", "sentence": "", "on": "drive", "law": "c*speed^3",
                           "parameters": {"c": {"unit": "V", "typical": 0.1}}}}  # fmt: skip
STEP = SimpleNamespace(effect="slope", error_before=3.0, error_after=1.0, force_before=None, force_after=None)
LADDER = SimpleNamespace(
    nominal_error=9.0,
    base_error=3.0,
    steps=(STEP,),
    error=1.0,
    noise_floor=1.0,
    effects=("slope",),
    problem=SimpleNamespace(plant=Model.default().plant_signature),
)


def is_passing(name):
    """True for a file of a change that was not made, or of one that the next command finishes."""
    return ".partial" in name or PREPARED_FOLDER in name or MADE_FOLDER in name or ".pyc." in name


class Writer(NamedTuple):
    """What writes in a workspace, which is the current folder; it may be repeated."""

    work: Callable[[Path], object]
    prepare: Callable[[Path], object] = lambda folder: None


def command(*parts, after=lambda folder: None):
    return Writer(lambda folder: without_traceback(run(*parts, code=None)), after)


def without_traceback(result):
    assert result.exit_code in (0, 1) and "Traceback" not in result.output, result.output


def edit_by_hand(folder):
    text = Model.open(folder).with_effects(["slope"]).text
    (folder / "model.toml").write_text(text, encoding="utf-8")


def save_explanation(folder):
    opened = Model.open(folder)
    if "slope" not in opened.effects:
        result = SimpleNamespace(model=opened.with_effects(["slope"]), steps=[STEP])
        change.save_explanation(result, ["log.csv"], [], opened)


def accept_law(folder):
    with suppress(Failure):  # the name is taken once it is done
        write_user_effects(folder, OWN_EFFECT, Model.default().plant_signature)


def keep_journal(folder):
    journal = Journal(folder / "campaign.csv.partial", "question")
    journal.begin()
    for key in sorted(set("abc") - set(journal.results)):
        journal.add(key, {"value": 1.0})


def keep_results(folder):
    """Two results: a journal, which becomes a part."""
    known, listed = ResultSet(folder / "campaign.results", "identify-question"), [Listed(1), Listed(2)]
    new = [one for one in listed if not known.knows(one)]
    with known.held(bool(new)):
        for one in new:
            known.add(one, LogResult(key_of(one.log), error=1.5))
        assert [r.error for r in known.results(listed)] == [1.5, 1.5]


def derive_text(folder):
    cache._texts_in_memory.clear()
    cache.cached_text("derived", "wheel_pendulum", "this test", lambda: "text of a module\n" * 50)


def keep_module(path, text):
    """A module's text and its bytecode, as the cache keeps them."""
    generated_text.write_unless_there(path, text)
    generated_text._code_of(path, text)


def write_own_effect(folder):
    (folder / "mine.toml").write_text(effect_table_text("own_drag", OWN_EFFECT["own_drag"]), encoding="utf-8")


WRITERS = {
    "new": command("new", "robot"),
    "generate": command("generate", after=edit_by_hand),
    "set": command("set", "sensors.encoder=relative", "columns.theta_p.unit=deg"),
    "split": command("split", "log.csv", "--from", "0.5", "--to", "1"),
    "effects --define": command("effects", "--define", "mine.toml", after=write_own_effect),
    "add": command("add", "slope"),
    "add --json": command("add", "slope", "--json", "result.json"),
    "remove": command("remove", "slope", after=lambda folder: run("add", "slope")),
    "identify --save": command("identify", "log.csv", "--method", "filtered", "--tau", "0.1,0.1", "--save"),
    "identify --json": command("identify", "log.csv", "--method", "filtered", "--tau", "0.1,0.1", "--json", "out.json"),
    "explain --save": Writer(save_explanation),
    "diagnose --accept": Writer(accept_law),
    "simulate to CSV": command("simulate", "-o", "log.csv", "--duration", "1"),
    "simulate to Parquet": command("simulate", "-o", "made.parquet", "--duration", "1"),
    "design": Writer(lambda folder: save_trajectory(folder / "designed.csv", *(np.arange(9.0) for _ in range(3)))),
    "export": command("export", "json"),
    "report": Writer(lambda folder: page.write_report(None, folder / "report.html")),
    "campaign's journal": Writer(keep_journal),
    "campaign's results": Writer(keep_results),
    "campaign's table": Writer(lambda folder: write_text(folder / "campaign.csv", "a,b\n1,2\n")),
    "demo's workspace": Writer(lambda folder: demo.fresh_workspace(folder / "demo")),
    "demo's picture": Writer(lambda folder: draw_ladder(LADDER, folder / "error_ladder.svg")),
    "reproduce": Writer(lambda folder: reproduction_files.write(folder / "made", {"a.csv": b"1", "b.png": b"22"})),
    "tau map": Writer(lambda folder: write_bytes(folder / "map.png", b"picture" * 100)),
    "cached text": Writer(derive_text),
    "cached module": Writer(lambda folder: keep_module(folder / "module.py", b"a = 1\n" * 20)),
}  # fmt: skip
READERS = (("history",), ("generate", "--check"), ("effects",))


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a workspace and a log, the current one."""
    monkeypatch.setattr(page, "page_html", lambda *arguments, **options: "<p>page</p>" * 500)
    monkeypatch.setattr(page, "residual_tests_of", lambda explanation: None)
    folder = tmp_path / "workspace"
    workspace.create(folder)
    save_log(folder / "log.csv", simulated(duration=2.0))
    enter(folder, monkeypatch)
    return folder


def enter(folder, monkeypatch, is_cache=False):
    """Make a folder the current one, and that of the cache where it is the cache that is written."""
    monkeypatch.chdir(folder)
    if not is_cache:
        return
    monkeypatch.setattr(cache, "cache_folder", lambda: folder)


def age(folder):
    """Make what a killed process left as old as it will be."""
    for path in [p for p in folder.rglob("*") if ".partial" in p.name]:
        os.utime(path, (0.0, 0.0))


def lasting(state):
    """A folder's files, without bytecode, which holds the time of its source, and what a command said of itself."""
    return {name: data for name, data in state.items() if ".bytecode" not in name and name != "result.json"}


@pytest.mark.parametrize("name", WRITERS)
def test_whatever_is_killed_leaves_whole_files_and_the_next_command_goes_on_and_clears_up(
    name, here, tmp_path, monkeypatch
):
    writer, is_cache = WRITERS[name], name.startswith("cached")
    enter(here, monkeypatch, is_cache)
    writer.prepare(here)
    old = read_state(here)
    states = states_of_kills(here, lambda: writer.work(here))
    new = states[-1]
    assert old != new and len(states) > 2
    for number, state in enumerate(states):
        halves = [n for n, data in state.items() if not is_passing(n) and data not in (old.get(n), new.get(n))]
        assert not halves, f"{halves} half written by {name}"
        folder = tmp_path / str(number)
        write_state(folder, {n: data for n, data in state.items() if ".pyc." not in n})  # bytecode, which is made anew
        age(folder)
        enter(folder, monkeypatch, is_cache)
        writer.work(folder)
        assert lasting(read_state(folder)) == lasting(new)


@pytest.mark.parametrize("name", ["add", "remove", "generate", "explain --save"])
def test_who_reads_a_workspace_after_a_kill_finds_it_whole(name, here, tmp_path, monkeypatch):
    WRITERS[name].prepare(here)
    for number, state in enumerate(states_of_kills(here, lambda: WRITERS[name].work(here))):
        folder = tmp_path / str(number)
        write_state(folder, state)
        enter(folder, monkeypatch)
        for reader in READERS:
            stale = reader == ("generate", "--check") and name == "generate"
            run(*reader, code=None if stale else 0)


def test_a_file_written_in_its_place_would_be_seen_half_written(tmp_path):
    (tmp_path / "a").write_bytes(b"old!")

    def work():
        (tmp_path / "a").write_bytes(b"newer!")
        with (tmp_path / "a").open("ab") as file:
            file.write(b"more")

    seen = [state["a"] for state in states_of_kills(tmp_path, work)]
    assert seen == [b"old!", b"", b"new", b"newer!", b"newer!mo", b"newer!more"]
    assert list(half_written({"a": b"1"}, {"a": b"2"}, ("os.rename", "b", "a"))) == []


def test_a_partial_file_that_somebody_may_still_write_is_left_alone(tmp_path):
    for name, old in (
        (".a.1.partial.csv", True),
        (".a.2.partial.csv", False),
        (".a.x.partial.csv", True),
        (".b.1.partial.csv", True),
    ):
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (0.0, 0.0) if old else None)
    write_text(tmp_path / "a.csv", "whole")
    assert sorted(os.listdir(tmp_path)) == [".a.2.partial.csv", ".a.x.partial.csv", ".b.1.partial.csv", "a.csv"]
