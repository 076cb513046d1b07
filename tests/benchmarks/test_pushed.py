"""The study of a robot that is pushed at random: all kinds meet, a run goes on, rates count what they say."""

from collections import Counter

import pytest

from wheelpend import Failure
from wheelpend.benchmarks.pushed.cases import Case, alike, hidden_values, plan
from wheelpend.benchmarks.pushed.page import BEGIN_MARK, END_MARK, rates, write
from wheelpend.benchmarks.pushed.runner import run
from wheelpend.benchmarks.pushed.trial import Outcome
from wheelpend.benchmarks.random_force.machine import rough_log

SHOWN = {"coulomb_drive": {"torque": 0.01}, "encoder_eccentricity": {"sine": 0.001, "cosine": 0.002}}


def test_every_kind_meets_every_force_at_every_place():
    met = Counter((c.kind, c.force, c.place) for c in plan())
    assert len(met) == 3 * 4 * 2 and set(met.values()) == {8}
    assert plan(30) == plan()[:30]


def test_a_size_is_so_many_standard_errors():
    one = Case(1, "single", "shots", "wheel", "coulomb_drive", 10.0)
    assert hidden_values(one, SHOWN) == {"coulomb_drive.torque": pytest.approx(0.02)}
    two = hidden_values(Case(1, "single", "shots", "wheel", "encoder_eccentricity", 10.0), SHOWN)
    in_sigmas = [5.0 * v / SHOWN["encoder_eccentricity"][n.split(".")[1]] for n, v in two.items()]
    assert sum(s**2 for s in in_sigmas) == pytest.approx(100.0, rel=1e-4)
    assert hidden_values(Case(0, "nothing", "shots", "wheel"), SHOWN) == {}


def test_what_the_equations_cannot_tell_apart_is_left_out_together():
    case = Case(2, "left_out", "shots", "wheel", "com_offset", 10.0)
    assert case.without == ("com_offset", "imu_bias") == alike("com_offset")
    assert Case(1, "single", "shots", "wheel", "com_offset", 10.0).without == ()
    dry = Case(2, "left_out", "shots", "wheel", "coulomb_drive", 10.0)
    assert set(dry.without) == {"coulomb_drive", "stribeck_drive", "presliding_drive"}


def test_the_engine_hides_nothing_that_it_does_not_know():
    with pytest.raises(Failure, match=r"coulomb_drive\.voltage is not among them"):
        rough_log("shots", "wheel", 1, {"coulomb_drive.voltage": 0.2}, 1.0)


def test_rates_tell_right_from_wrong_and_from_confidently_wrong():
    found = [
        Outcome("a", "nothing", (), verdict="nothing_missing"),
        Outcome("b", "nothing", (), verdict="unexplained"),
        Outcome("c", "single", ("x", "y"), verdict="effect_missing", named=("y", "z")),
        Outcome("d", "single", ("x",), verdict="ambiguous", named=("z",), equivalent=("x",)),
        Outcome("e", "left_out", ("x",), verdict="effect_missing", named=("z",)),
        Outcome("f", "left_out", ("x",), verdict="unexplained"),
    ]
    shares = [text.split(",")[0] for _, text, _ in rates(found)]
    assert shares == ["0 of 2", "1 of 2", "1 of 2", "2 of 2", "1 of 2", "1 of 2"]


def test_a_run_goes_on_where_it_was_interrupted_and_writes_its_page(tmp_path):
    tried, pilots = [], []

    def attempt(case, shown):
        tried.append(case.key)
        return Outcome(case.key, case.kind, (case.effect,), structures=(((), 0.5),))

    def pilot(case):
        pilots.append(case.pilot_key)
        return SHOWN

    cases = plan(6)
    for count in (2, 6, 6):
        found = run(tmp_path, cases[:count], attempt=attempt, pilot=pilot, jobs=1, progress=lambda line: None)
        assert [o.key for o in found] == [c.key for c in cases[:count]]
    assert sorted(tried) == sorted(c.key for c in cases) and len(pilots) == len(set(pilots)) == 2
    page = tmp_path / "statistics.md"
    with pytest.raises(Failure, match="must have the lines"):
        write(page, found)
    page.write_text(f"before\n{BEGIN_MARK}\nold\n{END_MARK}\nafter\n", encoding="utf-8")
    write(page, found)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before") and "old" not in text and "6 of 192 planned logs" in text
