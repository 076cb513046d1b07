"""Text to file: the templates make a module out of the pieces, and a folder is compared with it or replaced by it."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

import jinja2
import sympy as sp

from derive.records import Model
from derive.statespace import Code, generate_code

HERE = Path(__file__).resolve().parent
TEMPLATES = next(p for p in (HERE / "templates", HERE.parent / "templates") if p.is_dir())


def render(model: Model, source: str = "model.toml", title: str = "") -> str:
    """Text of the model's module."""
    code = generate_code(model)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    text = environment.get_template("module.py.j2").render(
        source=source,
        sympy=sp.__version__,
        plant=model.plant.name,
        assumptions=", ".join(f"{k}={v}" for k, v in model.assumptions.items()),
        effects=", ".join(e.name for e in model.effects) or "none",
        title=title or model.plant.name,
        equations=equations_text(model),
        code=code,
        late=", ".join(str(n in code.late) for n in range(len(code.outputs))),
        **argument_lists(code),
    )
    return tidy(text)


def argument_lists(code: Code) -> dict[str, str]:
    """What the functions of the integrator hand to each other: scalars, kept in registers, each under its own name."""
    count, width = len(code.accelerations), len(code.variables) + (code.lag >= 0)
    lists = {
        "accelerations": code.accelerations,
        "directions": code.directions,
        "variables": code.variables,
        "motion": (*code.variables, code.input, *code.directions),
        "mobility": [f"mobility_{i}_{j}" for i in range(count) for j in range(count)],
        "by_state": [f"by_{i}_{j}" for i in range(count) for j in range(width)],
        "forces": [f"force_{n}" for n in range(len(code.slips))],
    }
    return {name: ", ".join(entries) for name, entries in lists.items()}


def equations_text(model: Model) -> str:
    """The equations of motion as lines of text: residual = 0 for each row."""
    lines = []
    for coordinate, row in zip(model.plant.moving, model.residual, strict=True):
        terms = sp.Add.make_args(row)
        lines.append(f"{coordinate.row} row: 0 =")
        lines += [f"    {'- ' if str(t).startswith('-') else '+ '}{str(t).lstrip('-')}" for t in terms]
    return "\n".join(lines)


def tidy(text: str) -> str:
    """Two blank lines between functions, none trailing."""
    lines: list[str] = []
    for line in text.splitlines():
        blank = not line.strip()
        if blank and len(lines) >= 2 and not lines[-1] and not lines[-2]:
            continue
        if line.startswith("@"):
            while lines and not lines[-1]:
                lines.pop()
            lines += ["", ""]
        lines.append(line.rstrip() if not blank else "")
    return "\n".join(lines).rstrip() + "\n"


def differences(folder: Path, files: dict[str, str]) -> str:
    """Unified diff from what is in the folder to what should be; empty when nothing is stale."""
    found: list[str] = []
    for name, text in files.items():
        path = folder / name
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        found += difflib.unified_diff(old.splitlines(True), text.splitlines(True), str(path), f"{path} (derived)")
    return "".join(found)


def write(folder: Path, files: dict[str, str]) -> None:
    """Write files: all of them beside their places first, then renamed onto them."""
    folder.mkdir(parents=True, exist_ok=True)
    beside = {name: folder / f".{name}.{os.getpid()}.new" for name in files}
    try:
        for name, text in files.items():
            beside[name].write_text(text, encoding="utf-8")
        for name, path in beside.items():
            os.replace(path, folder / name)
    finally:
        for path in beside.values():
            path.unlink(missing_ok=True)
