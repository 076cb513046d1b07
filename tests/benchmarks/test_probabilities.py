"""The study of probabilities: drawn as stated, resumed without loss, and a summary that notices boasting."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from wheelpend import Failure
from wheelpend.benchmarks.probabilities.cases import Case, plan
from wheelpend.benchmarks.probabilities.page import BEGIN_MARK, END_MARK, section_text, write
from wheelpend.benchmarks.probabilities.runner import run
from wheelpend.benchmarks.probabilities.summary import middle_count, reliability, score
from wheelpend.benchmarks.probabilities.trial import GYRO_LAG_S, Outcome, begun_at, filtered, hidden_values, made_log

SHOWN = {"coulomb_drive": {"torque": 0.004}}


def test_cases_come_in_the_stated_shares():
    kinds = Counter(c.kind for c in plan("first", 1000))
    assert [kinds[k] / 1000 for k in ("complete", "left_out", "single", "pair")] == pytest.approx(
        [0.2, 0.2, 0.4, 0.2], abs=0.05
    )
    assert 0.03 < np.mean([bool(c.force) for c in plan("first", 1000)]) < 0.08
    assert plan("first", 20) == plan("first", 1000)[:20] != plan("second", 20)


def test_sizes_are_multiples_of_what_a_log_just_shows():
    case = Case("first", 3, "single", ("coulomb_drive",), (2.0,))
    assert 0.8 * 0.008 <= hidden_values(case, SHOWN)["coulomb_drive.torque"] <= 1.25 * 0.008
    assert hidden_values(case, SHOWN, 0.5)["coulomb_drive.torque"] < 0.6 * 0.008


def test_a_late_log_begins_in_motion_and_a_filtered_gyro_lags():
    case = Case("first", 3, "complete")
    plain, slow, late = (made_log(c, {}) for c in (case, replace(case, filtered=True), replace(case, late=True)))
    assert late.t[0] == 0.0 and len(late) == pytest.approx(len(plain), abs=2) and late.earlier is None
    begun, at_rest = (abs(log.measured[1, 0] - log.measured[0, 0]) for log in (late, plain))
    assert begun > 10 * at_rest
    step = replace(plain, measured=np.where(np.arange(len(plain))[:, None] < 500, 0.0, np.ones(3)))
    after = round(500 + GYRO_LAG_S / plain.dt)
    assert filtered(step).measured[after, 2] == pytest.approx(1 - np.exp(-1), abs=0.1)
    assert np.array_equal(filtered(step).measured[:, :2], step.measured[:, :2])
    assert slow.measured[200:, 2].std() < plain.measured[200:, 2].std()
    assert begun_at(plain, 2.0).t[-1] == pytest.approx(plain.t[-1] - 2.0)


def outcome(number, probability, right, kind="single"):
    truth = ("a",) if right else ("b",)
    return Outcome(f"first {number}", kind, truth, (1.0,), ((("a",), probability), ((), 1 - probability)), "", 30)


def outcomes(probability, share, count=200):
    return [outcome(k, probability, k < share * count) for k in range(count)]


def test_reliability_notices_who_boasts():
    honest, boasting = reliability(outcomes(0.7, 0.7)), reliability(outcomes(0.7, 0.4))
    assert [b.is_reliable for b in honest if b.mean > 0.5] == [True]
    assert [b.is_reliable for b in boasting if b.mean > 0.5] == [False]
    assert middle_count(outcomes(0.7, 0.7)) == 400


def test_the_score_is_above_the_base_rates_only_where_something_is_known():
    good, bad = score(outcomes(0.95, 0.95), "first"), score(outcomes(0.99, 0.0), "first")
    assert good.found > good.base_rate > bad.found
    assert good.base_rate == pytest.approx(np.log(0.4 / 30))


def test_a_run_goes_on_where_it_was_interrupted(tmp_path):
    tried, pilots = [], []

    def attempt(case, shown):
        tried.append(case.key)
        return Outcome(case.key, case.kind, case.effects, structures=(((), 0.5),))

    def pilot(rough):
        pilots.append(rough)
        return SHOWN

    cases = plan("first", 6)
    for count in (3, 6, 6):
        found = run(tmp_path, cases[:count], attempt=attempt, pilot=pilot, jobs=1, progress=lambda line: None)
        assert [o.key for o in found] == [c.key for c in cases[:count]]
    assert sorted(tried) == sorted(c.key for c in cases) and len(pilots) == len(set(pilots))
    assert found[0].structures == (((), 0.5),)


def test_the_page_is_written_between_its_marks(tmp_path):
    page = tmp_path / "trust.md"
    page.write_text(f"before\n{BEGIN_MARK}\nold\n{END_MARK}\nafter\n", encoding="utf-8")
    write(page, {"first": outcomes(0.7, 0.7), "second": []})
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before") and text.endswith("after\n") and "old" not in text and "not tried yet" in text
    assert (tmp_path / "reliability.svg").stat().st_size > 1000
    assert section_text({"first": outcomes(0.7, 0.7)}) in text
    page.write_text("no marks", encoding="utf-8")
    with pytest.raises(Failure, match="must have the lines"):
        write(page, {})
