"""A measurement log: sampled channels with their units, cut into stretches and segments.

Angles in rad, rates in rad/s, times in s, voltages in V.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from derive.effects import INPUT_MEMORY_S
from derive.plants import wheel_pendulum as default_plant
from wheelpend.errors import Failure, did_you_mean
from wheelpend.logs.columns import DEFAULT_TABLE, ColumnTable
from wheelpend.logs.finding import Finding
from wheelpend.notebook import NotebookResult, ResultTable

if TYPE_CHECKING:
    import polars as pl

MIN_SEGMENT_SAMPLES = 5  # samples
EXCERPT_SAMPLES, EXCERPT_PARTS = (
    400_000,
    8,
)  # samples, and pieces, that represent a long log in noise and interval
MIN_SAMPLE_INTERVAL_S, MAX_SAMPLE_INTERVAL_S = 1e-6, 0.5  # s, beyond which times must be in another unit
GAP_INTERVAL_RATIO = 5.0  # an interval this many times the median one is a gap
MAX_PAUSE_S = 0.05  # s: half of what the shortest segment lasts over the usual horizon
USUAL_SHARE, LONG_PAUSE_RATIO = 0.9, 2.0  # of the intervals, which are no gaps, nor are those so many times as long
COMMAND_HISTORY_S = 0.5  # of earlier commands, that a part of a log keeps
REST_DURATION_S, REST_SHARE = 0.05, 0.01  # s; share of a signal's range within which it rests
WAY_S = 0.1  # from reading to reading, over which the way of a channel is counted
MAX_WARM_UP_SHARE = 1 / 3  # of a log's usable samples, and of those in the third that gives its own parameters


class Stretch(NamedTuple):
    """A range of usable samples without a gap, and the sample in it from which on it may be judged.

    What was commanded before ``begin`` is not in the log. A delay or a lag still remembers it until ``settled``.
    """

    begin: int
    settled: int
    end: int


@dataclass(frozen=True, eq=False, repr=False)
class Log(NotebookResult):
    """A measured or simulated log; t grows strictly and starts at 0 for a whole log, behind its ``lead``."""

    name: str  # file name, for messages
    t: np.ndarray  # (N,) s, from the first sample
    voltage: np.ndarray  # (N,) commanded input, held until the next sample, (N, inputs) of several; NaN where unknown
    measured: np.ndarray  # (N, channels), NaN where a sensor gave no value
    channels: tuple[str, ...]  # column names of measured
    reference: np.ndarray | None = None  # (N,) commanded value of what is controlled [its unit]
    warnings: tuple[str, ...] = ()  # sentences on what is odd about the file
    range_channel: str = default_plant.RANGE_CHANNEL  # channel that must stay within ±π/2, where the log has it
    rates: Mapping[str, str] = field(default_factory=lambda: default_plant.RATES)  # channels that are rates of others
    earlier: tuple[np.ndarray, np.ndarray] | None = None  # times and commands before the first sample, where known
    memory_s: float = INPUT_MEMORY_S  # for which what is fitted to it may remember a command
    breaks: tuple[int, ...] = ()  # samples before which a sensor jumped: no segment reaches across
    faults: tuple[Finding, ...] = ()  # of the recording, what they concern left out already
    source: Path | None = None  # absolute, of the file that it was read from
    lead: int = 0  # rows put before the first one, which say what was before
    speed_noise: Mapping[str, float] = field(default_factory=dict)  # σ of the speeds that channels are the sums of

    @classmethod
    def from_arrays(
        cls, t: ArrayLike, *, name: str = "log", table: ColumnTable = DEFAULT_TABLE, **channels: ArrayLike
    ) -> Log:
        """Make a log from one array (N,) per column: ``Log.from_arrays(t=t, v_in=u, theta_w=..., ...)``.

        ``t`` [s] grows strictly, and counts from its first value. ``channels`` are the plant's inputs, held from each
        sample until the next, and its channels, in its units (V, rad, rad/s, ...); NaN where a value is missing.
        ``table`` has the columns of another plant: ``model.table``. The arrays are copied, and treated as a file's
        columns are: wrapped angles become continuous. Raises Failure where a column is missing, unknown, of another
        length or no numbers, and where the log cannot be used.
        """
        from wheelpend import load_log  # the public one, found as it is used: it stands above this record

        for given in channels:
            if given not in table.names:
                known = ", ".join(table.names)
                raise Failure(f"{name}: every array must be a column of the plant ({known}), but one is called "
                              f"'{given}'.{did_you_mean(given, table.names)}")  # fmt: skip
        absent = [n for n in table.required[1:] if n not in channels]
        if absent:
            raise Failure(f"{name}: every input and channel of the plant must be given; missing: {', '.join(absent)}.")
        return load_log({"t": t, **channels}, table=table, name=name)

    def headline(self) -> str:
        """The name, samples, duration and rate."""
        rate = f"{self.duration:.4g} s at {1.0 / self.dt:.4g} Hz" if len(self) > 1 else "at one moment"
        return f"Log {self.name}: {len(self)} samples, {rate}"

    def table(self) -> ResultTable:
        """A row per input and channel: range in its unit, and samples without a value."""
        columns = {"column": str, "least": float, "most": float, "missing": int}
        values = self._columns(DEFAULT_TABLE).items()
        return ResultTable(columns, [(name, *_range(v), int(np.isnan(v).sum())) for name, v in values if name != "t"])

    def to_frame(self, table: ColumnTable = DEFAULT_TABLE) -> pl.DataFrame:
        """A row per sample: t [s], inputs, channels and the reference, null where there is no value.

        The names of inputs and reference are those of ``table``; give ``model.table`` for another plant than the
        default one, as they would be ``input`` otherwise.
        """
        import polars as pl  # imported late: it is slow to load

        return pl.DataFrame(self._columns(table)).fill_nan(None)

    def _columns(self, table: ColumnTable) -> dict[str, np.ndarray]:
        """Every column (N,) by name, in the order of a file."""
        known = table.channels == self.channels
        numbered = ["input", *(f"input_{k}" for k in range(2, len(self.inputs) + 1))]
        data = {"t": self.t, **dict(zip(table.inputs if known else numbered, self.inputs, strict=False))}
        data |= dict(zip(self.channels, self.measured.T, strict=True))
        if self.reference is not None:
            data[table.reference if known and table.reference else "reference"] = self.reference
        return data

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def samples(self) -> int:
        """Number of samples that were read."""
        return len(self) - self.lead

    @property
    def inputs(self) -> np.ndarray:
        """Each input by itself (inputs, N)."""
        return self.voltage.reshape(len(self), -1).T

    @cached_property
    def known_voltage(self) -> np.ndarray:
        """The input, a missing command counted as the next one that is known, as it is before the first sample."""
        missing = np.isnan(self.voltage)
        if not missing.any():
            return self.voltage
        places = np.where(missing, len(self), np.arange(len(self)).reshape(-1, *[1] * (self.voltage.ndim - 1)))
        following = np.minimum.accumulate(places[::-1], axis=0)[::-1]
        padded = np.concatenate(
            [self.voltage, np.zeros_like(self.voltage[:1])]
        )  # after the last known one nothing acts
        return np.take_along_axis(padded, following, axis=0)

    @cached_property
    def dt(self) -> float:
        """Median sample interval [s]."""
        return float(np.median(np.diff(self.t[:EXCERPT_SAMPLES])))

    @cached_property
    def longest_interval(self) -> float:
        """Interval [s] between samples, from which on a longer one is a gap.

        Several times the median one; a short pause that one interval in ten has is the logger's own.
        """
        usual = float(np.quantile(np.diff(self.t[:EXCERPT_SAMPLES]), USUAL_SHARE)) if len(self) > 1 else 0.0
        return max(GAP_INTERVAL_RATIO * self.dt, min(LONG_PAUSE_RATIO * usual, MAX_PAUSE_S))

    @cached_property
    def ways(self) -> np.ndarray:
        """How far each channel goes, up and down (channels, 2) [its unit].

        From reading to reading 0.1 s apart, so that the noise of a fine sensor is no way.
        """
        found = []
        for values in self.measured.T:
            read = np.flatnonzero(np.isfinite(values))
            apart = np.flatnonzero(np.diff(np.floor(self.t[read] / WAY_S), prepend=-np.inf) > 0.0)
            steps = np.diff(values[read[apart]])
            found.append([steps[steps > 0.0].sum(), -steps[steps < 0.0].sum()])
        return np.array(found)

    @cached_property
    def read_before(self) -> np.ndarray:
        """In how many of the samples before each one, and before the log's end, some channel was read (N + 1,)."""
        return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(np.isfinite(self.measured).any(axis=1))])

    @cached_property
    def reach(self) -> tuple[np.ndarray, np.ndarray]:
        """How far each channel goes (channels,), and each input from zero (inputs,); NaN of one that is not known."""
        ways = [np.ptp(v[np.isfinite(v)]) if np.isfinite(v).any() else np.nan for v in self.measured.T]
        commands = [np.abs(u[np.isfinite(u)]).max() if np.isfinite(u).any() else np.nan for u in self.inputs]
        return np.array(ways), np.array(commands)

    @property
    def duration(self) -> float:
        """Time from the first sample that was read to the last [s]."""
        return float(self.t[-1] - self.t[self.lead])

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The ranges of samples without a gap; each is judged from the end of its warm-up on.

        The warm-up is as long as the longest memory of the effects that are compared: errors with and without one are
        then taken over the same samples.
        """
        return tuple(Stretch(a, _settled(self, a, b, self.warm_up_s), b) for a, b in self._gapless_ranges)

    @cached_property
    def warm_up_s(self) -> float:
        """Duration [s] at the start of each stretch in which nothing is judged: as long as an input is remembered.

        It is halved until it takes no more than a third of the log's samples, and of those in the log's first third.
        """
        warm_up = self.memory_s
        while warm_up > self.dt and self._lost_share(warm_up) > MAX_WARM_UP_SHARE:
            warm_up *= 0.5
        return warm_up if warm_up > self.dt else 0.0

    @property
    def first_usable(self) -> int:
        """The first sample that is not left out."""
        return self._gapless_ranges[0][0] if self._gapless_ranges else 0

    @property
    def first_read(self) -> int:
        """The first sample that was read and is not left out."""
        return max(self.first_usable, self.lead)

    def _lost_share(self, warm_up: float) -> float:
        """Share of the usable samples that a warm-up [s] takes, of all or of those in the first third."""
        ranges = np.array(self._gapless_ranges, dtype=np.int64).reshape(-1, 2)
        ends = np.array([_settled(self, a, b, warm_up) for a, b in ranges.tolist()], dtype=np.int64)
        first, shares = self.first_usable, [0.0]
        for until in (first + (len(self) - first) // 3, len(self)):
            begin, settled, end = (np.minimum(x, until) for x in (ranges[:, 0], ends, ranges[:, 1]))
            shares.append(float((settled - begin).sum() / max((end - begin).sum(), 1)))
        return max(shares)

    @cached_property
    def _gapless_ranges(self) -> list[tuple[int, int]]:
        return gapless_ranges(self, 0, len(self))

    def has_said(self, sentence: str) -> bool:
        """True where one of its warnings holds a sentence already."""
        return any(sentence in warning for warning in self.warnings)

    def excerpt(self) -> Log:
        """Equally long pieces spread over a long log, a missing sample and a break between them; a short log as is."""
        if len(self) <= EXCERPT_SAMPLES:
            return self
        length = EXCERPT_SAMPLES // EXCERPT_PARTS
        begins = np.arange(EXCERPT_PARTS) * (len(self) - length) // (EXCERPT_PARTS - 1)
        places = (begins[:, None] + np.arange(length)).ravel()
        measured = self.measured[places]
        measured[::length] = np.nan
        reference = None if self.reference is None else self.reference[places]
        own = [j * length + k - a for j, a in enumerate(begins.tolist()) for k in self.breaks if a < k < a + length]
        breaks = tuple(sorted({*range(length, len(places), length), *own}))
        return replace(
            self, t=self.t[places], voltage=self.voltage[places], measured=measured, reference=reference, breaks=breaks
        )

    def as_read(self) -> Log:
        """The log without the rows that were put before its first."""
        return self.part(self.lead, len(self)) if self.lead else self

    def part(self, first: int, last: int) -> Log:
        """Samples first to last - 1, with t still counted from the start of the whole log, and the commands before."""
        cut = slice(first, last)
        before = slice(
            int(np.searchsorted(self.t[:first], self.t[min(first, len(self) - 1)] - COMMAND_HISTORY_S)), first
        )
        return replace(
            self,
            t=self.t[cut],
            voltage=self.voltage[cut],
            measured=self.measured[cut],
            reference=None if self.reference is None else self.reference[cut],
            earlier=(self.t[before], self.voltage[before]) if first else self.earlier,
            breaks=tuple(k - first for k in self.breaks if first < k < last),
            lead=max(self.lead - first, 0),
        )


def _range(values: np.ndarray) -> tuple[float | None, float | None]:
    """Least and largest of values (N,) that are known; None where none is."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (None, None)


def stack_inputs(inputs: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """Inputs as a log has them: zeros (N,) of none, (N,) of one, (N, inputs) of several."""
    if len(inputs) < 2:
        return inputs[0] if inputs else np.zeros(samples)
    return np.column_stack(inputs)


def segment_bounds(log: Log, horizon_s: float, start: int = 0, stop: int | None = None) -> np.ndarray:
    """Cut a log into consecutive segments that can be judged: (n, 2) int, half-open sample ranges.

    A segment is ``horizon_s`` seconds long but has at least 5 samples with readings; the next one begins at the sample
    after its last. None contains a gap, a jump of a sensor, a sample without input, one beyond the plant's range of
    ±π/2, or one of the warm-up of the log or after a gap. What is left over at the end of a stretch becomes a segment
    of its own, unless it is shorter than 5 such samples or a fifth of the horizon.
    """
    last = len(log) if stop is None else stop
    ranges = [(max(s.settled, start), min(s.end, last)) for s in log.stretches]
    return segments_of_ranges(log, horizon_s, ranges)


def shortest_segment(log: Log, horizon_s: float) -> int:
    """Samples that a segment has at least: 5, and those of a fifth of the horizon."""
    return max(MIN_SEGMENT_SAMPLES, math.ceil(horizon_s / (5 * log.dt) - 1e-6))


def segments_of_ranges(log: Log, horizon_s: float, ranges: Sequence[tuple[int, int]]) -> np.ndarray:
    """Ranges of samples cut into consecutive segments, by the same rule, whatever is known of the input before them."""
    if not (math.isfinite(horizon_s) and horizon_s > 0):
        raise Failure(f"The horizon must be a positive time in s, not {horizon_s}.")
    dt = log.dt
    # The sample nearest to the end of the horizon begins the next segment; just under a half, so that ties are stable.
    length = horizon_s - 0.49 * dt
    shortest, read = shortest_segment(log, horizon_s), log.read_before
    bounds = []
    for begin, end in ranges:
        first = begin
        while end - first >= shortest and read[end] - read[first] >= MIN_SEGMENT_SAMPLES:
            following = int(np.searchsorted(log.t, log.t[first] + length))
            enough = int(np.searchsorted(read, read[first] + MIN_SEGMENT_SAMPLES))
            last = min(max(following, enough), end)
            bounds.append((first, last))
            first = last
    return np.array(bounds, dtype=np.int64).reshape(-1, 2)


def _settled(log: Log, begin: int, end: int, warm_up: float) -> int:
    """First sample of a range after a warm-up [s]; the range's end if there is none.

    Where only a sensor jumped, the commands before are known, and no warm-up is needed; where another recording begins
    they are not. Where the machine rests, nothing was commanded before.
    """
    known = begin in log.breaks and not np.isnan(log.voltage[begin - 1]).any()
    only_jumped = known and log.t[begin] - log.t[begin - 1] <= log.longest_interval
    if only_jumped or begin < log.lead or _begins_at_rest(log, begin, end):
        return begin
    after = log.t[begin] + warm_up - 0.5 * log.dt  # the sample nearest to it
    return begin + int(np.searchsorted(log.t[begin:end], after))


def _begins_at_rest(log: Log, begin: int, end: int) -> bool:
    """True where nothing moves and next to nothing is commanded as a range begins: nothing was just before, either.

    A command may set out at once: what it finds at rest is not driven yet.
    """
    last = min(begin + max(int(np.searchsorted(log.t[begin:end], log.t[begin] + REST_DURATION_S)), 2), end)
    ways, commands = log.reach
    for signals, reach, from_zero in ((log.measured.T, ways, False), (log.inputs, commands, True)):
        until = min(begin + 2, end) if from_zero else last
        for signal, most in zip(signals, reach, strict=True):
            first = signal[begin:until]
            if not np.isfinite([most, *first]).all():
                return False
            if (np.abs(first).max() if from_zero else np.ptp(first)) > REST_SHARE * most:
                return False
    return True


def gapless_ranges(log: Log, start: int, stop: int) -> list[tuple[int, int]]:
    """Ranges of usable samples between start and stop, each without a gap."""
    chunks = [(a, min(a + EXCERPT_SAMPLES, stop)) for a in range(start, stop, EXCERPT_SAMPLES)]  # saves memory
    if not chunks:
        return []
    usable = np.concatenate([_is_usable(log, a, b) for a, b in chunks])
    near = np.concatenate([np.diff(log.t[a : b + 1]) <= log.longest_interval for a, b in chunks])
    near[[k - 1 - start for k in log.breaks if start < k < stop]] = False
    joined = usable[1:] & usable[:-1] & near[: len(usable) - 1]
    begins = np.flatnonzero(usable & ~np.concatenate(([False], joined)))
    ends = np.flatnonzero(usable & ~np.concatenate((joined, [False]))) + 1
    return [(start + int(a), start + int(b)) for a, b in zip(begins, ends, strict=True)]


def _is_usable(log: Log, start: int, stop: int) -> np.ndarray:
    """Mask (stop - start,) of the samples that have an input and are within the plant's range."""
    known = ~np.isnan(log.voltage[start:stop].reshape(stop - start, -1)).any(axis=1)
    if log.range_channel in log.channels:
        known &= ~(np.abs(log.measured[start:stop, log.channels.index(log.range_channel)]) > math.pi / 2)
    return known
