"""Windows, the command line and a killed server agree, in a real browser."""

import os
import signal
import subprocess
import time

import pytest

from tests.support import run, simulated
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving
from wheelpend import Model, save_log
from wheelpend.model.workspace import history

pytestmark = [pytest.mark.slow, pytest.mark.extras, needs_nicegui, needs_browser]


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    Model.default().save(folder)
    return folder


@pytest.fixture
def log(tmp_path):
    save_log(tmp_path / "log.csv", simulated(duration=3.0, coulomb_drive__torque=0.3))
    return tmp_path / "log.csv"


def processes_about(path):
    """Numbers of the processes that name a file."""
    found = subprocess.run(["pgrep", "-f", str(path)], capture_output=True, text=True, check=False)
    return set(map(int, found.stdout.split())) - {os.getpid()}


def test_what_one_window_does_another_one_shows_and_so_does_the_command_line(workspace, log):
    with serving(workspace, log) as (address, _), browsing(address, address) as (first, second):
        first.press("Compare")
        second.until(lambda: second.text_of("hint").startswith("Running"), "that the other window runs", 10)
        second.until(lambda: "Error" in second.panel("compare"), "the comparison")
        assert "wheelpend compare" in second.text_of("commands")
        run("add", "slope", "--model", workspace)
        for window in (first, second):
            window.until(lambda: "Undo slope" in window.panel("add"), "the command line's change", 10)  # noqa: B023
            assert "add slope" in window.panel("add") and "Not compared yet" in window.panel("compare")
        assert not first.complaints() and not second.complaints()


def test_cancel_ends_the_command_while_the_page_stays_alive(workspace, log):
    with serving(workspace, log) as (address, process), browsing(address) as (window,):
        window.press("Learn what is missing")
        window.until(lambda: "diagnose" in window.text_of("running"), "the progress", 20)
        window.driver.find_element("css selector", "nav a").click()  # which is answered meanwhile
        window.press("Cancel")
        window.until(lambda: window.text_of("hint").startswith("Cancelled"), "the end", 10)
        assert processes_about(log) == {process.pid} and history(workspace) == []
        window.until(lambda: window.button("Compare").is_enabled(), "that it goes on", 10)


def test_a_server_that_is_killed_loses_nothing(workspace, log):
    with serving(workspace, log) as (address, process), browsing(address) as (window,):
        run("add", "coulomb_drive", "--model", workspace)
        window.until(lambda: "Undo coulomb_drive" in window.panel("add"), "the effect", 10)
        window.press("Undo coulomb_drive")
        window.until(lambda: "remove" in window.text_of("running"), "the change", 20)
        process.send_signal(signal.SIGKILL)
        process.wait()
    with serving(workspace, log) as (address, _), browsing(address) as (window,):
        window.until(lambda: "Redo coulomb_drive" in window.panel("add"), "what the killed server had begun")
        assert [entry["change"] for entry in history(workspace)] == ["add coulomb_drive", "remove coulomb_drive"]
        assert "add coulomb_drive" in window.panel("add") and "remove coulomb_drive" in window.panel("add")


HOSTILE = "<img src=x onerror=\"document.title='it ran'\">.csv"


def test_a_hostile_name_is_text(workspace, log, tmp_path):
    hostile = tmp_path / HOSTILE
    hostile.write_bytes(log.read_bytes().replace(b"theta_p", b"<script>document.title='it ran'</script>,theta_p", 1))
    with serving(workspace, log, "--holdout", hostile) as (address, _), browsing(address) as (window,):
        assert HOSTILE in window.panel("open")
        window.press("Compare")
        window.until(lambda: window.text_of("failure") or "Error" in window.panel("compare"), "a result")
        assert "it ran" not in window.driver.title and not window.driver.find_elements("css selector", "img[src=x]")


def test_by_the_keyboard_alone(workspace, log):
    from selenium.webdriver.common.keys import Keys

    with serving(workspace, log) as (address, _), browsing(address) as (window,):
        passed = []
        for _ in range(40):
            window.driver.switch_to.active_element.send_keys(Keys.TAB)
            focused = window.driver.switch_to.active_element
            passed.append(focused.text.strip())
            marks = [focused.value_of_css_property(name) for name in ("outline-style", "box-shadow")]
            assert marks != ["none", "none"] or focused.tag_name in ("input", "body"), passed
            if passed[-1] == "Compare":
                break
        assert {"1 Open", "Open", "Inspect the log", "Compare"} <= set(passed)
        window.driver.switch_to.active_element.send_keys(Keys.ENTER)
        window.until(lambda: "Error" in window.panel("compare"), "the comparison")


UNNAMED = """
const named = (e) => e.getAttribute("aria-label") || e.innerText.trim() || e.labels?.length || e.getAttribute("title")
  || e.closest("label") || e.type == "hidden";
return [...document.querySelectorAll("button, input, select, a, [role=button]")]
  .filter((e) => e.offsetParent !== null && !named(e)).map((e) => e.outerHTML.slice(0, 120))"""


def test_whatever_is_pressed_or_filled_in_has_a_name_and_sections_have_titles(workspace, log):
    with serving(workspace, log) as (address, _), browsing(address) as (window,):
        assert window.driver.execute_script(UNNAMED) == []
        titles = "return [...document.querySelectorAll('section')].map(e => document.getElementById(e.getAttribute("
        found = window.driver.execute_script(f"{titles}'aria-labelledby')).innerText)")
        assert [title.split()[0] for title in found if title != "What if"] == list("123456")


CONTRAST = """
const luminance = (text) => { const [r, g, b] = text.match(/[\\d.]+/g).map(Number).map((v) => v / 255)
  .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
const behind = (e) => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor;
  if (!/, 0\\)$|transparent/.test(c)) return c; } return "rgb(255, 255, 255)"; };
const enough = (e) => { const [a, b] = [getComputedStyle(e).color, behind(e)].map(luminance).sort((x, y) => y - x);
  return (a + 0.05) / (b + 0.05) >= 4.5; };
return [...document.querySelectorAll(".plain, .paragraph, .soft, .action:not([disabled]), .step, .there")]
  .filter((e) => e.offsetParent !== null && e.innerText.trim() && !e.closest("[disabled]") && !enough(e))
  .map((e) => e.innerText.slice(0, 60))"""


def test_dark_and_light_can_both_be_read(workspace, log):
    with serving(workspace, log) as (address, _), browsing(address) as (window,):
        for _ in range(3):
            assert window.driver.execute_script(CONTRAST) == []
            window.press("Dark or light")
            time.sleep(0.5)
        dark = "return document.body.classList.contains('body--dark')"
        window.press("Dark or light")
        window.until(lambda: window.driver.execute_script(dark), "the dark", 10)
        assert window.driver.execute_script(CONTRAST) == []
