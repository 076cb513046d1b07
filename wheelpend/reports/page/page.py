"""TODO reports.page.page"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path

import jinja2
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from wheelpend.diagnosis.explain import Explanation
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce
from wheelpend.files import write_text
from wheelpend.inspection.standstill import standstills
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.page import effect_figures, figures, force_figures
from wheelpend.reports.page.equations import equation_rows
from wheelpend.reports.page.rows import candidate_row, detectable_size_rows, law_table, log_rows, parameter_rows
from wheelpend.reports.page.sentences import (
    ambiguity_sentences,
    concentration_sentences,
    error_text,
    estimate_text,
    headline_sentences,
    number_text,
    p_value_text,
    verdict_text,
)
from wheelpend.reports.page.style import MAX_DRAWN_LOGS, display_text
from wheelpend.reports.text.unexplained import repeatability_sentences

REPORTED_PACKAGES = ("sympy", "numpy", "scipy", "numba", "plotly")


def write_report(explanation: Explanation, path: Path, *, version: str = "", command: str = "") -> Path:
    """Write the page, complete or not at all, and return its path."""
    path = Path(path)
    write_text(path, page_html(explanation, version=version, command=command))
    return path


def page_html(explanation: Explanation, *, version: str = "", command: str = "") -> str:
    """Text of the page."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "number": number_text,
        "error_text": error_text,
        "uncertain": estimate_text,
        "pretty": display_text,
        "probability": p_value_text,
    }
    q = plant_units_of(explanation.model)
    return environment.from_string(PAGE_TEMPLATE).render(
        style=Markup(PAGE_STYLE),
        plotly=Markup(get_plotlyjs()),
        title=title_text(explanation),
        headline=headline_sentences(explanation, q),
        verdict=verdict_text(explanation),
        doubts=ambiguity_sentences(explanation),
        remains=concentration_sentences(explanation.last, q) if explanation.verdict == "unexplained" else [],
        repeats=[display_text(line) for line in repeatability_sentences(explanation.repeats)],
        law=law_table(explanation.law) if explanation.law else None,
        e=explanation,
        charts=chart_markups(explanation, q),
        places=concentration_sentences(explanation.first, q),
        rungs=figures.ladder_rows(explanation),
        candidates=[candidate_row(t, q) for t in explanation.first.candidates],
        detectable=detectable_size_rows(explanation.last),
        parameters=parameter_rows(explanation),
        equations=equation_rows(explanation),
        logs=log_rows(explanation.problem),
        software=software_versions(version),
        command=command,
    )


def title_text(explanation: Explanation) -> str:
    """The finding in a few words."""
    names = [" or ".join((s.effect, *s.equivalent_to)) for s in explanation.steps]
    found = " and ".join(", ".join(names).rsplit(", ", 1))
    if explanation.verdict == "unexplained":
        also = f"{found} explains a part, but something of what is missing is not in the library"
        return also if found else "Something is missing that the library does not hold"
    return f"The model was missing {found}" if found else "Nothing is missing in this model"


def software_versions(version: str) -> list[tuple[str, str]]:
    """Versions of what made the page."""
    own = version or _installed_version("wheelpend")
    return [
        ("wheelpend", own),
        ("Python", platform.python_version()),
        *((n, _installed_version(n)) for n in REPORTED_PACKAGES),
    ]


def _installed_version(name: str) -> str:
    try:
        return installed(name)
    except PackageNotFoundError:
        return "–"


def chart_markups(explanation: Explanation, q: PlantUnits) -> dict:
    """Every chart of the page, as markup; logs come with their names."""
    first = explanation.first
    changed = bool(explanation.steps)
    compared = figures.residual_comparisons(explanation)
    rows = first.problem.module.ROWS
    table = explanation.model.table

    def still(c: figures.ResidualComparison) -> dict:
        return standstills(c.part.log, c.part.sigma, table)

    state = force_figures.state_figure(first, q)
    force = force_figures.force_figure(first.missing, rows, q) if first.missing is not None else None
    return {
        "ladder": chart_markup("ladder", figures.ladder_figure(explanation)),
        "logs": [
            (c.part.log.name, chart_markup(f"log{k}", figures.prediction_figure(c, changed, q, still(c))))
            for k, c in enumerate(compared[:MAX_DRAWN_LOGS])
        ],
        "left_out": len(compared) - MAX_DRAWN_LOGS,
        "force": chart_markup("force", force),
        "state": chart_markup("state", state),
        "repeats": chart_markup("repeats", most_repeatable_figure(explanation.repeats, q)),
        "dotted": state is not None and any(t.line.dash == "dot" for t in state.data),
        "parameters": chart_markup("parameters", figures.parameter_figure(explanation)),
        "effects": [
            (drawn, chart_markup(f"effect{k}", drawn.figure))
            for k, drawn in enumerate(effect_figures.effect_drawings(explanation))
        ],
    }


def most_repeatable_figure(repeats: Sequence[ExplainedForce], q: PlantUnits) -> go.Figure | None:
    """The missing force over what it depends on, where it repeats most."""
    return force_figures.explained_force_figure(repeats[0], q) if repeats and repeats[0].curves else None


def chart_markup(name: str, figure: go.Figure | None) -> Markup:
    """A figure's place in the page and the script that draws it."""
    if figure is None:
        return Markup("")
    data = figure.to_json().replace("<", "\\u003c").replace(">", "\\u003e")
    # only our own identifier and escaped JSON go into the script
    return Markup(
        f'<div class="chart" id="{name}" style="min-height:{int(figure.layout.height)}px"></div>\n'
        f'<script>{{const f = {data}; Plotly.newPlot("{name}", f.data, f.layout, '
        "{responsive: true, displaylogo: false, displayModeBar: false});}</script>"
    )


PAGE_STYLE = """
:root { --ink: #262b33; --soft: #667080; --line: #e2e6eb; --before: #d1592a; --after: #1f6fb4; --floor: #5b8c5a; }
html { overflow-y: scroll; } * { box-sizing: border-box; }
body { margin: 0; background: #f6f7f9; color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1100px; margin: 0 auto; padding: 28px 20px 60px; }
section, header { background: #fff; border: 1px solid var(--line); border-radius: 10px; padding: 22px 28px;
  margin: 0 0 18px; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .5rem; } h2 { font-size: 1.2rem; margin: 0 0 .4rem; }
h3 { font-size: 1rem; margin: 1.1rem 0 .2rem; } p { margin: .35rem 0 .6rem; max-width: 92ch; }
.lead { font-size: 1.1rem; } .soft, figcaption { color: var(--soft); font-size: .92rem; }
.figures { display: flex; flex-wrap: wrap; gap: 10px 40px; margin: 1rem 0 .3rem; }
.figures div { font-size: .85rem; color: var(--soft); }
.figures b { display: block; font-size: 1.7rem; line-height: 1.3; }
.figures b.word { font-size: 1.15rem; line-height: 1.92; }
.before { color: var(--before); } .after { color: var(--after); } .floor { color: var(--floor); }
.note { border-left: 4px solid #e0a63a; background: #fdf7ea; padding: 8px 14px; margin: .7rem 0; border-radius: 4px; }
.wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th { text-align: left; font-weight: 600; color: var(--soft); border-bottom: 2px solid var(--line);
  padding: 6px 14px 6px 0; vertical-align: bottom; }
td { border-bottom: 1px solid var(--line); padding: 7px 14px 7px 0; vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.first td { background: #f1f6fb; } tr.why td { color: var(--soft); padding-top: 0; }
tr.head td { border-bottom: 0; }
.two { display: grid; grid-template-columns: 1fr 1fr; gap: 8px 32px; }
pre { margin: .2rem 0; font: .95rem/1.65 system-ui, "Segoe UI", Roboto, sans-serif; white-space: pre-wrap; }
mark { background: #d9e9f8; color: #0f4c81; padding: 1px 3px; border-radius: 3px; }
del { background: #fbe3da; color: #9c3c15; padding: 1px 3px; border-radius: 3px; }
code { font: .88em ui-monospace, "DejaVu Sans Mono", Menlo, monospace; overflow-wrap: anywhere; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 20px; margin: .6rem 0 0; font-size: .92rem; }
summary { cursor: pointer; color: var(--soft); margin: .8rem 0 .3rem; font-size: .92rem; } ul { margin: .4rem 0; }
.law { font-style: italic; white-space: nowrap; color: var(--ink); }
.small { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(310px, 100%), 1fr)); gap: 14px 26px; }
.small figure { margin: 0; min-width: 0; } .small figcaption { min-height: 3.2em; } .small .law { white-space: normal; }
dt { color: var(--soft); } dd { margin: 0; min-width: 0; overflow-wrap: anywhere; } .chart { width: 100%; }
@media (max-width: 700px) { .two { grid-template-columns: 1fr; } section, header { padding: 16px; } }
@media print { body { background: #fff; } section { break-inside: avoid; } }
"""
PAGE_TEMPLATE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; \
style-src 'unsafe-inline'; img-src data: blob:">
<title>{{ title }}</title>
<style>{{ style }}</style>
<script>{{ plotly }}</script>
</head>
<body>
<main>
<header>
<h1>{{ title }}</h1>
{% for line in headline %}
<p class="lead">{{ line }}</p>
{% endfor %}
<div class="figures">
<div><b class="before">{{ e.base_error | error_text(3) }}</b>error{{ " before" if e.steps else "" }}</div>
{% if e.steps %}
<div><b class="after">{{ e.error | error_text(3) }}</b>error after</div>
{% endif %}
<div><b class="floor">{{ e.noise_floor | error_text(3) }}</b>noise floor</div>
<div><b class="word">{{ verdict }}</b>verdict</div>
</div>
{% for line in doubts %}
<p class="note">{{ line }}</p>
{% endfor %}
{% if e.experiment %}
<p class="note"><b>What would decide it:</b> {{ e.experiment }}</p>
{% endif %}
{% for line in remains %}
<p class="note">{{ line }}</p>
{% endfor %}
{% for line in e.warnings %}
<p class="note"><b>Warning:</b> {{ line }}</p>
{% endfor %}
<noscript><p class="note">The charts need scripts; all sentences and tables are complete without them.</p></noscript>
</header>

<section>
<h2>The error, step by step</h2>
<p class="soft">Root mean square of (measured − predicted)/σ over {{ e.horizon_s | number }} s predictions on \
{% if e.problem.validation %}data that no fit saw{% else %}the data of the fit, nothing was held out{% endif %}; \
1.0 is the sensors' own noise.</p>
{{ charts.ladder }}
<div class="wide"><table>
<tr><th>model</th><th class="n">error</th><th class="n">of the step before</th><th class="n">p-value</th>
<th class="n">blocks agree</th></tr>
{% for label, error, colour in rungs %}
<tr><td>{{ label }}</td><td class="n">{{ error | error_text }}</td>
{% set last = loop.previtem[1] if loop.previtem is defined else 0 %}
<td class="n">{% if last %}{{ (100 * error / last) | number(3) }} %{% else %}–{% endif %}</td>
{% set step = e.steps[-loop.revindex] if loop.revindex <= e.steps | length else none %}
<td class="n">{{ step.p_value | probability if step else "–" }}</td>
<td class="n">{{ step.blocks_agree or "–" if step else "–" }}</td></tr>
{% endfor %}
</table></div>
</section>

<section>
<h2>Measured against predicted</h2>
<p class="soft">Each stretch of {{ e.horizon_s | number }} s is predicted from its own initial state with the logged \
voltage. Below each channel: what is left over, in standard deviations of the sensor. Grey: a place that stands still \
within its noise.</p>
{% for name, drawn in charts.logs %}
<h3>{{ name }}</h3>
{{ drawn }}
{% endfor %}
{% if charts.left_out > 0 %}
<p class="soft">{{ charts.left_out }} further logs are judged likewise and not drawn.</p>
{% endif %}
</section>

{% if charts.force %}
<section>
<h2>{{ "Where the model failed" if candidates or places else "What the model leaves over" }}</h2>
<p class="soft">The force that would have to be added to each equation of the model before anything was added, so that \
it follows {{ e.first.missing.log }}, in volts at the motor.</p>
{% if places %}
<ul>{% for line in places %}<li>{{ line }}</li>{% endfor %}</ul>
{% else %}
<p>It is not concentrated in any range of the states.</p>
{% endif %}
{{ charts.force }}
{% if charts.state %}
<h3>Its shape{{ ", and what the candidates say it should be" if candidates else "" }}</h3>
{{ charts.state }}
{% if candidates %}
<p class="soft">Solid: what the model before would miss if the candidate and its refit were the truth; a true \
candidate runs through the means.{% if charts.dotted %} Dotted: the candidate's law alone, of which the parameters \
refitted without it had already taken on a part.{% endif %}</p>
{% endif %}
{% endif %}
</section>
{% endif %}

{% if repeats %}
<section>
<h2>What is unexplained{{ " behind the last step" if e.steps else "" }}</h2>
{% for line in repeats %}
<p>{{ line }}</p>
{% endfor %}
{% if charts.repeats %}
{{ charts.repeats }}
<p class="soft">The smooth function that predicts most, with the model's own parameters refitted beside it; what these \
could do as well is left to them. Less its mean; each variable with the others at their medians.</p>
{% endif %}
{% if law %}
<h3>A law for it</h3>
<p>{{ law.sentence }}</p>
<div class="wide"><table>
<tr><th>effect</th><th>resistance at</th><th>law [V]</th></tr>
{% for effect, port, text in law.laws %}
<tr><td>{{ effect }}</td><td>{{ port }}</td><td>{{ text }}</td></tr>
{% endfor %}
</table></div>
<div class="wide"><table>
<tr><th>number</th><th class="n">value ± standard error</th><th>unit</th></tr>
{% for name, value, unit in law.numbers %}
<tr><td>{{ name }}</td><td class="n">{{ value }}</td><td>{{ unit }}</td></tr>
{% endfor %}
</table></div>
{% else %}
<p class="soft"><code>wheelpend diagnose LOG --law</code> fits a free-form law to it, which you may accept as an \
effect of your own.</p>
{% endif %}
</section>
{% endif %}

<section>
<h2>Candidates</h2>
{% if candidates %}
<div class="wide"><table>
<tr><th>effect</th><th>family</th><th>coefficients</th><th class="n">p-value</th><th class="n">blocks agree</th>
<th class="n">error after</th><th>equivalent to</th><th>physical</th></tr>
{% for c in candidates %}
<tr class="head{% if loop.first %} first{% endif %}"><td><b>{{ c.tried.effect }}</b></td><td>{{ c.tried.family }}</td>
<td>{% for size in c.sizes %}{{ size }}{% if not loop.last %}<br>{% endif %}{% endfor %}</td>
<td class="n">{{ c.tried.p_value | probability }}</td><td class="n">{{ c.tried.blocks_agree }}</td>
<td class="n">{{ c.tried.error_after | error_text }}</td><td>{{ c.tried.equivalent_to | join(", ") or "–" }}</td>
<td>{{ "yes" if c.tried.physical else "no" }}</td></tr>
<tr class="why{% if loop.first %} first{% endif %}"><td colspan="8">{{ c.sentence }} {{ c.means }} \
<span class="law">{{ c.law }}</span></td></tr>
{% endfor %}
</table></div>
<p class="soft">Each was added alone to the first model, whose error is {{ e.base_error | error_text }}, and \
everything refitted. p-values are the larger of two: that of the data of the fit, corrected for the size of the \
library, and that of the held-out data, corrected for how many were judged on them; blocks are fifths of the held-out \
data in which the error falls.</p>
{% else %}
<p>No effect of the library lowers the error by enough to be named.</p>
{% endif %}
{% if detectable %}
<details{% if not e.steps %} open{% endif %}>
<summary>The smallest size of each effect that these logs would have shown in the final model</summary>
<div class="wide"><table>
<tr><th>effect</th><th>smallest size</th></tr>
{% for effect, size in detectable %}
<tr><td>{{ effect }}</td><td>{{ size }}</td></tr>
{% endfor %}
</table></div>
</details>
{% endif %}
{% if e.first.not_judged %}
<p class="soft">Not judged: {% for name, why in e.first.not_judged.items() %}{{ name }} ({{ why }})\
{{ "" if loop.last else ", " }}{% endfor %}.</p>
{% endif %}
</section>

{% if charts.effects %}
<section>
<h2>The effects, drawn</h2>
<p class="soft">Each law with its fitted coefficients, over what the logs of the fit cover; the band holds 95 %. \
Dashed: without the effect.</p>
<div class="small">
{% for d, drawn in charts.effects %}
<figure>
<figcaption><b>{{ d.name }}</b> ({{ d.role }}): <span class="law">{{ d.law }}</span></figcaption>
{{ drawn }}
</figure>
{% endfor %}
</div>
</section>
{% endif %}

<section>
<h2>How the parameters moved</h2>
{{ charts.parameters }}
<div class="wide"><table>
<tr><th>parameter</th><th class="n">nominal</th><th class="n">first fit</th>
{% for s in e.steps %}<th class="n">+ {{ s.effect }}</th>{% endfor %}<th class="n">final ± standard error</th></tr>
{% for p in parameters %}
<tr><td>{{ p.name }}</td><td class="n">{{ p.nominal | number }}</td><td class="n">{{ p.first | number }}</td>
{% for value, change in p.steps %}
<td class="n">{{ value | number }} <span class="soft">\
{% if change is not none %}({{ "+" if change >= 0 else "" }}{{ change | number(2) }} %){% endif %}</span></td>
{% endfor %}
<td class="n">{{ p.final }}</td></tr>
{% endfor %}
{% for name, row in e.parameters.items() if "." in name %}
<tr><td>{{ name }}</td><td class="n">–</td><td class="n">–</td>\
{% for s in e.steps %}<td></td>{% endfor %}<td class="n">{{ row.value | uncertain(row.sigma) }}</td></tr>
{% for own in row.get("per_log", [])[1:] %}
<tr><td class="soft">… in {{ own.log }}</td><td class="n">–</td><td class="n">–</td>\
{% for s in e.steps %}<td></td>{% endfor %}<td class="n">{{ own.value | uncertain(own.sigma) }}</td></tr>
{% endfor %}
{% endfor %}
</table></div>
</section>

<section>
<h2>The equations{% if e.steps %} before and after{% endif %}</h2>
<p class="soft">In volts at the motor.{% if e.steps %} \
<mark>New terms</mark> are marked, <del>replaced ones</del> struck out.{% endif %}</p>
{% macro listing(terms) %}
<pre>{% for t in terms %}{% if t.mark == "new" %}<mark>{{ t.text }}</mark>{% elif t.mark == "gone" %}\
<del>{{ t.text }}</del>{% else %}{{ t.text }}{% endif %}{{ "\n" }}{% endfor %}</pre>
{% endmacro %}
{% for q in equations %}
<h3>{{ q.row }}</h3>
{% if e.steps %}
<div class="two"><div>{{ listing(q.before) }}</div><div>{{ listing(q.after) }}</div></div>
{% else %}
{{ listing(q.after) }}
{% endif %}
{% endfor %}
</section>

<section>
<h2>Provenance</h2>
<div class="wide"><table>
<tr><th>log</th><th>used for</th><th class="n">samples</th><th class="n">duration</th><th>commanded pitch</th>
<th>σ of the channels</th><th class="n">noise floor</th></tr>
{% for log in logs %}
<tr><td>{{ log.name }}</td><td>{{ log.role }}</td><td class="n">{{ log.samples }}</td>
<td class="n">{{ log.duration | number }} s</td><td>{{ "logged" if log.reference else "not logged" }}</td>
<td>{% for c, size in log.sigma %}{{ c | pretty }} {{ size }}{{ "" if loop.last else ", " }}{% endfor %}</td>
<td class="n">{{ log.floor | error_text(3) }}</td></tr>
{% endfor %}
</table></div>
<dl>
<dt>horizon</dt><dd>{{ e.horizon_s | number }} s</dd>
<dt>plant</dt><dd>{{ e.model.plant }}</dd>
<dt>effects in the final model</dt><dd>{{ e.effects | join(", ") or "none" }}</dd>
<dt>assumptions</dt><dd>{% for k, v in e.model.assumptions.items() %}{{ k }} = {{ v }}\
{{ "" if loop.last else ", " }}{% endfor %}</dd>
<dt>software</dt><dd>{% for n, v in software %}{{ n }} {{ v }}{{ "" if loop.last else ", " }}{% endfor %}</dd>
{% if command %}
<dt>command</dt><dd><code>{{ command }}</code></dd>
{% endif %}
</dl>
</section>
</main>
</body>
</html>
"""
