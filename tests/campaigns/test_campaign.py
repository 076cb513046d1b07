"""Many logs are asked the same; failures, interruptions and files."""

import csv
import json
import pickle
from dataclasses import replace
from types import SimpleNamespace

import pytest

from tests.support import run, simulated
from wheelpend import Failure, Model, campaign, identify, parallel, save_log
from wheelpend.campaigns import cluster, one_log, runner

SHORT = 3.0  # s


@pytest.fixture(autouse=True)
def one_core(monkeypatch):
    monkeypatch.setattr(parallel, "cores", lambda: 1)


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")
    for seed in (0, 1):
        save_log(tmp_path / f"drive{seed}.csv", simulated(seed=seed, duration=SHORT))
    (tmp_path / "broken.csv").write_text("t,v_in\n0,1\n")
    return tmp_path


def lines(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def interrupt(text):
    if text.startswith("1 of"):
        raise KeyboardInterrupt


def test_every_seed_answers_as_its_log_does_alone():
    found = campaign(Model.default(), seeds=range(2), duration=SHORT, method="energy")
    for answer in found.logs:
        alone = identify(Model.default(), [simulated(seed=answer.seed, duration=SHORT)], method="energy")
        assert {n: e.value for n, e in answer.parameters.items()} == {
            n: row.value for n, row in alone.parameters.items()
        }
    assert found.summary.parameters["X5"].truth == 4.6701


def test_what_is_asked_can_be_handed_to_another_process(monkeypatch):
    def elsewhere(*asked):
        setting, sources, *_ = pickle.loads(pickle.dumps(asked[:2]))
        yield from ((k, one_log.analyse_log(setting, source)) for k, source in sources.items())

    monkeypatch.setattr(runner, "analyses_as_completed", elsewhere)
    log = simulated(duration=SHORT)
    assert campaign(Model.default(), [log], method="inverse").logs[0].failure is None
    assert campaign(Model.default(), seeds=[0], duration=SHORT, method="inverse").logs[0].failure is None


@pytest.mark.slow
def test_logs_in_memory_answer_as_logs_do():
    logs = [simulated(seed=seed, duration=SHORT) for seed in (0, 1)]
    columns = [{"t": x.t, "v_in": x.voltage, **dict(zip(x.channels, x.measured.T, strict=True))} for x in logs]
    found = campaign(Model.default(), columns, method="inverse").logs
    assert [answer.log for answer in found] == ["log 1", "log 2"]
    for answer, log in zip(found, logs, strict=True):
        assert answer.parameters == campaign(Model.default(), log, method="inverse").logs[0].parameters
    del columns[1]["v_in"]
    with pytest.raises(Failure, match="log 2: the column v_in is missing"):
        campaign(Model.default(), columns, method="inverse")


def test_a_campaign_hides_what_simulate_hides():
    found = campaign(Model.default(), seeds=[3], duration=SHORT, hide={"coulomb_drive": 0.3}, method="inverse")
    alone = identify(Model.default(), [simulated(seed=3, duration=SHORT, coulomb_drive__torque=0.3)], method="inverse")
    assert found.logs[0].parameters["X6"].value == alone.parameters["X6"].value
    assert found.summary.hidden == ("coulomb_drive",)


def test_a_log_that_fails_has_its_message_and_the_others_go_on(workspace):
    data = json.loads(run("campaign", "drive0.csv", "broken.csv", "gone.csv", "--json", "-").stdout)
    assert (data["schema"], data["do"], data["summary"]["logs"], data["summary"]["failed"]) == (1, "identify", 3, 2)
    good, broken, gone = lines(workspace / "campaign.csv")
    assert (good["log"], good["failure"], float(good["X1_sigma"]) > 0) == ("drive0.csv", "", True)
    assert "theta_w" in broken["failure"]
    assert "must exist" in gone["failure"]
    assert broken["X1"] == ""


def test_where_no_log_is_of_use_the_command_fails_and_still_writes_the_messages(workspace):
    result = run("campaign", "broken.csv", "gone.csv", "--json", "-", code=1)
    assert "none of 2 is" in json.loads(result.stdout)["failure"]
    assert len(lines(workspace / "campaign.csv")) == 2


@pytest.mark.slow
def test_an_interrupted_campaign_goes_on_where_it_stopped(tmp_path):
    keep, asked = tmp_path / "c.results", {"seeds": range(2), "duration": SHORT, "method": "inverse"}
    with pytest.raises(KeyboardInterrupt):
        campaign(Model.default(), **asked, keep=keep, progress=interrupt)
    said = []
    found = campaign(Model.default(), **asked, keep=keep, progress=said.append)
    assert "1 of 2 logs" in said
    assert tuple(found.logs) == campaign(Model.default(), **asked).logs


@pytest.mark.slow
def test_the_same_question_costs_nothing_and_another_is_put_beside(tmp_path, monkeypatch):
    keep = tmp_path / "c.results"
    asked = {"duration": SHORT, "keep": keep}
    first = campaign(Model.default(), seeds=[0, 1], method="inverse", **asked)
    other = campaign(Model.default(), seeds=[0], method="energy", **asked)
    assert len(list(keep.iterdir())) == 2 and all(path.name.startswith("question=identify-") for path in keep.iterdir())

    def refuse(*given):
        raise AssertionError("a log is analysed again")

    monkeypatch.setattr(one_log, "analyse_log", refuse)
    monkeypatch.setattr(cluster, "analyse_log", refuse)
    monkeypatch.setattr(runner, "compile_and_try_first", refuse)
    again = campaign(Model.default(), seeds=[1, 0], method="inverse", **asked)
    assert list(again.logs) == list(first.logs)[::-1]
    assert list(campaign(Model.default(), seeds=[0], method="energy", **asked).logs) == list(other.logs)


def test_an_interruption_says_what_is_kept_and_leaves_no_table(workspace, monkeypatch):
    def add(self, source, found):
        raise KeyboardInterrupt

    monkeypatch.setattr(runner.ResultSet, "add", add)
    result = run("campaign", "drive0.csv", "--method", "inverse", code=130)
    assert "goes on from there" in result.stderr
    assert not (workspace / "campaign.csv").exists()


def test_the_table_of_an_earlier_campaign_is_no_log_and_no_log_is_written_over(workspace):
    command = ("campaign", "drive0.csv", "drive1.csv", "--method", "inverse")
    run(*command)
    assert "left out" in run(*command, "campaign.csv", "campaign.results").stderr
    assert len(lines(workspace / "campaign.csv")) == 2
    assert "must be another file" in run(*command, "--out", "drive0.csv", code=1).stderr
    assert "beside the folder" in run(*command, "--out", "all.results", code=1).stderr


def test_a_campaign_is_of_measured_or_of_simulated_logs(workspace):
    run("campaign", code=2)
    run("campaign", "drive0.csv", "--simulate", code=2)
    run("campaign", "drive0.csv", "--hide", "slope=0.01", code=2)
    assert "given once" in run("campaign", "drive0.csv", "./drive0.csv", code=1).stderr


def test_what_no_log_could_answer_is_refused_at_once():
    for wrong, message in (
        ({"do": "identfy"}, "Did you mean 'identify'"),
        ({"method": "guess"}, "No method named"),
        ({"hide": {"columb": 1.0}}, "Known effects"),
        ({"command": "wild"}, "No command named"),
    ):
        with pytest.raises(Failure, match=message):
            campaign(Model.default(), seeds=[0], **wrong)


def test_what_a_log_says_of_itself_stands_in_its_answer_once(monkeypatch):
    said, new = "theta_p jumps by 2 rad at t = 1 s.", "theta_w counts the other way."
    findings = [SimpleNamespace(sentence=s) for s in (said, new)]
    monkeypatch.setattr(one_log, "inspect_for_model", lambda model, log: SimpleNamespace(findings=findings))
    log = replace(simulated(duration=SHORT), warnings=(f"{said} The log is split there.",))
    answer = campaign(Model.default(), [log], method="energy").logs[0]
    assert sum(said in w for w in answer.warnings) == 1
    assert answer.warnings[1] == new
