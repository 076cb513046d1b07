"""One self-contained HTML page with the tables, the figures and the choices; it needs neither network nor scripts."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from markupsafe import Markup

from wheelpend.reports.html import rendered_page
from wheelpend.reproduction.estimators import METHOD_LABELS
from wheelpend.reproduction.figures import SHOWN_SEED
from wheelpend.reproduction.sentences import bound_sentence, effect_sentences, finding_sentences
from wheelpend.reproduction.table_text import (
    case_title,
    condition_table,
    deviation_table,
    error_table,
    prediction_tables,
)

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
    sources = {name: Markup("data:image/png;base64," + base64.b64encode(d).decode()) for name, d in pictures.items()}
    return rendered_page(
        Path(__file__).parent,
        "gallery.html.j2",
        "gallery.css",
        sections=list(sections(result)),
        findings=finding_sentences(result),
        choices=[(c, effect_sentences(c)) for c in result.choices],
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
        ], [("", condition_table(result))], [])  # fmt: skip
    if result.table3:
        yield table3(result)
    if result.predictions:
        yield from paper_figures(result)


def table12(result: Reproduction, which: int) -> Section:
    """Table 1 or 2."""
    cells = result.table1 if which == 1 else result.table2
    titles = ("Table 1: differentiation and filtering, simple command", "Table 2: filtering, both commands")
    grids = [(f"{command.capitalize()} command", error_table(list(own)))
             for command, own in groupby(cells, key=lambda c: c.command)]  # fmt: skip
    failed = [f"{METHOD_LABELS[m]} gave no estimate in {n} of {result.seeds} seeds on the {c} command."
              for m, c, n in dict.fromkeys((c.method, c.command, c.failed) for c in cells if c.failed)]  # fmt: skip
    text = [
        f"Absolute error in % over {result.seeds} seeds: median, and in brackets the range from 10 to 90 %. "
        "The rank is the share of our draws whose error is smaller than that of the paper's single draw. "
        "All methods see the same data.",
        *([bound_sentence(result)] if which == 1 or not result.table1 else []), *failed,
    ]  # fmt: skip
    return Section(
        titles[which - 1], text, grids, [(f"table{which}", "Dots are medians, whiskers run from 10 to 90 %.")]
    )


def table3(result: Reproduction) -> Section:
    """Table 3."""
    grids = []
    for _, own in groupby(result.table3, key=lambda r: r.case):
        rows = list(own)
        grids.append((case_title(rows[0]), deviation_table(rows)))
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
    yield Section("Figures 4 to 6: predictions", text, prediction_tables(result.predictions), [
        ("figure4", "Figure 4. Outputs predicted by the closed loop: exact red, identified from the simple command "
                    "blue, from the aggressive command green."),
        ("figure5", f"Figure 5. Errors of these predictions; RMSE of this draw (seed {SHOWN_SEED}) and the paper's."),
        ("figure6", "Figure 6. Predicted control input: measured grey, exact red, simple green, aggressive blue, as "
                    "the paper has it."),
    ])  # fmt: skip
