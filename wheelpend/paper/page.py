"""The page docs/paper.md: findings of the comparison of the paper with the derivation."""

from __future__ import annotations

from collections.abc import Sequence

from wheelpend.paper.findings import EquationFinding, Verification
from wheelpend.paper.verification_text import STATUS_TEXTS, finding_text, summary_text

PAGE_HEADER = """# The paper, checked

Made by `wheelpend verify --page docs/paper.md`; do not edit.

The model is that of Peng, Cheng and Tsai, Electronics 2023, 12, 4569. Its numbered equations were typed in by hand as
printed and compared, symbolically, with what this project derives from the robot's geometry, from virtual work and
from Laplace algebra. A *match* is an identity. A *misprint* disagrees with the derivation, and the right equations that
tell are named. An *assumption* is a choice that could have been made otherwise. A *definition* claims nothing. What
character recognition destroyed in the copy at hand is *not readable* and counts for nothing.
"""


def page_text(verification: Verification) -> str:
    """The page as Markdown."""
    sections = [
        PAGE_HEADER,
        summary_text(verification) + "\n",
        section_text("Misprints", [details_text(c, "Correct") for c in verification.of("misprint")]),
        section_text("Assumptions", [details_text(c, "Otherwise") for c in verification.of("assumption")]),
        section_text("Numbers", [number_table(verification)]),
        section_text("Every equation", [equation_table(verification)]),
    ]
    return "\n".join(sections)


def section_text(title: str, parts: Sequence[str]) -> str:
    """Heading and parts of a section, or None."""
    return "\n".join([f"## {title}\n", *(parts or ["None.\n"])])


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table, closed by a line break."""
    lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
    return "\n".join(lines) + "\n"


def details_text(checked: EquationFinding, other: str) -> str:
    """Misprint or assumption as a subsection: as printed, the other form, and the relations it violates."""
    title = checked.assumption or f"{checked.name}"
    forms = [("Printed", formula_text(checked.printed)), (other, formula_text(checked.derived))]
    lines = [f"### ({checked.number}) {title}\n", f"{checked.note[:1].upper()}{checked.note[1:]}.\n"]
    lines += [f"- {name}: {text}" for name, text in forms if text]
    lines += [f"- How it shows: {sentence}; not as printed, but as corrected." for sentence in checked.shows]
    return "\n".join(lines) + "\n"


def formula_text(text: str) -> str:
    """Formulas as code, one after the other."""
    return ", ".join(f"`{part}`" for part in split_formulas(text))


def split_formulas(text: str) -> list[str]:
    """Formulas that stand side by side; a semicolon inside a matrix separates its rows."""
    parts, depth = [""], 0
    for letter in text:
        depth += {"[": 1, "]": -1}.get(letter, 0)
        if letter == ";" and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [p.strip() for p in parts if p.strip()]


def number_table(verification: Verification) -> str:
    """Table of the numbers, checked against each other."""
    introduction = (
        "A value with ± carries the rounding of the printed numbers behind it; whole numbers count as exact, g is "
        "9.81 m/s². A percentage may be rounded or cut off.\n"
    )
    rows = [(c.name, c.status, c.printed, c.derived, c.note) for c in verification.parameters]
    return introduction + "\n" + markdown_table(("number", "status", "printed", "needed", "note"), rows)


def equation_table(verification: Verification) -> str:
    """Every finding in a table."""
    rows = [
        (f"({c.number})", STATUS_TEXTS.get(c.status, c.status), formula_text(c.printed), finding_text(c))
        for c in verification.equations
    ]
    return markdown_table(("equation", "status", "printed", "finding"), rows)
