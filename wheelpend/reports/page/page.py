"""The report: one self-contained HTML page that needs no network."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

from markupsafe import Markup

from wheelpend.diagnosis.explain import Ladder
from wheelpend.files import write_text
from wheelpend.identification.residual_tests import ResidualTests
from wheelpend.model.units import plant_units_of
from wheelpend.reports.html import rendered_page
from wheelpend.reports.names import display_text
from wheelpend.reports.numbers import error_text, typeset_estimate_text, typeset_number_text, typeset_p_value_text
from wheelpend.reports.page.charts import DRAWING_SCRIPT, PLOTTING_SCRIPT, page_charts, script_hash
from wheelpend.reports.page.correlations import correlation_table
from wheelpend.reports.page.digests import file_rows, log_file_rows
from wheelpend.reports.page.equations import equation_rows
from wheelpend.reports.page.figures import labelled_rungs
from wheelpend.reports.page.innovations import residual_section, residual_tests_of
from wheelpend.reports.page.rows import candidate_row, law_table, log_rows, parameter_meanings, parameter_rows
from wheelpend.reports.page.sliders import Adjustable, carried_markup, slider_section
from wheelpend.reports.page.story import earlier_changes, earlier_rungs, story_sentences
from wheelpend.reports.text.effect_sizes import typeset_detectable_rows
from wheelpend.reports.text.force_ranges import typeset_force_ranges
from wheelpend.reports.text.remainder import remainder_sentences
from wheelpend.reports.text.title import title_text
from wheelpend.reports.text.unexplained import unexplained_sentences
from wheelpend.reports.text.verdict import ambiguity_sentences, headline_sentences, short_verdict_text

REPORTED_PACKAGES = ("sympy", "numpy", "scipy", "numba", "plotly")
TEMPLATE_FILTERS: dict[str, Callable[..., Any]] = {
    "number": typeset_number_text,
    "error_text": error_text,
    "uncertain": typeset_estimate_text,
    "pretty": display_text,
    "sentence_start": lambda text: text[0].upper() + text[1:],
    "probability": typeset_p_value_text,
}


def write_report(
    explanation: Ladder, path: Path, *, version: str = "", command: str = "", files: Sequence[Path] = ()
) -> Path:
    """Write the page, complete or not at all, and return its path.

    ``files`` are those that the logs were read from, which the page names with their digests; without them they are
    those that the logs know, and logs from memory have a digest of their values.
    """
    path = Path(path)
    tests = residual_tests_of(explanation)
    write_text(path, page_html(explanation, version=version, command=command, tests=tests, files=files))
    return path


def page_html(
    explanation: Ladder,
    *,
    version: str = "",
    command: str = "",
    tests: ResidualTests | str | None = None,
    files: Sequence[Path] = (),
) -> str:
    """Text of the page, with tests of the residuals where they, or why there are none, are given."""
    quantities = plant_units_of(explanation.model)
    first = explanation.first
    plotly = PLOTTING_SCRIPT.read_text(encoding="utf-8")
    meanings = {n: meaning for n, (_, meaning) in parameter_meanings(explanation.model).items()}
    sliders, no_sliders = slider_section(Adjustable.of_ladder(explanation), quantities, meanings)
    scripts = (plotly, DRAWING_SCRIPT, *([sliders.script] if sliders else []))
    changes, remarks = earlier_changes(explanation)
    earlier = earlier_rungs(changes)
    still_missing = explanation.last.where if explanation.verdict == "unexplained" else ()
    return rendered_page(
        Path(__file__).parent,
        "page.html.j2",
        "style.css",
        TEMPLATE_FILTERS,
        plotly=Markup(plotly),
        drawing=Markup(DRAWING_SCRIPT),
        script_hashes=Markup(" ".join(map(script_hash, scripts))),
        sliders=sliders,
        no_sliders=no_sliders,
        slider_data=carried_markup(sliders) if sliders else "",
        slider_script=Markup(sliders.script if sliders else ""),
        title=title_text(explanation),
        headline=[*headline_sentences(explanation, quantities), *story_sentences(changes)],
        remarks=[*explanation.warnings, *remarks],
        verdict=short_verdict_text(explanation),
        doubts=ambiguity_sentences(explanation),
        remains=typeset_force_ranges(still_missing, quantities),
        left=[display_text(line) for line in remainder_sentences(explanation.remainder, explanation.model)],
        repeats=[display_text(line) for line in unexplained_sentences(explanation)],
        law=law_table(explanation.law) if explanation.law else None,
        e=explanation,
        charts=page_charts(explanation, quantities, earlier),
        places=typeset_force_ranges(explanation.first.where, quantities),
        rungs=[*earlier, *labelled_rungs(explanation)],
        candidates=[candidate_row(t, quantities, first.problem.plant) for t in first.candidates],
        detectable=typeset_detectable_rows(explanation.last),
        tests=residual_section(tests, explanation.model),
        parameters=parameter_rows(explanation),
        correlations=correlation_table(explanation.fit),
        equations=equation_rows(explanation),
        logs=log_rows(explanation.problem),
        files=file_rows(files) if files else log_file_rows(explanation.problem),
        software=software_versions(version),
        command=command,
    )


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
