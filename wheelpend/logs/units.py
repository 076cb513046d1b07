"""Units: those that are known, how files spell them, and which one a column's name ends with."""

from __future__ import annotations

import math
import re
import unicodedata

UNIT_CONVERSIONS = {  # unit: (the unit it becomes, factor)
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "deg": ("rad", math.pi / 180),
    "rev": ("rad", 2 * math.pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
    "rev/s": ("rad/s", 2 * math.pi),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "m/s": ("m/s", 1.0),
    "cm/s": ("m/s", 1e-2),
    "mm/s": ("m/s", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "N m": ("N m", 1.0),
    "N cm": ("N m", 1e-2),
    "mN m": ("N m", 1e-3),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "kN": ("N", 1e3),
}
UNIT_SPELLINGS = {  # of a whole unit, in symbols
    "°": "deg", "º": "deg", "°/s": "deg/s", "º/s": "deg/s", "dps": "deg/s", "rps": "rev/s", "rev/min": "rpm",
    "r/min": "rpm", "1/min": "rpm", "µs": "us", "μs": "us", "µm": "um", "μm": "um", "turns": "rev", "turn": "rev",
}  # fmt: skip
WRITTEN_OUT = {  # words of a unit, in plural too
    "second": "s", "sec": "s", "millisecond": "ms", "msec": "ms", "milli": "ms", "microsecond": "us", "usec": "us",
    "micro": "us", "radian": "rad", "degree": "deg", "revolution": "rev", "minute": "min", "meter": "m", "metre": "m",
    "centimeter": "cm", "centimetre": "cm", "millimeter": "mm", "millimetre": "mm", "volt": "V", "millivolt": "mV",
    "amp": "A", "ampere": "A", "milliamp": "mA", "newton": "N",
    "degre": "deg", "grado": "deg", "grau": "deg", "grad": "deg", "seconde": "s", "segundo": "s", "sekunde": "s",
    "sekunden": "s", "metro": "m",  # fr, es, pt, de
}  # fmt: skip
UNIT_WORDS = re.compile(
    r"(m?rad|deg|[°º]|rev|rpm|dps|rps|[mµμun]?s|[cmµμuk]?m|m?V|m?A|[mk]?N([ .*-]?[·⋅]?c?m)?|-|1|%|count|counts|raw)"
    r"(/s²?|/s\^2|/min)?"
)
UNKNOWN_UNIT = re.compile(  # what can be nothing else, though no conversion is known here
    r"((m|k|M|µ|u|c|d)?(N|g|m|V|A|W|Hz|s|rad|bar|Pa)|kp|kgf?|gf?|lbf?|ozf?|in|inch|ft|yd|mph|rpm|rev|deg|°|h|min)"
    r"([ .*·⋅/^²]+(m?g|c?m|s|in|ft|rad|min|h|V|A|2))*"
)
SAID_UNIT = re.compile(r"\bin (\S+( c?m)?)\s*$", re.IGNORECASE)  # Angle in deg, Torque in N m
BRACKETED_TEXT = re.compile(r"\[.*\]|\(.*\)")
ENDING_IN_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")
NAME_SPELLINGS = {"deg/s": ("dps", "deg_s", "deg_per_s", "deg_per_sec"), "rad/s": ("rad_s", "rad_per_s", "rad_per_sec"),
                  "rev/s": ("rps", "rev_per_s"), "m/s": ("m_s", "m_per_s", "mps"), "cm/s": ("cm_s", "cm_per_s"),
                  "mm/s": ("mm_s", "mm_per_s"), "rev": ("turns", "rev"), "deg": ("degrees", "deg"), "ms": ("millis",),
                  "us": ("micros",)}  # fmt: skip
QUANTITY_WORDS = {  # beginnings of words that a unit of one letter must not contradict: theta_m is no length
    "rad": ("angle", "theta", "phi", "pitch", "tilt"), "rad/s": ("omega", "speed", "vel", "gyro", "dtheta"),
    "N m": ("tau", "torque"), "V": ("volt",), "A": ("current", "curr"), "N": ("force",),
}  # fmt: skip
QUANTITY_LETTERS = {"v": "V", "u": "V", "i": "A", "w": "rad/s"}  # as a whole word: V_m is no length either


def unit_base(unit: str) -> str:
    """The unit of ours that one turns into; nothing of one that we do not know."""
    return UNIT_CONVERSIONS.get(unit, ("", 1.0))[0]


def speed_unit(place: str) -> str:
    """The unit of the speed of a place in rad or m."""
    return f"{place}/s"


def words_of(name: str) -> list[str]:
    """The words of a name in small letters without accents: motor, encoder and l of MotorEncoder_L."""
    return [w.lower() for w in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", without_accents(name))]


def without_accents(text: str) -> str:
    """A text whose letters are those of English: angulo for ángulo."""
    return "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))


def is_unit(cell: str) -> bool:
    """True of what may stand in a row of units: a unit, something in brackets, nothing."""
    return not cell or bool(BRACKETED_TEXT.fullmatch(cell) or UNIT_WORDS.fullmatch(as_symbols(cell)))


def as_symbols(unit: str) -> str:
    """A unit with symbols in place of words: deg/s for degrees/second."""
    parts = re.split(r"( per |/|²|\^2)", unit)
    symbols = (WRITTEN_OUT.get(without_accents(word).strip().lower().removesuffix("s"), word) for word in parts)
    return "".join(symbols).replace(" per ", "/")


def plain_unit(cell: str) -> str:
    """A unit without brackets, in our spelling; nothing for a plain number, or what is no unit."""
    if not is_unit(cell):
        return ""
    unit = as_symbols((cell[1:-1] if BRACKETED_TEXT.fullmatch(cell) else cell).strip())
    return known_spelling(unit) or ("" if unit in ("-", "1") else unit)


def known_spelling(unit: str) -> str:
    """The known unit that is meant by one in symbols, whatever stands between its factors; nothing of any other."""
    if unit in UNIT_CONVERSIONS:
        return unit
    together = re.sub(r"[ .*·⋅-]", "", unit)
    alike = (u for u in UNIT_CONVERSIONS if u.replace(" ", "") == together)
    capital = (u for u in UNIT_CONVERSIONS if len(u) > 1 and u.lower() == unit.lower())  # RPM, Deg
    return UNIT_SPELLINGS.get(unit.lower(), "") or next(alike, "") or next(capital, "")


def unit_in_brackets(name: str) -> str | None:
    """What a column's name has in brackets at its end, in symbols, known or not; None of one without."""
    found = ENDING_IN_BRACKETS.search(name)
    return as_symbols(found[1].strip()) if found else None


def stated_unit(name: str) -> str:
    """The unit that a column's name ends with, or is, in any of the field's spellings; nothing of one that states none.

    What stands in brackets alone counts where there are some, and else what comes after "in". A unit of a single letter
    counts in its own case only, and where no word contradicts it: x_a and x_n are no amperes and no newtons, theta_m is
    no metres. Nor does one after a space, where "in" does not say so: phase A is no ampere.
    """
    within = unit_in_brackets(name)
    if within is not None:
        return known_spelling(within)
    if (said := SAID_UNIT.search(name)) and (unit := known_spelling(said[1])):
        return unit
    ending, found = f"_{name.rstrip(' _')}", {}
    for unit in UNIT_CONVERSIONS:
        for spelling in {unit, unit.replace(" ", ""), unit.replace(" ", "_"), *NAME_SPELLINGS.get(unit, ())}:
            single = len(spelling) == 1  # a whole name of one letter is no unit
            written, meant = (ending[1:], spelling) if single else (ending.lower(), spelling.lower())
            spaced = not single and f" {name}".endswith(f" {spelling}") and not name.endswith(f"per {spelling}")
            if (spaced or written.endswith(f"_{meant}")) and not (single and contradicts(unit, name)):
                found[spelling] = unit
    return found[max(found, key=len)] if found else ""


def contradicts(unit: str, name: str) -> bool:
    """True of a unit of one letter at the end of a name whose words are those of other quantities."""
    words = words_of(name)[:-1]
    told = {base for base, beginnings in QUANTITY_WORDS.items() if any(w.startswith(beginnings) for w in words)}
    told |= {QUANTITY_LETTERS[w] for w in words if w in QUANTITY_LETTERS}
    return bool(told) and unit_base(unit) not in told


def unknown_unit(name: str) -> str:
    """The unit in brackets at the end of a column's name that has no conversion here; nothing where none is there."""
    within = unit_in_brackets(name) or ""
    return within if within and not stated_unit(name) and UNKNOWN_UNIT.fullmatch(within) else ""


def unit_ending(own: str, column: str) -> str:
    """The unit that a column's name ends with, of those that turn into a quantity's own; nothing without one."""
    unit = stated_unit(column)
    return unit if unit_base(unit) == own else ""


def without_unit(name: str) -> str:
    """A name without the unit that it ends with: u of u_mV, Angle of Angle in deg."""
    if not stated_unit(name):
        return name
    if unit_in_brackets(name) is not None:
        return re.sub(r"[_\[( ]+[^_\[(]*$", "", name)
    return re.sub(r"( +in)?[_ ]+(N c?m|[^_ ]*)$", "", name)
