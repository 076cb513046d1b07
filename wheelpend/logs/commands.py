"""Cells without a command: an input that was switched off for a while, or one that is logged only when it changes.

What acted while no command is known is not known either, so such stretches are left out and the log on both sides is
used. A sparse column is another thing: every command is held until the next one, as between samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.errors import Failure
from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log
from wheelpend.logs.runs import runs_of
from wheelpend.numerics import last_true

MIN_PART_SAMPLES = 20  # samples, the shortest log that is read
MIN_PIECE_SHARE = 0.1  # of a log, that a part between gaps has at least: else they are borne
MIN_SPARSE_SHARE = 0.5  # of the cells, empty in a sparse column
MIN_FOLLOWED_SHARE = 0.8  # of its values, followed by an empty cell; of cells lost at random this many would be most


def held_commands(log: str, name: str, values: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """An input (N,) whose sparse values are held until the next one, with a sentence on that; any other as it is.

    Raises Failure where most cells are empty and nothing tells that values are held.
    """
    known = np.flatnonzero(~np.isnan(values))
    if not is_sparse(values, known):
        return values, []
    steps, changes = np.diff(known), np.diff(values[known])
    if np.ptp(steps) <= 1:
        why = f"has a value once in {round(float(np.median(steps)))} samples"
    elif (changes != 0.0).all():
        why = f"has {len(known)} values in {len(values)} samples, none like the one before, so it is logged on a change"
    else:
        raise Failure(
            f"{log}: {name} must be known in every sample, or be logged on a change, but it has {len(known)} values in "
            f"{len(values)} samples, some of them equal to the one before. If each was held until the next, fill "
            "the column forward (pandas: ffill, polars: forward_fill)."
        )
    return values[np.maximum(last_true(~np.isnan(values)), 0)], [f"{name} {why}; each is held until the next."]


def of_next_row(values: np.ndarray) -> np.ndarray:
    """What acts from each row on, of an input (N,) whose rows say what acted before them; the last one goes on."""
    return np.append(values[1:], values[-1:])


def is_sparse(values: np.ndarray, known: np.ndarray) -> bool:
    """True where most cells are empty, and an empty one follows nearly every value."""
    if len(known) < 2 or 1.0 - len(known) / len(values) < MIN_SPARSE_SHARE:
        return False
    return float(np.mean(np.diff(known) > 1)) >= MIN_FOLLOWED_SHARE


def unknown_stretches(inputs: np.ndarray) -> list[tuple[int, int]]:
    """Half-open ranges of samples in which some of the inputs (inputs, N) are unknown."""
    return [(int(a), int(b)) for a, b in runs_of(np.isnan(inputs).any(axis=0))]


def longest_known_part(log: Log) -> tuple[Log, str]:
    """The longest part without a break, a gap and a command unknown for longer than one; says where it is not all.

    For methods that take a log in one piece; single lost commands are left to their interpolation. Gaps are borne where
    hardly a sample would be left between them.
    """
    longest = GAP_INTERVAL_RATIO * log.dt
    unknown = [(a, b) for a, b in unknown_stretches(log.inputs) if (b - a) * log.dt > longest]
    pauses = [int(k) + 1 for k in np.flatnonzero(np.diff(log.t) > log.longest_interval)]
    breaks, gaps = (
        [(k, k) for k in map(int, at) if not any(a <= k <= b for a, b in unknown)] for at in (log.breaks, pauses)
    )
    begin, end = _longest_between([*unknown, *breaks, *gaps], len(log))
    if gaps and end - begin < MIN_PIECE_SHARE * len(log):
        gaps = []
        begin, end = _longest_between([*unknown, *breaks], len(log))
    if (begin, end) == (0, len(log)):
        return log, ""
    part = log.part(begin, end)
    if end - begin < MIN_PART_SAMPLES:
        raise Failure(
            f"{log.name} must have commands for at least {MIN_PART_SAMPLES} samples in a row, but the longest part "
            f"between stretches without any and jumps of a sensor has {end - begin}. Record a log in which the input "
            "is always written and no sensor jumps."
        )
    reasons = (("the input is unknown for a while", unknown), ("a sensor jumps", breaks), ("there is a gap", gaps))
    why = [text for text, cuts in reasons if cuts]
    return part, (
        f"Only the part from t = {part.t[0]:.6g} s to {part.t[-1]:.6g} s is used: this method takes a log in one "
        f"piece, and elsewhere {' and '.join(why)}. `--method shooting` uses all parts."
    )


def _longest_between(cuts: Sequence[tuple[int, int]], count: int) -> tuple[int, int]:
    """The longest part of so many samples between ranges that are cut out, from its first sample to behind its last."""
    edges = [0, *(k for cut in sorted(cuts) for k in cut), count]
    return max(zip(edges[::2], edges[1::2], strict=True), key=lambda part: part[1] - part[0])


def unknown_input_text(name: str, t: np.ndarray, values: np.ndarray) -> str:
    """Sentence on when an input (N,) has no values, from when to when [s], and what follows; nothing of a whole one."""
    stretches = unknown_stretches(values[None])
    if not stretches:
        return ""
    a, b = max(stretches, key=lambda s: s[1] - s[0])
    count, when = int(np.isnan(values).sum()), f"from t = {t[a]:.6g} s to {t[b - 1]:.6g} s"
    samples = "1 sample" if count == 1 else f"{count} samples"
    where = f"{when} ({samples})" if len(stretches) == 1 else (
        f"in {len(stretches)} stretches ({samples}), the longest {when}"
    )  # fmt: skip
    return (f"{name} has no value {where}: what acted then is not known and is left out, the log before and after it "
            "is used. If nothing was commanded, write 0.")  # fmt: skip
