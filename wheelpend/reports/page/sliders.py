"""Sliders for a model's parameters: the page simulates a log anew with what its reader chooses."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.subplots import make_subplots

from derive.parameter_name import effect_of
from wheelpend.diagnosis.compare import ComparedModel
from wheelpend.diagnosis.explain import Ladder
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import kernels_for
from wheelpend.estimation.free_parameters import effect_parameter, free_names, free_parameters
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.estimation.prediction import with_lead_in
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.validation import LEAD_IN_SEGMENTS, validation_values
from wheelpend.export.exported_model import ExportedModel, exported_model
from wheelpend.export.javascript_target import javascript_page_module
from wheelpend.export.replay import replayed_log
from wheelpend.model.record import Model
from wheelpend.model.units import PlantUnits
from wheelpend.reports.names import display_text
from wheelpend.reports.numbers import unit_text
from wheelpend.reports.page.carried_log import CarriedLog
from wheelpend.reports.page.packing import figure_text, script_text
from wheelpend.reports.page.style import AFTER_COLOUR, MEASURED_COLOUR, with_page_style

SLIDER_SCRIPT = Path(__file__).with_name("sliders.js")
MAX_CARRIED_S = 20.0  # of a log
SLIDER_STEPS = 500
AXIS_MARGIN_SHARE = 0.15  # of what is measured, above and below it


class Slider(NamedTuple):
    """A parameter that may be moved: by ``first`` to ``last`` steps, of which SLIDER_STEPS change it by ``scale``."""

    place: int  # among the exported parameters
    name: str
    unit: str
    meaning: str
    value: float
    absent: float
    scale: float
    first: int
    last: int


class Adjustable(NamedTuple):
    """A model at its values, and the segments of a log on which others are to be tried."""

    model: Model
    problem: EstimationProblem
    part: Segments
    values: Mapping[str, float]  # of that log
    estimates: Mapping[str, tuple[float, float | None]]  # value and standard error of each parameter that may be moved
    whole: bool  # there is no further log that an error is taken on

    @classmethod
    def of_ladder(cls, explanation: Ladder) -> Adjustable:
        """The final model of a ladder on the first held-out log, or where none is on the first log."""
        problem, fitted, validation = explanation.problem, explanation.fit, explanation.problem.data.validation
        part = validation[0].part if validation else problem.data.estimation[0]
        values = validation_values(problem, fitted, validation[0]) if validation else fitted.of_log(0)
        estimates = {n: (e.value, e.sigma) for n, e in explanation.parameters.items()}
        return cls(explanation.model, problem, part, values, estimates, len(validation) <= 1)

    @classmethod
    def of_comparison(cls, compared: ComparedModel) -> Adjustable:
        """A model as it stands on the first log that it is compared with."""
        problem, values = compared.problem, compared.log_values[0]
        given = problem.model.parameters | problem.model.effect_values
        known = {n: given.get(n) for n in free_names(problem, problem.model.effects)}
        estimates = {n: (values[n], k.sigma if k else None) for n, k in known.items()}
        return cls(problem.model, problem, compared.log_segments[0], values, estimates, len(compared.log_segments) == 1)


class SliderGroup(NamedTuple):
    """Sliders of an effect, or of the plant itself."""

    effect: str  # "" for the plant
    sentence: str
    sliders: tuple[Slider, ...]


@dataclass(frozen=True)
class SliderSection:
    """Everything of the section: what is shown, what is carried, and the script that simulates."""

    groups: tuple[SliderGroup, ...]
    log_name: str
    horizon_s: float
    error: float  # of the identified model on what is carried [σ]
    seconds: float
    whole: bool  # everything on which the report's error is taken is carried
    data: str  # JSON
    figure: go.Figure
    script: str


def slider_section(
    adjustable: Adjustable, quantities: PlantUnits, meanings: dict[str, str]
) -> tuple[SliderSection | None, str]:
    """The section of a model, or in a sentence why there is none."""
    try:
        return _section(adjustable, quantities, meanings), ""
    except Failure as failure:
        return None, str(failure)
    except NotImplementedError:
        return None, "Its equations have a part that cannot be translated into the language of a page."


def _section(adjustable: Adjustable, quantities: PlantUnits, meanings: dict[str, str]) -> SliderSection:
    problem, part, values = adjustable.problem, adjustable.part, adjustable.values
    known = {n: (float(values.get(n, value)), sigma) for n, (value, sigma) in adjustable.estimates.items()}
    exported = exported_model(adjustable.model.with_fit(known), period=part.log.dt)
    exported = replace(exported, max_step=min(exported.period, problem.max_step))
    carried = _carried_log(problem, exported, part, values)
    groups = _groups(adjustable, exported, meanings)
    script = javascript_page_module(exported) + SLIDER_SCRIPT.read_text(encoding="utf-8")
    return SliderSection(
        groups=groups,
        log_name=part.log.name,
        horizon_s=problem.horizon,
        error=carried.error,
        seconds=sum(float(s.intervals.sum()) for s in carried.replay.segments),
        whole=adjustable.whole and len(carried.replay.segments) - carried.lead == len(part.bounds),
        data=_json(carried.numbers() | {"groups": [[_moved(s) for s in g.sliders] for g in groups]}),
        figure=_figure(part, quantities),
        script=script.replace("</", "<\\/").replace("<!--", "<\\!--"),  # nothing in it may end the script
    )


def _carried_log(
    problem: EstimationProblem, exported: ExportedModel, part: Segments, values: Mapping[str, float]
) -> CarriedLog:
    """The first segments of a log, after those through which a coupled model must be simulated before."""
    segments, lead = with_lead_in(part, LEAD_IN_SEGMENTS if problem.carries else 0)
    t, bounds = segments.log.t, segments.bounds
    near = t[bounds[:, 1] - 1] <= t[bounds[0, 0]] + MAX_CARRIED_S
    near[: lead + 1] = True
    simulator = Simulator(kernels_for(problem, (), values), problem.max_step)
    first = replace(segments, bounds=bounds[near], weights=None)
    return CarriedLog.cut_to_size(replayed_log(exported, simulator, first, values), lead)


def _groups(adjustable: Adjustable, exported: ExportedModel, meanings: dict[str, str]) -> tuple[SliderGroup, ...]:
    """Sliders of each effect, then those of the plant."""
    problem, places, estimates = adjustable.problem, list(exported.module.PARAMETERS), adjustable.estimates
    by_effect: dict[str, list[Slider]] = {effect: [] for effect in (*adjustable.model.effects, "")}
    for p in free_parameters(problem, [n for n in estimates if n in places and effect_of(n) in by_effect]):
        place = places.index(p.name)
        late = place in (exported.module.DELAY, exported.module.SENSOR_DELAY)
        value = float(adjustable.values[p.name])
        if moves := _moves(problem, p, value, estimates[p.name][1], late):
            absent = float(exported.module.ABSENT[place])
            meaning = "" if p.effect else meanings.get(p.name, "")
            by_effect[p.effect].append(Slider(place, p.name, unit_text(p.unit), meaning, value, absent, *moves))
    return tuple(
        SliderGroup(effect, problem.effect(effect).sentence if effect else "", tuple(sliders))
        for effect, sliders in by_effect.items()
        if sliders
    )


def _moves(
    problem: EstimationProblem, parameter: FreeParameter, value: float, sigma: float | None, late: bool
) -> tuple[float, int, int] | None:
    """What SLIDER_STEPS steps change, and the first and last step that a simulation can be made with; None for none.

    An effect's size goes from zero to three times what was identified, everything else by half of that either way: so
    does a delay (``late``), of which an export keeps no more commands.
    """
    row, last = effect_parameter(parameter.name, problem.plant), SLIDER_STEPS
    if value == 0.0:
        known = sigma is not None and math.isfinite(sigma)
        scale = 3.0 * sigma if sigma and known else row.typical if row else 0.0
    elif parameter.role == "size" and math.isfinite(parameter.absent) and not late:
        scale, last = value, 2 * SLIDER_STEPS
    else:
        scale = 0.5 * value
    low, high = parameter.bounds
    inside = [k for k in range(-SLIDER_STEPS, last + 1) if low <= value + scale * (k / SLIDER_STEPS) <= high]
    return (scale, inside[0], inside[-1]) if scale and math.isfinite(scale) and inside else None


def _moved(slider: Slider) -> dict[str, Any]:
    """What the script knows of a slider; infinity is a text."""
    return {"place": slider.place, "value": slider.value, "scale": slider.scale, "absent": str(slider.absent),
            "unit": slider.unit, "steps": SLIDER_STEPS}  # fmt: skip


def _figure(segments: Segments, units: PlantUnits) -> go.Figure:
    """Axes and lines of each channel, measured and predicted above, residual below; the script fills them."""
    channels: Sequence[str] = segments.log.channels
    figure = make_subplots(rows=2 * len(channels), cols=1, shared_xaxes=True, vertical_spacing=0.022,
                           row_heights=[1.4, 1.0] * len(channels))  # fmt: skip
    for c, channel in enumerate(channels):
        measured = np.concatenate([segments.log.measured[a:b, c] for a, b in segments.bounds.tolist()])
        for name, colour, row, width in (
            ("measured", MEASURED_COLOUR, 2 * c + 1, 1.0),
            ("predicted", AFTER_COLOUR, 2 * c + 1, 1.4),
            ("left over", AFTER_COLOUR, 2 * c + 2, 1.0),
        ):
            line = go.Scatter(x=[], y=[], name=name, legendgroup=name, mode="lines", connectgaps=False,
                              showlegend=c == 0 and row == 1, line={"color": colour, "width": width})  # fmt: skip
            figure.add_trace(line, row=row, col=1)
        if np.isfinite(measured).any():
            low, high = float(np.nanmin(measured)), float(np.nanmax(measured))
            margin = AXIS_MARGIN_SHARE * (high - low) or 1.0
            figure.update_yaxes(range=[low - margin, high + margin], row=2 * c + 1, col=1)
        figure.update_yaxes(title=f"{display_text(channel)} [{units.unit(channel)}]", row=2 * c + 1, col=1)
        figure.update_yaxes(title="resid. [σ]", row=2 * c + 2, col=1)
    figure.update_xaxes(title="time [s]", row=2 * len(channels), col=1)
    return with_page_style(figure, 80 + 210 * len(channels))


def _json(numbers: dict[str, Any]) -> str:
    """JSON of what the page carries."""
    plain = json.dumps(numbers, default=float, allow_nan=False, separators=(",", ":"))
    return script_text(plain)


def carried_markup(section: SliderSection) -> Markup:
    """The data of the section, which no browser executes."""
    parts = {"numbers": section.data, "figure": figure_text(section.figure)}
    # only escaped JSON goes into the page as it is
    return Markup(
        "\n".join(f'<script type="application/json" data-sliders="{n}">{t}</script>' for n, t in parts.items())
    )
