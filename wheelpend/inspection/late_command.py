"""The finding that a command is logged a row after it acts: a sketch that commands, waits, reads and then prints.

A row's command is taken to act from the row on. Where it acted before, the machine answers in the very row of a change,
which no machine does. A step that a machine is said to answer before it comes makes friction of its lag. Seen only on
commands that are held for rows: of others, one that is made of what is measured is not told from one that is late. Nor
is one that a stop turns round.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import channel_values
from wheelpend.logs.columns import HELD_BEFORE
from wheelpend.logs.log import Log

ROWS_AHEAD, ROWS_BEHIND = 2, 3  # rows before and after a change of the command, in which the machine is looked at
PAST_SPEEDS = 3  # that tell what a speed would be without a change
ROWS_BEFORE = max(ROWS_BEHIND, PAST_SPEEDS) + 1  # a row of which this is known
MAX_CHANGED_SHARE = 0.25  # of the rows, in which a command changes that is held for rows
MIN_SINGULAR_RATIO = 1e-9  # of the least to the largest, below which coefficients are not told apart
MIN_ROWS = 25  # with all that is looked at
MANY_CHANGES = 4  # from which on their scatter is known
MIN_SIGMAS, MIN_SIGMAS_OF_FEW = 5.0, 6.0  # that an answer within the row is above nothing, and above the row before
MIN_NEXT_RATIO, MAX_NEXT_RATIO = 0.3, 5.0  # of the next row's answer to it: 3 at most of one that is a whole row late
MAX_TOLD_SIGMAS = 100.0  # beyond which their number says nothing
MAX_IN_TIME_SHARE = 0.1  # of the next row's answer, in the row of a change of a command that acts from there on
MAX_EARLIER_SHARE = 0.3  # of that answer, two rows before a change: else it is none to the change


class Answer(NamedTuple):
    """What a speed does in the rows about a change of the command, per unit of the change."""

    sizes: np.ndarray  # (ROWS_AHEAD + 1 + ROWS_BEHIND,) from so many rows before the change to so many after it
    covariance: np.ndarray  # of these
    changes: int

    @property
    def within_row(self) -> tuple[float, float]:
        """What it does in the row of the change beyond the row before, and the standard error."""
        weights = np.zeros(len(self.sizes))
        weights[ROWS_AHEAD], weights[ROWS_AHEAD - 1] = 1.0, -1.0
        return float(weights @ self.sizes), max(float(weights @ self.covariance @ weights), 0.0) ** 0.5

    @property
    def is_early(self) -> bool:
        """True where the machine surely answers a change of the command in its own row."""
        size, sigma = self.within_row
        least = MIN_SIGMAS if self.changes >= MANY_CHANGES else MIN_SIGMAS_OF_FEW
        earlier, later = float(np.abs(self.sizes[:ROWS_AHEAD]).max()), float(self.sizes[ROWS_AHEAD + 1] * np.sign(size))
        goes_on = MIN_NEXT_RATIO * abs(size) < later < MAX_NEXT_RATIO * abs(size)  # else the command answers it
        return abs(size) > least * sigma and goes_on and earlier < MAX_EARLIER_SHARE * abs(size)

    @property
    def is_in_time(self) -> bool:
        """True where the machine surely answers in the next row, and hardly in that of a change."""
        following = ROWS_AHEAD + 1
        size, sigma = abs(float(self.sizes[following])), float(self.covariance[following, following]) ** 0.5
        return size > MIN_SIGMAS * sigma and abs(self.within_row[0]) < MAX_IN_TIME_SHARE * size


def find_late_command(log: Log, corrections: LogCorrections) -> list[Finding]:
    """The finding on the only input of a machine that answers its changes in the rows in which they are logged."""
    table = corrections.table
    if len(table.inputs) != 1 or log.voltage.ndim != 1:
        return []
    known = corrections.known.get(table.input)
    if known and known.held == HELD_BEFORE:
        return []
    told = (answer_of(log, channel_values(log, c)) for c in table.places if c in log.channels)
    answers = [a for a in told if a]
    found = next((a for a in answers if a.is_early), None)
    if found is None or any(a.is_in_time for a in answers):
        return []
    corrections.late.add(table.input)
    size, sigma = found.within_row
    clear = f"{abs(size / sigma):.0f} standard errors" if sigma * MAX_TOLD_SIGMAS > abs(size) else "without any doubt"
    sentence = (f"{table.input} is logged a row after it acts: where it changes the machine answers in the very row, "
                f"which no machine does ({clear}). Or its speed was averaged over rows on both sides, or the command "
                "is turned round where the machine meets a stop: then leave it.")  # fmt: skip
    cure = (f'Map {table.input} in [columns] with held = "{HELD_BEFORE}": what a row says acted since the row before. '
            "As it is the machine seems to move before it is told to.")  # fmt: skip
    return [Finding("late_command", table.input, sentence, cure, log.dt)]


def answer_of(log: Log, place: np.ndarray) -> Answer | None:
    """What the speed between the rows of a place (N,) does about changes of the command; None where nothing tells.

    Least squares of each speed on some before it, a constant, the command long before, and its changes in the rows
    about it. The errors are those of the residual, or of its scatter with each row left out, whichever are larger.
    """
    interval, command = np.diff(log.t), log.voltage
    speed, change = np.diff(place) / interval, np.diff(command, prepend=command[:1])
    if np.mean(change != 0.0) > MAX_CHANGED_SHARE:
        return None
    if _stands_at_first(place, change):  # and has stood so before
        interval, speed, command, change = (
            np.concatenate((np.full(ROWS_BEFORE, first), values))
            for first, values in ((log.dt, interval), (0.0, speed), (command[0], command), (0.0, change))
        )
    rows = np.arange(ROWS_BEFORE, len(command) - ROWS_AHEAD)
    offsets = range(ROWS_AHEAD, -ROWS_BEHIND - 1, -1)
    past = (speed[rows - 1 - k] for k in range(1, PAST_SPEEDS + 1))
    matrix = np.column_stack(
        [*(change[rows + k] for k in offsets), np.ones(len(rows)), command[rows - ROWS_BEHIND - 1], *past]
    )
    target = speed[rows - 1]
    steady = (
        np.convolve(interval <= log.longest_interval, np.ones(ROWS_BEHIND + ROWS_AHEAD + 2), "same")
        > ROWS_BEHIND + ROWS_AHEAD + 1.5
    )
    good = np.isfinite(matrix).all(axis=1) & np.isfinite(target) & steady[rows - 1]
    matrix, target = matrix[good], target[good]
    about = matrix[:, : ROWS_AHEAD + 1 + ROWS_BEHIND]
    changes = int(np.count_nonzero(about[:, ROWS_AHEAD]))
    if len(target) < MIN_ROWS or not about.any(axis=0).all():
        return None
    return _least_squares(matrix, target, changes)


def _stands_at_first(place: np.ndarray, change: np.ndarray) -> bool:
    """True of a place (N,) that is the same in all rows, two or more, before the command's first change."""
    first = int(np.argmax(change != 0.0))
    return first > 1 and not np.ptp(place[:first])


def _least_squares(matrix: np.ndarray, target: np.ndarray, changes: int) -> Answer:
    """The coefficients that are an answer, with the larger of two covariances."""
    kept, scale = ROWS_AHEAD + 1 + ROWS_BEHIND, np.sqrt(np.mean(matrix**2, axis=0)) + 1e-300
    own = np.linalg.pinv(matrix / scale, MIN_SINGULAR_RATIO) / scale[:, None]  # (columns, rows)
    rest = target - matrix @ (own @ target)
    free = max(len(target) - matrix.shape[1], 1)
    covariance = own[:kept] @ own[:kept].T * float(rest @ rest) / free
    if changes >= MANY_CHANGES:
        leverage = np.sum(matrix.T * own, axis=0)
        robust = (own[:kept] * rest / np.maximum(1.0 - leverage, MIN_SINGULAR_RATIO)) @ (own[:kept] * rest).T
        if robust[ROWS_AHEAD, ROWS_AHEAD] > covariance[ROWS_AHEAD, ROWS_AHEAD]:
            covariance = robust
    return Answer(own[:kept] @ target, covariance, changes)
