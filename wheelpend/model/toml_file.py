"""Reading a model.toml: the shape of its tables, and every name in it held against plant and library."""

from __future__ import annotations

import tomllib

from wheelpend.errors import Failure
from wheelpend.model.entries import Column, Controller, File, Sensors, Value
from wheelpend.model.toml_checks import (
    Wrong,
    anything,
    mapping,
    number,
    one_of,
    or_word,
    positive,
    several,
    shorthand,
    size,
    table,
    text,
)

VALUE = table(Value, nominal=number, identified=number, sigma=size)
NOISE = or_word("auto", positive)
CHECKED = table(
    File,
    plant=text,
    effects=several(text),
    assumptions=mapping(anything),
    constants=mapping(number),
    parameters=mapping(shorthand("nominal", VALUE)),
    effect=mapping(mapping(shorthand("identified", VALUE))),
    sensors=table(
        Sensors,
        encoder=one_of("absolute", "relative"),
        encoder_counts=size,
        pitch_noise=NOISE,
        rate_noise=NOISE,
        noise=mapping(NOISE),
        step=mapping(size),
    ),
    controller=table(Controller, kind=one_of("pid"), gains=several(number, count=3)),
    columns=mapping(table(Column, column=text, unit=text, sign=one_of(1, -1), scale=positive)),
    simulation=mapping(number),
)


def read(text: str) -> File:
    """Parse and validate the shape of a model.toml."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise Failure(f"this is not valid TOML: {error}. Correct that line.") from error
    assumptions = data.get("assumptions")
    if isinstance(assumptions, dict) and "encoder" in assumptions:
        raise Failure("[assumptions] must not hold encoder. It describes a sensor: set encoder in [sensors].")
    try:
        return CHECKED(data, "")
    except Wrong as wrong:
        raise Failure("; ".join(wrong.args) + ".") from wrong
