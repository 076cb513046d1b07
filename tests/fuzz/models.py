"""Hostile model.toml and effects.toml: structured changes of sound ones, and text that is none."""

from __future__ import annotations

import copy
import tomllib
from datetime import UTC, date, datetime
from typing import Any

import tomlkit
from hypothesis import strategies as st

from derive.effects import EFFECT_LIBRARY
from tests.fuzz import hostile
from tests.fuzz.cases import Case
from tests.fuzz.invariants import fresh_files
from tests.fuzz.logs import byte_changes

EFFECTS_FILE = """
[own_drag]
family = "drive"
sentence = "A drag of mine."
on = "drive"
law = "c*speed^3"
dissipates = true
parameters = { c = { unit = "V", typical = 0.1, minimum = 0, maximum = 10 } }
"""
ODD_VALUES = (
    0, 1, -1, True, False, "", "auto", "x", 1e308, -1e308, 1e-320, float("nan"), float("inf"), 2**63 - 1, -(2**63), 0.5, [], [[]],
    [1, "a"], {}, {"nominal": 1}, {"nominal": float("nan")}, {"": {}}, date(2026, 1, 1), datetime(2026, 1, 1, tzinfo=UTC),
    [{"a": 1}], "wheel_pendulum", "../x", "/etc/passwd", "x.py", ["slope"], ["slope", "slope"], ["", "slosh"], "ms", "deg", "N m",
)  # fmt: skip
odd_values = st.sampled_from(ODD_VALUES) | hostile.names | st.floats() | st.integers(-(2**63), 2**63 - 1)
NESTINGS = {"arrays": "a = " + "[" * 3000 + "]" * 3000, "tables": "[" + ".".join(["a"] * 3000) + "]",
            "inline": "a = " + "{b = " * 3000 + "1" + "}" * 3000, "dotted": ".".join(["a"] * 3000) + " = 1",
            "many": "".join(f"k{k} = {k}\n" for k in range(20_000)), "long": 'plant = "' + "x" * 1_000_000 + '"'}  # fmt: skip


def places(table: Any, above: tuple = ()) -> list[tuple]:
    """The path of every key of a document."""
    found = []
    for key, value in table.items():
        found.append((*above, key))
        if isinstance(value, dict):
            found += places(value, (*above, key))
    return found


@st.composite
def table_changes(draw):
    """A change of one place of a document: another value, no value, a further key."""
    kind, where = draw(st.sampled_from(["value", "value", "remove", "further", "number"])), draw(st.integers(0, 1000))
    value, name = draw(odd_values), draw(hostile.names)
    number = draw(st.floats(allow_nan=False) | st.integers(-(10**6), 10**6))

    def change(document):
        document = copy.deepcopy(document)
        known = places(document)
        if not known:
            return document
        *above, key = known[where % len(known)]
        table = document
        for part in above:
            table = table[part]
        if kind == "remove":
            del table[key]
        elif kind == "further":
            (table[key] if isinstance(table[key], dict) else table)[name] = value
        else:
            table[key] = number if kind == "number" and isinstance(table[key], int | float) else value
        return document

    return change


def dumped(document: Any) -> bytes:
    """A document as TOML; what cannot be said in it as an empty one."""
    try:
        return tomlkit.dumps(document).encode()
    except (ValueError, TypeError, UnicodeError):
        return b""


def changed_documents(text: str):
    """A sound document after a few changes."""
    changes = hostile.steps(table_changes())
    return changes.map(lambda made: dumped(hostile.apply_all(made, tomllib.loads(text))))


def damaged(text: str):
    """The bytes of a sound document, damaged; or a document that nests."""
    bytes_changed = hostile.steps(byte_changes()).map(lambda made: hostile.apply_all(made, text.encode()))
    encoded = st.sampled_from(["utf-16", "utf-8-sig", "latin-1"]).map(lambda e: text.encode(e, "replace"))
    return bytes_changed | encoded | st.sampled_from(sorted(NESTINGS)).map(lambda k: NESTINGS[k].encode())


@st.composite
def known_effects(draw):
    """The sound model with a few effects of the library, and numbers for them."""
    chosen = draw(st.lists(st.sampled_from(sorted(EFFECT_LIBRARY)), max_size=2))
    document = tomllib.loads(model_text())
    document["effects"] = chosen
    document["effect"] = {
        name: draw(st.dictionaries(st.sampled_from(["torque", "angle", "x"]), odd_values, max_size=2))
        for name in chosen
    }
    return dumped(document)  # fmt: skip


def model_text() -> str:
    return fresh_files()["model.toml"].decode()


MODEL_COMMANDS = (
    ("generate", "--check"), ("generate",), ("equations",), ("history", "--json", "-"), ("effects", "--json", "-"),
    ("inspect", "log.csv", "--json", "-"), ("add", "slope"), ("remove", "slope"), ("add", "coulomb_drive", "--json", "-"),
    ("equations", "--latex", "--diff", "gear_ratio_in_back_emf=twice"), ("effects", "slope"), ("identify", "none.csv", "--save"),
)  # fmt: skip
MEETING_NUMBERS = (
    ("compare", "log.csv", "--json", "-"), ("inspect", "log.csv"), ("identify", "log.csv", "--method", "filtered", "--tau", "0.1,0.1"),
    ("simulate", "-o", "made.csv", "--duration", "1"), ("identify", "log.csv", "--method", "inverse", "--save"),
)  # fmt: skip


@st.composite
def model_cases(draw):
    """A hostile model file and a command that opens it."""
    kind = draw(st.sampled_from(["changed", "changed", "damaged", "effects"]))
    made = {"changed": changed_documents(model_text()), "damaged": damaged(model_text()), "effects": known_effects()}[
        kind
    ]
    return Case(f"model {kind}", (draw(st.sampled_from(MODEL_COMMANDS)),), {"model.toml": draw(made)})


@st.composite
def number_cases(draw):
    """A model whose equations are the sound one's and whose numbers are odd, and a command that reckons with them."""
    document = tomllib.loads(model_text())
    for table in draw(
        st.lists(
            st.sampled_from(["constants", "parameters", "sensors", "simulation", "controller", "columns"]), min_size=1
        )
    ):
        key = draw(st.sampled_from(sorted(document[table]) or ["theta_p"]))
        number = draw(
            st.sampled_from([0.0, 1e-320, 1e-12, -1.0, 1e6, 1e18, 1e150, 1e308])
            | st.floats(allow_nan=False, allow_infinity=False)
        )
        values = {
            "parameters": {"nominal": number},
            "columns": {"column": key, "scale": number},
            "controller": [number] * 3,
        }
        document[table]["gains" if table == "controller" else key] = values.get(table, number)
    return Case("model numbers", (draw(st.sampled_from(MEETING_NUMBERS)),), {"model.toml": dumped(document)})  # fmt: skip


ATOMS = (
    "c",
    "speed",
    "1",
    "0",
    "2.5",
    "1e12",
    "1e-300",
    "voltage",
    "position",
    "angle",
    "pi",
    "e",
    "I",
    "oo",
    "x",
    "t",
    "-1",
    "c*c",
)
WRAPS = ("{}+{}", "{}*{}", "{}/{}", "{}-{}", "{}^{}", "({})", "sin({})", "exp({})", "log({})", "sqrt({})", "abs({})", "sign({})",
         "positive({})", "tanh({})", "{}**{}**{}", "-{}", "lambdify({})", "__import__('os')", "{}.{}", "tan({})", "atan({})")  # fmt: skip
laws = st.recursive(
    st.sampled_from(ATOMS),
    lambda inner: st.builds(
        lambda wrap, parts: wrap.format(*parts), st.sampled_from(WRAPS), st.tuples(inner, inner, inner)
    ),
    max_leaves=6,
)
LAW_COMMANDS = (("effects", "own_drag"), ("effects", "--json", "-"), ("add", "own_drag"), ("generate", "--check"))


@st.composite
def law_cases(draw):
    """A hostile effects.toml and a command that reads it."""
    document = tomllib.loads(EFFECTS_FILE)
    kind = draw(st.sampled_from(["law", "law", "changed", "damaged"]))
    document["own_drag"]["law"] = draw(laws)
    data = draw(
        {
            "law": st.just(dumped(document)),
            "changed": changed_documents(EFFECTS_FILE),
            "damaged": damaged(EFFECTS_FILE),
        }[kind]
    )
    return Case(f"effects {kind}", (draw(st.sampled_from(LAW_COMMANDS)),), {"effects.toml": data})  # fmt: skip
