"""What columns of a file are: input, position, its rate, a reference; by their names, then by what they do."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np
from scipy.ndimage import median_filter

from wheelpend.inspection.column_names import (
    ANGLE_NAMES,
    BODY_SENSORS,
    DUTY_NAMES,
    ERROR_NAMES,
    REFERENCE_NAMES,
    SENSOR_NAMES,
    are_body_and_wheel,
    are_wheel_and_gyro,
    contains,
    controller_terms,
    has_word,
    inputs_among,
    is_called_angle,
    is_called_rate,
    is_command,
    is_likely_input,
    is_no_place,
    is_of_body,
    is_of_current,
    is_told,
    kind_by_name,
    left_name,
    may_be_sensor,
    stated_base,
    suggested_input_base,
)
from wheelpend.inspection.file_values import MAX_STEP_SHARE
from wheelpend.inspection.kinematics import ANGLE_SCALES, RatePair, rate_misfit, sum_misfit
from wheelpend.inspection.raw_units import full_scale, is_followed, states_volts
from wheelpend.inspection.signals import MAX_SWAPPED_MISFIT_SHARE, Signals
from wheelpend.inspection.unnamed_columns import is_battery, nameless_command, unnamed_command
from wheelpend.logs.checks import starts_at_rest
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.outliers import MAX_SPIKE_SAMPLES, MAX_SPIKE_SHARE
from wheelpend.logs.units import words_of
from wheelpend.logs.white_noise import difference_noise

COMMAND_WORDS = ("cmd", "command", "set", "ref", "target", "desired")  # of a current that is told, not measured
MAX_FOLLOWING_SHARE = 0.05  # of a position's variance, by which another one that it follows differs at most
MIN_NAMED_RATE_SHARE = 0.3  # unexplained, up to which a column that is called a rate is that of a position
MAX_ALIKE_RATIO, MAX_ALIKE_MISFIT = 2.0, 0.01  # of misfits, up to which names tell which place a rate is of
MAX_SUM_MISFIT_SHARE = 0.02  # of a place's variance about a line, that the sum of its rate leaves
MIN_PLACES = 10  # different readings of a place
MIN_GOAL_CORRELATION = 0.7  # of a place and the command that it goes to
MAX_LEAD_SAMPLES = 60  # by which a reference is looked for ahead of the position that follows it
MIN_LEAD_SHARE = 4  # parts of a log, of which a lead is one at most: the rest shows it
MAX_COPY_ROUGHNESS = 0.5  # of a signal's noise, which a filtered copy of it has at most


def right_sides(roles: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Columns of the right wheel of two, with a sentence: the left one is looked at alone.

    They are all that moves, or a body that balances on them beside. Not where only the right one's command is logged,
    or something that may be read at the body and is no place.
    """
    lefts = {(tuple(words_of(n)), role): n for n, (role, _) in roles.items()}
    found = {n: lefts[key] for n, (role, _) in roles.items() if (key := (left_name(n), role)) in lefts and key[0]}
    places = [n for n, (role, _) in roles.items() if role == "position"]
    of_body = [n for n, (role, _) in roles.items() if role == "further" and has_word(n, (*ANGLE_NAMES, *BODY_SENSORS))]
    alone = [n for n, (role, _) in roles.items() if role == "input" and n not in found and left_name(n)]
    wheels = [n for n in places if n in found or n in found.values()]
    body = len(places) - len(wheels)
    if len(wheels) != 2 or body > 1 or (of_body and not body) or alone:
        return {}
    mean = " Where the robot turns, log the mean of both." if body else ""
    said = {n: f"{n} is the other wheel's {left}: one wheel is looked at alone.{mean}" for n, left in found.items()}
    rates = {n: of for n, (role, of) in roles.items() if role == "rate" and of in found and n not in found}
    return said | {n: f"{n} is the rate of {of}, the other wheel's." for n, of in rates.items()}


def currents_beside(roles: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Currents of one motor whose voltage or duty is logged too, with a sentence: what is told to it drives it."""
    inputs = [n for n, (role, _) in roles.items() if role == "input"]
    currents = [n for n in inputs if suggested_input_base(n) == "A" and not has_word(n, COMMAND_WORDS)]
    told = [n for n in inputs if suggested_input_base(n) == "V" or has_word(n, DUTY_NAMES)]
    if not currents or len(told) != 1 or [role for role, _ in roles.values()].count("position") != 1:
        return {}
    return {n: f"{n} is measured beside {told[0]}, which drives: it is left. Map it as the input in its place if it is "
               "what the driver was told." for n in currents}  # fmt: skip


def held_inputs(
    values: dict[str, np.ndarray], moving: dict[str, np.ndarray], roles: dict[str, tuple[str, str]]
) -> dict[str, tuple[str, str]]:
    """Commands that are constant and not zero, where no other acts and the machine begins at rest: steps.

    Beside a constant voltage a current that has its sign throughout, and is less the faster the machine goes, is what
    the motor draws, and no command.
    """
    places = [n for n, (role, _) in roles.items() if role == "position"]
    inputs = [n for n, (role, _) in roles.items() if role == "input"]
    if not places or not all(starts_at_rest(moving[n]) for n in places):
        return {}
    held = [n for n, v in values.items() if np.isfinite(v).all() and v[0] and np.ptp(v) == 0.0]
    if inputs:
        volts = [n for n in inputs_among(held) if suggested_input_base(n) == "V" and n not in roles]
        drawn = all(suggested_input_base(n) == "A" and not has_word(n, COMMAND_WORDS) for n in inputs)
        alike = len(volts) == 1 and all((values[n] * values[volts[0]][0] >= 0.0).all() for n in inputs)
        less = drawn and all(_falls_with(np.abs(values[n]), np.abs(np.gradient(moving[places[0]]))) for n in inputs)
        return dict.fromkeys(volts, ("input", "")) if alike and less else {}
    if all(n.startswith(NAMELESS_PREFIX) for n in values):  # a file without a header
        return dict.fromkeys(held[:1], ("input", ""))
    return dict.fromkeys(inputs_among(held), ("input", ""))


def _falls_with(values: np.ndarray, other: np.ndarray) -> bool:
    """True of a signal (N,) that is rather less where another one is more."""
    known = np.isfinite(values) & np.isfinite(other)
    return bool(known.sum() > 2 and np.cov(values[known], other[known])[0, 1] < 0.0)


def roles_of(
    values: dict[str, np.ndarray], t: np.ndarray, signals: Signals | None, ranges: Sequence[tuple[int, int]]
) -> dict[str, tuple[str, str]]:
    """Role of each column that changes, and of rates and references the position: by names, then by what they do.

    A column that is read too seldom to be among the signals is none of a machine's. What it does is judged within the
    ranges of samples that follow each other without a gap.
    """
    places = [n for n in values if is_place(values[n], ranges)]
    places = places or [n for n in values if is_called_place(n) and len(np.unique(values[n])) >= MIN_PLACES]
    roles: dict[str, tuple[str, str]] = dict.fromkeys(inputs_among(list(values)), ("input", ""))
    seldom = {n for n in values if signals is not None and n not in signals.channels}
    terms = controller_terms(list(values))
    free = [n for n in values if n not in roles and n not in seldom and n not in terms and may_be_sensor(n)]
    free = [n for n in free if not is_of_current(n)]  # the set point of one
    roles |= rates_by_sum(free, values, t) if signals is None else rates_among(free, signals)
    if not any(r == "input" for r, _ in roles.values()):
        roles |= {n: ("input", "") for n in free if is_likely_input(n) and n not in roles}
    roles |= unnamed_roles(free, values, roles, places)
    free = [n for n in free if n not in roles and not is_no_place(n)]
    roles |= references_among(free, values)
    roles |= {n: ("position", "") for n in free if n not in roles and n in places and not is_told(n)}
    roles |= goals_among(values, roles)
    return roles | {n: ("further", "") for n in values if n not in roles}


def unnamed_roles(
    free: list[str], values: dict[str, np.ndarray], roles: dict[str, tuple[str, str]], places: list[str]
) -> dict[str, tuple[str, str]]:
    """The command among columns whose names say nothing, where none is called one, and the battery beside a duty.

    The battery may be called an input, by its volts. One place at least is left: what moves is no command.
    """
    found: dict[str, tuple[str, str]] = {}
    turning = {of for role, of in roles.values() if role == "rate"}
    open_names = [n for n in free if n not in roles]
    if not any(r == "input" for r, _ in roles.values()) and (
        command := unnamed_command([n for n in open_names if n not in turning], values, sensors=free)
    ):
        found[command] = ("input", "")
    elif not any(r == "input" for r, _ in roles.values()):
        unknown = [n for n in open_names if n.startswith(NAMELESS_PREFIX)]
        able = [n for n in unknown if n not in turning and n not in references_among(unknown, values)]
        found |= dict.fromkeys(filter(None, [nameless_command(able, values, unknown)]), ("input", ""))
    inputs = [n for n, (role, _) in (roles | found).items() if role == "input"]
    duties = [n for n in inputs if full_scale(n, values[n][np.isfinite(values[n])]) and not states_volts(n)]
    if duties:
        able = [n for n in values if n not in duties and (n in inputs or n not in roles | found)]
        found |= {n: ("supply", "") for n in able if is_battery(n, values[n])}
    return found if any(n in places for n in open_names if n not in found) else {}


def is_unnamed(name: str) -> bool:
    """True of an input whose name did not say that it is one."""
    return not (is_command(name) or name.startswith(NAMELESS_PREFIX))


def possible_rates(names: list[str]) -> list[tuple[str, str]]:
    """Pairs of columns of which the second may be the rate of the first by what their names state."""
    measured = [n for n in names if not contains(n, REFERENCE_NAMES)]
    places = [n for n in measured if not is_no_place(n)]
    able = [n for n in measured if kind_by_name(n) != "position" and not has_word(n, ERROR_NAMES)]
    has_body = any(is_of_body(n) for n in places)
    return [
        (a, b)
        for a in places
        for b in able
        if a != b and not are_body_and_wheel(a, b) and not (has_body and are_wheel_and_gyro(a, b))
    ]


def rates_by_sum(names: list[str], values: dict[str, np.ndarray], t: np.ndarray) -> dict[str, tuple[str, str]]:
    """Columns that give others when they are summed over the time, with these: of a log too short for derivatives."""
    sizes: dict[bool, tuple[float, ...]] = {False: ANGLE_SCALES, True: ()}  # what is called a rate may have any
    pairs = possible_rates(names)
    misfit = {(a, b): sum_misfit(values[a], values[b], t, sizes[is_called_rate(b)]) for a, b in pairs}
    return with_their_places(misfit, {b: MAX_SUM_MISFIT_SHARE for _, b in pairs})


def rates_among(names: list[str], signals: Signals) -> dict[str, tuple[str, str]]:
    """Columns that are derivatives of others, with these."""
    pairs = possible_rates(names)
    misfit = {(a, b): rate_misfit(signals, RatePair(a, b), own=False) for a, b in pairs}
    limits = {b: MIN_NAMED_RATE_SHARE if is_called_rate(b) else MAX_SWAPPED_MISFIT_SHARE for _, b in pairs}
    misfit |= {(a, b): min(misfit[a, b], rate_misfit(signals, RatePair(a, b), lenient=True)) for a, b in misfit
               if is_called_rate(b) and not is_called_rate(a) and misfit[a, b] >= limits[b]}  # fmt: skip
    return with_their_places(misfit, limits)


def with_their_places(
    misfit: Mapping[tuple[str, str], float], limits: Mapping[str, float]
) -> dict[str, tuple[str, str]]:
    """Rates with the place of each, by the misfit of every place and rate: the least ones below the rate's limit.

    Of places that fit about as well it is the one whose name has most in common: two joints may move alike.
    """
    found: dict[str, tuple[str, str]] = {}
    for a, b in sorted(misfit, key=lambda p: misfit[p]):
        if misfit[a, b] < limits[b] and a not in found and b not in found:
            most = min(limits[b], MAX_ALIKE_RATIO * misfit[a, b] + MAX_ALIKE_MISFIT)
            near = [n for n, rate in misfit if rate == b and n not in found and misfit[n, b] <= most]
            found[b] = ("rate", max(near, key=lambda n: (common_words(n, b), -misfit[n, b])))
    return found


def common_words(one: str, other: str) -> int:
    """How many words and numbers two names have in common."""
    words, others = (set(re.findall(r"[a-z]+|[0-9]+", n.lower())) for n in (one, other))
    return len(words & others)


def references_among(names: list[str], values: dict[str, np.ndarray]) -> dict[str, tuple[str, str]]:
    """Columns that a position follows, called so or ahead of it and smoother; and filtered copies, as further ones."""
    found: dict[str, tuple[str, str]] = {}
    for a, b in permutations(names, 2):
        apart = values[a] - values[b]
        known = np.isfinite(apart)
        close = known.any() and np.mean(apart[known] ** 2) < MAX_FOLLOWING_SHARE * np.nanvar(values[a])
        sides = any(words and words == tuple(words_of(n)) for n, words in ((b, left_name(a)), (a, left_name(b))))
        if not close or sides or a in found or b in found:  # two wheels run alike
            continue
        smoother = difference_noise(values[b][known]) < MAX_COPY_ROUGHNESS * difference_noise(values[a][known])
        lead = lead_samples(values[a], values[b])
        if contains(b, REFERENCE_NAMES) or (smoother and lead >= 1):
            found[b] = ("reference", a)
        elif smoother and not contains(a, REFERENCE_NAMES):
            found[b] = ("further", "")
    return found | {n: ("reference", "") for n in names if contains(n, REFERENCE_NAMES) and n not in found}


def goals_among(values: dict[str, np.ndarray], roles: dict[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    """Commands that are called an angle or a place, and to which a position goes: set points of a servo's own loop."""
    inputs = [n for n, (role, _) in roles.items() if role == "input"]
    open_names = [n for n in inputs if stated_base(n) in ("", "rad", "m") and not suggested_input_base(n)]
    open_names = [n for n in open_names if not has_word(n, DUTY_NAMES)]
    called = [n for n in open_names if has_word(n, (*ANGLE_NAMES, *SENSOR_NAMES)) or stated_base(n)]
    places = [n for n, (role, _) in roles.items() if role == "position"]
    pairs = {(n, p): np.isfinite(values[n]) & np.isfinite(values[p]) for n in called for p in places}
    return {n: ("reference", p) for (n, p), k in pairs.items() if k.any() and _comes_to(values[p][k], values[n][k])}


def _comes_to(place: np.ndarray, goal: np.ndarray) -> bool:
    """True of a place (N,) that goes to where a command (N,) is."""
    return is_followed(goal, place) and bool(np.corrcoef(goal, place)[0, 1] > MIN_GOAL_CORRELATION)


def lead_samples(follower: np.ndarray, leader: np.ndarray) -> int:
    """Samples by which a signal (N,) is ahead of another (N,): those of least squares, negative where it is behind."""
    costs = {}
    most = min(MAX_LEAD_SAMPLES, len(leader) // MIN_LEAD_SHARE)
    for k in range(-most, most + 1):
        late, early = (follower[k:], leader[: len(leader) - k]) if k >= 0 else (follower[:k], leader[-k:])
        costs[k] = float(np.nanmean((late - early) ** 2))
    return min(costs, key=lambda k: (costs[k], abs(k)))


def is_called_place(name: str) -> bool:
    """True of a column that is a place by its name or unit, however far apart its readings are."""
    called = stated_base(name) in ("rad", "m") or is_called_angle(name)
    return called and kind_by_name(name) != "rate" and not is_no_place(name)


def is_place(values: np.ndarray, ranges: Sequence[tuple[int, int]]) -> bool:
    """True of a signal (N,), without wraps, that moves on from where it was, as a place does, but for single spikes.

    From one range of samples to the next it may be anywhere.
    """
    known = values[np.isfinite(values)]
    if len(np.unique(known)) < MIN_PLACES:
        return False
    longest = MAX_STEP_SHARE * np.ptp(known)
    parts = [values[begin:end] for begin, end in ranges]
    if sum(np.sum(step_sizes(part) > longest) for part in parts) > MAX_SPIKE_SHARE * (len(known) - 1):
        return False
    return not any((step_sizes(part, 2 * MAX_SPIKE_SAMPLES + 1) > longest).any() for part in parts)


def step_sizes(values: np.ndarray, median_of: int = 1) -> np.ndarray:
    """Steps from reading to reading of a signal (N,), or of its running median."""
    known = values[np.isfinite(values)]
    return np.abs(np.diff(median_filter(known, median_of))) if known.size else np.zeros(0)
