"""The report says whether the rest is noise, what its parameters are, and which files it was made from."""

import hashlib
import re
from dataclasses import replace

import numpy as np

from tests.reports.test_page import explanation  # noqa: F401  # a fixture
from tests.support import simulated
from wheelpend import load_log, save_log
from wheelpend.errors import Failure
from wheelpend.identification import residual_tests
from wheelpend.identification.residual_tests import ChannelResidual, ResidualTests
from wheelpend.model.record import Model
from wheelpend.reports.page import innovations
from wheelpend.reports.page.correlations import correlation_table
from wheelpend.reports.page.digests import log_file_rows
from wheelpend.reports.page.page import page_html
from wheelpend.reports.page.rows import parameter_meanings

WHITE = ChannelResidual(True, 0.6, 0.4, 1.0, 1e-3, False, 0.0, (0.1,), (0.01,), (0.05,), (), 900)
COLOURED = replace(WHITE, white=False, whiteness_p=1e-9, independent_of_input_p=1e-5, sigma_ratio=2.5)


def test_the_page_says_of_each_channel_whether_its_rest_is_noise(explanation):  # noqa: F811
    tests = ResidualTests({"theta_w": WHITE, "theta_p": COLOURED}, None, False, ())
    page = page_html(explanation, tests=tests)
    section = page[page.index("Is the rest noise?") : page.index("How the parameters moved")]
    cells = [re.findall(r"<td.*?>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", section)]
    assert [row[:2] + row[4:5] for row in cells if row] == [["θw", "yes", "1"], ["θp", "no", "2.5"]]
    assert "<p>θw: white, at the noise found in the log.</p>" in section
    assert "It is 2.5 times as large as expected: something is missing in the model. Past inputs predict it" in section
    assert "Is the rest noise?" not in page_html(explanation)


def test_residuals_that_cannot_be_tested_are_a_sentence(explanation, monkeypatch):  # noqa: F811
    monkeypatch.setattr(residual_tests, "MAX_TESTED_SAMPLES", 10)
    assert "but they have 3001. `wheelpend residuals LOG` tests them." in innovations.residual_tests_of(explanation)
    monkeypatch.undo()

    def failing(*_):
        raise Failure("no start")

    monkeypatch.setattr(innovations, "residuals", failing)
    said = innovations.residual_tests_of(explanation)
    assert f"<p>{said}</p>" in page_html(explanation, tests=said) and said.endswith("tested: no start")


def test_parameters_that_hide_behind_each_other_are_named(explanation):  # noqa: F811
    known = explanation.fit
    covariance = np.diag(np.arange(1.0, len(known.names) + 1.0))
    assert correlation_table(replace(known, covariance=covariance)).sentence.startswith("No two parameters hide")
    assert "−0.00" not in page_html(replace(explanation, fit=replace(known, covariance=covariance)))
    covariance[0, 2] = covariance[2, 0] = -0.95 * np.sqrt(covariance[0, 0] * covariance[2, 2])
    found = replace(explanation, fit=replace(known, covariance=covariance))
    page = page_html(found)
    assert "These logs know a combination of X1 and X3 better than each of them" in page
    assert re.findall(r"<b>(−.*?)</b>", page) == ["−0.95"]


def test_each_parameter_has_its_unit_and_what_it_is_made_of(explanation):  # noqa: F811
    rows = dict(re.findall(r"<tr><td>(X\d)</td><td>(.*?</td><td>.*?)</td></tr>", page_html(explanation)))
    assert rows["X2"] == "V·s²/rad</td><td>inertia: 2·J_m·epsilon²/alpha"
    assert rows["X5"] == "V</td><td>weight: L·M·g/alpha"
    assert rows["X7"] == "V·s/rad</td><td>damping and back-EMF: (K_b·alpha + 2·f_m)/alpha"


def test_the_files_have_their_digests(explanation, tmp_path):  # noqa: F811
    path = tmp_path / "drive.csv"
    path.write_bytes(b"t,v_in\n0,1\n")
    page = page_html(explanation, files=[path, path, tmp_path])
    row = f"<td>drive.csv</td><td><code>{hashlib.sha256(path.read_bytes()).hexdigest()[:12]}</code></td>"
    assert page.count(row) == 1 and page.count("<code>") == 1


def test_without_files_the_logs_say_themselves_what_they_were_read_from(explanation, tmp_path):  # noqa: F811
    path = tmp_path / "drive.csv"
    path.write_bytes(b"t,v_in\n0,1\n")
    problem = explanation.problem
    (log,) = problem.logs
    known = replace(problem, data=replace(problem.data, estimation=(of_log(problem, replace(log, source=path)),)))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    assert f"<td>drive.csv</td><td><code>{digest}</code></td>" in page_html(replace(explanation, problem=known))
    (row,) = log_file_rows(problem)
    assert (row.name, row.changed) == (log.name, "values in memory") and row.size == 8 * (2 + 3) * len(log)
    other = replace(log, measured=log.measured + 1e-9)
    moved = replace(problem, data=replace(problem.data, estimation=(of_log(problem, other),)))
    assert log_file_rows(moved)[0].digest != row.digest
    path.unlink()
    assert log_file_rows(known)[0].changed == "values read from a file that has gone"


def of_log(problem, log):
    return replace(problem.data.estimation[0], log=log)


def test_a_log_that_is_read_knows_its_file_and_one_in_memory_has_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_log("drive.csv", simulated(duration=1.0))
    assert load_log("drive.csv").source == tmp_path / "drive.csv"
    assert load_log("drive.csv").part(0, 10).source == tmp_path / "drive.csv"
    assert simulated(duration=1.0).source is None


def test_a_parameter_of_a_free_pendulum_has_no_back_emf():
    free, driven = (Model.default(plant) for plant in ("pendulum", "cart_pole"))
    assert {said.partition(":")[0] for _, said in parameter_meanings(free).values()} == {"inertia"}
    said = {name: (unit, text.partition(":")[0]) for name, (unit, text) in parameter_meanings(driven).items()}
    assert said["X4"] == ("V·m", "weight") and said["X5"] == ("V·s/m", "damping and back-EMF")
