"""The picture of the workbench in the docs comes from here: WHEELPEND_PICTURES=docs pytest tests/view/test_pictures.py.

Without the variable the picture is made and looked at, and forgotten.
"""

import os
from pathlib import Path

import pytest

from tests.support import ROOT
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving

PICTURE_FILE = "workbench.png"
WIDTH, HEIGHT = 1280, 1120


@needs_nicegui
@needs_browser
@pytest.mark.slow
def test_what_is_chosen_in_time_stands_out_over_the_states_and_this_is_the_picture_of_the_docs(tmp_path):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By

    folder = Path(os.environ.get("WHEELPEND_PICTURES", tmp_path))
    with serving(tmp_path, "--demo") as (address, _), browsing(address) as (window,):
        window.press("Compare")
        window.until(lambda: window.text_of("hint").startswith("Running"), "that it runs", 10)  # and no button is free
        window.press("Learn what is missing")
        chart = lambda name: window.driver.find_elements(By.CSS_SELECTOR, f".{name} .main-svg")  # noqa: E731
        window.until(lambda: chart("force-map") and chart("force-time"), "the charts")
        over_time = window.driver.find_element(By.CSS_SELECTOR, ".force-time")
        window.driver.set_window_size(WIDTH, HEIGHT)
        window.driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", over_time)
        drag = ActionChains(window.driver).move_to_element_with_offset(over_time, -100, 0).click_and_hold()
        drag.move_by_offset(120, 5).release().perform()
        names = "return [...document.querySelectorAll('.force-state, .force-time')].map(e => e.data?.map(t => t.name))"
        chosen = lambda: [("chosen" in (found or [])) for found in window.driver.execute_script(names)]  # noqa: E731
        window.until(lambda: sum(chosen()) >= 7, "what was chosen, in every chart")  # over time, and six states
        window.driver.execute_script("document.getElementById('see').scrollIntoView()")
        window.until(lambda: window.driver.execute_script("return window.scrollY") > 0, "the panel")
        window.driver.save_screenshot(str(folder / PICTURE_FILE))
        assert window.complaints() == []
    assert (folder / PICTURE_FILE).stat().st_size > 30_000
    assert (ROOT / "docs" / PICTURE_FILE).exists()
