"""Stretches held out, the next log, an effect of one's own, parameters that moved: what panels make of results."""

import os
import stat
import time

import numpy as np
import pytest

from tests.support import simulated
from tests.view.serving import needs_nicegui
from tests.view.test_bench import found, worked_off
from wheelpend import Model, save_log
from wheelpend.view.bench import Bench

pytestmark = needs_nicegui
PLANT = Model.default().plant_signature


@pytest.fixture
def bench(tmp_path):
    Model.default().save(tmp_path)
    save_log(tmp_path / "a.csv", simulated(duration=4.0))
    save_log(tmp_path / "b.csv", simulated(duration=2.0))
    return Bench(tmp_path, [tmp_path / "a.csv"], [tmp_path / "b.csv"])


def split(bench, path, begin, end):
    bench.hold_out_stretch(path, begin, end)
    while bench.job is not None and bench.job.words[0] == "split":
        bench.tick()
        time.sleep(0.05)
    assert not bench.failure
    bench.cancel()
    worked_off(bench)


def names(paths):
    return [path.name for path in paths]


def test_a_stretch_is_held_out_moved_and_given_back(bench):
    (source,) = bench.logs
    split(bench, source, 1.0, 2.0)
    assert names(bench.logs) == ["a_without_1-2s.csv"] and names(bench.holdout) == ["b.csv", "a_1-2s.csv"]
    assert bench.done[1].startswith("wheelpend compare ")  # what judges is another, so it is asked at once
    split(bench, bench.logs[0], 2.0, 3.0)  # moved: of the whole log again
    assert names(bench.logs) == ["a_without_2-3s.csv"] and names(bench.holdout) == ["b.csv", "a_2-3s.csv"]
    assert f"split {source} --from 2" in bench.done[2]
    bench.join(bench.logs[0])
    assert bench.logs == [source] and names(bench.holdout) == ["b.csv"] and not bench.splits


def test_a_stretch_that_cannot_be_held_out_leaves_the_logs_as_they_are(bench):
    bench.hold_out_stretch(bench.logs[0], 3.0, 1.0)
    worked_off(bench)
    assert "must end after it begins" in bench.failure
    assert names(bench.logs) == ["a.csv"] and names(bench.holdout) == ["b.csv"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must name an effect"),
        ("[a", "TOML"),
        ('[slope]\nlaw = "1"', "in the library"),
        ('[mine]\nfamily = "drive"\nsentence = "x"\non = "drive"\nlaw = "__import__(1)"\nparameters.a = '
         '{ unit = "V", typical = 1 }', "[mine]"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_an_effect_is_said_while_it_is_typed(text, words):
    from wheelpend.view.own_effect import checked

    assert words in checked(text, PLANT, []).sentence and not checked(text, PLANT, []).is_right


def test_the_text_to_begin_with_is_right_and_its_law_is_drawn():
    from wheelpend.view.own_effect import checked, template

    said = checked(template(PLANT), PLANT, [])
    (line,) = said.law.data
    assert said.is_right and "my_friction" in said.sentence
    np.testing.assert_allclose(line.y, 0.3 * np.tanh(np.array(line.x) / 3.0), atol=1e-12)
    assert "is in effects.toml already" in checked(template(PLANT), PLANT, ["my_friction"]).sentence


def test_pairs_that_a_diagnosis_cannot_tell_apart_are_offered():
    from wheelpend.view.design_form import pairs_to_tell

    result = {"candidates": [{"effect": "slope", "equivalent_to": ["com_offset"]}, {"effect": "cogging"}]}
    assert pairs_to_tell(result) == ["slope or com_offset"] and pairs_to_tell({}) == []


def test_parameters_are_drawn_once_two_changes_have_them():
    from wheelpend.view.add_panel import parameter_figure

    def entry(change, **values):
        return {"change": change, "parameters": {n: {"value": v, "sigma": s} for n, (v, s) in values.items()}}

    first, second = entry("add slope", X1=(2.0, 0.1)), entry("add cogging", X1=(1.0, 0.05), X2=(3.0, None))
    assert parameter_figure([first]) is None
    before, after = parameter_figure([first, second]).data
    assert (list(before.y), list(before.x), list(after.x)) == (["X1"], [2.0], [1.0])
    assert before.error_x.array[0] == pytest.approx(0.196) and after.error_x.array[0] == pytest.approx(0.098)
    for spoilt in ({"parameters": 3}, {"parameters": {"X1": [1]}}, {"parameters": {"X1": {"value": "x"}}}, {}):
        assert parameter_figure([spoilt, first, second]) is not None


def test_the_band_of_the_residuals_is_drawn_to_both_sides():
    from wheelpend.view.residual_tests import autocorrelation_figure

    found = {"lags_s": [0.1, 0.2], "autocorrelation": [0.5, -0.1], "band": [0.2, 0.2]}
    line, low, high = autocorrelation_figure({"theta": found}).data
    assert list(line.y) == [0.5, -0.1] and list(low.y) == [-0.2, -0.2] and list(high.y) == [0.2, 0.2]
    assert autocorrelation_figure({"theta": {}}) is None


def test_an_effect_written_meanwhile_makes_an_older_answer_old(bench):
    found(bench, "diagnose", verdict="nothing_missing")
    assert bench.current("diagnose") is not None
    (bench.folder / "effects.toml").write_text("# none yet\n", encoding="utf-8")
    assert bench.current("diagnose") is None


def test_the_token_stands_on_no_command_line(tmp_path):
    from wheelpend.view.server import opening_page

    first = opening_page("http://127.0.0.1:1/?token=secret", tmp_path)
    assert "token=secret" in first.read_text() and "secret" not in first.name
    assert stat.S_IMODE(first.stat().st_mode) == 0o600
    second = opening_page("http://127.0.0.1:2/?token=other", tmp_path)
    assert list(tmp_path.iterdir()) == [second]  # what a killed workbench left is gone


def test_folders_that_a_killed_workbench_left_go_once_nothing_can_write_there(tmp_path, monkeypatch):
    from wheelpend.view import jobs

    monkeypatch.setattr(jobs.tempfile, "gettempdir", lambda: str(tmp_path))
    gone = 2**22 + 1  # larger than any number of a process
    for name in (f"{gone}-a", f"{gone}-young", f"{os.getpid()}-b", "c-d"):
        (tmp_path / f"{jobs.PLACE_PREFIX}{name}").mkdir()
        if "young" not in name:
            os.utime(tmp_path / f"{jobs.PLACE_PREFIX}{name}", (0.0, 0.0))
    jobs.clear_stale_places()
    left = {path.name.removeprefix(jobs.PLACE_PREFIX) for path in tmp_path.iterdir()}
    assert left == {f"{gone}-young", f"{os.getpid()}-b", "c-d"}
