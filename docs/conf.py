"""The site: `make docs` builds it from the Markdown of docs/ and of the root, which stays readable where it is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wheelpend.version import version as installed_version

project = "wheelpend"
release = version = installed_version()
copyright = "the wheelpend authors"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "docs/index"
include_patterns = ["docs/*.md", "README.md", "CHANGELOG.md", "SECURITY.md", "data/README.md"]
html_theme = "furo"
html_title = "wheelpend"
myst_heading_anchors = 4  # links to headings, as they stand in the Markdown
myst_enable_extensions = ["deflist"]
autodoc_typehints = "description"
autodoc_preserve_defaults = True
suppress_warnings = ["myst.header"]  # pages that a command fills begin their sections at the second level

CONTENTS = """

```{toctree}
:hidden:
:caption: %s

%s
```
"""
CHAPTERS = {
    "Begin": ("/README", "glossary", "troubleshooting", "coming_from"),
    "Tutorials": (
        "tutorial_workbench", "tutorial_robot", "tutorial_control", "tutorial_paper", "tutorial_embedded", "tutorial",
    ),
    "Use": (
        "commands", "python", "model", "faults", "effects", "plants", "own_effects", "unexplained", "design", "fleets",
        "kernels", "export", "export_c", "export_javascript", "export_fmu", "export_mujoco", "export_json",
    ),
    "Measured machines": ("emps", "robot", "pendulum", "servo", "arm"),
    "How it works, and how far to trust it": (
        "method", "statistics", "benches", "trust", "public_logs", "benchmark", "performance", "paper", "reproduction",
        "architecture",
    ),
    "Reference": ("reference", "/CHANGELOG", "/SECURITY", "/data/README"),
}  # fmt: skip


def add_contents(app: Any, page: str, source: list[str]) -> None:
    """Give the first page the list of all pages, which a reader of the Markdown has no use for."""
    if page == root_doc:
        source[0] += "".join(CONTENTS % (title, "\n".join(names)) for title, names in CHAPTERS.items())


def add_notebook(app: Any, page: str, source: list[str]) -> None:
    """Give the page of the tutorial the cells of its notebook, which it links to; the first one is its introduction."""
    if page == "docs/tutorial":
        notebook = json.loads(Path(__file__).with_name("tutorial.ipynb").read_text(encoding="utf-8"))
        for cell in notebook["cells"][1:]:
            text = "".join(cell["source"])
            source[0] += f"\n\n```python\n{text}\n```\n" if cell["cell_type"] == "code" else f"\n\n{text}\n"


def setup(app: Any) -> None:
    """Connect what is above to Sphinx."""
    app.connect("source-read", add_contents)
    app.connect("source-read", add_notebook)
