"""In a real browser: another stretch judges, the next log is designed, an effect written; an hour of log; odd names."""

import time
from urllib.parse import urlsplit

import numpy as np
import polars
import pytest

from tests.support import simulated
from tests.view.browsing import browsing, needs_browser
from tests.view.serving import needs_nicegui, serving
from wheelpend import Model, save_log

pytestmark = [pytest.mark.slow, pytest.mark.extras, needs_nicegui, needs_browser]
HOUR_SAMPLES = 3_600_000  # at 1 kHz
MAX_POINTS = 2 * 600 * 2  # of a line: least and largest of every pixel, and some more at gaps
MAX_SENT_BYTES = 2_000_000  # of five signals as text


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    Model.default().save(folder)
    save_log(folder / "log.csv", simulated(duration=4.0, coulomb_drive__torque=0.3))
    return folder


def at_rest(window):
    window.until(lambda: "Running" not in window.text_of("hint"), "that nothing runs")
    time.sleep(0.7)  # until buttons can be pressed again


def test_a_stretch_judges_the_next_log_is_drawn_and_an_effect_is_written(workspace):
    with serving(workspace, workspace / "log.csv") as (address, _), browsing(address) as (window,):
        window.press("Compare")
        window.until(lambda: "Hold out" in window.panel("compare"), "the chart")
        at_rest(window)
        assert "white?" in window.panel("compare")
        (words,) = [line for line in window.panel("compare").splitlines() if line.startswith("Hold out")]
        window.press(words)
        window.until(lambda: ", held out" in window.panel("open"), "the two files")
        window.until(lambda: "Whole log again" in window.panel("compare"), "the comparison")
        at_rest(window)
        window.press("Whole log again")
        window.until(lambda: ", held out" not in window.panel("open"), "the log as it was")
        window.unfold()
        window.press("Design the next log")
        window.until(lambda: "as it was designed" in window.panel("go_on"), "the command")
        at_rest(window)
        window.unfold()
        window.until(lambda: "Right: my_friction" in window.panel("go_on"), "that the text is right")
        field = window.driver.find_element("css selector", ".own-effect textarea")
        field.send_keys("nonsense")
        window.until(lambda: "TOML" in window.panel("go_on"), "what is wrong", 10)
        assert not window.button("Keep it in effects.toml").is_enabled()
        field.send_keys("\b" * len("nonsense"))
        window.until(lambda: "Right: my_friction" in window.panel("go_on"), "that it is right again", 10)
        window.press("Keep it in effects.toml")
        window.until(lambda: "is in effects.toml already" in window.panel("go_on"), "that it was kept")
        window.press("Cancel")  # of what is asked anew with it
        shown = window.text_of("commands")
        assert window.complaints() == []
        asked = {urlsplit(found) for found in window.addresses()}
        assert {(a.scheme, a.netloc) for a in asked if a.scheme not in ("data", "blob", "about")} == {
            (scheme, urlsplit(address).netloc) for scheme in ("http", "ws")
        }, "no request leaves the machine"
    assert (workspace / "designed.csv").exists() and "my_friction" in (workspace / "effects.toml").read_text()
    for command in ("wheelpend split ", "wheelpend design ", "wheelpend effects --define "):
        assert command in shown


SENT = """
const plot = document.querySelector('.tall');
if (!plot?.data) return null;
return [Math.max(...plot.data.map((line) => line.x.length)), JSON.stringify(plot.data).length,
  plot.layout.xaxis.range[1], plot.data.length];
"""
ZOOM = "document.querySelector('.tall').emit('plotly_relayout', {'xaxis.range[0]': 1800, 'xaxis.range[1]': 1803});"


def test_an_hour_of_log_is_drawn_and_zoomed_with_few_points(workspace):
    t = np.arange(HOUR_SAMPLES) * 1e-3
    signals = {"v_in": np.sin(9.0 * t), "theta_w": np.sin(0.3 * t), "theta_p": np.sin(t), "dtheta_p": np.cos(t)}
    signals["theta_p"][1_801_500] = 40.0  # one sample in an hour stands out, and is seen
    polars.DataFrame({"t": t, **signals}).write_parquet(workspace / "hour.parquet")
    with serving(workspace, "hour.parquet") as (address, _), browsing(address) as (window,):
        window.press("Inspect the log")
        window.until(lambda: window.driver.execute_script(SENT) is not None, "the signals")
        points, sent, end, lines = window.driver.execute_script(SENT)
        assert (lines, end) == (4, pytest.approx(3600.0, abs=0.01))
        assert 600 <= points <= MAX_POINTS and sent <= MAX_SENT_BYTES
        highest = "return Math.max(...document.querySelector('.tall').data.flatMap((line) => line.y))"
        assert window.driver.execute_script(highest) == 40.0
        window.driver.execute_script(ZOOM)
        window.until(lambda: window.driver.execute_script(SENT)[2] == 1803, "the stretch", 20)
        points, sent, _, _ = window.driver.execute_script(SENT)
        assert 600 <= points <= MAX_POINTS and sent <= MAX_SENT_BYTES
        assert window.driver.execute_script(highest) == 40.0


HOSTILE_NAME = "<img src=x onerror=\"document.title='it ran'\">"
ODD_NAMES = (HOSTILE_NAME, "<b>bold</b>", "a\u202eb", "${7*7}", "=1+1", "javascript:x")


def test_columns_of_any_name_are_text(tmp_path):
    t = np.arange(0.0, 4.0, 1e-3)
    columns = {"t": t, **{name: np.sin((k + 1) * t) for k, name in enumerate(ODD_NAMES)}}
    polars.DataFrame(columns).write_csv(tmp_path / "odd.csv")
    with serving(tmp_path, "odd.csv") as (address, _), browsing(address) as (window,):
        window.press("Inspect the log")
        window.until(lambda: window.driver.execute_script(SENT) is not None, "the signals")
        at_rest(window)
        window.unfold()
        assert "it ran" not in window.driver.title and not window.driver.find_elements("css selector", "img[src=x]")
        titles = "return document.querySelector('.tall').innerText"
        assert HOSTILE_NAME in window.driver.execute_script(titles) and "<b>bold</b>" in window.panel("open")
