"""What all windows share: commands in turn, results that hold for one model, changes from elsewhere."""

import time
from pathlib import Path

import pytest

import derive
from tests.support import run
from wheelpend import Model
from wheelpend.view.bench import Bench, Found
from wheelpend.view.hints import chain, hint_text, next_step


@pytest.fixture
def bench(tmp_path):
    Model.default().save(tmp_path)
    return Bench(tmp_path)


def worked_off(bench):
    begin = time.monotonic()
    while bench.is_busy:
        assert time.monotonic() < begin + 120
        bench.tick()
        time.sleep(0.05)


def found(bench, command, **result):
    bench.found[command] = Found((command, *bench.files), bench.watch.model_digest(), result, [])


def test_commands_run_in_turn_and_none_after_one_that_failed(bench):
    bench.run(("add", "coulomb_drive"), ("add", "coulomb_drive"), ("add", "slope"))
    worked_off(bench)
    assert bench.model().effects == ("coulomb_drive",) and "in the model already" in bench.failure
    assert bench.done == ["wheelpend add coulomb_drive"] * 2


def test_nothing_starts_while_something_runs(bench):
    bench.run(("add", "coulomb_drive"))
    bench.run(("add", "slope"))
    worked_off(bench)
    assert bench.done == ["wheelpend add coulomb_drive"]


def test_a_result_that_cannot_be_read_is_said_and_the_next_command_runs(bench, monkeypatch):
    def unreadable(job):
        raise ValueError("Cannot load file")

    monkeypatch.setattr("wheelpend.view.jobs.Job.text", unreadable)
    bench.run(("add", "coulomb_drive"), ("add", "slope"))
    worked_off(bench)
    assert "must leave a result that can be read" in bench.failure and len(bench.done) == 1
    monkeypatch.undo()
    bench.run(("add", "slope"))
    worked_off(bench)
    assert bench.model().effects == ("coulomb_drive", "slope") and not bench.failure


def test_cancel_starts_nothing_that_waits(bench):
    bench.run(("add", "coulomb_drive"), ("add", "slope"))
    bench.cancel()
    worked_off(bench)
    assert bench.model().effects == () and bench.said.startswith("Cancelled") and len(bench.done) == 1


def test_a_change_by_a_command_elsewhere_is_noticed_and_makes_results_old(bench, tmp_path):
    bench.open_log(tmp_path / "log.csv")
    found(bench, "diagnose", verdict="nothing_missing")
    bench.tick()
    version = bench.version
    assert bench.current("diagnose") and next_step(bench).panel == "go_on"
    run("add", "coulomb_drive", "--model", tmp_path)
    bench.tick()
    assert bench.version > version and bench.current("diagnose") is None and next_step(bench).panel == "compare"


def test_a_result_is_of_the_logs_that_it_was_made_with(bench, tmp_path):
    bench.open_log(tmp_path / "log.csv")
    found(bench, "compare")
    assert bench.current("compare")
    bench.open_log(tmp_path / "other.csv")
    assert bench.current("compare") is None
    bench.move(tmp_path / "other.csv")
    assert bench.files == (str(tmp_path / "log.csv"), "--holdout", str(tmp_path / "other.csv"))


def test_the_hints_walk_the_way_of_working(bench, tmp_path):
    assert next_step(bench).panel == "open"
    bench.open_log(tmp_path / "log.csv")
    bench.first_run = True
    assert hint_text(bench).startswith("Click 1 of 3: press Compare")
    found(bench, "compare")
    assert hint_text(bench).startswith("Click 2 of 3: press Learn")
    found(bench, "diagnose", verdict="effect_missing", candidates=[{"effect": "slope"}])
    assert hint_text(bench).startswith("Click 3 of 3: press Add slope")
    found(bench, "diagnose", verdict="unexplained", candidates=[])
    assert "no effect explains" in hint_text(bench)
    found(bench, "diagnose", verdict="unexplained", candidates=[], steps=["viscous_drive", "coulomb_drive"])
    assert "press Add viscous_drive, which explains a part of what is missing, then coulomb_drive" in hint_text(bench)
    assert next_step(bench).effect == "viscous_drive"
    found(bench, "diagnose", verdict="nothing_missing", candidates=[])
    assert hint_text(bench).startswith("Nothing more is missing")
    found(bench, "diagnose", verdict="nothing_missing", remainder={"instead": ["viscous_drive", "quadratic_drive"]})
    assert "may be chance or viscous_drive or quadratic_drive: press Add viscous_drive" in hint_text(bench)


def test_after_a_change_everything_is_looked_at_anew(bench, tmp_path):
    bench.open_log(tmp_path / "log.csv")
    log = str(tmp_path / "log.csv")
    after = ["compare", "predictions", "diagnose", "figures"]
    assert chain(bench, ("add", "slope", log)) == [("add", "slope", log), ("equations",), *((a, log) for a in after)]


def test_a_model_that_cannot_be_read_is_no_end(bench, tmp_path):
    (tmp_path / "model.toml").write_text("plant = 3")
    (tmp_path / "history.json").write_text("{")
    bench.tick()
    assert bench.model() is None and bench.history() == []


def test_another_model_file_is_named_to_every_command(tmp_path):
    bench = Bench(tmp_path / "other.toml", [tmp_path / "a.csv"])
    assert bench.files[-2:] == ("--model", "other.toml") and bench.folder == tmp_path
    assert bench.view_words[-2:] == ("--model", str(tmp_path / "other.toml"))


OWN_PLANT = Path(derive.plants.slide.__file__).read_text(encoding="utf-8").replace('"slide"', '"my_slide"')


def test_a_plant_of_ones_own_goes_with_every_command_and_is_known_here(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(OWN_PLANT, encoding="utf-8")
    run("new", tmp_path / "axis", "--plant", file)
    bench = Bench(tmp_path / "axis", plant_file=file)
    assert bench.model().plant == "my_slide"
    assert bench.files == bench.model_words == ("--plant", str(file))
    assert bench.view_words[-2:] == ("--plant", str(file))
    bench.run(("equations", *bench.model_words))
    worked_off(bench)
    assert not bench.failure and bench.current("equations")
