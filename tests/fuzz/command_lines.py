"""Command lines: every command, with odd options, values and paths."""

from __future__ import annotations

from hypothesis import strategies as st

from tests.fuzz import hostile
from tests.fuzz.cases import Case
from tests.fuzz.invariants import COMMANDS

PATHS = (
    "log.csv", "model.toml", "missing.csv", ".", "..", "", "generated", "generated/__init__.py", "history.json", "/dev/null", "-",
    "/dev/full", "/nonexistent/x.csv", "a/b/c.csv", "x" * 300, "a\nb.csv", "[bold]x.csv", "\x1b[31mred.csv", "\udcff.csv", " ",
    "out.csv", "out.parquet", "out.html", "log.csv/x", "~", "--", "-x", "\u202evsc.gol", "<script>.csv", "'; rm -rf x; '", "%s",
    "model.toml.", "log.csv\n", "out.json", "x.py", "generated/../log.csv",
)  # fmt: skip
WORDS = (
    "slope", "coulomb_drive", "slosh", "columb", "SLOPE", "wheel_pendulum", "arm", "filtered", "inverse", "energy", "auto", "0.1,0.1",
    "simple", "aggressive", "upright", "slope=0.01", "slope=nan", "slope=", "=1", "slope=angle:0.01,angle:1", "rotor_inertia=false",
    "gear_ratio_in_back_emf=twice", "X5=4.7", "X1=0:1", "X1=:", "X5=nan", "coulomb_drive.torque=0.3", "zero", "first", "table1", "compare", "slope,slosh", "slope,", ",",
)  # fmt: skip
# Commands and values that ask for much work are left to the limits of the other cases.
LONG_COMMANDS = {
    "identify",
    "residuals",
    "add",
    "remove",
    "demo",
    "warm",
    "reproduce",
    "campaign",
    "report",
    "explain",
    "diagnose",
    "verify",
    "design",
    "export",
    "view",
}
LONG_PATHS = {"log.csv", "generated/../log.csv"}

paths = st.sampled_from(PATHS)
words = st.sampled_from(WORDS) | hostile.names.map(lambda name: name.replace("\0", ""))


@st.composite
def option_values(draw, parameter):
    """A value for a parameter: of its kind most of the time."""
    if parameter.name == "duration":
        return draw(st.sampled_from(["0", "-1", "nan", "inf", "0.1", "1", "1e9", "x", ""]))
    if parameter.name == "seeds":
        return draw(st.sampled_from(["0", "-1", "x", ""]))
    pools = {
        "path": paths,
        "file": paths,
        "float": hostile.numbers,
        "integer": hostile.numbers,
        "integer range": hostile.numbers,
    }
    kind = st.integers(0, 5)
    return draw(words | paths if draw(kind) == 0 else pools.get(parameter.type.name, words | paths))


@st.composite
def options(draw, command):
    """One argument or option of a command, written out."""
    parameter = draw(st.sampled_from([p for p in command.params if p.name != "help"]))
    if parameter.param_type_name == "argument":
        return (draw(option_values(parameter)),)
    name = draw(st.sampled_from([*parameter.opts, *parameter.secondary_opts]))
    return (name,) if getattr(parameter, "is_flag", False) else (name, draw(option_values(parameter)))


@st.composite
def command_lines(draw):
    """A command with what it needs, so that most lines get past the parser, and odd options."""
    name = draw(st.sampled_from(sorted(COMMANDS)))
    command, parts = COMMANDS[name], [name]
    for parameter in command.params:
        if parameter.required and draw(st.integers(0, 9)):
            value = draw(option_values(parameter))
            parts += [value] if parameter.param_type_name == "argument" else [parameter.opts[0], value]
    for extra in draw(st.lists(options(command), max_size=3)):
        parts += extra
    if "json" in [p.name for p in command.params] and draw(st.booleans()):
        parts += ["--json", "-"]
    if draw(st.integers(0, 20)) == 0:
        parts.insert(
            draw(st.integers(0, len(parts))),
            draw(st.sampled_from(["--help", "--odd", "-q", "--", "--json", "--model"])),
        )
    return tuple(tame(parts))


def tame(parts: list[str]) -> list[str]:
    """The line without what would take minutes: a long command gets no log that it can use."""
    if parts[0] == "--":  # which is passed over
        return ["--", *tame(parts[1:])] if parts[1:] else parts
    if not LONG_COMMANDS & {parts[0]}:
        return parts
    if parts[0] in ("demo", "warm", "reproduce", "verify"):
        return [parts[0], "--odd", *parts[1:]]
    if parts[0] == "design":  # its own twenty seconds of command take as long to find
        parts = ["design", "--duration", "2", *parts[1:]]
    if parts[0] == "view":  # else it would serve until it is stopped
        parts = [parts[0], "--no-browser", "missing.csv", *parts[1:]]
    if parts[0] == "campaign":
        parts = [part for part in parts if part != "--simulate"]
    return [parts[0], *("missing.csv" if part in LONG_PATHS else part for part in parts[1:])]


@st.composite
def command_cases(draw):
    """A few command lines after one another in a sound workspace."""
    lines = draw(st.lists(command_lines(), min_size=1, max_size=2))
    return Case(f"command {lines[0][0]}", tuple(lines))
