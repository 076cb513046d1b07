"""The workbench in the Chromium of the system, without a window."""

import json
import shutil
import time
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

CHROMIUM, CHROMEDRIVER = shutil.which("chromium"), shutil.which("chromedriver")
WANTED = {"Selenium": find_spec("selenium"), "Chromium": CHROMIUM, "chromedriver": CHROMEDRIVER}
MISSING = ", ".join(name for name, found in WANTED.items() if not found)
needs_browser = pytest.mark.skipif(bool(MISSING), reason=f"{MISSING} is not installed")
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1280,1000",
           "--force-prefers-reduced-motion", "--no-first-run", "--disable-background-networking")  # fmt: skip
TIME_LIMIT_S = 240
PRESS = """
const button = [...document.querySelectorAll('button')].find((e) => e.innerText.trim() == arguments[0]);
if (!button || button.disabled || button.offsetParent === null) return false;
button.click();
return true;
"""
REPLACED_CHART = "Resize must be passed a displayed plot div element."


class Window:
    """A window of the workbench, as its user sees it."""

    def __init__(self, driver):
        self.driver = driver

    def text_of(self, name):
        """What the elements of a class say."""
        return "\n".join(self.driver.execute_script(
            "return [...document.getElementsByClassName(arguments[0])].map(e => e.innerText)", name))  # fmt: skip

    def panel(self, name):
        """What a panel says."""
        return self.driver.execute_script("return document.getElementById(arguments[0])?.innerText ?? ''", name)

    def button(self, words):
        """The button with these words, or None."""
        return self.driver.execute_script(
            "return [...document.querySelectorAll('button')].find(e => e.innerText.trim() == arguments[0])", words
        )

    def press(self, words):
        """Press a button once it can be pressed: found and pressed in one go, since a chart above may yet move it."""
        self.until(lambda: self.driver.execute_script(PRESS, words), f"the button {words}")

    def until(self, holds, what, seconds=TIME_LIMIT_S):
        """Wait for something."""
        begin = time.monotonic()
        while not holds():
            assert time.monotonic() < begin + seconds, f"{what} is awaited, but the page says:\n{self.text_of('page')}"
            time.sleep(0.1)

    def shot(self, path, width):
        """A picture of the whole page at a width; returns how far it sticks out of it [px]."""
        for height in (900, "document.documentElement.scrollHeight"):
            if not isinstance(height, int):
                height = self.driver.execute_script(f"return {height}")
            self.driver.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
            )
            time.sleep(0.5)
        self.driver.save_screenshot(str(path))
        return self.driver.execute_script("return document.documentElement.scrollWidth") - width

    def addresses(self):
        """Every address that the page asked for since the last time."""
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        named = {"Network.requestWillBeSent": ("request", "url"), "Network.webSocketCreated": ("url",)}
        found = set()
        for event in events:
            value = event["params"]
            for key in named.get(event["method"], ()):
                value = value[key]
            found |= {value} if isinstance(value, str) else set()
        return found

    def unfold(self):
        """Open whatever is folded."""
        self.driver.execute_script("document.querySelectorAll('details').forEach((e) => { e.open = true; })")

    def complaints(self):
        """What the browser complains of, but for Plotly about a chart that is just being replaced."""
        said = [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]
        return [words for words in said if REPLACED_CHART not in words]


@contextmanager
def browsing(*addresses):
    """A window for each address, each in a browser of its own."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    drivers = []
    try:
        for address in addresses:
            options = webdriver.ChromeOptions()
            options.binary_location = CHROMIUM
            options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
            for option in OPTIONS:
                options.add_argument(option)
            drivers.append(webdriver.Chrome(options=options, service=Service(CHROMEDRIVER)))
            drivers[-1].get(address)
        windows = [Window(driver) for driver in drivers]
        for window in windows:
            window.until(lambda: window.text_of("hint"), "the page", 30)  # noqa: B023  # called at once
        yield windows
    finally:
        for driver in drivers:
            driver.quit()
