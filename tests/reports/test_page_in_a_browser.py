"""A page of hostile names in a browser: its own scripts run, nobody else's do."""

import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from derive.effects import EFFECT_LIBRARY
from tests.reports.test_page import explanation  # noqa: F401  # a fixture
from wheelpend.reports.numbers import error_text
from wheelpend.reports.page.page import page_html

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
           "--disable-background-networking", "--disable-component-update", "--virtual-time-budget=20000",
           "--allow-file-access-from-files")  # fmt: skip
TIME_LIMIT_S = 120
RUN = "document.title='it ran'"
HOSTILE = (
    f"<script>{RUN}</script>.csv",
    f'"><img src=x onerror="{RUN}">',
    f"</script><script>{RUN}</script>",
    f"'><svg onload={RUN}>",
    f"</title></style><script>{RUN}</script>",
    f"<a href=javascript:{RUN}>x</a>",
    "{{ 7 * 7 }}{% raw %}",
    "\u202evsc.gol\u2066",
    f"<iframe srcdoc='<script>parent.{RUN}</script>'>",
)


FRAME = """
<iframe src="report.html" style="border: 0; width: WIDTHpx; height: 900px"></iframe>
<script>
onload = () => setTimeout(() => {
  const page = document.querySelector("iframe").contentDocument;
  const inside = (element) => element.closest(".wide, svg, head, script") === null;
  const wide = [...page.querySelectorAll("*")].filter(inside).filter((e) => e.getBoundingClientRect().right > WIDTH);
  const cut = [...page.querySelectorAll(".main-svg text")].filter((text) => {
    const [own, chart] = [text, text.closest(".chart")].map((e) => e.getBoundingClientRect());
    return own.width > 0 && (own.right > chart.right + 1 || own.left < chart.left - 1);
  });
  const charts = page.querySelectorAll(".chart .main-svg").length;
  const [names, texts] = [wide.map((e) => e.outerHTML.slice(0, 60)), cut.map((e) => e.textContent)];
  document.title = `charts ${charts}, wide ${names}, cut ${texts}.`;
}, 5000);
</script>"""


class Elements(HTMLParser):
    """Elements and attributes of a page."""

    def __init__(self, page):
        super().__init__()
        self.seen = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.seen.append((tag, dict(attributes)))


def hostile_page(explanation):  # noqa: F811
    """A page with hostile text wherever it shows text that is not ours: its log is named so already."""
    hostile_row = replace(EFFECT_LIBRARY["coulomb_drive"], sentence=" ".join(HOSTILE))
    with pytest.MonkeyPatch().context() as patch:
        patch.setitem(EFFECT_LIBRARY, "coulomb_drive", hostile_row)
        doubts = replace(explanation.last, where=explanation.first.where)
        said = replace(explanation, warnings=HOSTILE, experiment=" ".join(HOSTILE), last=doubts)
        return page_html(said, version=HOSTILE[0], command=" ".join(HOSTILE))


def shown(page, folder, frame=""):
    """The page, or a frame around it, after a browser has run its scripts, as text."""
    (folder / "report.html").write_text(page, encoding="utf-8")
    (folder / "frame.html").write_text(frame, encoding="utf-8")
    command = [
        BROWSER,
        *OPTIONS,
        f"--user-data-dir={folder / 'profile'}",
        "--dump-dom",
        (folder / ("frame.html" if frame else "report.html")).as_uri(),
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=True).stdout


@pytest.fixture(scope="module")
def page(explanation):  # noqa: F811
    return hostile_page(explanation)


def test_hostile_names_are_text_and_the_pages_elements_its_own(page):
    seen = Elements(page).seen
    scripts = [attributes for tag, attributes in seen if tag == "script"]
    assert len([a for a in scripts if not a]) == 2 and all(
        {*a} <= {"type", "data-chart", "data-sliders"} for a in scripts
    )
    assert [a["type"] for a in scripts if {*a} == {"type"}] == ["module"], "of the sliders"
    assert not [tag for tag, _ in seen if tag in ("img", "iframe", "svg", "object", "embed", "form")]
    assert not [a for _, a in seen if any(name.startswith("on") or "javascript:" in str(v) for name, v in a.items())]
    assert "\u202e" not in page and "\\u202e" in page and "{{ 7 * 7 }}" in page


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_in_a_browser_the_pages_charts_are_drawn_and_no_other_script_runs(page, tmp_path):
    dom = shown(page, tmp_path)
    assert re.search(r"<title>[^<]*\(coulomb_drive\), [0-9.]+ V: that explains", dom) and "it ran</title>" not in dom
    charts = page.count("data-chart=")
    assert charts >= 3 and dom.count('class="main-svg"') >= charts


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
@pytest.mark.parametrize("injected", [f"<script>{RUN}</script>", f'<img src=x onerror="{RUN}">'])
def test_in_a_browser_the_policy_stops_a_script_that_got_into_the_page(page, tmp_path, injected):
    assert "it ran</title>" not in shown(page.replace("</main>", f"{injected}</main>"), tmp_path)
    open_page = re.sub(r"<meta http-equiv=.*?>\n", "", page).replace("</main>", f"{injected}</main>")
    (tmp_path / "open").mkdir()
    assert "it ran</title>" in shown(open_page, tmp_path / "open"), "the test would notice a script that runs"


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
@pytest.mark.parametrize("width", [420, 1400])
def test_in_a_browser_nothing_sticks_out_of_a_page_as_narrow_as_a_telephone(explanation, tmp_path, width):  # noqa: F811
    dom = shown(page_html(explanation), tmp_path, FRAME.replace("WIDTH", str(width)))
    found = re.search(r"<title>charts (\d+), wide (.*), cut (.*)\.</title>", dom)
    assert int(found[1]) > 3, "the charts were drawn when this was measured"
    assert found.group(2, 3) == ("", "")


MOVING = """
<iframe src="report.html" style="border: 0; width: 1000px; height: 900px"></iframe>
<script>
onload = () => setTimeout(async () => {
  const page = document.querySelector("iframe").contentDocument;
  const [section, error] = [page.getElementById("try"), page.getElementById("try-error")];
  const done = [error.textContent];
  const moved = async (change) => {
    change();
    await new Promise((resolve) => setTimeout(resolve, 500));
    done.push(error.textContent);
  };
  const [torque] = section.querySelectorAll("input[type=range]");
  const slide = (value) => () => {
    torque.value = value;
    torque.dispatchEvent(new Event("input", {bubbles: true}));
    torque.dispatchEvent(new Event("input", {bubbles: true}));
  };
  await moved(slide(-500));
  await moved(slide(0));
  await moved(() => section.querySelector("input[type=checkbox]").click());
  done.push(`${torque.disabled} ${section.querySelector("output").textContent}`);
  await moved(() => page.getElementById("try-back").click());
  const lines = page.getElementById("try-chart").data.filter((line) => line.y.some(Number.isFinite)).length;
  document.title = `${done.join(", ")}; ${section.dataset.simulations} simulations, ${lines} lines.`;
}, 3000);
</script>"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_in_a_browser_a_moved_slider_changes_the_error_and_the_identified_value_brings_it_back(explanation, tmp_path):  # noqa: F811
    dom = shown(page_html(explanation), tmp_path, MOVING)
    found = re.search(r"<title>(.*); (\d+) simulations, (\d+) lines\.</title>", dom)
    identified, without, back, off, gone, again = found[1].split(", ")
    assert identified == back == again == f"{error_text(explanation.error, 3)} σ"
    assert float(without.split()[0]) > 2 * explanation.error and off == without, "zero torque is no friction"
    assert gone == "true absent"
    assert found.group(2, 3) == ("5", "9"), "two events at once are one simulation; three channels have three lines"
