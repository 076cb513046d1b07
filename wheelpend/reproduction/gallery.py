"""One self-contained HTML page with the tables, the figures and the choices; it needs neither network nor scripts."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import jinja2
from markupsafe import Markup

from wheelpend.reproduction import results_text
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.figures import SHOWN_SEED

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

Grid = tuple[list[str], list[list[str]]]


class Section(NamedTuple):
    """A heading with explanations, tables and pictures."""

    title: str
    text: list[str]
    tables: list[tuple[str, Grid]]  # with their captions
    pictures: list[tuple[str, str]]  # names, captions


def render(result: Reproduction, pictures: Mapping[str, bytes]) -> str:
    """Text of the page."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    sources = {name: Markup("data:image/png;base64," + base64.b64encode(d).decode()) for name, d in pictures.items()}
    return environment.from_string(PAGE_TEMPLATE).render(
        style=Markup(PAGE_STYLE_SHEET),
        sections=list(sections(result)),
        findings=results_text.finding_sentences(result),
        choices=[(c, results_text.effect_sentences(c)) for c in result.choices],
        sources=sources,
        result=result,
    )


def sections(result: Reproduction) -> Iterator[Section]:
    """The page's sections, as far as there is something to show."""
    if result.table1:
        yield table12(result, 1)
    if result.table2:
        yield table12(result, 2)
    if result.conditions:
        yield Section("Condition numbers", [
            "Of ΦᵀΦ, as the regressor stands and with its columns scaled to unit length, which takes the parameters' "
            "units out. Medians over seeds; the filtered regressor with FOH.",
        ], [("", results_text.condition_table(result))], [])  # fmt: skip
    if result.table3:
        yield table3(result)
    if result.predictions:
        yield from paper_figures(result)


def table12(result: Reproduction, which: int) -> Section:
    """Table 1 or 2."""
    cells = result.table1 if which == 1 else result.table2
    titles = ("Table 1: differentiation and filtering, simple command", "Table 2: filtering, both commands")
    grids = [(f"{command.capitalize()} command", results_text.error_table(list(own)))
             for command, own in groupby(cells, key=lambda c: c.command)]  # fmt: skip
    failed = [f"{METHOD_LABELS[m]} gave no estimate in {n} of {result.seeds} seeds on the {c} command."
              for m, c, n in dict.fromkeys((c.method, c.command, c.failed) for c in cells if c.failed)]  # fmt: skip
    text = [
        f"Absolute error in % over {result.seeds} seeds: median, and in brackets the range from 10 to 90 %. "
        "The rank is the share of our draws whose error is smaller than that of the paper's single draw. "
        "All methods see the same data.",
        *([results_text.bound_sentence(result)] if which == 1 or not result.table1 else []), *failed,
    ]  # fmt: skip
    return Section(
        titles[which - 1], text, grids, [(f"table{which}", "Dots are medians, whiskers run from 10 to 90 %.")]
    )


def table3(result: Reproduction) -> Section:
    """Table 3."""
    grids = []
    for _, own in groupby(result.table3, key=lambda r: r.case):
        rows = list(own)
        grids.append((results_text.case_title(rows[0]), results_text.deviation_table(rows)))
    text = [
        "Error in %, without noise, so there is nothing random in it. The range is what the absolute error would be "
        "over durations from 10 to 30 s, both signs of the deviation, and whether the filters or the robot are off.",
        "Ratio is our absolute error to the printed one. Where a printed error and its printed estimate are an order "
        "of magnitude apart, the estimate is believed.",
    ]
    caption = "Dots are ours, diamonds the paper's; bars are the range over what the paper leaves open."
    return Section("Table 3: filter time constants and a wrong initial pitch", text, grids, [("table3", caption)])


def paper_figures(result: Reproduction) -> Iterator[Section]:
    """Figures 2 to 6."""
    yield Section("Figures 2 and 3: the data", [], [], [
        ("figure2", f"Figure 2. Input data for system identification, seed {SHOWN_SEED}."),
        ("figure3", "Figure 3. Output data, the same seed. The wheel's speed: differences of the encoder."),
    ])  # fmt: skip
    text = [
        "Closed loops with the identified parameters under the aggressive command, ideal sensors. RMSE in the tables: "
        "as printed; recomputed with the paper's printed estimates; of our estimates (filtered, FOH) the median over "
        f"{result.seeds} seeds and the range from 10 to 90 %; in how many seeds the predicted robot falls over.",
    ]  # fmt: skip
    yield Section("Figures 4 to 6: predictions", text, results_text.prediction_tables(result.predictions), [
        ("figure4", "Figure 4. Outputs predicted by the closed loop: exact red, identified from the simple command "
                    "blue, from the aggressive command green."),
        ("figure5", f"Figure 5. Errors of these predictions; RMSE of this draw (seed {SHOWN_SEED}) and the paper's."),
        ("figure6", "Figure 6. Predicted control input: measured grey, exact red, simple green, aggressive blue, as "
                    "the paper has it."),
    ])  # fmt: skip


PAGE_STYLE_SHEET = """
:root { --ink: #262b33; --soft: #667080; --line: #e2e6eb; }
* { box-sizing: border-box; }
body { margin: 0; background: #f6f7f9; color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1100px; margin: 0 auto; padding: 28px 20px 60px; }
section, header { background: #fff; border: 1px solid var(--line); border-radius: 10px; padding: 22px 28px;
  margin: 0 0 18px; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .5rem; } h2 { font-size: 1.2rem; margin: 0 0 .4rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 .2rem; } p { margin: .35rem 0 .6rem; max-width: 92ch; }
li { margin: .15rem 0; max-width: 92ch; } ul { margin: .4rem 0; padding-left: 1.2rem; }
.soft, figcaption { color: var(--soft); font-size: .92rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .86rem; }
th { text-align: right; font-weight: 600; color: var(--soft); border-bottom: 2px solid var(--line);
  padding: 6px 0 6px 9px; vertical-align: bottom; }
td { border-bottom: 1px solid var(--line); padding: 6px 0 6px 9px; text-align: right; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
td span { display: block; color: var(--soft); font-size: .86em; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
.words td, .words th { text-align: left; white-space: normal; vertical-align: top; } .words ul { margin: 0; }
.words td:first-child { font-weight: 600; } .words td + td + td + td { width: 46%; }
figure { margin: 1.1rem 0 0; } img { width: 100%; min-width: 560px; height: auto; display: block; }
@media (max-width: 700px) {
  main { padding: 12px 8px 30px; } section, header { padding: 16px; }
  .words tr:first-child { display: none; }
  .words td, .words td + td + td + td { display: block; width: auto; border: 0; padding: 2px 0; }
  .words tr { display: block; border-bottom: 1px solid var(--line); padding: 8px 0; }
}
@media print { body { background: #fff; } figure { break-inside: avoid; } }
"""

PAGE_TEMPLATE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<title>The paper's tables and figures, reproduced</title>
<style>{{ style }}</style>
</head>
<body>
<main>
<header>
<h1>The paper's tables and figures, reproduced</h1>
<p class="soft">Peng, Cheng and Tsai, Electronics 2023, 12, 4569, section 4. Closed loop at 1 kHz for \
{{ "%g" | format(result.duration_s) }} s{% if result.table1 or result.table2 or result.predictions %}, \
{{ result.seeds }} seeds{% endif %}.</p>
<ul>
{% for line in findings %}
<li>{{ line }}</li>
{% endfor %}
</ul>
</header>
{% for s in sections %}
<section>
<h2>{{ s.title }}</h2>
{% for line in s.text %}
<p class="soft">{{ line }}</p>
{% endfor %}
{% for caption, (head, rows) in s.tables %}
{% if caption %}
<h3>{{ caption }}</h3>
{% endif %}
<div class="wide"><table>
<tr>{% for cell in head %}<th>{{ cell }}</th>{% endfor %}</tr>
{% for row in rows %}
<tr>{% for cell in row %}<td>{{ cell.split(" (")[0] }}\
{% if " (" in cell %} <span>({{ cell.split(" (")[1] }}</span>{% endif %}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
{% endfor %}
{% for name, caption in s.pictures %}
<figure>
<div class="wide"><img src="{{ sources[name] }}" alt="{{ caption }}"></div>
<figcaption>{{ caption }}</figcaption>
</figure>
{% endfor %}
</section>
{% endfor %}
{% if choices %}
<section>
<h2>What the paper leaves open</h2>
<p class="soft">For each choice: the factors by which the numbers change with another one, lowest to highest, over \
X1 to X5 of each case or command, or over the outputs of Figure 5. For Tables 1 and 2 the numbers are median errors.</p>
<table class="words">
<tr><th>choice</th><th>the paper</th><th>here</th><th>with another choice</th></tr>
{% for choice, sentences in choices %}
<tr><td>{{ choice.name }}</td><td>{{ choice.open }}</td><td>{{ choice.made }}</td>
<td><ul>{% for line in sentences %}<li>{{ line }}</li>{% endfor %}</ul></td></tr>
{% endfor %}
</table>
</section>
{% endif %}
</main>
</body>
</html>
"""
