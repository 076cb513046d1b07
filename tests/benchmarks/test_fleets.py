"""The study of fleets counts what stood out beside what aged, and goes on where it was interrupted."""

import json

import numpy as np
import pytest

from wheelpend.benchmarks.fleets import made_up
from wheelpend.benchmarks.fleets.cases import (
    AGED_UNITS,
    AGEING_SIDES,
    FLEET_UNITS,
    LACKED_EFFECTS,
    LACKING_FLEET_UNITS,
    LACKING_FLEETS,
    plan,
    units_of_fleet,
    units_of_lacking_fleet,
    usual_values,
)
from wheelpend.benchmarks.fleets.made_up import MadeUpCount
from wheelpend.benchmarks.fleets.page import BEGIN_MARK, END_MARK, section_text, write
from wheelpend.benchmarks.fleets.summary import count_fleets, count_lacks, standing_out
from wheelpend.benchmarks.fleets.trial import Answer, Lack, diagnose_unit, log_of, try_unit
from wheelpend.proportion import Proportion

NAMES = tuple(usual_values())
SIGMA = 1e-3 * np.array(list(usual_values().values()))


def answer(unit, off=None, error=1.0):
    """An estimate with small errors; ``off`` adds to a parameter in its standard errors."""
    rng = np.random.default_rng((unit.fleet, unit.number, 7))
    values = np.array([dict(unit.truth)[n] for n in NAMES]) + SIGMA * rng.normal(size=len(NAMES))
    for name, sigmas in (off or {}).items():
        values[NAMES.index(name)] += sigmas * SIGMA[NAMES.index(name)]
    return Answer(unit.key, NAMES, tuple(values), tuple(map(tuple, np.diag(SIGMA**2))), error)


def test_a_fleet_scatters_and_its_first_units_aged_in_one_parameter_each():
    units = units_of_fleet(3)
    assert [bool(u.aged) for u in units] == [k < AGED_UNITS for k in range(FLEET_UNITS)]
    values = np.array([[dict(u.truth)[n] for n in NAMES] for u in units[AGED_UNITS:]])
    assert np.allclose(values.std(axis=0) / values.mean(axis=0), 0.01, rtol=0.3)
    for unit in units[:AGED_UNITS]:
        change = dict(unit.truth)[unit.aged] / usual_values()[unit.aged] - 1.0
        assert 0.03 < AGEING_SIDES[unit.aged] * change < 0.13
    assert units_of_fleet(3) == units != units_of_fleet(4)
    assert len(plan(2)) == 2 * FLEET_UNITS + LACKING_FLEETS * LACKING_FLEET_UNITS


def test_aged_units_are_found_by_what_aged_and_others_are_hardly_accused():
    units = [u for u in plan(2) if u.fleet < 2]
    found = count_fleets(units, {u.key: answer(u) for u in units})
    assert found.found.of == 2 * AGED_UNITS and found.found.hits >= 9
    assert found.right.hits >= found.right.of - 1 and found.inside.hits >= found.inside.of - 2
    assert found.accused.hits <= 2 and found.scatter.of == 2 * len(NAMES) and found.scatter.hits >= 12


def test_a_unit_that_is_off_without_having_aged_counts_as_accused():
    units = units_of_fleet(0)
    before = count_fleets(units, {u.key: answer(u) for u in units}).accused.hits
    spoilt = {u.key: answer(u, {"X3": 150.0} if u.number == 50 else None) for u in units}
    assert count_fleets(units, spoilt).accused.hits == before + 1


def test_fleets_that_are_not_whole_are_not_counted_and_failures_are():
    units = units_of_fleet(0)
    answers = {u.key: answer(u) for u in units}
    assert count_fleets(units, dict(list(answers.items())[:-1])) is None
    answers[units[-1].key] = Answer(units[-1].key, failure="too short")
    assert count_fleets(units, answers).failed == 1


def test_one_unit_is_identified_within_its_errors():
    unit = units_of_fleet(0)[1]
    found = try_unit(unit)
    assert found.failure is None and set(found.names) == set(NAMES)
    off = (np.array(found.values) - [dict(unit.truth)[n] for n in found.names]) / np.sqrt(np.diag(found.covariance))
    assert np.abs(off).max() < 5.0
    assert json.loads(json.dumps(found.to_json()))["key"] == "fleet 0 unit 1"


def test_the_table_stands_between_its_marks(tmp_path):
    page = tmp_path / "fleets.md"
    page.write_text(f"before\n{BEGIN_MARK}\nold\n{END_MARK}\nafter\n")
    units = units_of_fleet(0)
    counted = MadeUpCount(20, 2, 3, Proportion(5, 6), Proportion(1, 6), Proportion(1, 3))
    write(page, count_fleets(units, {u.key: answer(u) for u in units}), None, [counted])
    text = page.read_text()
    assert text.startswith("before") and text.endswith("after\n") and "old" not in text and "1 of 20 planned" in text
    assert "| 20 | 2 | 3 | 5 of 6 | 1 of 6 | 1 of 3 |" in text
    assert "no fleet" in section_text(None, None, [])


def test_made_up_fleets_count_odd_units_and_accusations(monkeypatch):
    monkeypatch.setattr(made_up, "FLEET_SIZES", ((30, 2, 4),))
    (found,) = made_up.count_made_up()
    assert (found.found.of, found.fleets_accusing.of) == (8, 4)
    assert found.found.hits >= 6 and found.accused.hits <= 2
    assert made_up.count_made_up() == [found]


def test_units_that_lack_an_effect_are_diagnosed_where_they_stand_out():
    units = units_of_lacking_fleet(0)
    assert [u.lacked for u in units[:4]] == [*LACKED_EFFECTS, ""]
    answers = {u.key: answer(u, {"X1": 150.0} if u.number in (0, 7) else None, 3.0 if u.number == 1 else 1.0)
               for u in units}  # fmt: skip
    odd = standing_out(units, answers)
    assert {u.number for u in odd} == {0, 1, 7}
    lacks = {u.key: Lack(u.key, "effect_missing", ("stribeck_drive", "voltage_dead_zone")) for u in odd}
    assert count_lacks(units, odd, dict(list(lacks.items())[1:])) is None
    lacks[units[7].key] = Lack(units[7].key, "nothing_missing")
    found = count_lacks(units, odd, lacks)
    assert (found.asked, found.stand_out, found.named, found.alarms) == (3, (2, 3), (1, 2), (0, 1))
    assert "diagnosed" in section_text(None, found, [])
    assert count_fleets(units, answers) is None, "these fleets have no aged units"


@pytest.mark.slow
def test_the_log_of_a_unit_that_lacks_an_effect_has_it():
    unit = units_of_lacking_fleet(1)[0]
    said = diagnose_unit(unit)
    assert (said.verdict, said.failure) == ("effect_missing", None) and unit.lacked in said.named
    assert (log_of(unit).measured != log_of(unit._replace(lacked="")).measured).any()
