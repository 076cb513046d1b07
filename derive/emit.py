"""Text of a generated module: strings of ``Code`` in the templates.

A template formats strings of ``Code``. Functions that read the same in every module are no templates but Python files
in ``templates/core``; ``{{ core("friction", "_slip") }}`` in a template puts them where they belong.
"""

from __future__ import annotations

import ast
from functools import lru_cache
from importlib.metadata import version

import jinja2
import sympy as sp

from derive.files import TEMPLATE_FOLDER
from derive.records import Model
from derive.statespace import Code, generate_code


def render(model: Model, source: str = "model.toml", title: str = "", frame: str = "module") -> str:
    """Text of the model's module; the ``frame`` ``real_time`` is that of one for loops in real time."""
    code = generate_code(model)
    text = module_template(frame).render(
        source=source,
        sympy=sp.__version__,
        jinja=version("jinja2"),
        plant=model.plant.name,
        assumptions=", ".join(f"{k}={v}" for k, v in model.assumptions.items()),
        effects=", ".join(e.name for e in model.effects) or "none",
        title=title or model.plant.name,
        inputs_phrase=model.plant.plant_signature.inputs_phrase if model.plant.driven else "forces as in PARAMETERS",
        equations=equations_text(model),
        **code._asdict(),
        **argument_lists(code),
    )
    return normalise_blank_lines(text)


@lru_cache
def module_template(frame: str) -> jinja2.Template:
    """The template of a module with a frame, read once for all of them."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATE_FOLDER),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals["core"] = core
    return environment.get_template(f"{frame}.py.j2")


def core(file: str, *names: str) -> str:
    """Text of functions of a file in templates/core, verbatim: the named ones, or all.

    Raises KeyError, naming the known ones, for a function that is not there.
    """
    functions = core_functions(file)
    for name in names:
        if name not in functions:
            raise KeyError(f"templates/core/{file}.py has no function '{name}'; it has {', '.join(functions)}")
    return "\n\n\n".join(functions[name] for name in names or functions)


@lru_cache
def core_functions(file: str) -> dict[str, str]:
    """The functions of such a file by name, each from its decorator to its last line; imports and docstring stay."""
    text = (TEMPLATE_FOLDER / "core" / f"{file}.py").read_text(encoding="utf-8")
    lines = text.splitlines()
    return {
        f.name: "\n".join(lines[f.decorator_list[0].lineno - 1 : f.end_lineno])
        for f in ast.parse(text).body
        if isinstance(f, ast.FunctionDef)
    }


def argument_lists(code: Code) -> dict[str, str]:
    """Argument lists of the integrator's functions: scalars, kept in registers, each under its own name."""
    layout, friction, trig_arguments = code.layout, code.friction, code.layout.trig_arguments
    count, width = len(layout.accelerations), len(layout.variables) + (code.actuator.lag >= 0)
    lists = {
        "accelerations": layout.accelerations,
        "directions": friction.directions,
        "variables": layout.variables,
        "motion": (*layout.variables, code.actuator.input, *friction.directions),
        "mobility": [f"mobility_{i}_{j}" for i in range(count) for j in range(count)],
        "by_state": [f"by_{i}_{j}" for i in range(count) for j in range(width)],
        "forces": [f"force_{n}" for n in range(len(friction.slip_matrix))],
        "trig_values": [f"{f}_{name}" for name in trig_arguments for f in ("sin", "cos")],
        "angles": [f"angle_{name}" for name in trig_arguments],
        "states": layout.states,
        "signals": [f"signal_{n}" for n in range(len(code.filters.signals))],
        "features": [f"feature_{n}" for n in range(len(code.filters.features))],
        "start_angles": [f"start_{name}" for name in trig_arguments],
        "integrated": layout.variables[: len(layout.derivatives)],
    }
    return {name: ", ".join(entries) for name, entries in lists.items()}


def equations_text(model: Model) -> str:
    """The equations of motion as lines of text: residual = 0 for each row."""
    lines = []
    for coordinate, row in zip(model.plant.moving, model.residual, strict=True):
        terms = map(str, sp.Add.make_args(row))
        lines.append(f"{coordinate.row} row: 0 =")
        lines += [f"    {'- ' if t.startswith('-') else '+ '}{t.lstrip('-')}" for t in terms]
    return "\n".join(lines)


def normalise_blank_lines(text: str) -> str:
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
