"""What a campaign costs is measured in processes of their own, and written as tables, a picture and an outlook."""

import json

import pytest

from wheelpend.benchmarks.fleets import one_campaign, scaling
from wheelpend.benchmarks.fleets.one_campaign import CampaignCost, analyse_nothing, campaign_cost
from wheelpend.benchmarks.fleets.scaling import BEGIN_MARK, END_MARK, efficiency, main, section_text
from wheelpend.campaigns.one_log import SimulationSpec
from wheelpend.model.record import Model


def cost(workers, logs, seconds, **further):
    return CampaignCost(workers, logs, seconds, 0.01 * logs, 1e-3 * logs, 1.0, 10.0 + 1e-3 * logs, logs)._replace(
        **further
    )


def test_a_campaign_without_an_analysis_keeps_every_result():
    found = campaign_cost(Model.default(), SimulationSpec("aggressive", 4.0, {}), analyse_nothing, 0, 30)
    assert (found.workers, found.logs) == (0, 30) and found.seconds > 0.0 and found.last_seconds > 0.0
    assert 0.3 < found.kilobytes_on_disk / 30 < 5.0, "nine parameters, and eighty-one numbers of covariance, each"
    assert analyse_nothing(3) == analyse_nothing(3) != analyse_nothing(4)


def test_an_efficiency_is_the_share_of_its_cores(monkeypatch):
    monkeypatch.setattr(scaling, "cores", lambda: 2)
    alone = cost(0, 40, 20.0)
    assert efficiency(alone, alone) == 1.0
    assert efficiency(cost(1, 40, 25.0), alone) == pytest.approx(0.8)
    assert efficiency(cost(2, 40, 12.5), alone) == efficiency(cost(8, 40, 12.5), alone) == pytest.approx(0.8)


def test_a_million_logs_follow_from_the_largest_campaign():
    empty = [cost(1, n, 0.02 * n) for n in (100, 1000)]
    client = [cost(0, n, 0.01 * n) for n in (1000, 100_000)]
    text = section_text([cost(0, 40, 20.0), cost(2, 40, 12.5)], empty, client)
    assert "139 hours of one core" in text, "0.5 s each"
    assert "100 logs a second" in text and "2.8 hours at least" in text and "50 cores" in text
    assert "1.0 GB of memory" in text and "1.0 GB of Parquet" in text and "0.3 hours for summary" in text
    assert "| 1 | 1,000 | 20.0 | 10.0 |" in text and "| 100,000 | 100.0 | 110 | 1.00 |" in text


def test_the_section_and_its_picture_stand_in_the_page(tmp_path, monkeypatch):
    asked = []

    def measured(workers, logs, *options):
        asked.append((workers, logs, *options))
        return cost(workers, logs, 0.02 * logs)

    monkeypatch.setattr(scaling, "_measured", measured)
    page = tmp_path / "fleets.md"
    page.write_text(f"before\n{BEGIN_MARK}\nold\n{END_MARK}\nafter\n")
    main(longest=1000, identified=6, out=page)
    assert asked[:4] == [(w, 6, "--identify") for w in (0, 1, 2, 8)] and len(asked) == 4 + 9 + 3
    assert "old" not in page.read_text() and (tmp_path / "fleet_growth.svg").read_text().startswith("<?xml")


@pytest.mark.slow
def test_one_campaign_is_measured_by_a_process(capfd):
    found = scaling._measured(1, 5)
    assert (found.workers, found.logs) == (1, 5)
    one_campaign.main(workers=0, logs=2, identify=True)
    assert json.loads(capfd.readouterr().out.splitlines()[-1])["logs"] == 2
