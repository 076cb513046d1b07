"""The report tells what was missing, fetches nothing, and takes no text from a log for markup."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import plotly.graph_objects as go
import pytest

from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.explain import Ladder, Step
from wheelpend.diagnosis.missing_force.estimate import ForceConcentration
from wheelpend.diagnosis.missing_force.smoothed_force import missing_forces
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import EffectEstimate, Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameter_table import parameter_table
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.validation import validation_residuals
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import typeset_estimate_text, typeset_number_text, typeset_p_value_text
from wheelpend.reports.page.charts import page_charts
from wheelpend.reports.page.equations import Equation, equation_rows, equation_terms
from wheelpend.reports.page.figures import residual_comparisons
from wheelpend.reports.page.force_figures import (
    bin_means,
    law_over_state,
    missing_force_if_true,
    quantile_bins,
    state_figure,
)
from wheelpend.reports.page.packing import figure_text
from wheelpend.reports.page.page import page_html, write_report
from wheelpend.reports.page.thinning import segment_samples
from wheelpend.simulation.closed_loop import ClosedLoop

ROBOT = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256}
DEGREE = np.pi / 180
TORQUE = "coulomb_drive.torque"
HOSTILE = "<script>alert('log')</script>.csv"


def robot(torque: float) -> Log:
    """Noisy closed-loop log of 6 s with dry friction in the drive, under a hostile name."""
    module = kernels.library_module("wheel_pendulum", {})
    t = np.arange(3_001) * 2e-3
    reference = DEGREE * (3 * np.sin(7 * t) + 6 * (np.cos(4 * t) - np.sin(t)) + 10 * np.cos(3 * t) * np.sin(5 * t) ** 2)
    values = ROBOT | {"R": 0.2413, "g": 9.81, "alpha": 165.42, "J_w": 0.1339}
    values[TORQUE] = torque
    parameters = np.array([values.get(*pair) for pair in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    noise = np.random.default_rng(3).normal(size=(t.size, 3)) * [0, 0.5 * DEGREE, 0.5 * DEGREE]
    loop, quantum = ClosedLoop(module, np.array([-168.0, -800.0, -8.8])), np.array([2 * np.pi / 60000, 0.0, 0.0])
    run = loop.play(t, reference, np.gradient(reference, t), np.zeros(4), parameters, noise, quantum)
    return Log(HOSTILE, t, run.input, run.measured, ("theta_w", "theta_p", "dtheta_p"))


@pytest.fixture(scope="module")
def explanation() -> Ladder:
    """A ladder of one step, its two models fitted from the truth and nothing screened."""
    problem = prepare(Model.default(), [robot(0.3)])
    old, new = (fit_from_the_truth(problem, effects) for effects in ([], ["coulomb_drive"]))
    errors = [validation_residuals(problem, fitted)[0] for fitted in (old, new)]
    found = EffectEstimate("coulomb_drive", {"torque": Estimate(new.values[TORQUE], new.sigma(TORQUE), "V")})
    tried = CandidateFit(found.effect, found.estimates, "drive", 0.0, "5/5", errors[1], (), True, new)
    missing = missing_forces(problem, old)
    where = (ForceConcentration("wheel", "dtheta_w - dtheta_p", -2.0, 7.0, 0.6),)
    first = Diagnosis("effect_missing", 0.5, errors[0], problem.floor, {}, (tried,), None, {}, where, {}, (), old,
                      problem, missing)  # fmt: skip
    last = replace(first, verdict="nothing_missing", candidates=(), detectable={"slope": {"angle": 0.01}}, fit=new)
    step = Step(found.effect, found.estimates, 0.0, (), *errors, {n: new.values[n] for n in problem.base})
    model = problem.model.with_effects(["coulomb_drive"])
    changed = replace(problem, model=model)
    return Ladder("nothing_missing", 99.0, errors[0], (step,), ("coulomb_drive",), errors[1], problem.floor, 0.5,
                       parameter_table(changed, new), None, (), model, first, last, new, changed)  # fmt: skip


def fit_from_the_truth(problem: EstimationProblem, effects: list[str]) -> Fit:
    start = {**problem.model.constants, **ROBOT, TORQUE: 0.3 if effects else 0.0}
    return fit_model(problem, start, free_names(problem, effects), horizons=(1.0,))


@pytest.fixture(scope="module")
def page(explanation: Ladder, tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    return write_report(explanation, path, command="wheelpend report <log>").read_text(encoding="utf-8")


def without_scripts(page: str) -> str:
    return re.sub(r"<script\b[^>]*>.*?</script>", "", page, flags=re.DOTALL)


def test_the_page_names_the_missing_effect_and_its_size(page: str):
    size, change = r"0\.(3|30\d|29\d) V", r"[\d.]+ → [\d.]+ σ"
    title = rf"Dry friction in motor and gearbox \(coulomb_drive\), {size}: that explains [a-z ]+, {change}"
    assert re.search(rf"<title>{title}</title>", page) and re.search(rf"<h1>{title}</h1>", page)
    assert re.search(r"\(coulomb_drive\): torque 0\.(30|29)\d* ± 0\.\d+ V \(4\d\.\d N·m, .* % of the rms", page)


def test_nothing_is_fetched_from_a_network(page: str):
    own = without_scripts(page)
    assert not re.search(r"""(src|href)\s*=|url\(|@import|https?://""", own)
    assert "default-src 'none'" in own
    assert page.count("plotly.js (basic") == 1


def test_a_hostile_log_name_stays_text(page: str):
    assert HOSTILE not in page
    assert "&lt;script&gt;alert(" in page
    assert "wheelpend report &lt;log&gt;" in page


def test_the_new_term_is_marked_with_opposite_signs_on_both_rows(page: str):
    marked = re.findall(r"<mark>(.*?)</mark>", page)
    assert [m[0] for m in marked if "coulomb_drive.torque" in m] == ["+", "−"]


def test_every_section_is_readable_without_scripts(page: str):
    headings = re.findall(r"<h2>(.*?)</h2>", without_scripts(page))
    assert '<section id="try" hidden>' in page, "sliders need scripts, and are absent without"
    headings.remove("Try it")
    assert headings[:4] == [
        "The error, step by step",
        "Measured against predicted",
        "Where the model failed, before anything was added",
        "Candidates",
    ]
    assert headings[4:] == [
        "The effects, drawn",
        "Is the rest noise?",
        "How the parameters moved",
        "The equations before and after",
        "Provenance",
    ]


def charts_of(page: str) -> list[dict]:
    return [json.loads(text) for text in re.findall(r"<script [^>]*data-chart=[^>]*>(.*?)</script>", page, re.DOTALL)]


def test_the_page_has_at_most_one_and_a_half_megabytes(page: str):
    assert 1_200_000 < len(page.encode()) < 1_500_000


def test_many_logs_leave_the_page_as_light(explanation: Ladder):
    first = explanation.first
    missing = tuple(first.missing[0]._replace(log=f"{k}") for k in range(5))
    judged = explanation.problem.data.validation * 5
    problem = replace(explanation.problem, data=replace(explanation.problem.data, validation=judged))
    several = replace(explanation, problem=problem, first=replace(first, missing=missing))
    page = page_html(several)
    assert len([c for c in charts_of(page) if len(c["data"]) > 10]) == 3
    assert len(page.encode()) < 1_500_000


def test_no_chart_needs_more_than_the_script_can_draw(page: str):
    assert {trace["type"] for chart in charts_of(page) for trace in chart["data"]} == {"bar", "scatter"}
    assert "plotly.js (basic - minified)" in page


def test_the_held_out_residuals_are_those_of_the_ladder(explanation: Ladder):
    (shown,) = residual_comparisons(explanation)
    before, after = (np.sqrt(np.nanmean(r**2)) for r in (shown.before, shown.after))
    assert before == pytest.approx(explanation.base_error, rel=0.05)
    assert after == pytest.approx(explanation.error, rel=0.05)


def test_dry_friction_opposes_the_slip_on_the_wheel_and_helps_it_on_the_body(explanation: Ladder):
    tried, slip = explanation.first.candidates[0], np.array([-1.0, 0.0, 1.0])
    laws = [law_over_state(explanation.problem, tried, row, "dtheta_w - dtheta_p")(slip) for row in (0, 1)]
    torque = tried.coefficients["torque"]
    assert laws[0] == pytest.approx([torque, 0.0, -torque])
    assert laws[1] == pytest.approx([-torque, 0.0, torque])
    assert law_over_state(explanation.problem, tried, 0, "theta_p") is None


def test_the_true_effect_runs_through_the_means_of_the_missing_force(explanation: Ladder):
    first, row = explanation.first, 0
    slip, expected = (
        first.missing[0].variables["dtheta_w - dtheta_p"],
        missing_force_if_true(first, first.candidates[0]),
    )
    means = [bin_means(slip, force[:, row], quantile_bins(slip))[:, 1] for force in (expected, first.missing[0].force)]
    assert np.corrcoef(*means)[0, 1] > 0.8


def equations_between(before: list[str], after: list[str]) -> list[Equation]:
    """The page's equations of the paper's robot with some effects before and others after."""
    first = SimpleNamespace(problem=SimpleNamespace(model=SimpleNamespace(effects=before)))
    return equation_rows(SimpleNamespace(model=Model.default(), effects=after, first=first))


@pytest.mark.parametrize("effect", ["drive_compliance", "backlash", "wheel_slip", "slosh"])
def test_the_equations_of_what_moves_inside_are_new_and_go_with_it(effect):
    new = {e.row: e for e in equations_between([], [effect])}
    old = {e.row: e for e in equations_between([effect], [])}
    (row,) = [r for r, e in new.items() if not e.before]
    assert {t.mark for t in new[row].after} == {"new"} and {t.mark for t in old[row].before} == {"gone"}
    assert not old[row].after and new.keys() == old.keys()
    assert all(t.mark == "" for e in equations_between([effect], [effect]) for t in (*e.before, *e.after))


def test_no_force_is_drawn_of_an_effect_that_the_kernels_at_hand_do_not_have(explanation: Ladder):
    first = explanation.first
    other = replace(first.candidates[0], effect="drive_compliance")
    assert missing_force_if_true(first, other) is None and missing_force_if_true(first, first.candidates[0], 7) is None


def test_the_missing_force_of_every_log_has_a_chart_and_its_band_over_a_state(explanation: Ladder):
    first, q = explanation.first, plant_units_of(explanation.model)
    both = replace(first, missing=(*first.missing, first.missing[0]._replace(log="another")))
    charts = page_charts(replace(explanation, first=both), q).force
    assert [name for name, _ in charts] == [HOSTILE, "another"]
    assert ['id="force0"' in charts[0][1], 'id="force1"' in charts[1][1]] == [True, True]
    band = next(t for t in state_figure(first, q).data if t.fill == "toself")
    means = next(t for t in state_figure(first, q).data if t.error_y.array is not None)
    half = 0.5 * (band.y[: len(means.y)] - band.y[: len(means.y) - 1 : -1])
    assert half == pytest.approx(2.0 * np.sqrt(np.mean(first.missing[0].sigma[:, 0] ** 2)), rel=0.5)


def test_samples_of_one_visit_to_a_bin_are_no_independent_ones():
    x, y = np.tile(np.repeat([0.0, 1.0], 50), 8), np.random.default_rng(0).normal(size=800)
    errors = bin_means(x, y, x.astype(int))[:, 2]
    assert errors == pytest.approx(np.ones(2) / np.sqrt(8), rel=0.15)


def test_thinning_keeps_every_peak_and_a_break_after_each_segment():
    values = np.sin(np.linspace(0, 90, 20_000))
    values[[777, 13_001]] = 9.0, -9.0
    values[5_000:5_100] = np.nan
    bounds = np.array([[k, k + 1_000] for k in range(0, 20_000, 1_000)])
    chosen = segment_samples(bounds, [values, -values], 800)
    assert len(chosen) <= 800 and (chosen == -1).sum() == 20
    assert {777, 13_001} <= {*chosen.tolist()} and np.all(np.diff(chosen[chosen >= 0]) > 0)
    assert len(segment_samples(bounds, [values], 60)) <= 60  # more segments than points: one line


def test_figures_are_packed_without_a_visible_loss():
    x, y = np.linspace(0, 1, 500), np.random.default_rng(0).normal(size=500)
    y[3] = np.nan
    traces = json.loads(figure_text(go.Figure([go.Scatter(x=x, y=y), go.Scatter(x=x, y=np.r_[y[:-1], 1e9])])))["data"]
    assert traces[1]["x"] == {"again": 0}, "an array is written once"
    packed = traces[0]["y"]
    read = np.frombuffer(b64decode(packed["packed"]), "<i2") * packed["step"] + packed["middle"]
    assert read[4:] == pytest.approx(y[4:], abs=1e-4 * np.nanmax(np.abs(y))) and np.ptp(read) > np.nanmax(y)
    assert "bdata" in traces[1]["y"], "a value far out leaves the others their digits"


def test_a_model_that_misses_nothing_has_a_page(explanation: Ladder, tmp_path: Path):
    quiet = replace(explanation.first, verdict="nothing_missing", candidates=(), where=(), missing=(),
                    detectable={"slope": {"angle": 0.01}})  # fmt: skip
    bare = replace(explanation, verdict="nothing_missing", steps=(), effects=(), nominal_error=None, first=quiet,
                   last=quiet, fit=quiet.fit, problem=quiet.problem)  # fmt: skip
    page = write_report(bare, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Nothing is missing in this model" in page
    assert "Where the model failed" not in page
    assert "angle 0.01 rad" in page


def test_without_alpha_no_torque_is_shown(explanation: Ladder, tmp_path: Path):
    model = replace(explanation.model, constants={})
    page = write_report(replace(explanation, model=model), tmp_path / "report.html").read_text(encoding="utf-8")
    assert "N·m" not in without_scripts(page)


def test_an_ambiguous_finding_says_what_would_decide_it(explanation: Ladder, tmp_path: Path):
    step = replace(explanation.steps[0], equivalent_to=("rolling_resistance",))
    unsure = replace(explanation, verdict="ambiguous", steps=(step,), experiment="Lift the wheels & repeat.")
    page = write_report(unsure, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "These data cannot tell coulomb_drive from rolling_resistance." in page
    assert "Lift the wheels &amp; repeat." in page


def test_a_folder_that_is_not_there_is_named(explanation: Ladder, tmp_path: Path):
    with pytest.raises(Failure, match="cannot be written"):
        write_report(explanation, tmp_path / "absent" / "report.html")


def test_a_sensor_effect_and_a_delay_show_in_the_equations():
    import derive

    found = equation_terms(derive.compose("wheel_pendulum", {}, ["imu_bias", "actuator_delay"]))
    assert "+ imu_bias.bias" in found["sensor theta_p ="]
    assert "actuator_delay.delay" in found["command:"][0]


def test_numbers_are_written_for_people():
    assert (typeset_number_text(-0.000012345), typeset_number_text(None), typeset_number_text(float("inf"))) == (
        "−1.234×10⁻⁵",
        "–",
        "–",
    )
    assert typeset_estimate_text(0.30012, 0.00043) == "0.30012 ± 0.00043"
    assert (typeset_p_value_text(0.0), typeset_p_value_text(3e-5), typeset_p_value_text(None)) == (
        "< 10⁻¹²",
        "3×10⁻⁵",
        "–",
    )
