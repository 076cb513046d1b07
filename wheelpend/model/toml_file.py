"""Reading a model.toml: its tables as records, every key known and every value of its kind."""

from __future__ import annotations

import tomllib
from typing import Any

from derive.input_units import UNIT_WORDS
from wheelpend.errors import Failure
from wheelpend.model.entries import (
    Column,
    Controller,
    Input,
    ModelFile,
    ParameterValue,
    RandomForce,
    SensorNoise,
    Sensors,
)
from wheelpend.model.toml_checks import (
    any_value,
    checked,
    keyword_or,
    list_of,
    mapping,
    nonnegative,
    number,
    number_or_table,
    one_of,
    positive,
    table,
    table_with_rest,
    text,
)

MODEL_FILE, USER_EFFECTS_FILE = "model.toml", "effects.toml"  # in a workspace
GUESS_MARK = "guessed: "  # begins the comment behind an entry that nobody has stated
UNKNOWN_MARK = "not recognised: "  # and behind one that somebody must state

MAX_DOTS = 1000  # in a line

VALUE_CHECK = table(ParameterValue, nominal=number, identified=number, sigma=nonnegative)
NOISE_CHECK = keyword_or("auto", positive)
MODEL_FILE_CHECK = table(
    ModelFile,
    plant=text,
    effects=list_of(text),
    assumptions=mapping(any_value),
    constants=mapping(number),
    parameters=mapping(number_or_table("nominal", VALUE_CHECK)),
    effect=mapping(mapping(number_or_table("identified", VALUE_CHECK))),
    sensors=table_with_rest(Sensors, "of_plant", noise=mapping(NOISE_CHECK), step=mapping(nonnegative)),
    controller=table(Controller, kind=one_of("pid"), gains=list_of(number, count=3)),
    columns=mapping(
        table(
            Column,
            column=text,
            unit=text,
            sign=one_of(1, -1),
            scale=positive,
            offset=number,
            times=text,
            smooth=nonnegative,
            held=one_of("after", "before"),
        )
    ),
    simulation=mapping(number),
    input=table(Input, unit=one_of(*UNIT_WORDS)),
    random_force=mapping(table(RandomForce, rms=nonnegative, correlation_time=positive, place=text)),
    sensor_error=mapping(table(SensorNoise, rms=nonnegative, correlation_time=positive, lag=nonnegative)),
)


def parse_model_file(text: str) -> ModelFile:
    """The tables of a model.toml; raises Failure naming everything in them that is not as it must be."""
    return checked(MODEL_FILE_CHECK, parse_toml(text))


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text; raises Failure where it is not valid, nests without end or has endless numbers."""
    if any(line.count(".") > MAX_DOTS for line in text.splitlines()):  # the reader's time grows with their square
        raise Failure(f"no line may have more than {MAX_DOTS} dots, which nest as brackets do. Take some out.")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise Failure("this is not valid TOML: it nests too deeply to be read. Take brackets out.") from None
    except ValueError as error:  # numbers of thousands of digits too, which Python does not read
        raise Failure(f"this is not valid TOML: {str(error).partition(';')[0]}. Correct that line.") from error
