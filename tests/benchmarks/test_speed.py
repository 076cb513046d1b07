"""Contenders do the same work, the table says what was measured, and what is absent is told with its reason."""

from pathlib import Path

import numpy as np
import pytest

from wheelpend.benchmarks.speed import reference, regression, simulation
from wheelpend.benchmarks.speed.environment import OWN_ENVIRONMENT_PATH, peer
from wheelpend.benchmarks.speed.page import BEGIN_MARK, END_MARK, table_text, write
from wheelpend.benchmarks.speed.record import Goal, Measured, NotMeasurableError, Row, Times
from wheelpend.benchmarks.speed.rows import all_rows, measure, select_rows
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.benchmarks.speed.timing import best_in_turn
from wheelpend.errors import Failure
from wheelpend.reports.numbers import time_text

TWICE = Row("twice", "adding up", "C", Goal("at least", 2.0), lambda s: Times(50e-9, 110e-9), "sample")


def not_here(setting):
    raise NotMeasurableError("no such package")


NOT_HERE = TWICE._replace(name="other", reference="other", measure=not_here)


@pytest.fixture(scope="module")
def setting():
    return Setting(Path("nowhere"))


@pytest.fixture
def c():
    try:
        return reference.load()
    except NotMeasurableError as reason:
        pytest.skip(str(reason))


# ---- the same work


def test_the_loop_in_c_is_the_generated_closed_loop(setting, c):
    loop = setting.loop(2.0)
    states, _, voltage = simulation.generated_closed_loop(setting, loop)()
    work, record = simulation.c_closed_loop(loop)
    work()
    np.testing.assert_allclose(np.column_stack([states, voltage]), record[:, :, 0], rtol=0, atol=1e-9 * record.max())


def test_a_batch_in_c_is_one_robot_after_the_other(setting, c):
    loop = setting.loop(0.5)
    batch = simulation.Batch(loop, 3)
    batch.in_c()()
    own = loop._replace(state=batch.begin[1], parameters=batch.parameters[1])
    states = simulation.generated_closed_loop(setting, own)()[0]
    np.testing.assert_allclose(batch.record[:, :-1, 1], states[:: simulation.RECORD_INTERVAL_SAMPLES], atol=1e-12)
    np.testing.assert_allclose(batch.states[1], states[-1], atol=1e-12)


def test_the_filters_in_c_give_the_gram_matrix_of_the_generated_ones(setting, c):
    log = regression.measurement(setting, 5000)
    tau, phi = setting.lean.filter_regressor(
        log.t, log.states, log.voltage, setting.parameters, *regression.FILTER_TIME_CONSTANTS_S, True, log.states[0]
    )
    matrix = np.concatenate([phi, tau[:, :, None]], axis=2).reshape(-1, 8)
    gram, work = regression.gram_in_c(log)
    work()
    regression.require_agreement("filters", matrix.T @ matrix, gram)


def test_recursive_least_squares_in_c_is_the_generated_update(setting, c):
    rows = regression.regression_rows(setting)
    few = regression.Rows(rows.phi[:2000].copy(), rows.tau[:2000].copy())
    (ours, run), (theirs, work) = regression.recursion_of(setting, few), regression.recursion_in_c(few)
    run()
    work()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())


def test_the_peers_lambdified_loop_is_the_generated_closed_loop(setting):
    loop = setting.loop(0.1)
    with peer(OWN_ENVIRONMENT_PATH, "lambdify", **loop._asdict()) as (contender, result):
        np.testing.assert_allclose(result, simulation.generated_closed_loop(setting, loop)()[0][-1], atol=1e-12)
        assert contender() > 0.0


def test_the_peers_filters_give_the_gram_matrix_of_c(setting, c):
    log = regression.measurement(setting, 5000)
    gram, work = regression.gram_in_c(log)
    work()
    problem = {
        "states": log.states,
        "voltage": log.voltage,
        "h": np.array(1e-3),
        "tau": np.array(regression.FILTER_TIME_CONSTANTS_S),
    }
    with peer(OWN_ENVIRONMENT_PATH, "scipy", **problem) as (_, result):
        regression.require_agreement("filters", result.reshape(8, 8), gram)


def test_what_differs_is_not_timed():
    with pytest.raises(Failure, match=r"differ by 0\.5"):
        reference.require_agreement("sums", np.array([1.5]), np.array([1.0]), np.array([1.0]))


# ---- what is absent


def test_a_missing_environment_is_a_reason_and_no_error(setting):
    with pytest.raises(NotMeasurableError, match="make bench"), peer(Path("nowhere"), "casadi"):
        pass


def test_a_package_that_cannot_be_imported_is_a_reason_and_no_error(tmp_path):
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text('#!/bin/sh\necho \'{"failure": "No module named casadi"}\'\n')
    python.chmod(0o755)
    with pytest.raises(NotMeasurableError, match="No module named casadi"), peer(tmp_path, "casadi"):
        pass


def test_a_row_that_is_absent_leaves_the_others(setting):
    found = measure([NOT_HERE, TWICE], setting, lambda line: None)
    assert [r.met for r in found] == [None, True]
    assert "Absent: other, because no such package." in table_text(found)


# ---- the table


def test_a_row_tells_both_times_their_ratio_and_whether_that_is_enough():
    table = table_text([Measured(TWICE, Times(50e-9, 110e-9)), Measured(TWICE, Times(0.5, 0.6))]).splitlines()
    assert [c.strip() for c in table[0].strip("|").split("|")] == ["work", "ours", "reference", "ratio", "goal", "met"]
    cells = [c.strip() for c in table[2].strip("|").split("|")]
    assert cells == ["adding up", "50 ns/sample", "110 ns/sample, C", "2.2", "at least 2", "yes"]
    assert table[3].rstrip(" |").endswith("no")
    assert len({len(line) for line in table[:4]}) == 1


@pytest.mark.parametrize(
    ("goal", "times", "ratio", "met"),
    [
        (Goal("at least", 2.0), Times(1.0, 3.0), 3.0, True),
        (Goal("at most", 40.0), Times(30.0, 1.0), 30.0, True),
        (Goal("at most", 40.0), Times(50.0, 1.0), 50.0, False),
        (Goal("within", 0.6), Times(0.5, 5.0), 10.0, True),
        (Goal("within", 0.6), Times(0.7, 70.0), 100.0, False),
    ],
)
def test_goals_are_a_speed_a_length_or_a_limit(goal, times, ratio, met):
    assert (goal.ratio(times), goal.met(times)) == (pytest.approx(ratio), met)


def test_goals_are_told_as_they_are_meant():
    assert [str(Goal("at most", 40)), str(Goal("within", 0.6))] == ["at most 40", "within 0.6 s"]


def test_times_are_told_in_a_unit_that_suits_them():
    assert [time_text(x) for x in (2.5e-9, 33.33e-6, 0.1234, 250.0)] == ["2.5 ns", "33.3 µs", "123 ms", "250 s"]


def test_the_table_takes_its_place_in_a_page(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n\n{BEGIN_MARK}\nold\n{END_MARK}\n\nafter\n")
    write(page, [Measured(TWICE, Times(1.0, 3.0))])
    found = page.read_text()
    assert found.startswith("before") and found.endswith("after\n")
    assert "adding up" in found and "old" not in found


def test_contenders_take_turns_and_the_best_of_each_counts():
    order, times = [], iter([3.0, 30.0, 1.0, 10.0, 2.0, 20.0])

    def contender(name):
        def once():
            order.append(name)
            return next(times)

        return once

    assert best_in_turn(contender("a"), contender("b"), seconds=0.0, turn=0.0) == [1.0, 10.0]
    assert order == list("ababab")


def test_every_row_has_a_name_of_its_own():
    names = [row.name for row in all_rows()]
    assert len(set(names)) == len(names)


def test_an_unknown_row_is_answered_with_the_known_ones():
    with pytest.raises(Failure, match="casadi"):
        select_rows(["casady"])
