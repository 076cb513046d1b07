"""Many logs are asked the same, and the summary says what their answers have in common."""

import csv
import json
import pickle

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.conftest import simulated
from wheelpend import Failure, Model, campaign, identify, parallel, save_log
from wheelpend.campaigns import runner
from wheelpend.campaigns.one_log import Estimate, LogResult, NamedEffect, SimulationSpec
from wheelpend.campaigns.summary import parameter_agreement, parameter_recovery, summarise
from wheelpend.cli.main import app

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


def run(*arguments, code=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == code, result.output + str(result.exception)
    return result


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
            n: row["value"] for n, row in alone.parameters.items()
        }
    assert found.summary.parameters["X5"].truth == 4.6701


def test_what_is_asked_can_be_handed_to_another_process(monkeypatch):
    def elsewhere(jobs):
        yield from ((k, pickle.loads(pickle.dumps(job))()) for k, job in enumerate(jobs))

    monkeypatch.setattr(runner, "as_they_end", elsewhere)
    log = simulated(duration=SHORT)
    assert campaign(Model.default(), [log], method="inverse").logs[0].failure is None
    assert campaign(Model.default(), seeds=[0], duration=SHORT, method="inverse").logs[0].failure is None


def test_a_campaign_hides_what_simulate_hides():
    found = campaign(Model.default(), seeds=[3], duration=SHORT, hide={"coulomb_drive": 0.3}, method="inverse")
    alone = identify(Model.default(), [simulated(seed=3, duration=SHORT, coulomb_drive__torque=0.3)], method="inverse")
    assert found.logs[0].parameters["X6"].value == alone.parameters["X6"]["value"]
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


def test_an_interrupted_campaign_goes_on_where_it_stopped(tmp_path):
    keep, asked = tmp_path / "c.partial", {"seeds": range(2), "duration": SHORT, "method": "inverse"}
    with pytest.raises(KeyboardInterrupt):
        campaign(Model.default(), **asked, keep=keep, progress=interrupt)
    said = []
    found = campaign(Model.default(), **asked, keep=keep, progress=said.append)
    assert "1 of 2 logs" in said
    assert found.logs == campaign(Model.default(), **asked).logs


def test_answers_of_another_setting_are_put_aside_and_not_taken_up(tmp_path):
    keep = tmp_path / "c.partial"
    with pytest.raises(KeyboardInterrupt):
        campaign(Model.default(), seeds=[0, 1], duration=SHORT, method="inverse", keep=keep, progress=interrupt)
    said, before = [], keep.read_text()
    campaign(Model.default(), seeds=[0], duration=SHORT, method="energy", keep=keep, progress=said.append)
    assert "0 of 1 logs" in said and any("put aside" in text for text in said)
    assert (tmp_path / "c.partial.other").read_text() == before != keep.read_text()


def test_an_interruption_says_what_is_kept_and_leaves_no_table(workspace, monkeypatch):
    def add(self, source, found):
        raise KeyboardInterrupt

    monkeypatch.setattr(runner.Kept, "add", add)
    result = run("campaign", "drive0.csv", "--method", "inverse", code=130)
    assert "goes on from there" in result.stderr
    assert not (workspace / "campaign.csv").exists()


def test_the_table_of_an_earlier_campaign_is_no_log_and_no_log_is_written_over(workspace):
    command = ("campaign", "drive0.csv", "drive1.csv", "--method", "inverse")
    run(*command)
    assert "left out" in run(*command, "campaign.csv").stderr
    assert len(lines(workspace / "campaign.csv")) == 2
    assert "must be another file" in run(*command, "--out", "drive0.csv", code=1).stderr


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


def test_logs_of_one_value_agree_and_one_that_is_off_is_named():
    sigma, names = np.full(20, 0.1), [f"drive{k}" for k in range(20)]
    values = 2.0 + np.random.default_rng(0).normal(size=20) * sigma
    assert parameter_agreement(names, np.column_stack([values, sigma])).p_value > 0.05
    values[7] = 3.0
    off = parameter_agreement(names, np.column_stack([values, sigma]))
    assert off.p_value < 1e-9
    assert off.furthest.log == "drive7"
    assert off.furthest.sigmas == pytest.approx(10.0, abs=3.0)


def test_chi_square_is_that_of_the_weighted_mean():
    found = parameter_agreement(["a", "b"], np.array([[1.0, 1.0], [4.0, 2.0]]))
    assert found.mean == pytest.approx((1.0 + 4.0 / 4.0) / 1.25)
    assert found.chi_square == pytest.approx(9.0 / 5.0)  # difference squared over the sum of the variances


def test_bias_spread_and_coverage_are_those_of_the_estimates():
    found = parameter_recovery([1.0, 2.0, 6.0], [(1.0, 0.1), (2.0, 1.0), (6.0, 3.0)], truth=2.0)
    assert (found.mean, found.bias, found.inside) == (3.0, 1.0, (2, 3))
    assert found.spread == pytest.approx(np.std([1.0, 2.0, 6.0], ddof=1))


def diagnosed(*named, verdict="effect_missing", **parameters):
    told = tuple(NamedEffect(effect, tuple(equivalent)) for effect, *equivalent in named)
    estimates = {n.replace("__", "."): Estimate(v, 0.1) for n, v in parameters.items()}
    return LogResult("log", verdict=verdict, named=told, effects=tuple(n.effect for n in told), parameters=estimates)


def test_what_is_hidden_counts_as_found_where_it_or_an_equivalent_is_named():
    told = [diagnosed(("slope",)), diagnosed(("com_offset", "slope")), diagnosed(("coulomb_drive",))]
    found = summarise(Model.default(), SimulationSpec("aggressive", SHORT, {"slope.angle": 0.01}), told)
    assert found.first_right == (2, 3)
    assert found.found == {"slope": (2, 3)}
    assert found.named == {"slope": 1, "com_offset": 1, "coulomb_drive": 1}
    assert found.false_alarms is None


def test_what_is_named_where_nothing_is_hidden_is_a_false_alarm():
    told = [diagnosed(verdict="nothing_missing"), diagnosed(("slope",)), diagnosed(verdict="unexplained")]
    assert summarise(Model.default(), SimulationSpec("aggressive", SHORT, {}), told).false_alarms == (2, 3)


def test_parameters_are_those_of_the_model_that_most_logs_end_with():
    told = [diagnosed(("slope",), slope__angle=0.01)] * 2 + [diagnosed(("com_offset",), com_offset__angle=0.5)]
    found = summarise(Model.default(), None, told)
    assert (found.effects, list(found.parameters)) == (("slope",), ["slope.angle"])
