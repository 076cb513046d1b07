"""A log without what is no measurement: a saturated sensor, a machine that is held or lies, joined recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wheelpend.errors import Failure
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.faults import (
    find_seams,
    held_finding,
    held_samples,
    lying_finding,
    lying_samples,
    saturated,
    seam_finding,
)
from wheelpend.logs.finding import Finding
from wheelpend.logs.log import Log
from wheelpend.logs.unlogged_drive import unlogged_drive

MIN_STANDING_SHARE = 0.05  # share of a log in which a machine must stand for anything to be learnt

Seams = list[tuple[int, list[str]]]


def seams_of(t: np.ndarray, columns_by_name: Mapping[str, np.ndarray], table: ColumnTable) -> Seams:
    """Samples after which another recording begins, with the channels that jump there."""
    channels = {c: columns_by_name[c] for c in table.channels if c in columns_by_name}
    return find_seams(t, channels, [c for c in table.places if c in channels])


def cured(log: Log, table: ColumnTable, seams: Seams | None = None) -> Log:
    """The log with what is no measurement left out, and what was found in ``faults``; as it is where it has some.

    ``seams`` are where other recordings begin, found in the log where they are not given. Raises Failure when a machine
    lies on the floor nearly all the time.
    """
    if log.faults:
        return log
    measured = dict(zip(log.channels, log.measured.T, strict=True))
    channels = dict(measured)
    faults: list[Finding] = []
    without_input = np.zeros(len(log), dtype=bool)
    seams = seams_of(log.t, channels, table) if seams is None else seams
    if seams:
        faults.append(seam_finding(log.t, seams))
        without_input[[k for k, _ in seams]] = True
    if table.range_channel in channels and (lying := lying_samples(log.t, channels[table.range_channel])).any():
        faults.append(lying_finding(table.range_channel, log.t, lying, table.words.machine))
        if 1 - lying.mean() < MIN_STANDING_SHARE:
            raise Failure(f"{log.name}: the {table.words.machine} must {table.words.stay}, but {faults[-1].sentence} "
                          "Record a log in which it stands.")  # fmt: skip
        without_input |= lying
    places = [channels[c] for c in table.places if c in channels]
    if not table.inputs and (held := held_samples(log.t, places)):
        faults.append(held_finding(log.t, held, table.words.machine))
        without_input[:held] = True
    if not table.inputs:
        faults += unlogged_drive(log.t, {c: channels[c] for c in table.places if c in channels}, table.words.machine)
    for name in (c for c in channels if c in table.rates or c == table.range_channel):
        rate = name if name in table.rates else next((r for r, a in table.rates.items() if a == name), "")
        channels[name], found = saturated(name, channels[name], measured.get(rate))
        faults += found
    if not faults:
        return log
    inputs = log.voltage.astype(float)
    inputs[without_input] = np.nan
    left = np.column_stack(list(channels.values()))
    breaks = tuple(sorted({*log.breaks, *(k + 1 for k, _ in seams)}))
    return replace(log, voltage=inputs, measured=left, breaks=breaks, faults=tuple(faults))
