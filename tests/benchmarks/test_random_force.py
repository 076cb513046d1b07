"""The studies of random forces measure what they say: the bound, the forces, the machine, the journal, the counts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Failure, Model
from wheelpend.benchmarks.random_force import bound as bounds
from wheelpend.benchmarks.random_force.bound import efficient_estimates, efficient_solution, true_record
from wheelpend.benchmarks.random_force.forces import FIRST_ORDER_TIME_S, FORCE_KINDS, SHOT_TIME_S
from wheelpend.benchmarks.random_force.page import section_text, write
from wheelpend.benchmarks.random_force.runner import LAWFUL_EFFECTS, plan, run
from wheelpend.benchmarks.random_force.summary import (
    clustered_interval,
    complete_summary,
    force_summaries,
    lawful_summaries,
)
from wheelpend.benchmarks.random_force.trial import (
    Answer,
    Case,
    Found,
    FoundForce,
    hidden_values,
    model_with,
    size_name,
)
from wheelpend.estimation.free_parameters import known_values
from wheelpend.proportion import Proportion
from wheelpend.serialise import plain_data
from wheelpend.simulation.hidden import base_parameter_names, machine_values

MODEL = Model.default()
NAMES = base_parameter_names(MODEL)


# ---- the bound


def plain_least_squares(record):
    """Standard deviations and error of least squares over one trajectory from an unknown state, by normal equations."""
    columns = np.array([record.module.PARAMETERS.index(n) for n in NAMES])
    log, first = record.log, record.module.NX
    _, readings, derivative = record.module.sensitivities(
        log.t, log.voltage, record.states[0], record.parameters, columns, log.dt
    )
    rows = (derivative / record.sigma[:, None]).reshape(-1, derivative.shape[-1])
    size = np.abs(rows).max(axis=0)
    covariance = np.linalg.inv((rows / size).T @ (rows / size)) / np.outer(size, size)
    error = covariance @ rows.T @ ((log.measured - readings) / record.sigma).ravel()
    return np.sqrt(np.diag(covariance))[first:], error[first:]


@pytest.mark.parametrize("segment", [0.1, 0.25, 1.0])
def test_where_no_segment_is_needed_tied_segments_are_one_trajectory(segment):
    record = true_record(MODEL, simulated(seed=3, duration=2.0), 3)
    (sigma, error), (plain, off) = efficient_solution(record, NAMES, segment), plain_least_squares(record)
    assert sigma == pytest.approx(plain, rel=1e-6) and error / sigma == pytest.approx(off / plain, abs=1e-6)


def test_the_bound_of_a_long_record_does_not_depend_on_the_length_of_the_segments():
    record = true_record(MODEL, simulated(seed=1), 1)
    (short, error), (long, other) = (efficient_solution(record, NAMES, segment) for segment in (0.1, 1.0))
    assert short == pytest.approx(long, rel=1e-6) and error / short == pytest.approx(other / long, abs=1e-4)


def test_the_bound_of_the_papers_record_is_what_a_filter_predicts_of_itself():
    found, truth = efficient_estimates(MODEL, simulated(seed=1), 1), machine_values(MODEL, {})
    filters = {"X1": 0.051, "X2": 0.125, "X3": 0.025, "X4": 0.012, "X5": 0.013, "X7": 0.0083}  # %, measured
    assert {n: 100 * found[n].sigma / truth[n] for n in filters} == pytest.approx(filters, rel=0.05)


def test_the_efficient_estimate_errs_as_its_bound_says():
    found = [efficient_estimates(MODEL, simulated(seed=seed), seed) for seed in range(1, 9)]
    deviations = np.array([[e.error / e.sigma for e in log.values()] for log in found])
    assert 0.6 < np.sqrt(np.mean(deviations**2)) < 1.4 and np.abs(deviations).max() < 4


def test_untied_segments_would_know_less(monkeypatch):
    record = true_record(MODEL, simulated(seed=1), 1)
    tied, _ = efficient_solution(record, NAMES, 0.5)
    monkeypatch.setattr(bounds, "null_space", lambda equations: np.eye(equations.shape[1]))
    free, _ = efficient_solution(record, NAMES, 0.5)
    assert 3 < free[0] / tied[0] < 10


def test_a_bound_is_that_of_the_log_with_its_seed():
    with pytest.raises(ValueError, match="seed 4"):
        true_record(MODEL, simulated(seed=3, duration=2.0), 4)


# ---- forces


@pytest.mark.parametrize("name", FORCE_KINDS)
def test_a_force_has_the_size_that_was_asked_for(name):
    path = FORCE_KINDS[name].draw(np.random.default_rng(1), 1_000_000, 1e-3)
    assert path.shape == (1_000_000,) and path.std() == pytest.approx(1, abs=0.03)
    first = np.array([FORCE_KINDS[name].draw(np.random.default_rng(k), 2, 1e-3)[0] for k in range(400)])
    assert first.std() == pytest.approx(1, abs=0.15)  # from the first sample on


@pytest.mark.parametrize("name, time", [("first_order", FIRST_ORDER_TIME_S), ("shots", SHOT_TIME_S)])
def test_a_force_forgets_at_the_pace_that_was_asked_for(name, time):
    path = FORCE_KINDS[name].draw(np.random.default_rng(2), 1_000_000, 1e-3)
    for lag in (time / 2, time):
        steps = round(lag * 1000)
        assert np.mean(path[:-steps] * path[steps:]) / np.mean(path**2) == pytest.approx(np.exp(-lag / time), abs=0.03)


def test_shots_are_rare_and_large():
    path = FORCE_KINDS["shots"].draw(np.random.default_rng(3), 1_000_000, 1e-3)
    assert 1.5 < np.mean(path**4) - 3 < 9  # kurtosis beyond that of Gaussian noise


def test_a_band_limited_force_lies_in_its_band():
    path = FORCE_KINDS["band_limited"].draw(np.random.default_rng(4), 100_000, 1e-3)
    power, frequency = np.abs(np.fft.rfft(path)) ** 2, np.fft.rfftfreq(100_000, 1e-3)
    inside = power[(frequency > 0.5) & (frequency < 5)].sum()
    assert 0.75 * power.sum() < inside < 0.95 * power.sum()  # a filter of second order has skirts
    assert power[(frequency > 1) & (frequency < 2.5)].mean() == pytest.approx(
        power[(frequency > 2.5) & (frequency < 4)].mean(), rel=0.2
    )  # and a level top


# ---- cases and their journal


def answer(case, **changes):
    """An answer that is right, but for what is changed."""
    acting = {"": {}, "wheel": {"wheel": 0.3}, "drive": {"wheel": 0.3, "body": 0.3}}[case.place]
    found = {n: Found(1.01, 0.01, 1.0, 0.01, 1.0) for n in NAMES}
    if case.effect:
        found[size_name(case.effect)] = Found(0.2, 0.02, case.size or 0.2)
    right = Answer(
        case, "", found, (), (case.place,) if case.place else (),
        {row: FoundForce(rms * 1.1, 0.12, rms) for row, rms in acting.items()}, 1.0,
    )  # fmt: skip
    return replace(right, **changes)


def test_an_answer_comes_back_from_its_journal_as_it_was():
    whole = answer(Case("lawful", 3, "first_order", "wheel", "slope", 0.02), lost=("X2",))
    assert Answer.from_json(json.loads(json.dumps(plain_data(whole)))) == whole


def test_a_plan_asks_each_study_as_often_as_it_says():
    cases = plan()
    assert [sum(c.study == s for c in cases) for s in ("complete", "forces", "lawful")] == [400, 96, 96]
    assert len({c.key for c in cases}) == len(cases)
    assert len(plan(["forces"], 2)) == 16


def test_a_run_goes_on_where_it_was_interrupted_and_loses_no_answer(tmp_path):
    cases, asked = plan(["complete"], 5), []

    def attempt(case):
        if case.seed == 4:
            raise KeyboardInterrupt
        asked.append(case.seed)
        return answer(case)

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, cases, jobs=1, progress=lambda line: None, attempt=attempt)
    journal = next(tmp_path.iterdir())
    journal.write_text(journal.read_text() + '{"key": "complete 4", "ans')  # cut off as it was written
    found = run(
        tmp_path, cases, jobs=1, progress=lambda line: None, attempt=lambda c: asked.append(c.seed) or answer(c)
    )
    assert asked == [1, 2, 3, 4, 5] and [a.case.seed for a in found] == [1, 2, 3, 4, 5]
    assert len(journal.read_text().splitlines()) == 6


def test_a_lawful_effect_is_hidden_at_ten_of_the_standard_errors_that_its_pilot_found(tmp_path):
    cases = [c for c in plan(["lawful"], 1) if c.effect == "slope"]
    found = run(tmp_path, cases, jobs=1, progress=lambda line: None, attempt=answer)
    assert [(a.case.study, a.case.size) for a in found] == [("pilot", 0.0), ("lawful", pytest.approx(0.2))]


@pytest.mark.parametrize("jobs", [1, 2])
def test_when_the_time_is_over_no_log_is_begun(tmp_path, jobs):
    assert run(tmp_path, plan(["lawful"], 1), jobs=jobs, minutes=0.0, progress=lambda line: None, attempt=answer) == []


@pytest.mark.parametrize("effect", LAWFUL_EFFECTS)
def test_the_model_is_given_an_effect_but_not_its_size(effect):
    known, hidden = known_values(model_with(effect, 0.123)), hidden_values(effect, 0.123)
    event = len(hidden) > 1
    assert hidden[size_name(effect)] == 0.123
    assert known.get(size_name(effect)) == (pytest.approx(0.0615) if event else None)
    times = {n: v for n, v in hidden.items() if n != size_name(effect)}
    assert all(0.001 < abs(known[n] - v) < 0.005 for n, v in times.items())


# ---- counts


def test_precision_is_the_error_over_the_bound():
    found = complete_summary([
        answer(Case("complete", 1), parameters={"X1": Found(1.01, 0.02, 1.0, 0.01, 1.01)}),
        answer(Case("complete", 2), parameters={"X1": Found(1.03, 0.01, 1.0, 0.01, 1.02)}, places=("wheel",)),
    ])  # fmt: skip
    only = found.precision[0]
    assert (only.rms_error, only.bound) == (pytest.approx(100 * np.sqrt(0.0005)), pytest.approx(1.0))
    assert (only.ratio, only.lost) == (pytest.approx(np.sqrt(5)), pytest.approx(np.sqrt(0.5)))
    assert only.inside == Proportion(1, 2)
    assert found.force_found == (1, 2) and found.coverage.inside == (1, 2)


def test_the_interval_of_a_coverage_knows_that_a_log_errs_as_a_whole():
    together = clustered_interval([[True] * 7] * 15 + [[False] * 7])
    alone = clustered_interval([[True] * 7] * 9 + [[True] * 6 + [False]] * 7)
    assert together == pytest.approx(Proportion(15, 16).interval)
    assert alone == pytest.approx(Proportion(105, 112).interval)


@pytest.mark.parametrize("place", ["wheel", "drive"])
def test_a_force_is_right_where_its_size_its_time_and_its_place_are(place):
    right = answer(Case("forces", 1, "first_order", place))
    large = replace(right, forces={row: f._replace(rms=0.4) for row, f in right.forces.items()})
    slow = replace(right, forces={row: f._replace(correlation_time=0.21) for row, f in right.forces.items()})
    elsewhere = replace(right, places=("body",))
    found = force_summaries([right, large, slow, elsewhere])[0]
    assert (found.rms_right, found.time_right, found.place_right) == ((3, 4), (3, 4), (3, 4))
    assert found.rms_ratio == pytest.approx((3 * 1.1 + 4 / 3) / 4)


def test_a_force_that_was_not_found_or_is_found_on_another_row_too_is_wrong():
    right = answer(Case("forces", 1, "shots", "wheel"))
    none = replace(right, forces={"wheel": FoundForce(0.0, 0.0, 0.3)}, places=())
    both = replace(right, forces={**right.forces, "body": FoundForce(0.1, 0.1, 0.0)}, places=("wheel", "body"))
    found = force_summaries([none, both])[0]
    assert (found.rms_right, found.place_right) == ((0, 2), (0, 2)) and found.time_right.of == 2


def test_a_force_without_a_correlation_time_is_not_judged_by_one():
    found = force_summaries([answer(Case("forces", 1, "band_limited", "wheel"))])[0]
    assert found.time_ratio is None and found.time_right.of == 0


def test_a_lawful_effect_is_judged_by_its_mean_over_logs():
    cases = [Case("lawful", seed, "first_order", "wheel", "slope", 0.2) for seed in (1, 2)]
    sizes = [Found(0.22, 0.02, 0.2), Found(0.15, 0.02, 0.2)]
    found = lawful_summaries([answer(c, parameters={"slope.angle": s}) for c, s in zip(cases, sizes, strict=True)])[0]
    assert (found.ratio, found.deviation) == (pytest.approx(0.925), pytest.approx(-0.75))
    assert found.inside == (1, 2) and found.size == 0.2


def test_the_tables_stand_between_their_marks_and_name_what_failed(tmp_path):
    lawful = Case("lawful", 1, "first_order", "wheel", "slope", 0.2)
    answers = [
        answer(Case("complete", 1)), answer(Case("forces", 1, "shots", "drive")), answer(lawful),
        Answer(Case("complete", 2), failure="no log"),
    ]  # fmt: skip
    page = tmp_path / "page.md"
    page.write_text("before\n", encoding="utf-8")
    with pytest.raises(Failure, match="must have the lines"):
        write(page, answers)
    page.unlink()
    write(page, answers)
    write(page, answers)
    text = page.read_text(encoding="utf-8")
    assert section_text(answers) in text and text.count("`slope`") == 1
    assert "complete 2: no log" in text and "filtered shots" in text and "not tried" not in text
    assert section_text([]).count("not tried") == 3


def test_a_study_that_was_not_tried_again_keeps_its_tables(tmp_path):
    page, lawful = tmp_path / "page.md", Case("lawful", 1, "first_order", "wheel", "slope", 0.2)
    failed = Answer(Case("complete", 2), failure="no log")
    write(page, [answer(Case("complete", 1)), answer(Case("forces", 1, "shots", "drive")), answer(lawful), failed])
    before = page.read_text(encoding="utf-8")
    write(page, [])
    assert page.read_text(encoding="utf-8") == before
    write(page, [answer(Case("forces", 1, "band_limited", "wheel"))])
    text = page.read_text(encoding="utf-8")
    assert "0.5 to 5 Hz" in text and "filtered shots" not in text and text.count("complete 2: no log") == 1

    def part_of(page_text: str, heading: str) -> str:
        return page_text.partition(heading)[2].partition("### ")[0].partition("<!--")[0].strip()

    for heading in ("Complete models", "What is slow"):
        assert part_of(text, heading) == part_of(before, heading) != ""
