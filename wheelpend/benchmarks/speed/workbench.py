"""Rows: the workbench in a browser, with a log of an hour at 1 kHz, beside one of twenty seconds."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from time import monotonic, perf_counter, sleep
from typing import Any, NamedTuple

import numpy as np

from wheelpend.benchmarks.speed.record import NotMeasurableError, Times
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.errors import Failure
from wheelpend.isolation import import_configured, python_command, python_environment

LONG_SAMPLES, SHORT_SAMPLES = 3_600_000, 20_000  # at 1 kHz
MAX_PAGE_BYTES = 500e6
TIME_LIMIT_S, LOOK_INTERVAL_S = 120.0, 0.01
BROWSER_OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1280,1000",
    "--enable-precise-memory-info",
)  # fmt: skip
PRESS_SCRIPT = """
const button = [...document.querySelectorAll('button')].find((e) => e.innerText.trim() == arguments[0] && !e.disabled);
button?.click();
return Boolean(button);
"""
DRAWN_SCRIPT = "return Boolean(document.querySelector('.tall .main-svg') && document.querySelector('.tall').data)"
AT_REST_SCRIPT = "return !document.querySelector('.running .q-linear-progress:not(.hidden)')"
ZOOM_SCRIPT = """
const [begin, end, done] = arguments, plot = document.querySelector('.tall'), begun = performance.now();
const times = () => plot.data[0].x;
plot.emit('plotly_relayout', {'xaxis.range[0]': begin, 'xaxis.range[1]': end});
const isThere = () => times()[0] > begin - 1 && times().at(-1) < end + 1;
const look = () => isThere() ? done(performance.now() - begun) : setTimeout(look);
look();
"""
MEMORY_SCRIPT = "return performance.memory.usedJSHeapSize"


class Seen(NamedTuple):
    """What a window showed of a log."""

    first_picture_s: float  # from the click to the signals
    zoom_s: float  # the median of some, from the request to what is drawn


def first_picture(s: Setting) -> Times:
    """From a click to the signals of an hour, against those of twenty seconds."""
    return Times(_seen(LONG_SAMPLES).first_picture_s, _seen(SHORT_SAMPLES).first_picture_s)


def zoom(s: Setting) -> Times:
    """From a zoom into an hour to its picture, against one into twenty seconds."""
    return Times(_seen(LONG_SAMPLES).zoom_s, _seen(SHORT_SAMPLES).zoom_s)


@lru_cache
def _seen(samples: int) -> Seen:
    """A log of so many samples, opened and zoomed into; raises NotMeasurableError where there is no browser."""
    with tempfile.TemporaryDirectory() as name, _serving(Path(name), samples) as address, _browser() as driver:
        driver.get(address)
        begun = _when(lambda: driver.execute_script(PRESS_SCRIPT, "Inspect the log"))
        drawn = _when(lambda: driver.execute_script(DRAWN_SCRIPT))
        _when(lambda: driver.execute_script(AT_REST_SCRIPT))
        length = samples * 1e-3
        spans = [(share * length, share * length + 0.02 * length) for share in (0.1, 0.3, 0.5, 0.7, 0.9)]
        zooms = [driver.execute_async_script(ZOOM_SCRIPT, *span) * 1e-3 for span in spans]
        if (taken := float(driver.execute_script(MEMORY_SCRIPT))) > MAX_PAGE_BYTES:
            raise Failure(f"The page must take at most {MAX_PAGE_BYTES / 1e6:g} MB, but takes {taken / 1e6:.0f}.")
        return Seen(drawn - begun, float(np.median(zooms)))


def _when(holds: Callable[[], Any]) -> float:
    """The time at which something holds [s]."""
    end = monotonic() + TIME_LIMIT_S
    while not holds():
        if monotonic() > end:
            raise Failure(f"The workbench must show a log within {TIME_LIMIT_S:g} s, but it does not.")
        sleep(LOOK_INTERVAL_S)
    return perf_counter()


@contextmanager
def _serving(folder: Path, samples: int) -> Iterator[str]:
    """The address of a workbench with a made-up log of so many samples."""
    polars = import_configured("polars")
    rng, t = np.random.default_rng(0), np.arange(samples) * 1e-3
    table = {"t": t, "v_in": 5.0 * np.sin(t) + rng.normal(size=samples), "theta_w": 10.0 * np.sin(0.3 * t),
             "theta_p": 0.1 * np.sin(2.0 * t), "dtheta_p": 0.2 * np.cos(2.0 * t)}  # fmt: skip
    polars.DataFrame(table).write_parquet(folder / "log.parquet")
    environment = python_environment()
    subprocess.run(python_command("-m", "wheelpend", "new", "."), cwd=folder, env=environment, check=True,
                   capture_output=True)  # fmt: skip
    command = python_command("-m", "wheelpend", "view", "log.parquet", "--no-browser")
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               text=True)  # fmt: skip
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line):
                yield found[0]
                return
        raise NotMeasurableError("the workbench does not start: is NiceGUI, of the extra view, installed?")
    finally:
        process.kill()
        process.wait()


@contextmanager
def _browser() -> Iterator[Any]:
    """The Chromium of the system without a window; raises NotMeasurableError where there is none."""
    binary, driver_path = shutil.which("chromium"), shutil.which("chromedriver")
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        raise NotMeasurableError("selenium, of the extra browser, is not installed") from None
    if not binary or not driver_path:
        raise NotMeasurableError("Chromium or its driver is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for option in BROWSER_OPTIONS:
        options.add_argument(option)
    driver = webdriver.Chrome(options=options, service=Service(driver_path))
    try:
        yield driver
    finally:
        driver.quit()
