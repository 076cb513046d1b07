"""What the name of a file's column says of it: the unit that it ends with, and the words of the field in it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from wheelpend.logs.columns import INPUT_ALIASES, INPUT_NAME_UNITS
from wheelpend.logs.units import UNIT_CONVERSIONS, stated_unit, unit_base, without_unit, words_of

REFERENCE_NAMES = ("ref", "goal", "desired", "target", "setpoint")
RATE_NAMES = ("vel", "rate", "gyro", "omega", "dtheta", "speed", "dpos", "dot", "rpm", "tach")
ACCELERATION_NAMES = ("accel", "accl", "ddot", "ddtheta", "ddq")
AXIS_ACCELERATION, AXIS_RATE = re.compile(r"a(cc)?_?[xyz]"), re.compile(r"g(yr)?_?[xyz]")  # of an IMU: ax, gyr_z
MAGNITUDE_NAMES = ("absolute", "magnitude", "norm")  # of three axes together, which has no direction
NO_READINGS = ("err", "error", "cmd", "sp", "set", "des", "pid", "out", "integral")  # words of what a controller makes
TOLD_WORDS = frozenset(("cmd", "command", "commanded", "ctrl", "control"))
ERROR_NAMES = ("err", "deviation")  # what a controller makes of a reading
TORQUE_NAMES = ("tau", "trq", "torque")
SENSOR_NAMES = ("enc", "pos", "angle", "tick", "count", "theta", "temp")  # what is read at a motor, not told to it
BODY_SENSORS = ("gyro", "imu")
BODY_ANGLES, WHEEL_WORDS = ("pitch", "tilt"), ("wheel", "motor")  # of what balances, and of what it balances on
ANGLE_NAMES = ("angle", "theta", "phi", "pitch", "tilt", "angul", "angol", "winkel")  # es, pt, it, de too
CLOCK_NAMES = ("time", "stamp", "micros", "millis")  # beginnings of words
SECOND_NAMES = ("sec", "secs", "seconds", "msec", "usec", "nsec", "nsecs")  # whole words: no section, no second_q
CLOCK_WORDS = ("tempo", "tiempo", "temps", "zeit")  # the same in other languages, as a whole name: tempo_c is warm
COUNT_NAMES = ("enc", "tick", "count", "pulse")
INCREMENT_NAMES = ("delta", "incr")  # what was counted since the row before
SUPPLY_NAMES = ("bat", "supply", "vcc", "vdd", "bus")  # volts and amperes that command nothing
LEFT_OF_RIGHT = {"right": "left", "r": "l"}
WHEEL_NAMES = ("wheel", "motor", "enc", "tick", "count", "pulse", "pwm", "duty")
DUTY_NAMES = ("duty", "pwm")
PID_COMMAND, PID_OTHERS = "Output", ("Setpoint", "Input")  # of Arduino's PID block; in small letters a machine's own
TERM_NAME = re.compile(r"[PID]|[pid][ _]?(term|part|out)|prop(ortional)?|integral|deriv(ative)?")  # of a sum
CURRENT_WORD = "iq"  # of a motor, in the frame of its rotor
NUMBER_OR_SIDE = re.compile(r"(\d+|_[lr]|_left|_right)$")  # u1, u_L: of one of several
EFFORT_NAMES = (
    *TORQUE_NAMES,
    "volt",
    "current",
    "pwm",
    "duty",
    "effort",
    "esfor",
    "esfuerz",
    "tensao",
    "voltaj",
    "spannung",
)  # es, pt, de
SHORT_INPUT_NAMES = ("v", "cmd", "ctrl", "motor", "effort")  # inputs where no column is called one outright
VOLTAGE_NAMES = ("v", "vm", "v_m", "va", "v_a", "vin")  # of a motor, where no other column is called an input
INPUT_WORDS = (*INPUT_ALIASES, *TORQUE_NAMES, "v_in")
INPUT_UNITS = {"N m": TORQUE_NAMES, "A": ("current", "amp"), "N": ("force",), "V": ("v_in", "volt", "vir")}
KIND_OF_UNIT = {"rad": "position", "m": "position", "rad/s": "rate", "m/s": "rate",
                "V": "input", "A": "input", "N m": "input", "N": "input"}  # fmt: skip


def contains(name: str, words: Sequence[str]) -> bool:
    """True of a name that is one of the words, of a number or a side too, or has one of more than two letters in it."""
    low = name.lower()
    return any(NUMBER_OR_SIDE.sub("", low) == w or (len(w) > 2 and w in low) for w in words)


def has_word(name: str, words: Sequence[str]) -> bool:
    """True of a name one of whose words begins with one of these: encoders, but not calibrated for a rate."""
    return any(w.startswith(tuple(words)) for w in words_of(name))


def stated_base(name: str) -> str:
    """The unit of SI that the unit in a column's name becomes; nothing of a name without one."""
    return unit_base(stated_unit(name))


def stated_factor(name: str) -> float:
    """Factor that brings a column to the unit of SI, by its name; 1 where that states none."""
    unit = stated_unit(name)
    return UNIT_CONVERSIONS[unit][1] if unit else 1.0


def unit_within(own: str, name: str) -> str:
    """The unit that a column's name states, of those that turn into a quantity's own; nothing of any other."""
    return stated_unit(name) if stated_base(name) == own else ""


def kind_by_name(name: str) -> str:
    """What a column can only be by the unit in its name: position, rate or input; nothing where none is stated."""
    return KIND_OF_UNIT.get(stated_base(name), "")


def may_be_input(name: str) -> bool:
    """False of a column that is a place, a rate or a time by its unit or its words."""
    called = has_word(name, (*ANGLE_NAMES, *RATE_NAMES, *COUNT_NAMES))
    return kind_by_name(name) in ("", "input") and not called and not is_called_time(name)


def may_be_sensor(name: str) -> bool:
    """False of a column that is a voltage, a current, a force or a time by its unit, or a supply by its words."""
    kind = kind_by_name(name)
    return kind in ("position", "rate") or (not kind and not contains(name, SUPPLY_NAMES) and not is_called_time(name))


def is_called_clock(name: str) -> bool:
    """True of a column that is a time by its words and not another quantity by its unit: t, time_ms, TimeStamp."""
    bare, words = without_unit(name).strip(" _"), words_of(name)
    called = bare == "t" or bare.lower() in CLOCK_WORDS or has_word(name, CLOCK_NAMES)
    called = called or any(w.endswith("time") or w in SECOND_NAMES for w in words)
    return called and stated_base(name) in ("", "s")


def is_called_time(name: str) -> bool:
    """True of a column that is a time by its words, or by a unit of more than one letter."""
    return is_called_clock(name) or stated_unit(name) in ("ms", "us", "ns")


def is_called_rate(name: str) -> bool:
    """True of a column that is a rate by its unit or by its words, though the unit be that of its place: x_dot_cm."""
    kind = kind_by_name(name)
    if kind == "position":
        return has_word(name, RATE_NAMES)
    return kind == "rate" if kind else contains(name, RATE_NAMES) or is_gyro_axis(name)


def is_gyro_axis(name: str) -> bool:
    """True of a column that is called after one axis of a gyro: gz, gyr_x."""
    return bool(AXIS_RATE.fullmatch(without_unit(name).strip().lower()))


def is_acceleration(name: str) -> bool:
    """True of a column that is called an acceleration."""
    by_axis = AXIS_ACCELERATION.fullmatch(without_unit(name).strip().lower())
    return bool(by_axis) or has_word(name, ACCELERATION_NAMES) or "acc" in words_of(name)


def is_called_angle(name: str) -> bool:
    """True of a column that is called an angle that is read: no set point, no error and no acceleration of one."""
    controls = contains(name, REFERENCE_NAMES) or any(w in NO_READINGS for w in words_of(name))
    return has_word(name, ANGLE_NAMES) and not controls and not is_acceleration(name)


def is_of_gyro(name: str) -> bool:
    """True of a column that is called after a body's gyro."""
    return has_word(name, BODY_SENSORS) or is_gyro_axis(name)


def is_no_place(name: str) -> bool:
    """True of a speed by its unit or by one of its words, and of an acceleration: no position, whatever it does."""
    kind = kind_by_name(name)
    called = has_word(name, RATE_NAMES) or is_acceleration(name) or is_gyro_axis(name)
    return kind == "rate" or (called and kind != "input") or (not kind and name.lower() in SHORT_INPUT_NAMES)


def are_body_and_wheel(place: str, rate: str) -> bool:
    """True of a place that is called after what balances, and a rate after what it balances on."""
    return is_of_body(place) and has_word(rate, WHEEL_WORDS)


def is_of_body(name: str) -> bool:
    """True of a column that is called after what balances."""
    return has_word(name, BODY_ANGLES)


def are_wheel_and_gyro(place: str, rate: str) -> bool:
    """True of a place that is called after a wheel or its encoder, and a rate after a gyro: that is the body's."""
    return has_word(place, WHEEL_NAMES) and has_word(rate, BODY_SENSORS)


def is_of_joint_states(name: str) -> bool:
    """True of a column from a message of joints in ROS, whose angles are in rad (REP 103)."""
    return "joint_state" in name.lower() or "jointstate" in name.lower()


def left_name(name: str) -> tuple[str, ...]:
    """The words that the left wheel's column has, of a name after a right one; nothing of any other.

    A single r stands for right beside what a wheel has alone: x_r and joint_r are no wheels.
    """
    words = words_of(name)
    sided = "right" in words or ("r" in words and has_word(name, WHEEL_NAMES))
    return tuple(LEFT_OF_RIGHT.get(w, w) for w in words) if sided else ()


def is_of_wheel(name: str) -> bool:
    """True of a column that is called after an encoder, or counts on one side: no clock, however evenly it grows."""
    words = words_of(name)
    sided = any(w in words for w in ("left", "right")) and has_word(name, COUNT_NAMES)
    return not is_called_clock(name) and (sided or has_word(name, ("enc",)))


def is_counting(name: str) -> bool:
    """True of a column that is called after counts, and in no unit."""
    return not stated_unit(name) and has_word(name, COUNT_NAMES)


def is_increment(name: str) -> bool:
    """True of a column that is called what was counted since the row before, and in no unit."""
    return not stated_unit(name) and has_word(name, INCREMENT_NAMES)


def is_of_current(name: str) -> bool:
    """True of a column that is called after a motor's current in the frame of its rotor: Iq_measured."""
    return CURRENT_WORD in words_of(name)


def controller_terms(names: Sequence[str]) -> list[str]:
    """Columns that are the terms of a controller: two or more called P, I or D beside a set point or an error."""
    terms = [n for n in names if TERM_NAME.fullmatch(n.strip())]
    controlled = any(contains(n, REFERENCE_NAMES) or has_word(n, ERROR_NAMES) for n in names)
    return terms if controlled and len(terms) > 1 else []


def inputs_among(names: Sequence[str]) -> list[str]:
    """The columns that are inputs: by their words, or else by a unit of volts, amperes, newtons or newton metres."""
    if set(names) >= {PID_COMMAND, *PID_OTHERS}:  # what it reads is called its input
        return [PID_COMMAND]
    terms = controller_terms(names)
    open_names = [
        n for n in names if n not in terms and kind_by_name(n) in ("", "input") and not contains(n, REFERENCE_NAMES)
    ]
    open_names = [n for n in open_names if not is_read_at_motor(n) and not has_word(n, ERROR_NAMES)]
    called = [n for n in open_names if any(contains(w, INPUT_WORDS) for w in (n, without_unit(n))) or is_of_current(n)]
    stated = [n for n in open_names if kind_by_name(n) == "input"]
    return [n for n in called or stated if not contains(n, SUPPLY_NAMES)]


def is_likely_input(name: str) -> bool:
    """True of a column that is the input where no other is called so: a short name, or a command in its words.

    A torque or voltage that is a target is told to the motor, where a target angle is what a controller follows.
    """
    if is_read_at_motor(name) or contains(name, SUPPLY_NAMES) or has_word(name, ERROR_NAMES):
        return False
    words = words_of(name)
    if len(words) > 1 and words[-1] == "load" and not has_word(name, ANGLE_NAMES):  # what a servo reports of its motor
        return True
    return (
        name.lower() in VOLTAGE_NAMES
        or contains(name, ("cmd", "motor", "ctrl"))
        or words[-1:] == ["control"]
        or has_word(name, EFFORT_NAMES)
    )


def is_magnitude(name: str) -> bool:
    """True of a column that is called the size of a vector."""
    return has_word(name, MAGNITUDE_NAMES) or "abs" in words_of(name)


def is_command(name: str) -> bool:
    """True of a column that is called an input, or is one where no other is called so."""
    return bool(inputs_among([name])) or is_likely_input(name)


def is_told(name: str) -> bool:
    """True of a column that one of its words calls a command, and none a place: no sensor reads it."""
    return not TOLD_WORDS.isdisjoint(words_of(name)) and not has_word(name, (*ANGLE_NAMES, *SENSOR_NAMES))


def is_read_at_motor(name: str) -> bool:
    """True of a column that is called after a motor, but for what is measured there: its encoder, its speed."""
    return "motor" in words_of(name) and has_word(name, (*SENSOR_NAMES, *RATE_NAMES))


def input_unit(names: Sequence[str]) -> str:
    """Unit of inputs by their names: the one stated, the one their words suggest, or V where nothing tells."""
    for name in names:
        if (base := stated_base(name)) in INPUT_UNITS:
            return base
    for unit, words in INPUT_UNITS.items():
        if any(contains(n, words) or (unit == "A" and is_of_current(n)) for n in names):
            return unit
    return "V"


def suggested_input_base(name: str) -> str:
    """Unit of SI of an input that its name states or suggests; nothing where it tells nothing."""
    by_word = next((u for word, u in INPUT_NAME_UNITS.items() if word in name.lower()), "")
    return stated_base(name) or by_word or ("A" if is_of_current(name) else "")
