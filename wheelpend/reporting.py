"""One self-contained HTML page that tells what a model was missing and what adding it did.

The page needs no network: plotly.js and every chart's data are in it. Text and tables are readable without scripts.
Whatever comes from users (names of logs, warnings, commands) is escaped by the template.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path
from typing import NamedTuple

import jinja2
import numpy as np
import plotly.graph_objects as go
import sympy as sp
from markupsafe import Markup
from plotly.offline import get_plotlyjs

import derive
from wheelpend import reporting_effects
from wheelpend import reporting_figures as figures
from wheelpend.diagnosis import Diagnosis
from wheelpend.evidence import Tried
from wheelpend.explanation import Explanation, Step
from wheelpend.failures import Failure
from wheelpend.free_law import FreeLaw
from wheelpend.inspection import standstills
from wheelpend.quantities import Quantities, quantities_of
from wheelpend.repeatable import Repeats
from wheelpend.reporting_figures import pretty
from wheelpend.study import Study
from wheelpend.unexplained import law_sentence, repeat_sentences

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
SOFTWARE = ("sympy", "numpy", "scipy", "numba", "plotly")


def write_report(explanation: Explanation, path: Path, *, version: str = "", command: str = "") -> Path:
    """Write the page, complete or not at all, and return its path."""
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        beside.write_text(render(explanation, version=version, command=command), encoding="utf-8")
        os.replace(beside, path)
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        beside.unlink(missing_ok=True)
    return path


def render(explanation: Explanation, *, version: str = "", command: str = "") -> str:
    """Text of the page."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "number": number,
        "error_text": error_text,
        "uncertain": uncertain,
        "pretty": pretty,
        "probability": probability,
    }
    q = quantities_of(explanation.model)
    return environment.from_string(PAGE).render(
        style=Markup(STYLE),
        plotly=Markup(get_plotlyjs()),
        title=title(explanation),
        headline=headline(explanation, q),
        verdict=verdict(explanation),
        doubts=doubts(explanation),
        remains=places(explanation.last, q) if explanation.verdict == "unexplained" else [],
        repeats=[pretty(line) for line in repeat_sentences(explanation.repeats)],
        law=law_table(explanation.law) if explanation.law else None,
        e=explanation,
        charts=charts(explanation, q),
        places=places(explanation.first, q),
        rungs=figures.ladder(explanation),
        candidates=[candidate_row(t, q) for t in explanation.first.candidates],
        detectable=detectable(explanation.last),
        parameters=parameter_rows(explanation),
        equations=equations(explanation),
        logs=log_rows(explanation.study),
        software=software(version),
        command=command,
    )


# ---- sentences


def title(explanation: Explanation) -> str:
    """The finding in a few words."""
    names = [" or ".join((s.effect, *s.equivalent_to)) for s in explanation.steps]
    found = " and ".join(", ".join(names).rsplit(", ", 1))
    if explanation.verdict == "unexplained":
        also = f"{found} explains a part, but something of what is missing is not in the library"
        return also if found else "Something is missing that the library does not hold"
    return f"The model was missing {found}" if found else "Nothing is missing in this model"


def verdict(explanation: Explanation) -> str:
    """The verdict as people say it."""
    more = "more " if explanation.steps else ""
    known = {"nothing_missing": f"nothing {more}is missing", "unexplained": "something is unexplained"}
    return known.get(explanation.verdict, explanation.verdict)


def headline(explanation: Explanation, q: Quantities) -> list[str]:
    """What is missing, how large it is, and what adding it did to the held-out error."""
    lines = [sized(step, explanation, q) for step in explanation.steps]
    before, after, floor = map(error_text, (explanation.base_error, explanation.error, explanation.noise_floor))
    kind = "held-out" if explanation.study.held else "training"
    if not explanation.steps:
        return [f"With its own parameters refitted, the model has a {kind} error of {before} "
                f"(noise floor {floor}); no effect of the library is worth adding."]  # fmt: skip
    return [*lines, f"The {kind} error falls from {before} to {after}; "
                    f"the noise floor is {floor}."]  # fmt: skip


def sized(step: Step, explanation: Explanation, q: Quantities) -> str:
    """An effect with its sentence and the sizes of its coefficients in the final model."""
    sizes = []
    for name, unit in step.unit.items():
        own = {"value": step.coefficients[name], "sigma": step.sigma[name]}
        value, sigma = (explanation.parameters.get(f"{step.effect}.{name}", own)[k] for k in ("value", "sigma"))
        text = f"{name} {uncertain(value, sigma)} {shown_unit(unit)}".rstrip()
        own = explanation.parameters.get(f"{step.effect}.{name}", {}).get("per_log", [])
        text = f"{name} {in_each_log(own, unit)}" if own else text
        extra = [in_torque(value, unit, q)] if in_torque(value, unit, q) else []
        if unit == q.force and explanation.study.module.INPUT:
            extra.append(f"{100 * abs(value) / rms_voltage(explanation.study):.3g} % of the rms drive voltage")
        sizes.append(text + (f" ({', '.join(extra)})" if extra else ""))
    return f"{derive.effects.find(step.effect).sentence.rstrip('.')} ({step.effect}): {', '.join(sizes)}."


def in_each_log(rows: list[dict], unit: str) -> str:
    """A parameter that several logs have each for themselves."""
    return ", ".join(f"{uncertain(r['value'], r['sigma'])} {shown_unit(unit)} in {r['log']}" for r in rows)


def in_torque(value: float, unit: str, q: Quantities) -> str:
    """A force in V as a torque, or nothing where it is not a force or the volt's worth is unknown."""
    found = q.in_physical(value, unit)
    return f"{number(found[0], 3)} {shown_unit(found[1])}" if found else ""


def rms_voltage(study: Study) -> float:
    """Root mean square of the commanded voltage over the training logs."""
    voltage = np.concatenate([log.voltage[np.isfinite(log.voltage)] for log in study.logs])
    return float(np.sqrt(np.mean(voltage**2))) if voltage.size and np.any(voltage) else float("nan")


def doubts(explanation: Explanation) -> list[str]:
    """What these data cannot tell apart."""
    return [
        f"These data cannot tell {s.effect} from {', '.join(s.equivalent_to)}."
        for s in explanation.steps
        if s.equivalent_to
    ]


def places(diagnosis: Diagnosis, q: Quantities) -> list[str]:
    """Where the missing force is concentrated, as sentences."""
    return [
        f"{100 * p.share:.0f} % of what the {p.row} row misses lies where {figures.quantity(p.state)} is between "
        f"{number(p.low, 3)} and {number(p.high, 3)} {q.unit(p.state)}."
        for p in diagnosis.where
    ]


class LawTable(NamedTuple):
    """A free-form law as the page shows it."""

    sentence: str
    laws: list[tuple[str, str, str]]  # effect, where it acts, law
    numbers: list[tuple[str, str, str]]  # effect.parameter, value with standard error, unit


def law_table(law: FreeLaw) -> LawTable:
    """Texts of a free-form law."""
    laws = [(effect, law.on[effect], _typeset(text.replace("^", "**"))) for effect, text in law.laws.items()]
    numbers = [(n, uncertain_size(v, law.sigma[n]), shown_unit(law.unit[n])) for n, v in law.coefficients.items()]
    return LawTable(law_sentence(law), laws, numbers)


def uncertain_size(value: float, sigma: float) -> str:
    """Value ± standard error; small ones in powers of ten."""
    return uncertain(value, sigma) if abs(value) >= 1e-3 else f"{number(value, 5)} ± {number(sigma, 2)}"


# ---- numbers


def number(value: float | None, digits: int = 4) -> str:
    """A number in few digits, or a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    if abs(value) >= 10**digits and abs(value) < 1e6:
        return f"{value:.0f}".replace("-", "−")
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return (mantissa + (f"×10{str(int(power)).translate(RAISED)}" if power else "")).replace("-", "−")


def error_text(value: float | None, digits: int = 4) -> str:
    """An error with all its digits, so that 1.00 is not 1."""
    if value is None or not np.isfinite(value) or abs(value) >= 10**digits:
        return number(value, digits)
    return f"{value:#.{digits}g}".rstrip(".")


def uncertain(value: float | None, sigma: float | None) -> str:
    """Value ± standard error, to two digits of the latter."""
    if value is None or sigma is None or not np.isfinite(sigma) or sigma <= 0 or not np.isfinite(value):
        return number(value)
    decimals = int(np.clip(1 - np.floor(np.log10(sigma)), 0, 9))
    if decimals == 9 or abs(value) >= 1e5:
        return f"{number(value)} ± {number(sigma, 2)}"
    return f"{value:.{decimals}f} ± {sigma:.{decimals}f}".replace("-", "−")


def probability(p: float | None) -> str:
    """A p-value; very small ones only as a bound."""
    if p is None:
        return "–"
    return "< 10⁻¹²" if p < 1e-12 else number(p, 1)


def shown_unit(unit: str) -> str:
    """A unit as people read it; nothing for a plain number."""
    return "" if unit == "1" else unit.replace(" s", "·s")


# ---- tables


class CandidateRow(NamedTuple):
    """A candidate as the table shows it."""

    tried: Tried
    sentence: str
    means: str
    law: str
    sizes: list[str]


def candidate_row(tried: Tried, q: Quantities) -> CandidateRow:
    """Texts of a candidate."""
    effect = derive.effects.find(tried.effect)
    sizes = []
    for name, value in tried.coefficients.items():
        unit = tried.unit[name]
        torque = in_torque(value, unit, q)
        text = f"{name} = {uncertain(value, tried.sigma[name])} {shown_unit(unit)}"
        sizes.append(text.rstrip() + (f" ({torque})" if torque else ""))
        further = [o for o in tried.per_log[1:] if name in o.coefficients]
        sizes += [f"… in {o.log}: {uncertain(o.coefficients[name], o.sigma[name])}" for o in further]
    return CandidateRow(tried, effect.sentence, effect.means, effect.equation, sizes)


def detectable(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """The smallest size of each effect that the logs would have shown."""
    rows = []
    for effect, sizes in diagnosis.detectable.items():
        units = {p.name: shown_unit(p.unit) for p in diagnosis.study.effect(effect).parameters}
        rows.append((effect, ", ".join(f"{n} {number(v, 2)} {units.get(n, '')}".rstrip() for n, v in sizes.items())))
    return rows


class ParameterRow(NamedTuple):
    """A base parameter through the ladder."""

    name: str
    nominal: float | None
    first: float
    steps: list[tuple[float, float | None]]  # value, change from the first in %
    final: str


def parameter_rows(explanation: Explanation) -> list[ParameterRow]:
    """How each base parameter moved."""
    rows = []
    for name in explanation.study.base:
        given, first = explanation.model.parameters.get(name), explanation.first.fit.values[name]
        values = [s.parameters[name] for s in explanation.steps if name in s.parameters]
        steps = [(v, 100.0 * (v / first - 1.0) if first else None) for v in values]
        final = explanation.parameters.get(name, {"value": first, "sigma": None})
        row = uncertain(final["value"], final["sigma"])
        rows.append(ParameterRow(name, given.nominal if given else None, first, steps, row))
    return rows


class LogRow(NamedTuple):
    """A log as the provenance shows it."""

    name: str
    role: str
    samples: int
    duration: float  # s
    reference: bool
    sigma: list[tuple[str, str]]  # channel, standard deviation with unit
    floor: float


def log_rows(study: Study) -> list[LogRow]:
    """Training logs, then hold-out logs."""
    own = {h.training for h in study.held}
    logs = [(log, "fit; last third held out" if k in own else "fit") for k, log in enumerate(study.logs)]
    logs += [(h.part.log, "held out") for h in study.held if h.training is None]
    rows, units = [], quantities_of(study.model)
    for (log, role), noise in zip(logs, study.noise, strict=False):
        sigma = [(c, f"{number(s, 3)} {units.unit(c)}") for c, s in zip(log.channels, noise.sigma, strict=True)]
        seconds = float(log.t[-1] - log.t[0])
        rows.append(LogRow(log.name, role, len(log.t), seconds, log.reference is not None, sigma, noise.floor))
    return rows


def software(version: str) -> list[tuple[str, str]]:
    """Versions of what made the page."""
    own = version or _installed("wheelpend")
    return [("wheelpend", own), ("Python", platform.python_version()), *((n, _installed(n)) for n in SOFTWARE)]


def _installed(name: str) -> str:
    try:
        return installed(name)
    except PackageNotFoundError:
        return "–"


# ---- equations


class Term(NamedTuple):
    """A term of an equation; mark is "new", "gone" or nothing."""

    text: str
    mark: str


class Equation(NamedTuple):
    """A row's equation before and after."""

    row: str
    before: list[Term]
    after: list[Term]


def equations(explanation: Explanation) -> list[Equation]:
    """The equations of motion before and after, with the difference marked; sensors and command where they changed."""
    plant, assumptions = explanation.model.plant, explanation.model.assumptions
    final = derive.compose(plant, assumptions, explanation.effects)
    old = terms(derive.compose(plant, assumptions, explanation.first.study.model.effects))
    new = terms(final)
    moving = list(new)[: len(final.plant.coordinates)]
    return [
        Equation(
            pretty(row),
            [Term(_typeset(t), "" if t in new[row] else "gone") for t in old[row]],
            [Term(_typeset(t), "" if t in old[row] else "new") for t in new[row]],
        )
        for row in new
        if row in moving or old[row] != new[row]
    ]


def terms(model: derive.Model) -> dict[str, list[str]]:
    """Signed terms of each row, as equations_text prints them, dry friction included, then of each sensor."""
    found: dict[str, list[str]] = {}
    row = ""
    for line in derive.equations_text(model).splitlines():
        if line.startswith(" "):
            found[row].append(line.strip())
        else:
            row = line.rstrip(" 0=:") + ": 0 ="
            found[row] = []
    for surface in model.surfaces:
        slip = sum(int(w) * c.dq for w, c in zip(surface.slip, model.plant.coordinates, strict=True))
        for row, weight in zip(found, surface.slip, strict=False):
            if weight:
                law = surface.law.subs(surface.direction, sp.Function("sign")(slip))
                found[row] += [_signed(t) for t in sp.Add.make_args(sp.expand(int(weight) * law))]
    for channel, reading in zip(model.plant.channels, model.readings, strict=True):
        found[f"sensor {channel.name} ="] = [_signed(t) for t in sp.Add.make_args(sp.expand(reading))]
    found["command:"] = [f"+ v_in(t − {model.delay})" if model.delay else "+ v_in(t)"]
    found["command:"] += [f"− {model.lag} dU/dt"] if model.lag else []
    return found


def _signed(term: sp.Expr) -> str:
    text = str(term)
    return f"- {text[1:]}" if text.startswith("-") else f"+ {text}"


def _typeset(term: str) -> str:
    for ours, shown in (("**2", "²"), ("**3", "³"), ("Magnitude", "abs"), ("Sign", "sign"), ("Ramp(", "max(0, "),
                        ("*", "·"), ("-", "−")):  # fmt: skip
        term = term.replace(ours, shown)
    return pretty(term)


# ---- charts


def charts(explanation: Explanation, q: Quantities) -> dict:
    """Every chart of the page, as markup; logs come with their names."""
    first = explanation.first
    changed = bool(explanation.steps)
    compared = figures.comparisons(explanation)
    rows = first.study.module.ROWS
    table = explanation.model.table

    def still(c: figures.Comparison) -> dict:
        return standstills(c.part.log, c.part.sigma, table)

    state = figures.state_figure(first, q)
    force = figures.force_figure(first.missing, rows, q) if first.missing is not None else None
    return {
        "ladder": chart("ladder", figures.ladder_figure(explanation)),
        "logs": [
            (c.part.log.name, chart(f"log{k}", figures.prediction_figure(c, changed, q, still(c))))
            for k, c in enumerate(compared[: figures.MOST_LOGS])
        ],
        "left_out": len(compared) - figures.MOST_LOGS,
        "force": chart("force", force),
        "state": chart("state", state),
        "repeats": chart("repeats", repeating(explanation.repeats, q)),
        "dotted": state is not None and any(t.line.dash == "dot" for t in state.data),
        "parameters": chart("parameters", figures.parameter_figure(explanation)),
        "effects": [
            (drawn, chart(f"effect{k}", drawn.figure))
            for k, drawn in enumerate(reporting_effects.drawn_effects(explanation))
        ],
    }


def repeating(repeats: Sequence[Repeats], q: Quantities) -> go.Figure | None:
    """The missing force over what it depends on, where it repeats most."""
    return figures.repeats_figure(repeats[0], q) if repeats and repeats[0].curves else None


def chart(name: str, figure: go.Figure | None) -> Markup:
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


# ---- the page

STYLE = """
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

PAGE = """<!doctype html>
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
{% if e.study.held %}data that no fit saw{% else %}the data of the fit, nothing was held out{% endif %}; \
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
