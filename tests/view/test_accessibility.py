"""axe-core finds nothing serious on the workbench, light and dark, wide and narrow; the keyboard reaches a click."""

from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving

AXE = find_spec("axe_core_python")
needs_axe = pytest.mark.skipif(AXE is None, reason="axe-core-python, of the extra browser, is not installed")
SERIOUS = ("serious", "critical")
RUN_AXE = """
const done = arguments[0];
axe.run(document, {resultTypes: ["violations"]}).then((found) => done(found.violations.map((v) =>
    [v.impact, v.id, v.help, v.nodes.map((n) => n.html.slice(0, 160) + " " + (n.any[0]?.message ?? "")).slice(0, 4)])));
"""
pytestmark = [needs_nicegui, needs_browser, needs_axe]


def axe_script():
    return (Path(AXE.origin).parent / "axe.min.js").read_text(encoding="utf-8")


def violations(window):
    """Serious and critical violations of the page as it is."""
    window.driver.execute_script(axe_script())
    return [found for found in window.driver.execute_async_script(RUN_AXE) if found[0] in SERIOUS]


def look_everywhere(window):
    """The violations at both widths, in both colours, with all that is folded open."""
    found = {}
    window.unfold()
    for width in (1280, 420):
        window.driver.set_window_size(width, 1000)
        for colours in ("as the system", "dark", "light"):
            if colours != "as the system":
                window.press("Dark or light")
            found[width, colours] = violations(window)
        window.press("Dark or light")
    return found


def test_an_empty_workbench_has_no_serious_violation(tmp_path):
    with serving(tmp_path) as (address, _), browsing(address) as (window,):
        assert not any(look_everywhere(window).values())


def test_axe_would_find_a_field_without_a_name(tmp_path):
    with serving(tmp_path) as (address, _), browsing(address) as (window,):
        window.driver.execute_script("document.querySelector('main').append(document.createElement('input'))")
        assert [found[1] for found in violations(window)] == ["label"]


@pytest.mark.slow
def test_a_workbench_after_a_diagnosis_has_no_serious_violation_and_is_worked_by_the_keyboard(tmp_path):
    from selenium.webdriver.common.keys import Keys

    with serving(tmp_path, "--demo") as (address, _), browsing(address) as (window,):
        focused = "return document.activeElement?.innerText.trim()"
        for _ in range(60):
            window.driver.switch_to.active_element.send_keys(Keys.TAB)
            if window.driver.execute_script(focused) == "Compare":
                break
        outline = "return getComputedStyle(document.activeElement).boxShadow"
        assert window.driver.execute_script(focused) == "Compare" and "px" in window.driver.execute_script(outline)
        window.driver.switch_to.active_element.send_keys(Keys.ENTER)
        window.until(lambda: "noise floor" in window.panel("compare"), "the comparison")
        window.press("Learn what is missing")
        window.until(lambda: window.button("Add coulomb_drive") and "Map over" in window.panel("see"), "the diagnosis")
        found = look_everywhere(window)
        assert not any(found.values()), found
