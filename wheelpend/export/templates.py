"""Templates of the files around translated functions."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import jinja2


@lru_cache
def file_template(folder: Path, name: str) -> jinja2.Template:
    """A template of a language's folder, whose blocks leave no empty lines."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(name)
