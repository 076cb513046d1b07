"""A newcomer's way, in a real browser: from the first screen of --demo to 'nothing more is missing' in three clicks."""

import pytest

from tests.support import ROOT
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving
from wheelpend.model.workspace import history

pytestmark = [pytest.mark.slow, pytest.mark.extras, needs_nicegui, needs_browser]
CLICKS = ("Compare", "Learn what is missing", "Add coulomb_drive")


def test_three_clicks_lead_to_nothing_more_is_missing(tmp_path):
    with serving(tmp_path, "--demo") as (address, _), browsing(address) as (window,):
        for number, click in enumerate(CLICKS, 1):
            window.until(lambda: f"Click {number} of 3" in window.text_of("hint"), click)  # noqa: B023
            window.press(click)
            window.until(lambda: window.text_of("hint").startswith("Running"), "that it runs", 10)
        window.until(lambda: window.text_of("hint").startswith("Nothing more is missing"), "the end")
        assert "coulomb_drive" in window.panel("add") and "Undo coulomb_drive" in window.panel("add")
        log, holdout = (ROOT / "data" / name for name in ("demo.csv", "demo_holdout.csv"))
        assert f"wheelpend add coulomb_drive {log} --holdout {holdout}" in window.text_of("commands")
        assert max(window.shot(tmp_path / f"{width}.png", width) for width in (1280, 420)) <= 0, "nothing sticks out"
        assert window.complaints() == []
    (entry,) = history(tmp_path / "demo")
    assert entry["change"] == "add coulomb_drive" and entry["error_after"] < 1.05 < 50 < entry["error_before"]
