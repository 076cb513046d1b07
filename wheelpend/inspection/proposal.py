"""The model that a file's columns suggest: which plant under which assumptions, which column is what."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from derive import plants
from wheelpend.errors import Failure
from wheelpend.inspection.angle_unit import is_in_degrees, is_small_swing
from wheelpend.inspection.camera_path import arc_sentence
from wheelpend.inspection.column_names import (
    REFERENCE_NAMES,
    contains,
    input_unit,
    is_acceleration,
    is_called_time,
    is_no_place,
    may_be_input,
    unit_within,
)
from wheelpend.inspection.column_roles import is_called_place
from wheelpend.inspection.gravity import (
    ChainZero,
    chain_zero,
    gravity_zero,
    hangs_at_zero,
    resting_zero,
    spring_zero,
    zero_offset,
)
from wheelpend.inspection.guesses import guess_units
from wheelpend.inspection.mounting import turned_over
from wheelpend.inspection.plant_fit import Candidate, candidates, partly_fitted, preference, toml_value
from wheelpend.inspection.raw_units import in_counts
from wheelpend.inspection.signals import DEGREES_PER_RADIAN, Signals
from wheelpend.inspection.survey import SUMMED_PLACE, FileColumn, Survey
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.faults import held_samples
from wheelpend.logs.read import stated_clock_unit
from wheelpend.logs.units import UNIT_CONVERSIONS, speed_unit, stated_unit
from wheelpend.model.toml_file import GUESS_MARK, UNKNOWN_MARK

SUMMED_REASON = "a speed, which is summed over time, as no column is a place"
UNKNOWN_SPEED_UNIT = {  # by that of the place
    "rad": "; its unit is not said: put scale = 0.0174533 for deg/s, 0.10472 for rpm",
    "m": "; its unit is not said: put scale = 0.001 for mm/s, or the radius of a wheel in m that turns by it in rad/s",
}
PLACE_LETTERS = ("x", "y", "q", "pos")  # names that a place has most often
UNNAMED_COLUMN = "?"  # stands for a column that its user must name
COMMENTED_SECTIONS = ("columns", "sensors")  # of a model.toml, in which an entry may be a guess


class Proposal(NamedTuple):
    """The text of a model.toml for a file, with the sentences that say why."""

    text: str
    sentences: tuple[str, ...]
    plants: tuple[str, ...]  # that fit by the columns, the likeliest first
    guesses: Mapping[str, str] = {}  # why a quantity's column is read as it is, where only numbers say so
    missing: Mapping[str, str] = {}  # what to put for a quantity of the plant named that no column was found for


def propose(survey: Survey, plant: str = "", untold: Collection[str] = ()) -> Proposal:
    """The model that a file's columns suggest, of that plant if named; raises Failure where none has such columns.

    ``untold`` are channels in counts whose unit the equations of motion did not tell.
    """
    if not plant and (said := arc_sentence(survey)):
        raise Failure(f"{survey.file}: {said}")
    inputs, places = survey.of_role("input"), survey.of_role("position")
    gravity = hanging_at(survey, places[0], inputs) if len(places) == 1 else None
    pulled = gravity is not None or (len(places) == 1 and looks_like_degrees(survey, places[0]))
    found = sorted(
        candidates(survey, [plant] if plant else list(plants.KNOWN_PLANTS)), key=lambda c: -preference(c, pulled)
    )
    best = found[0] if found else partly_fitted(plant, survey) if plant else None
    if best is None:
        raise Failure(no_plant_text(survey, plant))
    missing = missing_columns(survey, best)
    untold = counted_channels(survey, best) if missing else untold  # the equations cannot be asked
    unit = unit_of_inputs(best)
    guesses = guess_units(survey, best.table, best.columns, unit, untold)
    maps = column_maps(best, survey, unit) | {n: g.column for n, g in guesses.items()}
    maps |= followed_reference(survey, best, maps)
    chain = chain_hanging_at(survey, best, inputs, maps)
    gravity = swinging_about(survey, best, maps) if gravity is None else gravity
    gravity = chain.zero if chain else gravity if best.swings else None
    offset = zero_offset(gravity) if gravity is not None else 0.0
    turned = best.table.places if chain and not chain.is_relative else best.table.places[:1]
    reasons = nameless_reasons(best) | surplus_reasons(survey, best) | {n: g.reason for n, g in guesses.items()}
    mounting = turned_over(survey, best, maps)
    maps |= mounting.maps if mounting else {}
    beyond = not mounting and is_beyond_its_range(survey, best, maps)
    hangs = not beyond and is_hanging_pole(survey, best)
    if beyond or hangs:
        best = best._replace(assumptions={**best.assumptions, "range": "any"})
    sentences = [
        plants_sentence(found or [best]),
        *controlled_sentence(survey, best),
        *role_sentences(survey, best),
        *offset_sentence(best, maps, gravity, offset, turned),
    ]
    if beyond:
        column = best.columns[best.table.range_channel]
        sentences.append(f'{column} is beyond ±π/2 for most of the log: it hangs or swings up, hence range = "any".')
    offsets = dict.fromkeys(turned, offset) if offset else {}
    if mounting:
        offsets = {best.table.range_channel: mounting.offset}
        sentences.append(mounting.sentence)
    if hangs:
        column = best.columns[best.table.range_channel]
        offsets = {best.table.range_channel: math.pi}
        sentences.append(
            f"{column} is measured from hanging, by what gravity does to it; {best.table.range_channel} is 0 upright, "
            'hence the offset, and range = "any".'
        )
    told = {n: g for n, g in guesses.items() if g.column.column != SUMMED_PLACE}  # that is of the speed
    sentences += [guess_sentence(n, g.column.column, g.reason) for n, g in told.items()]
    if "t" not in guesses and (reason := clock_reason(survey)):
        reasons["t"] = reason
        sentences.append(guess_sentence("t", survey.clock.column, reason))
    if SUMMED_PLACE in best.columns.values():
        maps |= (speeds := summed_speed(survey, best, maps))
        untold_unit = "" if stated_unit(survey.speed) else UNKNOWN_SPEED_UNIT[best.table.units[next(iter(speeds))]]
        reasons |= dict.fromkeys(speeds, SUMMED_REASON + untold_unit)
        place = "a place of a wheel" if len(best.table.places) > 1 else "a place"
        sentences.append(f"Nothing in {survey.file} is {place}: {survey.speed}, a speed, is summed over time.")
    maps |= {n: ColumnMap(UNNAMED_COLUMN) for n in missing}
    text = model_text(best, maps, unit, offsets, {**guess_comments(reasons), **missing})
    return Proposal(text, tuple(sentences), tuple(dict.fromkeys(c.words for c in found or [best])), reasons, missing)


def is_beyond_its_range(survey: Survey, best: Candidate, maps: Mapping[str, ColumnMap]) -> bool:
    """True of a machine that begins beyond its range and is there for most of the log, where the plant allows that."""
    name = best.table.range_channel
    column = best.columns.get(name, "")
    if not best.table.words.anywhere or column not in survey.values:
        return False
    entry = maps.get(name, ColumnMap(column))
    _, unit = UNIT_CONVERSIONS["rad" if stated_unit(column) else entry.unit or "rad"]  # a stated one is read already
    known = survey.values[column][np.isfinite(survey.values[column])]
    beyond = np.abs(known * entry.scale * unit) > math.pi / 2
    return bool(beyond.size and beyond[0] and 2 * np.count_nonzero(beyond) > len(beyond))


def is_hanging_pole(survey: Survey, best: Candidate) -> bool:
    """True of a pole on a cart whose angle is measured from hanging, where the plant allows any angle."""
    name, places = best.table.range_channel, best.table.places
    carts = [p for p in places if best.table.units[p] == "m"]
    if not best.table.words.anywhere or name not in best.columns or len(carts) != 1 or carts[0] not in best.columns:
        return False
    cart, pole = best.columns[carts[0]], best.columns[name]
    unit = DEGREES_PER_RADIAN if looks_like_degrees(survey, pole) else 1.0
    return hangs_at_zero(survey.stretches, cart, pole, unit)


def surplus_reasons(survey: Survey, best: Candidate) -> dict[str, str]:
    """Why a quantity has the column that it has, where the file has more of that kind than the plant has places."""
    found: dict[str, str] = {}
    for role, names in (("input", best.table.inputs), ("position", best.table.places)):
        columns = survey.of_role(role)
        if len(columns) > len(names) and not best.by_name:
            found |= {n: f"one of {len(columns)} {role}s: {', '.join(columns)}" for n in names if n in best.columns}
    return found


def nameless_reasons(best: Candidate) -> dict[str, str]:
    """Why a quantity has a column that no header names."""
    reason = "the file has no header, so by what the column does"
    return {n: reason for n, column in best.columns.items() if column.startswith(NAMELESS_PREFIX)}


def clock_reason(survey: Survey) -> str:
    """Why a column is read as the time that nothing calls so, or in the unit that nothing states; else nothing.

    Nothing of the first column of a file without names.
    """
    name = survey.clock.column
    if survey.times != "read" or name == f"{NAMELESS_PREFIX}1":
        return ""
    if is_called_time(name):
        stated, read_in = stated_clock_unit(name), survey.clock.unit
        if stated and stated != read_in:
            return f"in {read_in} its stamps count since 1970, as they hardly do in {stated}"
        return f"no unit is said; {read_in}, by how far its rows are apart" if read_in != "s" and not stated else ""
    called = next((c.name for c in survey.columns if is_called_time(c.name)), "")
    if called:
        return f"{called} does not grow from row to row, and this one does"
    return "no column is called a time, and this one grows from row to row"


def unit_of_inputs(best: Candidate) -> str:
    """Unit of a plant's inputs by their columns, its own where none was found; nothing where nothing drives it."""
    columns = [best.columns[n] for n in best.table.inputs if n in best.columns]
    own, named = best.table.units.get(best.table.input, ""), input_unit(columns) if columns else ""
    turns = all(best.table.units[p] == "rad" for p in best.table.places)
    return own if not named or (named == "N" and turns) else named  # a force turns nothing by itself


def missing_columns(survey: Survey, best: Candidate) -> dict[str, str]:
    """What to put for each quantity that a plant needs and no column of the file was found for."""
    known = [c.name for c in survey.columns if c.remark]  # the other wheel's speed, say
    left = left_over(survey, [*best.columns.values(), *known])
    choice = (
        f"put {'one of ' if left[1:] else ''}{', '.join(left)} in its place"
        if left
        else "no column is left over; log it"
    )
    return {n: f"{UNKNOWN_MARK}{choice}" for n in best.table.required[1:] if n not in best.columns}


def left_over(survey: Survey, used: Collection[str]) -> list[str]:
    """The columns of a file that change, tell more than the time, and are not used."""
    return [
        c.name
        for c in survey.columns
        if c.name not in used and c.role not in ("time", "counter", "copy", "constant", "unread", "text")
    ]


def counted_channels(survey: Survey, best: Candidate) -> list[str]:
    """The positions of a plant that are in counts by their numbers."""
    return [
        n
        for n, c in best.columns.items()
        if c in survey.values and in_counts(n, survey.values[c], ColumnMap(c, stated_unit(c)), best.table)
    ]


def guess_comments(guesses: Mapping[str, str]) -> dict[str, str]:
    """The comments that mark entries of a model.toml as guessed."""
    return {name: f"{GUESS_MARK}{reason}" for name, reason in guesses.items()}


def hanging_at(survey: Survey, place: str, inputs: list[str]) -> float | None:
    """Reading at which a position hangs [rad], in degrees or rad as it looks; None where no gravity shows, or a way.

    What is held at first is pulled nowhere: a machine that nothing drives is judged from where it is let go.
    """
    signals = survey.longest_with(place)
    if survey.base_of(place) != "rad" and is_small_swing(survey.values[place], signals, place, inputs):
        return None
    unit = DEGREES_PER_RADIAN if looks_like_degrees(survey, place) else 1.0
    zero = gravity_zero(signals if inputs else _let_go(signals, place), place, inputs, unit)
    return resting_zero(survey.values[place] / unit) if zero is None and not inputs else zero


def swinging_about(survey: Survey, best: Candidate, maps: Mapping[str, ColumnMap]) -> float | None:
    """Reading about which a pendulum's only angle swings [rad], as ``maps`` read it; None where that does not show.

    Of counts, what a rad is has to be guessed before gravity is seen in them. A swing too small for gravity to show,
    as a spring would do as well, is about where the pendulum hangs if nothing drives it.
    """
    name, inputs = best.table.places[0], survey.of_role("input")
    place = best.columns.get(name)
    if not best.swings or len(best.table.places) != 1 or best.table.range_channel or not place:
        return None
    signals, unit = survey.longest_with(place), 1.0 / _guessed_factor(place, maps.get(name))
    if inputs:
        return gravity_zero(signals, place, inputs, unit)
    free = _let_go(signals, place)
    found = (z for look in (gravity_zero, spring_zero) if (z := look(free, place, inputs, unit)) is not None)
    return next(found, None)


def _let_go(signals: Signals | None, place: str) -> Signals | None:
    """The signals of a machine that nothing drives from where it is let go."""
    if signals is None:
        return None
    values = signals.channels[place]
    return signals.since(held_samples(signals.dt * np.arange(len(values)), [values]))


def chain_hanging_at(
    survey: Survey, best: Candidate, inputs: list[str], maps: Mapping[str, ColumnMap]
) -> ChainZero | None:
    """Where the first of two links hangs; None of any other machine, and where no gravity shows.

    Of angles without a unit that is stated, ``maps`` say how many of theirs are a rad.
    """
    places = [best.columns[n] for n in best.table.places if n in best.columns]
    are_links = len(places) == 2 and all(best.table.units[n] == "rad" for n in best.table.places)
    if not are_links or best.table.range_channel:
        return None
    factors = {_guessed_factor(p, maps.get(n)) for n, p in zip(best.table.places, places, strict=True)}
    return chain_zero(survey.longest_with(*places), places, inputs, 1.0 / factors.pop()) if len(factors) == 1 else None


def _guessed_factor(column: str, read_as: ColumnMap | None) -> float:
    """Factor that brings a surveyed column to the unit of SI: a stated unit is in its values already."""
    if stated_unit(column) or read_as is None:
        return 1.0
    return abs(read_as.scale) * UNIT_CONVERSIONS[read_as.unit or "rad"][1]


def looks_like_degrees(survey: Survey, place: str) -> bool:
    """True of a position that states no unit and is an angle in degrees by what gravity does to it."""
    states = survey.base_of(place) == "m" or stated_unit(place)
    signals, inputs = survey.longest_with(place), survey.of_role("input")
    return not states and bool(is_in_degrees(survey.values[place], signals, place, inputs))


def guess_sentence(name: str, column: str, reason: str) -> str:
    """What is said of a column that is read by a guess."""
    return f"{column} is read as {name} by a guess: {reason}."


def offset_sentence(
    best: Candidate, maps: Mapping[str, ColumnMap], zero: float | None, offset: float, turned: Collection[str]
) -> list[str]:
    """What is said of an angle that does not hang at 0, and of those that are ``turned`` with it."""
    if not offset or zero is None:
        return []
    name = best.table.places[0]
    column = maps[name].column if name in maps else name
    where = {
        math.pi: f"near {'-' if zero < 0 else ''}π: it is measured from upright",
        math.pi / 2: "a quarter turn from 0: it is measured from level",
    }.get(abs(offset), "and not at 0")
    too = "" if len(turned) < 2 else f" That of {' and '.join([*turned][1:])} is the same: it is measured as the first."
    return [f"{column} hangs at {zero:.4g} rad, {where}; {name} is 0 hanging down, hence the offset.{too}"]


def column_maps(best: Candidate, survey: Survey, unit: str) -> dict[str, ColumnMap]:
    """Maps of the quantities that the file has under other names or in other units."""
    maps = {}
    for name, column in best.columns.items():
        own = unit if name in best.table.inputs else best.table.units[name]
        stated = unit_within(own, column)
        if name != column or stated not in ("", own):
            maps[name] = ColumnMap(column, stated if stated != own else "")
    if survey.clock.column != "t" or survey.clock.unit not in ("", "s"):
        maps["t"] = replace(survey.clock, unit=survey.clock.unit if survey.clock.unit != "s" else "")
    references = [r for r in survey.of_role("reference") if best.table.reference]
    references.sort(key=lambda r: not survey.column(r).of)
    if references and best.table.reference not in references:
        maps[best.table.reference] = ColumnMap(references[0])
    return maps


def summed_speed(survey: Survey, best: Candidate, maps: Mapping[str, ColumnMap]) -> dict[str, ColumnMap]:
    """The map of the place that a speed was summed to: the speed, with its unit, or as that of the place."""
    (name,) = (n for n, c in best.columns.items() if c == SUMMED_PLACE)
    own, stated = speed_unit(best.table.units[name]), stated_unit(survey.speed)
    base, factor = UNIT_CONVERSIONS.get(stated, ("", 1.0))
    unit, factor = (stated, 1.0) if base == own else (own, factor)
    return {name: ColumnMap(survey.speed, unit, scale=factor * (maps[name].scale if name in maps else 1.0))}


def followed_reference(survey: Survey, best: Candidate, maps: Mapping[str, ColumnMap]) -> dict[str, ColumnMap]:
    """The map of a reference in the unit of the position that follows it, where its name states none of its own."""
    name = best.table.reference
    if not name or name not in maps or stated_unit(maps[name].column):
        return {}
    of = survey.column(maps[name].column).of
    followed = next((m for n, m in maps.items() if n != name and m.column == of), None)
    return {name: replace(followed, column=maps[name].column)} if followed else {}


def no_plant_text(survey: Survey, plant: str) -> str:
    """The message that no plant, or not the one named, has a file's columns."""
    places_found = survey.of_role("position")
    inputs, places = (count(len(survey.of_role(r)), r) for r in ("input", "position"))
    taken = ", ".join(f"{c.name} is {c.words}" for c in survey.columns)
    if places_found:
        what = f"the plant {plant} must have other columns than" if plant else "no plant has"
        what += f" {places} and {inputs}"
    else:
        what = f"{f'the plant {plant}' if plant else 'every plant'} has a position, and no column is one ({inputs})"
    further = [c.name for c in survey.columns if c.role == "further"]
    speeds = [n for n in further if is_no_place(n) and not is_acceleration(n)]
    integrate = (
        f" A speed ({', '.join(speeds)}) is no position: log what the encoder counts, or the speed summed over time."
        if speeds and not places_found
        else ""
    )
    left = left_over(survey, places_found + survey.of_role("rate") + survey.of_role("input"))
    rest = f" Not recognised: {', '.join(left)}." if left else ""
    unread = "".join(f" {c.remark}" for c in survey.columns if c.role == "unread")
    return f"{survey.file}: {what}; by their names and what they do, {taken}.{unread}{integrate}{rest}" + (
        "" if plant or not (places_found or survey.may_hold_place) else plant_advice(survey, left)
    )


def plant_advice(survey: Survey, left: list[str]) -> str:
    """How to start with a plant that one knows, with a line that says what a column is."""
    file, places = survey.file, survey.of_role("position")
    needs_input = bool(places) and not survey.of_role("input")
    able = [n for n in left if (may_be_input(n) if needs_input else not is_no_place(n))]
    able.sort(key=lambda n: needs_input or not (is_called_place(n) or n.lower() in PLACE_LETTERS))
    first = next(iter(able), "...") if needs_input or not places else places[-1]
    turns = first in survey.values and (survey.base_of(first) == "rad" or looks_like_degrees(survey, first))
    name = "v_in" if needs_input else "theta_1" if first != "..." and turns else "x"
    unit = stated_unit(first) or ("deg" if first in places and looks_like_degrees(survey, first) else "")
    if first == SUMMED_PLACE:
        name = "x" if survey.base_of(first) == "m" else "theta_m"
        first, unit = survey.speed, stated_unit(survey.speed) or speed_unit("m" if name == "x" else "rad")
        places = [first]
    entry = f'{{ column = "{first}", unit = "{unit}" }}' if unit and first in places else f'{{ column = "{first}" }}'
    return (
        f" If you know the plant ({', '.join(plants.KNOWN_PLANTS)}), `wheelpend new FOLDER --from {file} --plant NAME` "
        "writes a model.toml with what fits; under its [columns] a line says what another column is:\n\n"
        f"{name} = {entry}"
    )


def plants_sentence(found: list[Candidate]) -> str:
    """Which plants fit by the columns."""
    words = list(dict.fromkeys(c.words for c in found))
    others = f" These fit by their columns too: {'; '.join(words[1:])}." if len(words) > 1 else ""
    return f"By its columns this is a log of the plant {words[0]}.{others}"


def controlled_sentence(survey: Survey, best: Candidate) -> list[str]:
    """That a file with a set point is of a machine that a controller drives, where no column is what it commands."""
    called = (c.name for c in survey.columns if contains(c.name, REFERENCE_NAMES))
    goal = next(iter([*survey.of_role("reference"), *called]), "")
    if not goal or best.table.inputs:
        return []
    return [
        f"{goal} is a set point: a controller drives the machine, and no column is what it commands. In a model "
        "that nothing drives its controller stands for gravity: log the command too."
    ]


def role_sentences(survey: Survey, best: Candidate) -> list[str]:
    """What is said of rates, references and constants."""
    found = [f"{c.name} is the derivative of {c.of}. {c.remark}".strip() for c in survey.columns if c.role == "rate"]
    found += [f"{c.name} is the battery beside the duty, by its numbers." for c in survey.columns if c.role == "supply"]
    found += [f"{c.name} comes in steps. {c.remark}" for c in survey.columns if c.role == "position" and c.remark]
    found += [
        f"{c.name} is what {c.of} follows: the reference." for c in survey.columns if c.role == "reference" and c.of
    ]
    used = [*best.columns.values()]
    found += [
        c.remark or f"{c.name} is none of its channels, and is ignored."
        for c in survey.columns
        if c.role == "further" and c.name not in used
    ]
    found += [c.remark for c in survey.columns if c.role in ("counter", "copy", "unread")]
    found += [f"{c.name} {constant_words(c, best)}" for c in survey.columns if c.role == "constant"]
    return found + [f"{n} = {v:.6g} is a constant beside the columns." for n, v in survey.scalars.items()]


def constant_words(column: FileColumn, best: Candidate) -> str:
    """What is said of a column that never changes, after its name."""
    known = next((n for n, c in best.columns.items() if c == column.name), "")
    if math.isnan(column.minimum):
        return "has no values at all: " + ("it must be measured." if known else "it is not connected, or not logged.")
    dead = ": this sensor is dead, or is not connected" if known in best.table.channels else ""
    return f"is {column.minimum:g} throughout{dead}."


def count(number: int, what: str) -> str:
    """A number of things."""
    return f"{number or 'no'} {what}{'' if number == 1 else 's'}"


def model_text(
    best: Candidate,
    maps: Mapping[str, ColumnMap],
    unit: str,
    offsets: Mapping[str, float],
    comments: Mapping[str, str],
) -> str:
    """The text of a model.toml with the columns of a file, and comments on some of its entries."""
    own = best.table.units[best.table.inputs[0]] if best.table.inputs else ""
    tables: dict[str, Any] = {"assumptions": dict(best.assumptions), "input": {"unit": unit} if unit != own else {}}
    tables["columns"] = {n: map_entry(m) for n, m in maps.items()}
    for name, offset in offsets.items():
        tables["columns"].setdefault(name, {"column": best.columns[name]})["offset"] = offset
    return toml_text(best.plant, tables, comments)


def map_entry(entry: ColumnMap) -> dict[str, Any]:
    """A column map as a table of [columns]."""
    stated = {"unit": entry.unit} if entry.unit else {}
    scale = {"scale": entry.scale} if entry.scale != 1.0 else {}
    return {"column": entry.column} | stated | scale | ({"times": entry.times} if entry.times else {})


def toml_text(plant: str, tables: Mapping[str, Any], comments: Mapping[str, str]) -> str:
    """Plant and tables as the text of a model.toml; tables within [columns] stand on a line each.

    Those of ``comments`` have one behind them.
    """
    lines = [f'plant = "{plant}"']
    for name, entries in tables.items():
        flat = {k: v for k, v in entries.items() if not isinstance(v, dict) or name == "columns"}
        why = {k: f"  # {comments[k]}" for k in flat if name in COMMENTED_SECTIONS and k in comments}
        lines += ["", f"[{name}]"] * bool(flat) + [f"{k} = {inline(v)}{why.get(k, '')}" for k, v in flat.items()]
        for key, entry in entries.items():
            if key not in flat:
                lines += ["", f"[{name}.{key}]", *(f"{k} = {toml_value(v)}" for k, v in entry.items())]
    return "".join(f"{line}\n" for line in lines)


def inline(value: Any) -> str:
    """A value, or an inline table of values."""
    if not isinstance(value, dict):
        return toml_value(value)
    return "{ " + ", ".join(f"{k} = {toml_value(v)}" for k, v in value.items()) + " }"


def with_cures(text: str, *cures: str, guesses: Mapping[str, str] | None = None) -> str:
    """The text of a model.toml with the sections of others in it, key by key, and why some columns are guessed."""
    found = tomllib.loads(text)
    plant = found.pop("plant")
    for cure in cures:
        for section, entries in tomllib.loads(cure).items():
            known = found.setdefault(section, {})
            for key, entry in entries.items():
                known[key] = {**known.get(key, {}), **entry} if isinstance(entry, dict) else entry
    return toml_text(plant, found, guess_comments(guesses or {}))
