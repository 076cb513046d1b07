"""A user's own plant: a Python file like those in derive/plants, run only because somebody named it.

A model.toml names a plant but never a file: opening somebody else's workspace runs nothing of theirs. The file is given
on the command line, or comes with an installed package that names it under the entry point ``wheelpend.plants``.
"""

from __future__ import annotations

import hashlib
import re
import sys
import traceback
from contextlib import redirect_stdout
from pathlib import Path

from derive import plants
from derive.lazy import sp
from derive.records import Plant
from wheelpend.errors import Failure
from wheelpend.files import read_bytes
from wheelpend.text_modules import compiled, new_module, run

NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,39}")
PARAMETER_PATTERN = re.compile(r"X\d+")
TAKEN_NAMES = {"t": "the time", "load": "the motor's load on a port", "origin": "where a log begins"}
PLANT_MODULE_PREFIX = "wheelpend_plant_"  # of the names of modules made from such files


def plant_name(name: str) -> str:
    """The name of a plant that is given by name or by its file; raises Failure where the file is no plant's."""
    return load_plant(Path(name)) if name.endswith(".py") else name


def load_plant(path: Path) -> str:
    """Run a plant's file and make the plant known under its PLANT_NAME, which is returned.

    Raises Failure saying what is wrong with the file, with the line where its code fails.
    """
    try:
        text = read_bytes(path)
    except FileNotFoundError:
        raise Failure(f"A plant's file must be there to be read, but there is none at {path}. Name another.") from None
    module_name = f"{PLANT_MODULE_PREFIX}{hashlib.sha256(text).hexdigest()[:16]}"
    if path.suffix != ".py":
        raise Failure(f"A plant's file must be Python code with a name that ends in .py, not {path}.")
    try:
        with redirect_stdout(sys.stderr):  # what it prints is no result
            if module_name not in sys.modules:
                module = new_module(module_name, path.resolve(), compiled(text, path.resolve()))
                run(module)
                sys.modules[module_name] = module
            module = sys.modules[module_name]
            name = plants.register(module)
            check_plant(plants.build(name, plants.complete_assumptions(name, {})), name)
        return name
    except Failure as failure:
        raise Failure(f"{path}: {failure}") from None
    except BaseException as error:  # whatever a user's code may raise is theirs to hear of, with its line
        if type(error) is KeyboardInterrupt:  # Ctrl-C
            raise
        raise Failure(
            f"{path} must state a plant, but {_failing_line_text(error, path)}{type(error).__name__}{_message(error)}."
        ) from error


def plant_file(name: str) -> Path | None:
    """The file that another process must load to know a plant too; None of a plant that comes with the package."""
    module = plants.find(name)
    return Path(str(module.__file__)) if module.__name__.startswith(PLANT_MODULE_PREFIX) else None


def check_plant(plant: object, name: str) -> None:
    """Raise Failure unless a plant's file states what the derivation needs."""
    if not isinstance(plant, Plant):
        raise Failure(f"build must return a Plant of derive.records, not {type(plant).__name__}.")
    if not NAME_PATTERN.fullmatch(name) or plant.name != name:
        raise Failure(
            f"PLANT_NAME must be small letters, digits and _, and the Plant's name: '{name}', '{plant.name}'."
        )
    for kind, entries in (("coordinate", plant.coordinates), ("port", plant.ports), ("channel", plant.channels)):
        if not entries:
            raise Failure(f"a plant must have at least one {kind}.")
    check_ports_and_channels(plant)
    for sensor in plant.channels:
        check_linear(plant, f"channel {sensor.name}", sensor.reading)
    for port in plant.ports:
        check_linear(plant, f"port {port.name}", port.coordinate)
    for c in plant.coordinates:
        if c.unit not in ("rad", "m"):
            raise Failure(f"a coordinate must be in rad or m; {c.name} is in {c.unit}.")
    check_names(plant)


def check_ports_and_channels(plant: Plant) -> None:
    """Raise Failure unless loads act on ports, and what is controlled, commanded or limited is a channel."""
    ports = [p.name for p in plant.ports]
    for load in plant.loads:
        if load.port not in ports:
            raise Failure(f"the load '{load.name}' must act on one of the ports {', '.join(ports)}, not '{load.port}'.")
    channels = [c.name for c in plant.channels]
    for channel in (*plant.controlled, plant.range_channel):
        if channel and channel not in channels:
            raise Failure(
                f"controlled and range_channel must be channels ({', '.join(channels)}), but '{channel}' is none."
            )
    if plant.reference and not plant.controlled[0]:
        raise Failure(f"reference is the commanded value of what is controlled; with {plant.reference} must come the "
                      "channel, controlled = (CHANNEL, \"\").")  # fmt: skip


def check_names(plant: Plant) -> None:
    """Raise Failure unless coordinates and inputs have names of their own, which no quantity of every model has."""
    names = [s.name for c in plant.moving for s in (c.q, c.dq, c.ddq)] + [u.name for u in plant.inputs]
    for k, name in enumerate(names):
        if not name.isidentifier():
            raise Failure(f"a coordinate or an input must be called by letters, digits and _, not '{name}'.")
        if name in TAKEN_NAMES or PARAMETER_PATTERN.fullmatch(name):
            raise Failure(
                f"no coordinate and no input may be called {name}, which is {TAKEN_NAMES.get(name, 'a parameter')}."
            )
        if name in names[:k]:
            raise Failure(f"coordinates, their rates and inputs must differ in their names; two are called {name}.")
    for channel in plant.channels:
        if channel.name == "t" or channel.name in map(str, plant.inputs):
            raise Failure(f"a channel must be a column of its own; {channel.name} is the time or an input.")


def check_linear(plant: Plant, what: str, expression: sp.Expr) -> None:
    """Raise Failure unless an expression is a sum of coordinates, or of rates, with plain numbers."""
    states = [s for c in plant.coordinates for s in (c.q, c.dq)]
    slopes = sp.Matrix([expression]).jacobian(states)
    if slopes.free_symbols or sp.sympify(expression).subs(dict.fromkeys(states, 0)) != 0:
        raise Failure(f"the {what} must be a sum of coordinates, or of rates, with plain numbers, not {expression}.")


def _message(error: BaseException) -> str:
    """What an error says, after a colon; nothing where it cannot say it."""
    try:
        return f": {error}".rstrip(": .")
    except Exception:
        return ""


def _failing_line_text(error: BaseException, path: Path) -> str:
    """The line of the file in which an error came up."""
    own = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path.resolve()]
    return f"line {own[-1].lineno} raises " if own else "it raises "
