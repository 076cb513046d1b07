"""HTML pages from a template and a style sheet that lie beside their module."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from wheelpend.reports.characters import visible


def rendered_page(
    folder: Path, template: str, style: str, filters: dict[str, Callable[..., Any]] | None = None, **values: Any
) -> str:
    """A page from a template and a style sheet in a folder; whatever is not markup is escaped, nothing may be missing.

    Characters that would turn a text around are written as escapes.

    The template has its style sheet as ``style``.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_visible_value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters or {}
    sheet = Markup((folder / style).read_text(encoding="utf-8"))  # our own file
    return environment.get_template(template).render(style=sheet, **values)


def _visible_value(value: Any) -> Any:
    """What a template shows of a value."""
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value
