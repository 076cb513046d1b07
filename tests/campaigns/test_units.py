"""A manifest says which logs are of which unit and day, and the campaign what units share, lack and differ in."""

import json
from dataclasses import replace

import numpy as np
import polars
import pytest

from tests.support import run, simulated
from wheelpend import Failure, Model, campaign, parallel, save_log
from wheelpend.campaigns.fleet_figures import deviation_map, effect_map, forest_figure, telling_parameters
from wheelpend.campaigns.fleet_page import write_fleet_page
from wheelpend.campaigns.manifest import Listed, day_of, is_manifest, listed_logs, read_manifest
from wheelpend.campaigns.one_log import ErrorCovariance, Estimate, LogResult, NamedEffect
from wheelpend.campaigns.runner import Campaign
from wheelpend.campaigns.summary import summarise
from wheelpend.campaigns.units import is_per_log, log_estimate, units_answer
from wheelpend.campaigns.units_text import then_text

SHORT = 3.0  # s


@pytest.fixture(autouse=True)
def one_core(monkeypatch):
    monkeypatch.setattr(parallel, "cores", lambda: 1)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def made_up(unit, value, sigma=0.1, date="", **further):
    parameters = {"X1": Estimate(value, sigma), "X2": Estimate(2.0, sigma)}
    covariance = ErrorCovariance(("X1", "X2"), ((sigma**2, 0.0), (0.0, sigma**2)))
    return LogResult(f"{unit}.csv", parameters=parameters, covariance=covariance, unit=unit, date=date, **further)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_manifest_lists_logs_from_its_own_folder_on(here, kind):
    (here / "fleet").mkdir()
    rows = {"unit": ["a", "b"], "log": ["1.csv", "sub/2.csv"], "date": ["2026-03-01", ""], "surface": ["ice", "felt"]}
    path = here / "fleet" / f"list.{kind}"
    table = polars.DataFrame(rows)
    table.write_csv(path) if kind == "csv" else table.write_parquet(path)
    first, second = read_manifest(path)
    assert is_manifest(path) and (first.log, first.unit, first.date) == (here / "fleet" / "1.csv", "a", "2026-03-01")
    assert (second.log, second.date, second.conditions) == (here / "fleet" / "sub" / "2.csv", "", {"surface": "felt"})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("log,unit\na.csv,u\n,v\n", "row 2 names none"),
        ("log,date\na.csv,yesterday\n", "must be like 2026-03-31"),
        ("log,unit\na.csv,u,extra\n", "cannot be read"),
        ("log,unit\na\0b.csv,u\n", "row 1 names none"),
    ],
)
def test_a_manifest_that_is_wrong_says_where(here, text, words):
    (here / "fleet.csv").write_text(text)
    with pytest.raises(Failure, match=words):
        read_manifest(here / "fleet.csv")


def test_a_log_and_a_campaigns_table_are_no_manifests(here):
    (here / "log.csv").write_text("t,v_in\n0,1\n")
    (here / "campaign.csv").write_text("log,failure,X1\na.csv,,1\n")
    assert not any(map(is_manifest, (here / "log.csv", here / "campaign.csv", here / "nowhere.csv", here)))


def test_a_pattern_stands_for_the_files_that_fit_it(here):
    for name in ("b2.csv", "b1.csv", "c.csv"):
        (here / name).write_text("t\n")
    assert [found.log.name for found in listed_logs([here / "b*.csv"])] == ["b1.csv", "b2.csv"]
    with pytest.raises(Failure, match="none fits"):
        listed_logs([here / "d*.csv"])


def test_days_count_from_times_of_any_kind():
    assert day_of("1970-01-02") == 1.0 and day_of("1970-01-01T12:00") == 0.5


def test_a_parameter_of_a_log_tells_nothing_of_its_unit():
    assert is_per_log("encoder_zero.bias") and not is_per_log("coulomb_drive.torque") and not is_per_log("X1")


def test_logs_of_a_unit_are_one_estimate_wider_where_they_contradict_each_other():
    agreeing = units_answer([made_up("a", 1.0), made_up("a", 1.05)]).units[0]
    contradicting = units_answer([made_up("a", 1.0), made_up("a", 3.0)]).units[0]
    assert agreeing.values[0] == pytest.approx(1.025) and agreeing.covariance[0, 0] == pytest.approx(0.005)
    assert contradicting.values[0] == pytest.approx(2.0) and contradicting.covariance[0, 0] == pytest.approx(0.5)


def test_what_units_lack_is_counted_and_two_of_them_are_compared():
    missing = {"verdict": "effect_missing", "named": (NamedEffect("slope", ()),)}
    results = [made_up("a", 1.0, **missing), made_up("b", 1.0, verdict="nothing_missing"), made_up("c", 2.0, **missing)]
    answer = units_answer(results, ["a", "c"])
    (spread,) = answer.effects
    assert (spread.effect, spread.units, spread.of) == ("slope", ("a", "c"), 3)
    (explained,) = answer.differ.difference.parameters
    assert (explained.parameter, explained.difference) == ("X1", pytest.approx(1.0))
    with pytest.raises(Failure, match="a, b, c, not 'd'"):
        units_answer(results, ["a", "d"])


def test_logs_without_a_unit_or_without_errors_make_no_fleet():
    assert units_answer([made_up("", 1.0)]) is None
    assert log_estimate(LogResult("a.csv", unit="a")) is None
    assert units_answer([LogResult("a.csv", unit="a"), made_up("b", 1.0)]).fleet is None


def test_a_drift_over_dates_is_found():
    days = [f"2026-03-{d:02d}" for d in (1, 6, 11, 16, 21, 26)]
    answer = units_answer([made_up("a", 1.0 + 0.1 * k, 0.01, day) for k, day in enumerate(days)])
    (drift,) = answer.drifts
    assert (drift.unit, drift.parameter) == ("a", "X1") and drift.per_day == pytest.approx(0.02)


@pytest.mark.slow
def test_a_fleet_from_its_manifest_names_the_unit_that_has_more_friction(here):
    model = Model.default().with_effects(["coulomb_drive"])
    model.save(here)
    rows = ["log,unit,date"]
    for k in range(5):
        save_log(here / f"{k}.csv", simulated(seed=k, duration=SHORT, coulomb_drive__torque=0.35 if k == 3 else 0.3))
        rows.append(f"{k}.csv,robot {k},2026-03-0{k + 1}")
    (here / "fleet.csv").write_text("\n".join(rows) + "\n")
    result = run("campaign", "fleet.csv", "--differ", "robot 0", "robot 3", "--json", "found.json")
    said = " ".join(result.output.split())
    assert "units stand out" in said and "robot 3: coulomb_drive.torque +0.04998" in said
    assert "robot 3 beside robot 0: coulomb_drive.torque +0.05" in said
    data = json.loads((here / "found.json").read_text())
    assert data["fleet"]["odd"][0]["unit"] == "robot 3"
    assert data["logs"][3]["unit"] == "robot 3" and len(data["logs"][3]["covariance"]["names"]) == 8
    low, high = data["fleet"]["differ"]["parameters"][0]["interval"]
    assert low < 0.05 < high and high - low < 0.001
    assert (here / "campaign.csv").read_text().startswith("log,failure,unit,date,")
    assert "must state of which unit" in run("campaign", "0.csv", "--differ", "a", "b", code=1).output
    again = campaign(Model.open(here), [here / "fleet.csv"])
    assert again.fleet.fleet.odd[0].unit == "robot 3"
    then = json.loads(run("campaign", "fleet.csv", "--then", "diagnose", "--json", "-").stdout)["then"]
    assert then["do"] == "diagnose"
    assert sorted(r["unit"] for r in then["logs"]) == sorted(o["unit"] for o in data["fleet"]["odd"])
    assert all(r["verdict"] == "nothing_missing" for r in then["logs"]), "its model has the friction that is larger"
    assert len(list((here / "campaign.results").glob("question=diagnose-*"))) == 1


def test_a_further_question_follows_identify_and_is_about_units(here):
    with pytest.raises(Failure, match="about units"):
        campaign(Model.default(), here / "log.csv", then="diagnose")
    listed = [Listed(here / "a.csv", "a")]
    with pytest.raises(Failure, match="No further question named 'diagnos'"):
        campaign(Model.default(), listed, then="diagnos")
    with pytest.raises(Failure, match="--then follows identify"):
        campaign(Model.default(), listed, do="compare", then="explain")


def test_what_the_units_lack_that_stand_out_is_said_and_drawn(here):
    result = made_up_fleet(here)
    lacks = (
        LogResult("a.csv", unit="<b>robot 4</b>", verdict="effect_missing", named=(NamedEffect("cogging", ()),),
                  error=9.0, error_after=1.25),
        LogResult("b.csv", unit="<b>robot 4</b>", failure="It fell."),
    )  # fmt: skip
    model = Model.default()
    then = Campaign("diagnose", None, None, lacks, summarise(model, None, lacks), model, units_answer(lacks))
    said = "\n".join(map(str, then_text(then)))
    assert "It fell." in said and "cogging" in said and "1.25" in said
    assert "no unit stands out" in " ".join(map(str, then_text(replace(then, logs=()))))
    bare = replace(result, logs=[replace(r, named=(), verdict=None) for r in result.logs], then=then)
    bare = replace(bare, fleet=units_answer(bare.logs))
    write_fleet_page(bare, here / "then.html", here / "campaign.csv")
    page = (here / "then.html").read_text(encoding="utf-8")
    assert "the only ones asked" in page and "cogging" in page and "<b>robot 4</b>" not in page


def made_up_fleet(here):
    rng, rows = np.random.default_rng(5), []
    for k in range(30):
        value = 1.0 + 0.02 * rng.normal() + (0.6 if k == 4 else 0.0)
        rows.append(made_up(f"<b>robot {k}</b>", value, 0.02, f"2026-03-{k % 28 + 1:02d}"))
    rows += [made_up("drifting", 1.0 + 0.05 * k, 0.01, f"2026-04-{k + 1:02d}") for k in range(6)]
    rows[0] = replace(rows[0], verdict="effect_missing", named=(NamedEffect("slope", ()),))
    model = Model.default()
    return Campaign("identify", "filter_error", None, tuple(rows), summarise(model, None, rows), model,
                    units_answer(rows))  # fmt: skip


def test_a_drift_is_drawn_without_the_logs_that_do_not_identify_it(here):
    result = made_up_fleet(here)
    logs = list(result.logs)
    silent = ErrorCovariance(("X2",), ((1e-4,),))
    logs[-1] = replace(logs[-1], parameters={"X2": Estimate(2.0, 0.01)}, covariance=silent)
    answer = units_answer(logs)
    assert [d.parameter for d in answer.drifts] == ["X1"]
    write_fleet_page(replace(result, logs=tuple(logs), fleet=answer), here / "fleet.html", here / "campaign.csv")
    assert "What drifts" in (here / "fleet.html").read_text(encoding="utf-8")


def test_a_date_with_an_offset_is_a_moment():
    assert day_of("2026-03-31T00:00-12:00") - day_of("2026-03-31T00:00+12:00") == pytest.approx(1.0)
    assert day_of("2026-03-31T12:00Z") == day_of("2026-03-31T12:00")
    with pytest.raises(Failure, match="a date must be like"):
        day_of("0001-01-01T00:00+12:00")


def test_the_page_of_a_fleet_draws_who_stands_out_who_lacks_what_and_what_drifts(here):
    result = made_up_fleet(here)
    write_fleet_page(result, here / "fleet.html", here / "campaign.csv", "wheelpend campaign")
    page = (here / "fleet.html").read_text(encoding="utf-8")
    for title in ("stand", "The units beside each other", "Units by parameters", "Units by effects", "What drifts"):
        assert title in page
    assert "<b>robot" not in page.partition("</style>")[2].replace("\\\\u003cb\\\\u003e", "")
    assert "&lt;b&gt;robot 4&lt;/b&gt;: X1 +" in page and 500_000 < len(page) < 1_500_000
    with pytest.raises(Failure, match="needs units"):
        write_fleet_page(replace(result, fleet=None), here / "none.html", here / "campaign.csv")
    assert not (here / "none.html").exists()


def test_pictures_of_a_fleet_show_the_numbers_that_were_found(here):
    result = made_up_fleet(here)
    fleet = result.fleet.fleet
    assert telling_parameters(result.fleet)[0] == "X1"
    (forest,) = forest_figure(fleet, "X1", "kg").data
    assert list(forest.x) == sorted(forest.x) and forest.marker.color[-1] != forest.marker.color[5]
    squares = deviation_map(fleet).data[0]
    odd = [
        c for c, x, y in zip(squares.marker.color, squares.x, squares.y, strict=True) if "robot 4<" in y and x == "X1"
    ]
    assert len(squares.x) == 2 * len(result.fleet.units) and odd[0] > 5.0
    (lacking,) = effect_map(result.fleet.effects).data
    assert list(lacking.x) == ["slope"] and list(lacking.y) == ["<b>robot 0</b>"]
