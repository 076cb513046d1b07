"""The fleet as one self-contained HTML page: which units differ, in what, since when."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from wheelpend.campaigns.fleet_figures import (
    deviation_map,
    drift_figure,
    effect_map,
    forest_figure,
    telling_parameters,
)
from wheelpend.campaigns.manifest import day_of
from wheelpend.campaigns.runner import Campaign
from wheelpend.campaigns.text import campaign_text
from wheelpend.campaigns.units import UnitsAnswer, log_estimate
from wheelpend.campaigns.units_text import UnitOf, drift_sentence, then_text, units_text
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.model.units import effect_unit
from wheelpend.reports.html import rendered_page
from wheelpend.reports.page.charts import DRAWING_SCRIPT, PLOTTING_SCRIPT, chart_markup, script_hash
from wheelpend.reports.text.table import Table
from wheelpend.version import version

STYLE_FOLDER = Path(__file__).parents[1] / "reports" / "page"
MAX_DRIFTS = 4  # that are drawn


class Section(NamedTuple):
    """A part of the page."""

    title: str
    words: str = ""
    charts: Sequence[Markup] = ()
    tables: Sequence[Table] = ()


def write_fleet_page(result: Campaign, path: Path, out: Path, command: str = "") -> None:
    """Write the page, complete or not at all; raises Failure where no unit was stated."""
    if result.fleet is None:
        raise Failure("A report of a fleet needs units: name a manifest that states of which unit each log is.")
    write_text(path, fleet_page(result, result.fleet, out, command))


def fleet_page(result: Campaign, answer: UnitsAnswer, out: Path, command: str = "") -> str:
    """Text of the page; ``out`` is the table of the campaign."""
    blocks = [block for block in campaign_text(result, out) if isinstance(block, str)]
    plotly = PLOTTING_SCRIPT.read_text(encoding="utf-8")
    odd, units = len(answer.standing_out), max(len(answer.units), answer.judged)
    return rendered_page(
        STYLE_FOLDER,
        "fleet_page.html.j2",
        "style.css",
        plotly=Markup(plotly),
        drawing=Markup(DRAWING_SCRIPT),
        script_hashes=Markup(" ".join(map(script_hash, (plotly, DRAWING_SCRIPT)))),
        title=f"A fleet of {units} units: {odd or 'none'} {'stands' if odd <= 1 else 'stand'} out",
        sentences=[line.strip() for line in blocks],
        sections=list(_sections(result, answer, partial(effect_unit, result.model))),
        command=command,
        version=version(),
    )


def _sections(result: Campaign, answer: UnitsAnswer, unit_of: UnitOf) -> Iterator[Section]:
    tables = [block for block in units_text(answer, unit_of) if isinstance(block, Table)]
    if answer.fleet is not None:
        charts = [
            chart_markup(f"forest{k}", forest_figure(answer.fleet, name, unit_of(name)))
            for k, name in enumerate(telling_parameters(answer))
        ]
        words = ("Each unit with its interval of 95 %; the band holds 95 % of the fleet, and who stands out is in "
                 "the other colour. Of many units those farthest from the mean are drawn.")  # fmt: skip
        yield Section("The units beside each other", words if charts else "", charts, tables)
        yield Section(
            "Units by parameters",
            "How far each unit is from the fleet, in standard deviations of scatter and errors together.",
            [chart_markup("map", deviation_map(answer.fleet))],
        )
    further = result.then.fleet.effects if result.then and result.then.fleet else ()
    asked_then = [block for block in then_text(result.then) if isinstance(block, Table)] if result.then else []
    if answer.effects or asked_then:
        words = (
            "What each unit lacks." if answer.effects else "What the units lack that stand out, the only ones asked."
        )
        named = answer.effects or further
        yield Section(
            "Units by effects", words, [chart_markup("effects", effect_map(named))] if named else [], asked_then
        )
    drifting = answer.drifts[:MAX_DRIFTS]
    if drifting:
        known = [(e, day_of(r.date)) for r in result.logs if r.date and (e := log_estimate(r)) is not None]
        figures = [drift_figure(d, [e for e, _ in known], [day for _, day in known], unit_of(d.parameter))
                   for d in drifting]  # fmt: skip
        words = " ".join(drift_sentence(d, unit_of) for d in answer.drifts)
        yield Section("What drifts", words, [chart_markup(f"drift{k}", f) for k, f in enumerate(figures)])
